# SPDX-License-Identifier: MIT
# Linux on 32-bit PowerPC, big endian: statically linked, run by qemu-user.
linux-powerpc_PACKAGES := gcc-powerpc-linux-gnu libc6-dev-powerpc-cross qemu-user
linux-powerpc_PREFIX := powerpc-linux-gnu-
linux-powerpc_SRC := firmware/port/linux/port.c
linux-powerpc_LDFLAGS := -static
linux-powerpc_RUN := qemu-ppc
