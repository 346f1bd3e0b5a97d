/* SPDX-License-Identifier: MIT */
/* LEON3 (SPARC V8) after reset, supervisor: traps stay off, so that one ends the run; the FPU on; no
 * register window is marked invalid, for the program is compiled flat and helpers of the compiler
 * nest but a few windows. */
  .section .text.start, "ax"
  .globl start
start:
  mov 0, %wim
  set 0x1080, %g1              /* PSR: EF floating point, S supervisor, ET (traps) 0 */
  mov %g1, %psr
  nop
  nop
  nop
  set floats, %g1
  ld [%g1], %fsr               /* round to nearest, no trap of IEEE 754 */
  set bss_start, %g1
  set bss_end, %g2
clear:
  cmp %g1, %g2
  bgeu ready
  nop
  st %g0, [%g1]
  st %g0, [%g1 + 4]
  ba clear
  add %g1, 8, %g1
ready:
  set stack_top - 96, %sp      /* 64 bytes for a window, 32 for a callee's arguments; aligned to 8 */
  mov 0, %fp
  call port_start
  nop
  ta 0

  .section .rodata
  .balign 4
floats:
  .word 0
