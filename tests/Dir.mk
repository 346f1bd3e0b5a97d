# SPDX-License-Identifier: MIT
# tests/lib/test_X.c tests lib/src/ROOM/X.c; tests/host/test_*.cpp test the host tools;
# tests/cli/*.sh run the commands end to end. Sources of one concept share a test: FILE=TEST.
SHARED_TESTS := interference/detector=interference search/statistic=search search/scan=search monitor/open=monitor monitor/step=monitor \
  monitor/unknown=monitor_gaps search/search_guard=guard search/select_guard=guard

TEST_LIB_SRC := $(sort $(wildcard tests/lib/test_*.c))
TEST_HOST_SRC := $(sort $(wildcard tests/host/test_*.cpp))
# The longest first, so that none of them is left alone at the end.
LONG_CLI := python can hidden vehicles demo cfs campaign diagnose report schema frameworks measured_machines freertos formats interference experiment_cobot train
TEST_CLI := $(LONG_CLI:%=tests/cli/%.sh) $(filter-out $(LONG_CLI:%=tests/cli/%.sh),$(sort $(wildcard tests/cli/*.sh)))
TEST_FIRMWARE_BIN := $(patsubst %.c,$(BUILD)/%,$(sort $(wildcard tests/firmware/test_*.c)))
TEST_LIB_BIN := $(TEST_LIB_SRC:%.c=$(BUILD)/%) $(TEST_FIRMWARE_BIN)
TEST_HOST_BIN := $(TEST_HOST_SRC:%.cpp=$(BUILD)/%)

# What a test does itself takes less time than to compile it at -O2. Another OPT holds here too.
TEST_CFLAGS = -std=c11 $(if $(filter -O2,$(OPT)),-O1,$(OPT)) -ffp-contract=off $(WARNINGS) $(SANITIZER_FLAGS) -Ilib/include -Ilib/src -Itests/lib

# Python packages of the tests, in build/venv, and a browser. Where they cannot be had, their tests
# are skipped and say so.
REQUIREMENTS := tests/python/requirements.txt
TEST_PACKAGES := python3-venv zstd chromium
.PHONY: venv-deps venv-try
venv-deps: deps
	$(call install_missing,$(TEST_PACKAGES))
	@cmp -s $(REQUIREMENTS) $(BUILD)/venv/requirements || { rm -rf $(BUILD)/venv && python3 -m venv $(BUILD)/venv && \
	  $(BUILD)/venv/bin/pip install --quiet --no-compile --disable-pip-version-check -r $(REQUIREMENTS) && \
	  cp $(REQUIREMENTS) $(BUILD)/venv/requirements; }
venv-try: deps
	@mkdir -p $(BUILD)
	@timeout 400 $(MAKE) --no-print-directory SUDO='sudo -n' venv-deps > $(BUILD)/venv-deps.txt 2>&1 < /dev/null || \
	  { rm -rf $(BUILD)/venv; echo "test: what needs PyPI or a browser is skipped: $$(grep -v '^make' $(BUILD)/venv-deps.txt | tail -n 1)"; }
TEST_NEEDS += venv-try

.PHONY: vehicles-simulated
BASE ?= 7000
vehicles-simulated: host ## grade rim on machines of JSBSim, MuJoCo and RocketPy (from PyPI, in build/): some 20 minutes
	@test -x $(BUILD)/simulators/bin/python || python3 -m venv $(BUILD)/simulators
	@$(BUILD)/simulators/bin/pip install --quiet --disable-pip-version-check -r tests/vehicles/simulators/requirements.txt
	@$(BUILD)/simulators/bin/python tests/vehicles/grade.py --rim $(BUILD)/rim --module tests/vehicles/simulators/machines.py \
	  --train 30 --healthy 30 --per 3 --base $(BASE) --jobs $(TEST_JOBS)

# As in host_tools: some tests at a time are compiled as one program, which has all their names.
TEST_GROUPS := $(if $(GROUPS),1 2 3)

.PHONY: test-run test-build test-missing
test-missing:
	@fail=0; for s in $(LIB_SRC); do m=$$(basename $$s .c); \
	  for t in $(SHARED_TESTS); do [ $$s != lib/src/$${t%=*}.c ] || m=$${t#*=}; done; \
	  [ -f tests/lib/test_$$m.c ] || { echo "$$s has no tests/lib/test_$$m.c" >&2; fail=1; }; \
	done; exit $$fail

# The groups first: they take longest to compile, and small objects fill up what is left at the end.
test-build: test-missing $(TEST_GROUPS:%=$(BUILD)/tests/host/group_%.o) $(TEST_LIB_BIN) $(TEST_HOST_BIN) host thesis $(if $(SANITIZE),,python-objects)

# The commands come last: they take longest.
test-run: test-build
	@RIM=$(abspath $(BUILD)/rim) RIM_THESIS=$(abspath $(BUILD)/rim-thesis) BUILD=$(abspath $(BUILD)) MAKE=$(MAKE) SANITIZE=$(SANITIZE) TEST_JOBS=$(TEST_JOBS) TEST_TIMEOUT=$(or $(TEST_TIMEOUT),$(if $(SANITIZE),7200,600)) \
	  tests/run.sh $(TEST_LIB_BIN) $(TEST_HOST_BIN) $(TEST_CLI)

$(BUILD)/flags.test: FORCE
	$(call flags_stamp,$(CC) $(TEST_CFLAGS))

# lcm-gen's own encoders, which the tests of our messages hold ours to.
WIRE_TYPES := $(sort $(wildcard lib/wire/*.lcm))
LCMGEN_SRC := $(WIRE_TYPES:lib/wire/%.lcm=$(BUILD)/lcmgen/%.c)
$(BUILD)/lcmgen/%.c: lib/wire/%.lcm
	@mkdir -p $(@D)
	$(call say,LCM )lcm-gen -c --c-no-pubsub --c-cpath $(@D) --c-hpath $(@D) $<
# Not our code: its warnings are not ours. An encoder includes the headers of what it holds.
LCMGEN_OBJ := $(LCMGEN_SRC:.c=.o)
$(LCMGEN_OBJ): %.o: %.c $(LCMGEN_SRC) $(BUILD)/flags.test
	$(call say,CC  )$(CC) $(TEST_CFLAGS) -w -isystem $(BUILD)/lcmgen -c $< -o $@
LCMGEN_TESTS := $(addprefix $(BUILD)/tests/lib/,test_lcm test_control test_entry test_model test_sealed)
$(LCMGEN_TESTS): $(LCMGEN_OBJ)
$(LCMGEN_TESTS): TEST_EXTRA = -isystem $(BUILD)/lcmgen $(LCMGEN_OBJ)

$(BUILD)/tests/lib/%: tests/lib/%.c $(BUILD)/librim.a $(BUILD)/flags.test
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(TEST_CFLAGS) -MMD -MP -MF $@.d $< $(TEST_EXTRA) -o $@ $(BUILD)/librim.a -lcmocka -lm

# Compiled and linked apart: after an edit in a library a test is linked again, no more.
define link_test
	$(call say,LINK)$(CXX) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -o $@ $@.o $(BUILD)/libthesis.a $(BUILD)/libhost.a $(BUILD)/librim.a -lcmocka $(HOST_LIBS)
endef
$(BUILD)/tests/host/%.o: tests/host/%.cpp $(BUILD)/flags.host $(PCH_FILES)
	@mkdir -p $(@D)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@

TEST_GROUP_BIN := $(TEST_GROUPS:%=$(BUILD)/tests/host/group_%)
# $(call group_tests,N): the N-th third by size. Neighbours by name need the same templates.
group_tests = $(shell wc -c $(TEST_HOST_SRC) | awk '$$2 != "total" {size[NR] = $$1; name[NR] = $$2; all += $$1; n = NR} \
  END {for (i = 1; i <= n; i++) {if (int($(words $(TEST_GROUPS)) * (before + size[i] / 2) / all) == $(1) - 1) print name[i]; before += size[i]}}')
define test_group
TEST_GROUP_$(1) := $$(call group_tests,$(1))
$$(BUILD)/tests/host/group_$(1).cpp: $$(TEST_GROUP_$(1)) FORCE
	@mkdir -p $$(@D)
	@tests/host/group.sh $$(TEST_GROUP_$(1)) > $$@.new
	@cmp -s $$@.new $$@ && rm $$@.new || mv $$@.new $$@
$$(TEST_GROUP_$(1):%.cpp=$$(BUILD)/%): $$(BUILD)/tests/host/group_$(1)
	@ln -f $$< $$@
endef
$(foreach group,$(TEST_GROUPS),$(eval $(call test_group,$(group))))
$(TEST_GROUP_BIN:=.o): %.o: %.cpp $(BUILD)/flags.host $(PCH_FILES)
	$(call say,CXX )$(CXX) $(HOST_CXXFLAGS) -Itests/host $(HOST_LEVEL) $(call pch,$(firstword $(HOST_LEVEL))) -MMD -MP -c $< -o $@
$(or $(TEST_GROUP_BIN),$(TEST_HOST_BIN)): %: %.o $(BUILD)/libthesis.a $(BUILD)/libhost.a $(BUILD)/librim.a
	$(link_test)
.SECONDARY: $(TEST_HOST_BIN:=.o) $(TEST_GROUP_BIN:=.o)

.PHONY: test-long
test-long: ## the whole test, with all of the campaigns of which `make test` runs a part
	@RIM_LONG=1 $(MAKE) --no-print-directory test

.PHONY: instructions instructions-deps
instructions-deps: deps
	$(call install_missing,valgrind)
instructions: instructions-deps $(BUILD)/tests/lib/test_interference host ## instructions of the interference detector and of a planner's choice (installs valgrind)
	@lib/instructions.sh $(BUILD)

-include $(TEST_LIB_BIN:=.d) $(TEST_HOST_BIN:=.d) $(TEST_GROUP_BIN:=.d)
