# build/rim: every host_tools/**/*.cpp. A command registers itself (cli/command.hpp).

HOST_SRC := $(shell find host_tools -name '*.cpp' | LC_ALL=C sort)
HOST_OBJ := $(HOST_SRC:%.cpp=$(BUILD)/%.o)
HOST_OBJ_TEST := $(filter-out $(BUILD)/host_tools/cli/main.o,$(HOST_OBJ))

HOST_DEFINES := -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 -DEIGEN_DONT_PARALLELIZE \
  -DRIM_VERSION='"$(VERSION)"'
HOST_CXXFLAGS = -std=c++17 $(OPT) -ffp-contract=off $(NO_SLP) -pthread $(WARNINGS) $(SANITIZER_FLAGS) \
  $(EXTRA_CFLAGS) $(HOST_DEFINES) -Ihost_tools -Ilib/include -Ilib/src -isystem /usr/include/eigen3
HOST_LIBS := -llcm -lfmt -ltomlplusplus -lmuparser -lccd -lpthread

.PHONY: host
host: $(BUILD)/rim

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

$(BUILD)/rim: $(HOST_OBJ) $(BUILD)/librim.a
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $(HOST_OBJ) $(BUILD)/librim.a $(HOST_LIBS)

-include $(HOST_OBJ:.o=.d)
