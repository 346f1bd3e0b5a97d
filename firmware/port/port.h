/* SPDX-License-Identifier: MIT */
/* port.h - all that a program of firmware/ asks of a computer. Each port in firmware/port/ provides
 * these functions and a start-up that calls main() once, with the stack set, the floating-point
 * unit on, and static memory cleared. firmware/PORTING.md says how to add one. */
#ifndef PORT_H
#define PORT_H

#include <stdint.h>

/* Send one character to the console, waiting as long as it takes. */
void port_putchar(char c);

/* End the program: 0 fine, 3 bad data or a fault, 4 internal error. Where nothing can carry a
 * status out of the machine the console alone tells. */
_Noreturn void port_exit(int status);

/* Return a count for measuring one step, in units of port_tick_instructions(), that wraps at
 * port_tick_mask(); 0 always where the port has none. */
uint32_t port_ticks(void);

/* Instructions per tick, and the bits of the count; 0 and 0: the port has none. */
uint32_t port_tick_instructions(void);
uint32_t port_tick_mask(void);

#endif
