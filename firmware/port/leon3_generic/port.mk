# SPDX-License-Identifier: MIT
# LEON3 (SPARC V8, big endian), no operating system, no C library; Debian's 64-bit SPARC compiler makes
# 32-bit code too; its libgcc is for SPARC V9, so nothing of it may be needed: the library needs nothing.
leon3_generic_PACKAGES := gcc-sparc64-linux-gnu gcc-multilib-sparc64-linux-gnu qemu-system-sparc
leon3_generic_PREFIX := sparc64-linux-gnu-
leon3_generic_CFLAGS := -m32 -mcpu=leon3 -mno-v8plus -mflat -Wa,-Aleon -ffreestanding -fno-pic -fno-stack-protector \
  -fno-asynchronous-unwind-tables -isystem firmware/port/bare
leon3_generic_SRC := firmware/port/leon3_generic/port.c firmware/port/leon3_generic/start.S firmware/port/bare/memory.c
leon3_generic_LDFLAGS := -nostdlib -static -no-pie -Wl,--build-id=none,-z,noexecstack,--no-warn-rwx-segments -T firmware/port/leon3_generic/link.ld
leon3_generic_RUN := qemu-system-sparc -M leon3_generic -display none -monitor none -serial stdio -kernel
