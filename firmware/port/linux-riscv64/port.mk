# SPDX-License-Identifier: MIT
# Linux on 64-bit RISC-V: statically linked, run by qemu-user.
linux-riscv64_PACKAGES := gcc-riscv64-linux-gnu libc6-dev-riscv64-cross qemu-user
linux-riscv64_PREFIX := riscv64-linux-gnu-
linux-riscv64_SRC := firmware/port/linux/port.c
linux-riscv64_LDFLAGS := -static
linux-riscv64_RUN := qemu-riscv64
