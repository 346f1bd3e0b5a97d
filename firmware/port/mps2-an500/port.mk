# SPDX-License-Identifier: MIT
# Arm Cortex-M7 with double-precision FPU, no operating system, no C library.
mps2-an500_PACKAGES := gcc-arm-none-eabi qemu-system-arm
mps2-an500_PREFIX := arm-none-eabi-
mps2-an500_CFLAGS := -mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16 -ffreestanding -isystem firmware/port/bare
mps2-an500_SRC := firmware/port/mps2-an500/port.c firmware/port/bare/memory.c
mps2-an500_LDFLAGS := -nostdlib -static -T firmware/port/mps2-an500/link.ld
mps2-an500_LIBS := -lgcc
# -icount: an instruction is a nanosecond of the board's clock, which counts them.
mps2-an500_RUN := qemu-system-arm -M mps2-an500 -icount shift=0 -display none -monitor none -serial stdio \
  -semihosting-config enable=on,target=native -kernel
