/* SPDX-License-Identifier: MIT */
/* A Cortex-A53 core after reset, at the highest exception level the machine has, MMU off: traps to one
 * handler, floating point on at every level, stack set, static memory cleared. */
  .section .text.start, "ax"
  .globl start
start:
  mrs x0, mpidr_el1
  ands x0, x0, #0xff
  b.ne park                    /* the other cores sleep */
  adr x1, traps
  mrs x0, CurrentEL
  cmp x0, #(3 << 2)
  b.eq level_3
  cmp x0, #(2 << 2)
  b.eq level_2
  msr vbar_el1, x1
  b level_1
level_3:
  msr vbar_el3, x1
  msr cptr_el3, xzr            /* floating point is not trapped */
  b level_1
level_2:
  msr vbar_el2, x1
  mov x0, #0x33ff              /* the bits that are always 1; TFP, bit 10, is 0 */
  msr cptr_el2, x0
level_1:
  mov x0, #(3 << 20)           /* CPACR_EL1.FPEN */
  msr cpacr_el1, x0
  isb
  ldr x0, =stack_top
  mov sp, x0
  ldr x0, =bss_start
  ldr x1, =bss_end
clear:
  cmp x0, x1
  b.hs ready
  stp xzr, xzr, [x0], #16      /* link.ld aligns both ends to 16 */
  b clear
ready:
  bl port_start
park:
  wfe
  b park

  .balign 2048
traps:                         /* Arm ARM D1.10.2: 16 entries of 128 bytes */
  .rept 16
  b port_fault
  .balign 128
  .endr
