# SPDX-License-Identifier: MIT
# Linux on the build machine itself.
linux_PREFIX :=
linux_SRC := firmware/port/linux/port.c
