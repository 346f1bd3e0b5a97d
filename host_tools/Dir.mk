# SPDX-License-Identifier: MIT
# build/rim: the rooms of host_tools/ but thesis/. A command registers itself (cli/command.hpp).
# build/rim-thesis: thesis/ on the same library. It is built for the tests and by `make thesis`.

HOST_SRC := $(shell find host_tools -name '*.cpp' | LC_ALL=C sort)
HOST_OBJ := $(HOST_SRC:%.cpp=$(BUILD)/%.o)
# What registers itself must be linked as objects; the rest is a library, from which every program
# and every test takes what it needs.
HOST_CLI_OBJ := $(filter $(BUILD)/host_tools/cli/%,$(HOST_OBJ))
THESIS_OBJ := $(filter $(BUILD)/host_tools/thesis/%,$(HOST_OBJ))
THESIS_CLI_OBJ := $(filter $(BUILD)/host_tools/thesis/cli/%,$(THESIS_OBJ)) $(BUILD)/host_tools/cli/command.o
HOST_LIB_OBJ := $(filter-out $(HOST_CLI_OBJ) $(THESIS_OBJ),$(HOST_OBJ))
THESIS_LIB_OBJ := $(filter-out $(THESIS_CLI_OBJ),$(THESIS_OBJ))

HOST_DEFINES := -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 -DEIGEN_DONT_PARALLELIZE \
  -DRIM_VERSION='"$(VERSION)"'
HOST_CXXFLAGS = -std=c++17 $(OPT) -ffp-contract=off $(NO_SLP) -pthread $(WARNINGS) $(SANITIZER_FLAGS) \
  $(EXTRA_CFLAGS) $(HOST_DEFINES) -Ihost_tools -Ilib/include -Ilib/src -isystem /usr/include/eigen3
HOST_LIBS := -llcm -lfmt -ltomlplusplus -lmuparser -lccd -lpthread

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

# The learning code gains a third from -O3; the library's arithmetic is compiled elsewhere.
$(BUILD)/host_tools/train/%.o: HOST_SPEED = $(if $(filter -O2,$(OPT)),-O3)
$(BUILD)/host_tools/diagnose/%.o: HOST_SPEED = $(if $(filter -O2,$(OPT)),-O3)

$(BUILD)/host_tools/%.o: host_tools/%.cpp $(BUILD)/flags.host
	@mkdir -p $(@D)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) $(HOST_SPEED) -MMD -MP -c $< -o $@

$(BUILD)/libhost.a: $(HOST_LIB_OBJ)
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(HOST_LIB_OBJ)
$(BUILD)/libthesis.a: $(THESIS_LIB_OBJ)
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(THESIS_LIB_OBJ)

$(BUILD)/rim: $(HOST_CLI_OBJ) $(BUILD)/libhost.a $(BUILD)/librim.a
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)

$(BUILD)/rim-thesis: $(THESIS_CLI_OBJ) $(BUILD)/libthesis.a $(BUILD)/libhost.a $(BUILD)/librim.a
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $^ $(HOST_LIBS)

-include $(HOST_OBJ:.o=.d)
