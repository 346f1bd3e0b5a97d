# SPDX-License-Identifier: MIT
# Linux on 32-bit Arm with an FPU: statically linked, run by qemu-user.
linux-armhf_PACKAGES := gcc-arm-linux-gnueabihf libc6-dev-armhf-cross qemu-user
linux-armhf_PREFIX := arm-linux-gnueabihf-
linux-armhf_SRC := firmware/port/linux/port.c
linux-armhf_LDFLAGS := -static
linux-armhf_RUN := qemu-arm
