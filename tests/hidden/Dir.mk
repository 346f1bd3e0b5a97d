# SPDX-License-Identifier: MIT
# tests/hidden: nature draws cases, rim diagnose gets the logs, grade compares. See README.md.

HIDDEN_NATURE_SRC := $(sort $(wildcard tests/hidden/nature*.cpp))
HIDDEN_GRADE_SRC := $(sort $(wildcard tests/hidden/grade*.cpp))
HIDDEN_BIN := $(addprefix $(BUILD)/tests/hidden/,nature grade oracle check)
# As in host_tools/Dir.mk: what needs the same headers is compiled together.
HIDDEN_ORACLE_SRC := tests/hidden/oracle.cpp tests/hidden/check.cpp
hidden_apart = $(1:%.cpp=$(BUILD)/%.o)
HIDDEN_GRADE_OBJ := $(if $(GROUPS),$(BUILD)/tests/hidden/all_of_grade.o,$(call hidden_apart,$(HIDDEN_GRADE_SRC)))
HIDDEN_ORACLE_OBJ := $(if $(GROUPS),$(BUILD)/tests/hidden/oracle_and_check.o)
HIDDEN_OBJ := $(call hidden_apart,$(HIDDEN_NATURE_SRC)) $(HIDDEN_GRADE_OBJ) $(or $(HIDDEN_ORACLE_OBJ),$(call hidden_apart,$(HIDDEN_ORACLE_SRC)))
SEED ?= 1
COUNT ?= 40

.PHONY: hidden hidden-build hidden-floors
hidden-build: $(HIDDEN_BIN)
test-build: hidden-build

hidden: hidden-build host ## a campaign of hidden effects: SEED=n COUNT=m, the figures at the end
	@RIM=$(abspath $(BUILD)/rim) BUILD=$(abspath $(BUILD)) tests/hidden/run.sh $(SEED) $(COUNT)
# `make test` takes six of these, `make test-long` 14.
hidden-floors: hidden-build host ## forty cases of hidden effects, one of each family among them, against tests/hidden/floors.txt
	@RIM=$(abspath $(BUILD)/rim) BUILD=$(abspath $(BUILD)) HIDDEN_FLOORS=tests/hidden/floors.txt tests/hidden/run.sh 0 40 each

$(BUILD)/tests/hidden/%.o: tests/hidden/%.cpp $(BUILD)/flags.host $(PCH_FILES)
	@mkdir -p $(@D)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@

$(BUILD)/tests/hidden/all_of_grade.cpp: FORCE
	@mkdir -p $(@D)
	@printf '#include "%s"\n' $(HIDDEN_GRADE_SRC) > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@
$(BUILD)/tests/hidden/oracle_and_check.cpp: $(HIDDEN_ORACLE_SRC) FORCE
	@mkdir -p $(@D)
	@tests/host/group.sh $(HIDDEN_ORACLE_SRC) > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@
$(filter %/all_of_grade.o %/oracle_and_check.o,$(HIDDEN_OBJ)): %.o: %.cpp $(BUILD)/flags.host $(PCH_FILES)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) -I. -Itests/hidden $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@

# How the programs of the host tools read their command lines.
HIDDEN_ARGUMENTS := $(addprefix $(BUILD)/host_tools/cli/,arguments.o describe.o)
$(HIDDEN_BIN): $(HIDDEN_ARGUMENTS)
$(BUILD)/tests/hidden/nature: $(HIDDEN_NATURE_SRC:%.cpp=$(BUILD)/%.o)
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)
$(BUILD)/tests/hidden/grade: $(HIDDEN_GRADE_OBJ)
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)
$(BUILD)/tests/hidden/oracle $(BUILD)/tests/hidden/check: %: $(or $(HIDDEN_ORACLE_OBJ),%.o)
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)

-include $(HIDDEN_OBJ:.o=.d)

.PHONY: machines
machines: host ## machines drawn after the search was made, channel by channel: SEED=n COUNT=m
	@tests/hidden/channels.py --rim $(BUILD)/rim --drawer guests.py --seed $(SEED) --count $(COUNT)
	@tests/hidden/channels.py --rim $(BUILD)/rim --drawer latecomers.py --seed $(SEED) --count $(COUNT)

.PHONY: bench-diagnose
RIM_MEASURED ?= ../shared/measured
bench-diagnose: host ## rim diagnose beside pysindy and pyoperon (from PyPI, in build/): terms named, error left
	@test -x $(BUILD)/others/bin/python || python3 -m venv $(BUILD)/others
	@$(BUILD)/others/bin/python -c 'import pysindy, pyoperon' 2> /dev/null || \
	  $(BUILD)/others/bin/pip install -q pysindy==2.1.0 pyoperon==0.6.2
	@$(BUILD)/others/bin/python tests/hidden/others.py --rim $(abspath $(BUILD)/rim) --work $(BUILD)/bench_diagnose \
	  --measured $(RIM_MEASURED) --seed $(SEED)
