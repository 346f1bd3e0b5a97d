# SPDX-License-Identifier: MIT
# rimwatch: everything is built in $(BUILD)/. `make help` lists the targets.

# Of lib/include/rim/version.h, the only place where it stands.
VERSION := $(shell awk '/RIM_VERSION_(MAJOR|MINOR|PATCH) [0-9]/ {v = v dot $$3; dot = "."} END {print v}' lib/include/rim/version.h)

BUILD ?= build
PREFIX ?= /usr/local
DESTDIR ?=
CROSS_COMPILE ?=
OPT ?= -O2
SANITIZE ?=
TEST_JOBS ?= 2
SUDO ?= sudo

ifeq ($(origin CC),default)
CC := $(CROSS_COMPILE)gcc
endif
ifeq ($(origin CXX),default)
CXX := $(CROSS_COMPILE)g++
endif
ifeq ($(origin AR),default)
AR := $(CROSS_COMPILE)ar
endif
NM ?= $(CROSS_COMPILE)nm
SIZE ?= $(CROSS_COMPILE)size

WARNINGS := -Wall -Wextra -Wconversion -Wshadow -Werror
comma := ,
# gcc 12 under the sanitizers takes the inside of <regex> for uninitialised: seen, said, no error.
# -g1: the lines that a report names, at a third less of compiling than -g.
SANITIZER_FLAGS := $(if $(SANITIZE),-g1 -fsanitize=address$(comma)undefined -fno-sanitize-recover=all -Wno-error=maybe-uninitialized)
# What is done in a word; the whole command with V=1.
V ?=
say = $(if $(V),,@echo '  $(1)' $@;)
# Set from outside for a target: -mcpu=..., -static, ...
EXTRA_CFLAGS ?=
EXTRA_LDFLAGS ?=

.DEFAULT_GOAL := all
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules

include lib/Dir.mk
include firmware/Dir.mk
include host_tools/Dir.mk
include host_tools/packaging/Dir.mk
include tests/Dir.mk
include tests/hidden/Dir.mk
include tests/assurance/Dir.mk
include data/Dir.mk

.PHONY: help deps all demo test test-sanitized bench size api install clean check FORCE

help: ## this list
	@awk -F':.*## ' '/^[a-z_-]+:.*## /{printf "  make %-14s %s\n", $$1, $$2}' \
	  Makefile lib/Dir.mk firmware/Dir.mk host_tools/Dir.mk host_tools/packaging/Dir.mk tests/Dir.mk tests/hidden/Dir.mk tests/assurance/Dir.mk data/Dir.mk
	@echo "Variables: BUILD=$(BUILD) PREFIX=$(PREFIX) DESTDIR=$(DESTDIR) CROSS_COMPILE=$(CROSS_COMPILE) CC=$(CC) CXX=$(CXX) OPT=$(OPT) SANITIZE=$(SANITIZE)"

DEB_PACKAGES := gcc g++ make binutils python3 libeigen3-dev liblcm-dev liblcm-bin libcmocka-dev \
  libccd-dev libnanoflann-dev libcli11-dev libtomlplusplus-dev nlohmann-json3-dev libfmt-dev \
  libboost-dev libmuparser-dev gnuplot-nox zlib1g-dev libzstd-dev libsodium-dev libjs-dygraphs
DEB_CHECK_PACKAGES := cppcheck clang-format

# $(call install_missing,PACKAGES): a machine that has them all is not touched.
define install_missing
	@command -v dpkg-query >/dev/null || \
	  { echo "deps: not a Debian machine; needed are: $(1)" >&2; exit 0; }; \
	missing=; for p in $(1); do \
	  dpkg-query -W -f='$${Status}\n' $$p 2>/dev/null | grep -q 'install ok installed' || \
	    missing="$$missing $$p"; \
	done; \
	if [ -n "$$missing" ]; then \
	  echo "deps: installing$$missing"; \
	  sudo=; [ "$$(id -u)" = 0 ] || sudo="$(SUDO)"; \
	  $$sudo apt-get update -q && \
	  $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends $$missing || \
	  { echo "deps: could not install$$missing (root or sudo, and a network, are needed)" >&2; exit 1; }; \
	fi
endef

deps: ## install the Debian packages that are missing (root or sudo)
	$(call install_missing,$(DEB_PACKAGES))

# Nothing may be compiled before its packages are there, also under -j.
demo test: deps
ifneq ($(filter demo test,$(MAKECMDGOALS)),)
$(BUILD)/flags.host $(BUILD)/flags.lib: | deps
endif

# Recompile when a flag changes: the stamp's content is the flags, its date changes only with them.
define flags_stamp
	@mkdir -p $(@D)
	@printf '%s\n' '$(subst ','\'',$(1))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(1))' > $@
endef

all: lib $(if $(CROSS_COMPILE),,host) firmware ## the library build/librim.a and the tool build/rim

demo: ## learn 50 landings, replay one healthy and three faulty ones, hear the alarms over LCM
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) host
	@RIM=$(BUILD)/rim BUILD=$(BUILD) host_tools/demo/demo.sh

# What is fetched for some of the tests (TEST_NEEDS) mostly waits for the network: it runs beside the compiler's jobs.
test: ## every test; the last line counts them
	@$(MAKE) --no-print-directory $(TEST_NEEDS) & $(MAKE) --no-print-directory -j$(TEST_JOBS) test-build || { wait; exit 1; }; wait
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) test-run

# Measured logs, where they are on this machine.
MEASURED ?= ../shared/measured
MEASURED_SETS := falcon:falcon9 measured_falcon:falcon9 measured_mrclam:mrclam control_mrclam:mrclam

bench: all thesis ## speed, memory and detection figures with their intervals and limits (some 30 minutes)
	$(BUILD)/rim bench
	@status=0; \
	figure() { \
	  echo "== $$1"; $(BUILD)/rim-thesis experiment "$$@" > $(BUILD)/bench.txt || { status=1; return; }; \
	  cat $(BUILD)/bench.txt; tests/thesis/limits.py "$$1" $(BUILD)/bench.txt || status=1; }; \
	figure lander --thesis; \
	for name in golf fig3.3 fig3.4 fig3.5 figC.5 fig5.10 figB.6 table3.1; do figure $$name; done; \
	for pair in $(MEASURED_SETS); do \
	  if [ -d "$(MEASURED)/$${pair#*:}" ]; then figure $${pair%:*} --data $(MEASURED)/$${pair#*:}; \
	  else echo "bench: $${pair%:*} is left out: there is no $(MEASURED)/$${pair#*:} (MEASURED=FOLDER names another place)"; fi; done; \
	exit $$status

clean: ## remove everything built
	rm -rf $(BUILD)

# Everything goes through $(STAGE)/, whose files are listed in share/rimwatch/installed.txt.
STAGE = $(BUILD)/stage
share = $(STAGE)/share/rimwatch
install: all ## into $(DESTDIR)$(PREFIX): bin lib include share
	rm -rf $(STAGE)
	install -d $(STAGE)/bin $(STAGE)/lib/pkgconfig $(STAGE)/lib/cmake/rimwatch $(STAGE)/include/rim/plan $(share)/wire \
	  $(STAGE)/share/doc/rimwatch $(STAGE)/share/man/man1 $(STAGE)/share/bash-completion/completions $(STAGE)/share/zsh/site-functions
	$(if $(CROSS_COMPILE),,install -m 755 $(BUILD)/rim $(BUILD)/rimd $(STAGE)/bin/)
	$(if $(CROSS_COMPILE),,@$(MAKE) --no-print-directory stage-rim)
	install -m 644 firmware/rimd/rimd.conf $(share)/
	sed -e 's|@PREFIX@|$(PREFIX)|' firmware/rimd/rimd.service.in > $(share)/rimd.service
	install -m 644 $(BUILD)/librim.a $(STAGE)/lib/librim.a
	install -m 644 lib/include/rim/*.h $(STAGE)/include/rim/
	install -m 644 lib/include/rim/plan/*.h $(STAGE)/include/rim/plan/
	install -m 644 lib/wire/*.lcm lib/wire/*.dbc $(share)/wire/
	sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@VERSION@|$(VERSION)|' lib/rimwatch.pc.in > $(STAGE)/lib/pkgconfig/rimwatch.pc
	set -e; for f in rimwatch-config rimwatch-config-version; do \
	  sed -e 's|@VERSION@|$(VERSION)|' lib/$$f.cmake.in > $(STAGE)/lib/cmake/rimwatch/$$f.cmake; done
	install -m 644 LICENSE README.md CHANGELOG.md $(STAGE)/share/doc/rimwatch/
	set -e; for f in lib firmware host_tools data; do install -m 644 $$f/README.md $(STAGE)/share/doc/rimwatch/$$f.md; done
	set -e; for f in $(filter-out README.md,$(DATA_FILES)); do install -D -m 644 data/$$f $(share)/$$f; done
	cd $(STAGE) && { find . -type f; echo ./share/rimwatch/installed.txt; } | LC_ALL=C sort | cut -c3- > share/rimwatch/installed.txt
	install -d $(DESTDIR)$(PREFIX)
	cd $(STAGE) && tar -cf - . | tar -C $(abspath $(DESTDIR)$(PREFIX)) --no-same-owner -xf -

# Pages and completion that the program writes of itself, and the readers of other formats.
.PHONY: stage-rim uninstall
stage-rim:
	$(BUILD)/rim help --man > $(STAGE)/share/man/man1/rim.1
	set -e; for c in $$($(BUILD)/rim --help | awk '/^  [a-z-]+ /{print $$1}'); do \
	  $(BUILD)/rim help --man $$c > $(STAGE)/share/man/man1/rim-$$c.1; done
	$(BUILD)/rim help --bash > $(STAGE)/share/bash-completion/completions/rim
	$(BUILD)/rim help --zsh > $(STAGE)/share/zsh/site-functions/_rim
	install -d $(share)/readers && install -m 644 host_tools/python/src/rimwatch/readers/*.py $(share)/readers/

uninstall: ## remove what install put into $(DESTDIR)$(PREFIX)
	@list=$(DESTDIR)$(PREFIX)/share/rimwatch/installed.txt; \
	[ -f $$list ] || { echo "uninstall: no $$list" >&2; exit 1; }; \
	cd $(DESTDIR)$(PREFIX) && cp share/rimwatch/installed.txt share/.rimwatch.tmp && xargs -d '\n' rm -f < share/.rimwatch.tmp && \
	sed 's|/[^/]*$$||' share/.rimwatch.tmp | LC_ALL=C sort -ru | xargs -d '\n' rmdir -p --ignore-fail-on-non-empty 2>/dev/null; \
	rm -f share/.rimwatch.tmp; rmdir --ignore-fail-on-non-empty share 2>/dev/null; true

size: lib $(if $(CROSS_COMPILE),,host) ## code size, static RAM, stack and the RAM of a monitor
	@lib/size.sh "$(SIZE)" $(BUILD)
	@$(if $(CROSS_COMPILE),,$(BUILD)/rim bench --memory || echo "monitor RAM: 'rim bench --memory' failed")

api: lib ## public headers and functions of the library, with their size in lines
	@lib/api.py "$(NM)" $(BUILD)/librim.a

check: check-deps lib host ## cppcheck, style, rooms, public and forbidden symbols, and the tests under the sanitizers
	tests/style.sh
	tests/rooms.py
	lib/check_symbols.sh "$(NM)" $(BUILD)/librim.a names
	lib/api.py "$(NM)" $(BUILD)/librim.a > $(BUILD)/api.txt && tail -n 2 $(BUILD)/api.txt
	lib/size.sh "$(SIZE)" $(BUILD) > $(BUILD)/size.txt || { tail -6 $(BUILD)/size.txt; exit 1; }
	cppcheck --quiet --error-exitcode=1 --inline-suppr --std=c11 \
	  --enable=warning,performance,portability -Ilib/include -Ilib/src lib/src
	cppcheck --quiet --error-exitcode=1 --inline-suppr --std=c++17 --language=c++ -j2 \
	  --enable=warning,performance,portability -Ilib/include -Ilib/src -Ihost_tools -I$(BUILD)/gen host_tools
	@$(MAKE) --no-print-directory prove-quick trace
	@$(MAKE) --no-print-directory test-sanitized

# A script that cannot run under the sanitizers, or would take hours, is skipped and prints why.
test-sanitized: deps ## the tests under the address and undefined-behaviour sanitizers
	@$(MAKE) --no-print-directory -j$(TEST_JOBS) BUILD=$(BUILD)/sanitize SANITIZE=1 OPT=-O1 test-run

.PHONY: check-deps
check-deps: deps
	$(call install_missing,$(DEB_CHECK_PACKAGES))

FORCE:
