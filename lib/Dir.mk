# SPDX-License-Identifier: MIT
# librim.a: every lib/src/ROOM/*.c, freestanding in spirit: no heap, stdio, libm, recursion or VLA.

LIB_SRC := $(sort $(wildcard lib/src/*/*.c))
LIB_OBJ := $(LIB_SRC:%.c=$(BUILD)/%.o)

# No function of the library may need more stack than this (an optimised build of gcc; the
# sanitizers and -O0 pad frames).
LIB_STACK_LIMIT := 2048
LIB_STACK := $(if $(SANITIZE)$(filter -O0,$(OPT)),,$(if $(findstring clang,$(CC)),,-Wstack-usage=$(LIB_STACK_LIMIT)))

# gcc 12 miscompiles pairs of double -> float -> double in its SLP vectoriser.
NO_SLP = $(if $(findstring clang,$(CC)),,-fno-tree-slp-vectorize)

LIB_CFLAGS = -std=c11 $(OPT) -ffp-contract=off -fno-math-errno $(NO_SLP) $(WARNINGS) -Wvla -Wstrict-prototypes \
  -Wmissing-prototypes $(LIB_STACK) $(SANITIZER_FLAGS) $(EXTRA_CFLAGS) -Ilib/include -Ilib/src

.PHONY: lib
lib: $(BUILD)/librim.a

$(BUILD)/flags.lib: FORCE
	$(call flags_stamp,$(CC) $(LIB_CFLAGS))

$(BUILD)/lib/src/%.o: lib/src/%.c $(BUILD)/flags.lib
	@mkdir -p $(@D)
	$(call say,CC  )$(CC) $(LIB_CFLAGS) $(if $(findstring clang,$(CC)),,-fstack-usage -fcallgraph-info=su) -MMD -MP -c $< -o $@

$(BUILD)/librim.a: $(LIB_OBJ) lib/check_symbols.sh
	@rm -f $@
	$(call say,AR  )$(AR) rcsD $@ $(LIB_OBJ)
	@$(if $(SANITIZE),true,lib/check_symbols.sh "$(NM)" $@ $(if $(CROSS_COMPILE),cross))

-include $(LIB_OBJ:.o=.d)
