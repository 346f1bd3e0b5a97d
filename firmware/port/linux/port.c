/* SPDX-License-Identifier: MIT */
/* Any Linux, through its C library. */
#include "port/port.h"

#include <stdio.h>
#include <stdlib.h>

void port_putchar(char c) { putchar(c); }

void port_exit(int status) { exit(fflush(stdout) == 0 ? status : 4); }

uint32_t port_ticks(void) { return 0; }
uint32_t port_tick_instructions(void) { return 0; }
uint32_t port_tick_mask(void) { return 0; }
