# SPDX-License-Identifier: MIT
# build/rim: the rooms of host_tools/ but thesis/. A command registers itself (cli/command.hpp).
# build/rim-thesis: thesis/ on the same library. It is built for the tests and by `make thesis`.

HOST_SRC := $(shell find host_tools -name '*.cpp' ! -path 'host_tools/python/*' | LC_ALL=C sort)
HOST_OBJ := $(HOST_SRC:%.cpp=$(BUILD)/%.o)
# What registers itself must be linked as objects; the rest is a library, from which every program
# and every test takes what it needs.
HOST_CLI_OBJ := $(filter $(BUILD)/host_tools/cli/%,$(HOST_OBJ))
THESIS_OBJ := $(filter $(BUILD)/host_tools/thesis/%,$(HOST_OBJ))
# Levels of optimisation: -O2 where `rim train`, `rim diagnose` and the simulated landings spend
# their time by a profile, the rest -O1. Another OPT than -O2 holds for everything. No result depends
# on the level (no fast-math).
HOST_HOT := train/behaviour train/fit_gram train/noise \
  $(addprefix diagnose/,expression function late model null scan sets) \
  stats/orthogonal stats/robust
HOST_WARM := $(addprefix $(BUILD)/host_tools/,world/lander%.o log/csv_read.o replay/replay.o)
HOST_HOT_OBJ := $(filter $(HOST_HOT:%=$(BUILD)/host_tools/%.o),$(HOST_OBJ))
HOST_WARM_OBJ := $(filter $(HOST_WARM),$(HOST_OBJ))

# Precompiled headers, for gcc alone; a compiler cache works better without them.
PCH := $(if $(findstring ccache,$(CXX)),,$(if $(findstring g++,$(CXX)),1))
PCH_LEVELS := $(if $(filter -O2,$(OPT)),-O1 -O2,$(OPT))

# Sources that are compiled together, as one: half of the time of a small one is what every run of the
# compiler begins with, and neighbours need the same templates. It is for speed alone: with a compiler
# cache, or with `make GROUPS=`, each is compiled by itself. Sources of a group share their unnamed
# namespaces; what collides is taken off its list.
GROUPS := $(if $(PCH),answers bus claims fitting image learner log plan replay report search trainer util world)
HOT_GROUPS := $(if $(GROUPS),likelihood scanner)
THESIS_GROUPS := $(if $(GROUPS),figures games landings thesis_cli)
GROUP_answers := $(addprefix diagnose/,extension measured response roles)
GROUP_bus := bus/%
GROUP_claims := $(addprefix diagnose/,apply_extension catalogue diagnose flagged gain library mixed regions rollout sentence term)
GROUP_figures := $(addprefix thesis/experiment/,falcon fig4_10 thesis_lander_search)
GROUP_fitting := train/fitter train/outside
GROUP_games := thesis/baseline/% $(addprefix thesis/experiment/,cobot_points control_mrclam fig3_3 keepaway keepaway_figures plan_figure)
GROUP_image := image/%
GROUP_landings := thesis/poisson thesis/shard $(addprefix thesis/experiment/,alarm_score golf_points lander lander_tables measured_common \
  measured_falcon measured_mrclam precision_recall search_curve select_engine table6_1 thesis_lander)
GROUP_learner := $(addprefix train/,behaviour_section choose_models external_residuals fit_gate healthy_runs interference_report \
  part_file rolled run_store survey)
GROUP_likelihood := $(addprefix train/,behaviour fit_gram noise)
GROUP_log := log/%
GROUP_plan := plan/%
GROUP_replay := $(addprefix replay/,flight_report outputs understand)
GROUP_report := $(addprefix report/,data gain output_folder outputs page show style svg tables)
GROUP_scanner := $(addprefix diagnose/,expression function late model null scan)
GROUP_search := diagnose/search%
GROUP_thesis_cli := thesis/cli/%
GROUP_trainer := $(addprefix train/,agreement calibrate calibrate_external fit fit_section healthy_blocks train_report trainer)
GROUP_util := $(addprefix util/,gnuplot interrupt json parallel_for progress run_program shard table toml_table utf8)
GROUP_world := world/%
ALL_GROUPS := $(GROUPS) $(HOT_GROUPS) $(THESIS_GROUPS)
GROUP_OBJ := $(ALL_GROUPS:%=$(BUILD)/group/%.o)
# $(call grouped,GROUP): its objects, all of one level.
grouped = $(filter $(GROUP_$(1):%=$(BUILD)/host_tools/%.o),$(if $(filter $(1),$(HOT_GROUPS)),$(HOST_HOT_OBJ),$(filter-out $(HOST_HOT_OBJ) $(HOST_WARM_OBJ),$(HOST_OBJ))))
# $(call together,OBJECTS,GROUPS): these objects, with those of the groups as one each.
together = $(filter-out $(foreach group,$(2),$(call grouped,$(group))),$(1)) $(2:%=$(BUILD)/group/%.o)
HOST_HOT_LINK := $(call together,$(HOST_HOT_OBJ),$(HOT_GROUPS))
HOST_LIB_OBJ := $(call together,$(filter-out $(HOST_CLI_OBJ) $(THESIS_OBJ),$(HOST_OBJ)),$(GROUPS) $(HOT_GROUPS))
THESIS_CLI_OBJ := $(call together,$(filter $(BUILD)/host_tools/thesis/cli/%,$(THESIS_OBJ)),$(filter %_cli,$(THESIS_GROUPS))) \
  $(addprefix $(BUILD)/host_tools/cli/,command.o arguments.o describe.o)
THESIS_LIB_OBJ := $(call together,$(filter-out $(BUILD)/host_tools/thesis/cli/%,$(THESIS_OBJ)),$(filter-out %_cli,$(THESIS_GROUPS)))

HOST_DEFINES := -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 -DEIGEN_DONT_PARALLELIZE
# gcc collects its own garbage too eagerly for units that include Eigen: less often takes a tenth off.
GCC_MEMORY = $(if $(findstring clang,$(CXX)),,--param ggc-min-expand=200 --param ggc-min-heapsize=1000000)
# Position-independent, and nothing visible: the Python module links the same objects.
HOST_CXXFLAGS = -std=c++17 $(OPT) -fPIC -fvisibility=hidden -ffp-contract=off $(NO_SLP) $(GCC_MEMORY) -pthread \
  $(WARNINGS) $(SANITIZER_FLAGS) \
  $(EXTRA_CFLAGS) $(HOST_DEFINES) -Ihost_tools -Ilib/include -Ilib/src -isystem /usr/include/eigen3
# One list for the programs and for the Python module (python/CMakeLists.txt).
HOST_LIBS := $(addprefix -l,$(file < host_tools/libraries.txt))

.PHONY: host thesis
host: $(BUILD)/rim
thesis: $(BUILD)/rim-thesis ## the thesis's tables and figures: build/rim-thesis

$(BUILD)/flags.host: FORCE
	$(call flags_stamp,$(CXX) $(HOST_CXXFLAGS))

# One file alone knows where it was built and will be installed: another PREFIX compiles that one.
$(BUILD)/flags.prefix: FORCE
	$(call flags_stamp,$(PREFIX) $(CURDIR))
$(BUILD)/host_tools/util/data_path.o: $(BUILD)/flags.prefix
$(BUILD)/host_tools/util/data_path.o: private HOST_DEFINES += -DRIM_PREFIX='"$(PREFIX)"' -DRIM_SOURCE_DIR='"$(CURDIR)"'

# One knows the commit.
COMMIT := $(shell git rev-parse --short HEAD 2>/dev/null)
$(BUILD)/flags.commit: FORCE
	$(call flags_stamp,$(COMMIT))
$(BUILD)/host_tools/cli/command.o: $(BUILD)/flags.commit
$(BUILD)/host_tools/cli/command.o: private HOST_DEFINES += -DRIM_COMMIT='"$(if $(COMMIT), ($(COMMIT)))"'

# gcc 12 at -O1 takes parts of Eigen's matrices for uninitialised: seen, said, no error.
HOST_LEVEL = $(if $(filter -O2,$(OPT)),-O1 -Wno-error=maybe-uninitialized,$(OPT))
$(HOST_HOT_OBJ) $(HOST_WARM_OBJ) $(HOT_GROUPS:%=$(BUILD)/group/%.o): private HOST_LEVEL = $(OPT)
# Its own source of what the precompiled header declares.
$(BUILD)/host_tools/stats/orthogonal.o: private PCH :=
# All of it is CLI11, which runs once per command: what it takes is its compiling.
$(BUILD)/host_tools/cli/arguments.o: private HOST_LEVEL = $(if $(filter -O2,$(OPT)),-O0,$(OPT))

PCH_FILES := $(if $(PCH),$(PCH_LEVELS:%=$(BUILD)/pch%/precompiled.hpp.gch))
# $(call pch,LEVEL): the flags by which a source uses the header of that level, where there is one.
pch = $(if $(and $(PCH),$(filter $(1),$(PCH_LEVELS))),-Winvalid-pch -include $(BUILD)/pch$(1)/precompiled.hpp)
.SECONDARY: $(PCH_FILES)
$(BUILD)/pch%/precompiled.hpp.gch: host_tools/stats/precompiled.hpp host_tools/stats/eigen_kernels.hpp $(BUILD)/flags.host
	@mkdir -p $(@D) && cp $< $(@:.gch=)
	$(call say,PCH )$(CXX) $(HOST_CXXFLAGS) $* -x c++-header $< -o $@

$(BUILD)/host_tools/%.o: host_tools/%.cpp $(BUILD)/flags.host $(PCH_FILES)
	@mkdir -p $(@D)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@

$(GROUP_OBJ:.o=.cpp): $(BUILD)/group/%.cpp: FORCE
	@mkdir -p $(@D)
	@printf '#include "%s"\n' $(patsubst $(BUILD)/host_tools/%.o,%.cpp,$(call grouped,$*)) > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@
$(GROUP_OBJ): %.o: %.cpp $(BUILD)/flags.host $(PCH_FILES)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@

$(BUILD)/libhost.a: $(HOST_LIB_OBJ)
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(HOST_LIB_OBJ)
$(BUILD)/libthesis.a: $(THESIS_LIB_OBJ)
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(THESIS_LIB_OBJ)

# A program for the browser, as a text of C++.
$(BUILD)/gen/%_js.inc: host_tools/report/%.js
	@mkdir -p $(@D)
	$(call say,TEXT){ echo 'R"rimjs('; cat $<; echo ')rimjs"'; } > $@
$(BUILD)/host_tools/report/explore.o: $(BUILD)/gen/explore_js.inc $(BUILD)/gen/explore_tools_js.inc
$(BUILD)/host_tools/report/live_page.o: $(BUILD)/gen/live_js.inc
$(addprefix $(BUILD)/host_tools/report/,explore.o live_page.o): private HOST_CXXFLAGS += -I$(BUILD)/gen

# The library once more, position-independent, for the Python module (python/CMakeLists.txt).
LIB_PIC_OBJ := $(LIB_SRC:%.c=$(BUILD)/pic/%.o)
$(BUILD)/pic/%.o: %.c $(BUILD)/flags.lib
	@mkdir -p $(@D)
	$(call say,CC  )$(CC) $(LIB_CFLAGS) -fPIC -fvisibility=hidden -MMD -MP -c $< -o $@
$(BUILD)/librim_pic.a: $(LIB_PIC_OBJ)
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(LIB_PIC_OBJ)
.PHONY: python-objects
python-objects: $(BUILD)/libhost.a $(BUILD)/librim_pic.a
-include $(LIB_PIC_OBJ:.o=.d)

# A function that several objects hold is taken from the first: the computing ones come before.
$(BUILD)/rim: $(HOST_HOT_LINK) $(HOST_CLI_OBJ) $(BUILD)/libhost.a $(BUILD)/librim.a
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)

$(BUILD)/rim-thesis: $(HOST_HOT_LINK) $(THESIS_CLI_OBJ) $(BUILD)/libthesis.a $(BUILD)/libhost.a $(BUILD)/librim.a
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)

-include $(HOST_OBJ:.o=.d) $(GROUP_OBJ:.o=.d)
