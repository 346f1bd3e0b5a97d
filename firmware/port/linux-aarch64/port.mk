# SPDX-License-Identifier: MIT
# Linux on 64-bit Arm: statically linked, run by qemu-user.
linux-aarch64_PACKAGES := gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user
linux-aarch64_PREFIX := aarch64-linux-gnu-
linux-aarch64_SRC := firmware/port/linux/port.c
linux-aarch64_LDFLAGS := -static
linux-aarch64_RUN := qemu-aarch64
