# SPDX-License-Identifier: MIT
# Arm Cortex-A53, no operating system, no C library. With the MMU off memory is of the device type,
# where an access must be aligned.
xlnx-zcu102_PACKAGES := gcc-aarch64-linux-gnu qemu-system-arm
xlnx-zcu102_PREFIX := aarch64-linux-gnu-
xlnx-zcu102_CFLAGS := -mcpu=cortex-a53 -mstrict-align -mno-outline-atomics -ffreestanding -fno-pic -fno-stack-protector \
  -fno-asynchronous-unwind-tables -isystem firmware/port/bare
xlnx-zcu102_SRC := firmware/port/xlnx-zcu102/port.c firmware/port/xlnx-zcu102/start.S firmware/port/bare/memory.c
xlnx-zcu102_BUS_SRC := firmware/replay/can_bus.c firmware/port/xlnx-zcu102/can.c
xlnx-zcu102_LDFLAGS := -nostdlib -static -no-pie -Wl,--build-id=none,-z,noexecstack,--no-warn-rwx-segments -T firmware/port/xlnx-zcu102/link.ld
xlnx-zcu102_LIBS := -lgcc
xlnx-zcu102_RUN := env QEMU_AUDIO_DRV=none qemu-system-aarch64 -object can-bus,id=bus \
  -M xlnx-zcu102,canbus0=bus,canbus1=bus -display none -monitor none \
  -serial stdio -semihosting-config enable=on,target=native -kernel
