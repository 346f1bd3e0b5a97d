# SPDX-License-Identifier: MIT
# Programs for the target. They depend on librim.a and their transports alone. A port is a folder
# firmware/port/NAME with a port.mk; nothing here names one (PORTING.md).

PORTS := $(patsubst firmware/port/%/port.mk,%,$(sort $(wildcard firmware/port/*/port.mk)))
include $(PORTS:%=firmware/port/%/port.mk)

.PHONY: firmware
firmware: lib $(if $(CROSS_COMPILE),,$(BUILD)/rimd)

# The daemon, for Linux: librim and the C library. For another computer:
# make CROSS_COMPILE=aarch64-linux-gnu- BUILD=build/aarch64 build/aarch64/rimd
RIMD_SRC := $(sort $(wildcard firmware/rimd/*.c firmware/transport/*.c))
RIMD_OBJ := $(RIMD_SRC:%.c=$(BUILD)/%.o)
# Keyed commands want libsodium, linked into rimd alone; without it rimd knows no key.
has_sodium = $(shell echo 'int main(void) {return sodium_init();}' | $(1) $(EXTRA_CFLAGS) $(EXTRA_LDFLAGS) \
  -include sodium.h -x c - -o /dev/null -lsodium 2> /dev/null && echo yes)
SODIUM = $(eval SODIUM := $$(call has_sodium,$$(CC)))$(SODIUM)
RIMD_LIBS = $(if $(SODIUM),-lsodium) -lm
FIRMWARE_CFLAGS = -std=c11 $(OPT) -ffp-contract=off $(WARNINGS) -Wvla -Wstrict-prototypes -Wmissing-prototypes \
  -pthread $(SANITIZER_FLAGS) $(EXTRA_CFLAGS) -DRIM_VERSION='"$(VERSION)"' $(if $(SODIUM),-DSEAL_SODIUM) -Ifirmware -Ilib/include -Ilib/src

$(BUILD)/flags.firmware: FORCE
	$(call flags_stamp,$(CC) $(FIRMWARE_CFLAGS))

$(BUILD)/firmware/%.o: firmware/%.c $(BUILD)/flags.firmware
	@mkdir -p $(@D)
	$(call say,CC  )$(CC) $(FIRMWARE_CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/rimd: $(RIMD_OBJ) $(BUILD)/librim.a
	$(call say,LINK)$(CC) $(OPT) $(SANITIZER_FLAGS) $(EXTRA_LDFLAGS) -pthread -o $@ $(RIMD_OBJ) $(BUILD)/librim.a $(RIMD_LIBS)

-include $(RIMD_OBJ:.o=.d)

test-build: $(BUILD)/rimd

# tests/firmware/test_X.c tests firmware/rimd and firmware/transport: all of the daemon but its main.
$(BUILD)/tests/firmware/%: tests/firmware/%.c $(RIMD_OBJ) $(BUILD)/librim.a $(BUILD)/flags.firmware
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(FIRMWARE_CFLAGS) -MMD -MP -MF $@.d $< -o $@ \
	  $(filter-out %/rimd/main.o,$(RIMD_OBJ)) $(BUILD)/librim.a -lcmocka $(RIMD_LIBS) $(TEST_LINK)
# tests/firmware/fake_can.h stands for the kernel's CAN.
$(addprefix $(BUILD)/tests/firmware/,test_socketcan test_run): TEST_LINK = $(addprefix -Wl$(comma)--wrap=,socket close bind setsockopt ioctl write recvmsg)
$(BUILD)/tests/firmware/test_faults: TEST_LINK = $(addprefix -Wl$(comma)--wrap=,open fstat mmap read socket setsockopt bind sendmsg recvmsg poll \
  sem_init pthread_create $(addprefix pthread_attr_,init setstacksize setinheritsched setschedpolicy setschedparam))
$(BUILD)/tests/firmware/test_state: TEST_LINK = $(addprefix -Wl$(comma)--wrap=,write read fsync close rename)

# What every port replays. landing: twenty healthy landings learnt, then one with a hidden fault, from
# its first row to its last, 29 features and 25 outcomes. golf: 4.2.3 (p. 55) with its own
# predictions, 100 features and 1 outcome, regions of two features. Both hold alarms.
RECORDINGS := landing golf
CROSS := $(BUILD)/cross
RECORDED_FAULT := 04_doppler_scale

$(CROSS)/record: firmware/replay/record.c firmware/replay/recording.h $(BUILD)/librim.a $(BUILD)/flags.lib
	@mkdir -p $(@D)
	$(call say,CC  )$(CC) -std=c11 $(OPT) -ffp-contract=off $(WARNINGS) -Ifirmware -Ilib/include -Ilib/src $< -o $@ $(BUILD)/librim.a

$(CROSS)/landing/model.rim: $(BUILD)/rim
	@mkdir -p $(@D)
	$(call say,RIM )$(BUILD)/rim simulate lander --out $(@D)/healthy --runs 20 --seed 1 > $(@D)/simulate.txt && \
	  $(BUILD)/rim train $(@D)/healthy/run_*.csv --out $@ --quick > $(@D)/train.txt

$(CROSS)/landing/log/run_0001.csv: $(BUILD)/rim
	$(call say,RIM )$(BUILD)/rim simulate lander --out $(@D) --seed 2 --effect $(RECORDED_FAULT) > /dev/null

$(CROSS)/golf/log/run_0001.csv: $(BUILD)/rim
	$(call say,RIM )$(BUILD)/rim simulate golf --out $(@D) --dims 100 --anomalous 60 --seed 5 > /dev/null

$(CROSS)/golf/model.rim: $(CROSS)/golf/log/run_0001.csv
	$(call say,RIM )$(BUILD)/rim replay $< --calibration-runs 39 --save-model $@ > $(@D)/train.txt

$(CROSS)/%.rec: $(CROSS)/record $(CROSS)/%/model.rim $(CROSS)/%/log/run_0001.csv
	$(call say,REC )$(CROSS)/record $(CROSS)/$*/model.rim $(CROSS)/$*/log/run_0001.csv $@

# The same in the flight profile (--flight), and 6 features with 3 outcomes, for the budgets.
$(CROSS)/landing_flight/model.rim: $(CROSS)/landing/model.rim
	@mkdir -p $(@D)
	$(call say,RIM )$(BUILD)/rim train $(CROSS)/landing/healthy/run_*.csv --out $@ --quick --flight > $(@D)/train.txt
$(CROSS)/golf_flight/model.rim $(CROSS)/six_flight/model.rim: $(CROSS)/%/model.rim: $(CROSS)/%/log/run_0001.csv $(BUILD)/rim
	$(call say,RIM )$(BUILD)/rim replay $< --calibration-runs 39 --flight --save-model $@ > $(@D)/train.txt
$(CROSS)/landing_flight/log/run_0001.csv $(CROSS)/golf_flight/log/run_0001.csv: \
    $(CROSS)/%_flight/log/run_0001.csv: $(CROSS)/%/log/run_0001.csv
	@mkdir -p $(@D)
	$(call say,COPY)cp $< $@
$(CROSS)/six_flight/log/run_0001.csv: firmware/replay/six_three.awk
	@mkdir -p $(@D)
	$(call say,AWK )awk -f $< > $@

# What `rim replay` says of the same rows.
$(CROSS)/%.digest: $(CROSS)/%/model.rim $(CROSS)/%/log/run_0001.csv
	$(call say,RIM )$(BUILD)/rim replay --model $(CROSS)/$*/model.rim $(CROSS)/$*/log/run_0001.csv > $@.txt && tail -n 1 $@.txt > $@

BUDGETED := six_flight landing_flight golf_flight
.SECONDARY: $(RECORDINGS:%=$(CROSS)/%.rec) $(BUDGETED:%=$(CROSS)/%.rec)

# $(call port_rules,PORT): library and replay for one port, in $(CROSS)/PORT.
define port_rules
$(1)_CC = $$(if $$($(1)_PREFIX),$$($(1)_PREFIX)gcc,$$(CC))
$(1)_FLAGS = -std=c11 -O2 -ffp-contract=off -fno-math-errno -fno-tree-slp-vectorize \
  -fno-tree-loop-distribute-patterns $$(WARNINGS) -Wvla -Wstrict-prototypes -Wmissing-prototypes \
  -Wstack-usage=$$(LIB_STACK_LIMIT) $$($(1)_CFLAGS) -Ifirmware -Ilib/include -Ilib/src
$(1)_LIB_OBJ := $$(LIB_SRC:%.c=$$(CROSS)/$(1)/%.o)
$(1)_OBJ := $$(addsuffix .o,$$(addprefix $$(CROSS)/$(1)/,$$($(1)_SRC) $$(or $$($(1)_BUS_SRC),firmware/replay/no_bus.c) firmware/replay/replay.c))

$$(CROSS)/$(1)/flags: FORCE
	$$(call flags_stamp,$$($(1)_CC) $$($(1)_FLAGS))

$$(CROSS)/$(1)/lib/%.o: lib/%.c $$(CROSS)/$(1)/flags | cross-deps
	@mkdir -p $$(@D)
	$$(call say,CC  )$$($(1)_CC) $$($(1)_FLAGS) -fstack-usage -MMD -MP -c $$< -o $$@

$$(CROSS)/$(1)/firmware/%.o: firmware/% $$(CROSS)/$(1)/flags | cross-deps
	@mkdir -p $$(@D)
	$$(call say,CC  )$$($(1)_CC) $$($(1)_FLAGS) -MMD -MP -c $$< -o $$@

$$(CROSS)/$(1)/recording-%.o: firmware/replay/recording.S $$(CROSS)/%.rec $$(CROSS)/$(1)/flags | cross-deps
	@mkdir -p $$(@D)
	$$(call say,AS  )$$($(1)_CC) $$($(1)_CFLAGS) -DRECORDING='"$$(CROSS)/$$*.rec"' -c $$< -o $$@

$$(CROSS)/$(1)/librim.a: $$($(1)_LIB_OBJ) lib/check_symbols.sh
	@rm -f $$@
	$$(call say,AR  )$$($(1)_PREFIX)ar rcsD $$@ $$($(1)_LIB_OBJ)
	@lib/check_symbols.sh $$($(1)_PREFIX)nm $$@ $$(if $$($(1)_PREFIX),cross)

$$(CROSS)/$(1)/replay-%: $$($(1)_OBJ) $$(CROSS)/$(1)/recording-%.o $$(CROSS)/$(1)/librim.a
	$$(call say,LINK)$$($(1)_CC) $$($(1)_CFLAGS) $$($(1)_LDFLAGS) -o $$@ $$^ $$($(1)_LIBS)

.SECONDARY: $$(RECORDINGS:%=$$(CROSS)/$(1)/recording-%.o) $$(BUDGETED:%=$$(CROSS)/$(1)/recording-%.o)
-include $$($(1)_LIB_OBJ:.o=.d) $$($(1)_OBJ:.o=.d)
endef
$(foreach port,$(PORTS),$(eval $(call port_rules,$(port))))

.PHONY: cross cross-deps
cross-deps: deps
	$(call install_missing,$(sort $(foreach port,$(PORTS),$($(port)_PACKAGES))))

PORT_LIST := $(if $(PORT),$(PORT),$(PORTS))
CROSS_BUILT := $(foreach r,$(RECORDINGS),$(CROSS)/$(r).digest $(patsubst %,$(CROSS)/%/replay-$(r),$(sort $(PORT_LIST) linux)))
cross: cross-deps ## two recorded runs on every port, emulated: are the bits the host's? (PORT='A B': those)
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) $(CROSS_BUILT)
	@firmware/cross.sh $(CROSS) '$(RECORDINGS)' $(foreach port,$(PORT_LIST),'$(port)' '$($(port)_PREFIX)' '$($(port)_RUN)')

# Every decoder of what comes in, searched for faults (libFuzzer): make fuzz FUZZ_SECONDS=3600. What it
# finds is left in $(BUILD)/fuzz. In `make test` tests/firmware/test_fuzz.c runs the corpus and damaged copies of it, and
# tests/cli/fuzz.sh, where there is clang, libFuzzer for 60000 inputs.
FUZZ_SECONDS ?= 600
FUZZ_DECODERS := $(shell sed -n 's/^.define FUZZ_DECODERS \([0-9]*\).*/\1/p' tests/fuzz/fuzz_decoders.h)
FUZZ_SRC := tests/fuzz/fuzz.c $(filter-out %/main.c,$(RIMD_SRC)) $(LIB_SRC)
.PHONY: fuzz fuzz-deps
fuzz-deps: deps
	$(call install_missing,clang libclang-rt-14-dev)
$(BUILD)/fuzz/fuzz: $(FUZZ_SRC) tests/fuzz/fuzz_decoders.h tests/fuzz/fuzz_repaired.h $(wildcard lib/include/rim/*.h lib/include/rim/plan/*.h lib/src/*/*.h firmware/*/*.h)
	@mkdir -p $(@D)
	$(call say,FUZZ)clang -std=c11 -g -O1 -ffp-contract=off -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all \
	  -pthread -DRIM_VERSION='"$(VERSION)"' $(if $(SODIUM),-DSEAL_SODIUM) -Ifirmware -Ilib/include -Ilib/src $(FUZZ_SRC) -o $@ $(RIMD_LIBS)
fuzz: fuzz-deps ## search every decoder for faults, guided by coverage (FUZZ_SECONDS=600; installs clang)
	@$(MAKE) --no-print-directory $(BUILD)/fuzz/fuzz
	@mkdir -p $(BUILD)/fuzz/corpus
	cp -n tests/fuzz/corpus/* $(BUILD)/fuzz/corpus/
	@cd $(BUILD)/fuzz && status=0; for k in $$(seq 0 $$(($(FUZZ_DECODERS) - 1))); do \
	  FUZZ_DECODER=$$k ./fuzz -max_total_time=$$(($(FUZZ_SECONDS) / $(FUZZ_DECODERS))) -max_len=8192 -close_fd_mask=2 \
	    -print_final_stats=1 corpus > said.$$k 2>&1 || status=1; \
	  awk -v k=$$k '/number_of_executed_units/ {n = $$2} /cov: / {c = $$4} END {print "decoder " k ": " n + 0 " inputs, edges " c + 0}' said.$$k; \
	  grep -h "ERROR\|crash-\|timeout-" said.$$k || :; done; exit $$status

# The same of every reader of a file on the ground, one after another, from good files that the test writes.
FUZZ_GROUND := $(BUILD)/fuzz/ground
GROUND_READERS := $(shell sed -n 's/^.define FUZZ_GROUND_READERS \([0-9]*\).*/\1/p' tests/fuzz/fuzz_ground.hpp)
FUZZ_GROUND_FLAGS := -g -fsanitize=address,undefined -fno-sanitize-recover=all
.PHONY: fuzz-ground
fuzz-ground: fuzz-deps $(BUILD)/tests/host/test_fuzz_ground ## search every reader of files on the ground for faults (FUZZ_SECONDS=600; builds it with clang)
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) BUILD=$(FUZZ_GROUND) CC=clang CXX=clang++ PCH= WARNINGS=-w NM=true OPT=-O1 \
	  EXTRA_CFLAGS='$(FUZZ_GROUND_FLAGS) -fsanitize=fuzzer-no-link' $(FUZZ_GROUND)/libhost.a $(FUZZ_GROUND)/librim.a
	@mkdir -p $(FUZZ_GROUND)/corpus && FUZZ_SEEDS=$(FUZZ_GROUND)/corpus $(BUILD)/tests/host/test_fuzz_ground > $(FUZZ_GROUND)/seeds.txt 2>&1
	$(call say,FUZZ)clang++ -std=c++17 -w -O1 -pthread $(FUZZ_GROUND_FLAGS) -fsanitize=fuzzer $(HOST_DEFINES) -Ihost_tools -Ilib/include -Ilib/src \
	  -isystem /usr/include/eigen3 tests/fuzz/fuzz_ground.cpp \
	  $(FUZZ_GROUND)/libhost.a $(FUZZ_GROUND)/librim.a -o $(FUZZ_GROUND)/fuzz $(HOST_LIBS)
	@cd $(FUZZ_GROUND) && status=0; for k in $$(seq 0 $$(($(GROUND_READERS) - 1))); do \
	  FUZZ_READER=$$k RIMWATCH_DATA=$(CURDIR)/data ./fuzz -max_total_time=$$(($(FUZZ_SECONDS) / $(GROUND_READERS))) -max_len=16384 -close_fd_mask=3 \
	    -print_final_stats=1 corpus > said.$$k 2>&1 || status=1; \
	  awk -v k=$$k '/number_of_executed_units/ {n = $$2} /cov: / {c = $$4} END {print "reader " k ": " n + 0 " inputs, edges " c + 0}' said.$$k; \
	  grep -h "ERROR\|crash-\|timeout-" said.$$k || :; done; exit $$status

# Instructions of a step and RAM on the Cortex-M7, in the flight profile: thousands, kB.
.PHONY: budgets budget-deps
size: $(if $(CROSS_COMPILE),,budgets)
budget-deps: deps
	$(call install_missing,$(mps2-an500_PACKAGES))
budgets: budget-deps
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) $(BUDGETED:%=$(CROSS)/mps2-an500/replay-%)
	@firmware/budget.sh $(CROSS) '$(mps2-an500_RUN)' six_flight 6/3 150 250 40 landing_flight 29/25 200 2600 55 \
	  golf_flight 100/1 180 300 55

# The monitor inside of frameworks: tests/cli/freertos.sh and cfs.sh, where the frameworks' sources are
# (FRAMEWORKS=FOLDER). What they need is installed where it can be; else they are skipped, saying so.
INTEGRATION_PACKAGES := cmake gcc-arm-none-eabi qemu-system-arm
.PHONY: integration-deps integration-try
integration-deps: deps
	$(call install_missing,$(INTEGRATION_PACKAGES))
integration-try: deps | can-try
	@timeout 240 $(MAKE) --no-print-directory SUDO='sudo -n' integration-deps < /dev/null || \
	  echo "test: some of the frameworks are skipped: could not install $(INTEGRATION_PACKAGES)"
TEST_NEEDS += integration-try

# SocketCAN in a guest with Debian's own kernel: tests/cli/can.sh. `make test` fetches what it needs where
# it can, and else skips it, saying so; `make test-can` insists.
CAN_PACKAGES := qemu-system-x86 busybox-static can-utils cpio iproute2
KERNEL_PACKAGE = "$$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: *\(linux-image-[^ ]*\).*/\1/p' | head -n 1)"
.PHONY: test-can can-deps can-try
can-deps: deps venv-try
	$(call install_missing,$(CAN_PACKAGES))
	@mkdir -p $(BUILD)/can; cd $(BUILD)/can; ls linux-image-*.deb > /dev/null 2>&1 || \
	  apt-get download -q $(KERNEL_PACKAGE) || { apt-get update -q && apt-get download -q $(KERNEL_PACKAGE); } || \
	  { echo "test-can: the package of Debian's kernel could not be had" >&2; exit 1; }
can-try: deps venv-try
	@mkdir -p $(BUILD)
	@timeout 240 $(MAKE) --no-print-directory SUDO='sudo -n' can-deps > $(BUILD)/can-deps.txt 2>&1 < /dev/null || \
	  echo "test: rimd on SocketCAN is skipped: $$(grep -v '^make' $(BUILD)/can-deps.txt | tail -n 1)"
TEST_NEEDS += can-try
test-can: can-deps ## rimd on SocketCAN: two controllers on one bus in a guest (installs QEMU and a kernel)
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) $(BUILD)/rim $(BUILD)/rimd
	@RIM=$(abspath $(BUILD)/rim) BUILD=$(abspath $(BUILD)) tests/cli/can.sh && RIM=$(abspath $(BUILD)/rim) BUILD=$(abspath $(BUILD)) tests/cli/interop.sh
