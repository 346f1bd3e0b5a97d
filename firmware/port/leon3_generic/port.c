/* SPDX-License-Identifier: MIT */
/* LEON3 of a GRLIB system: the APBUART at 0x80000100; a trap while traps are off ends the run. */
#include "port/port.h"

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define UART_DATA REGISTER(0x80000100)
#define UART_STATUS REGISTER(0x80000104)
#define UART_CONTROL REGISTER(0x80000108)
#define UART_TX_ENABLE 2u
#define UART_TX_FIFO_EMPTY 4u

int main(void);
_Noreturn void port_start(void);

void port_putchar(char c) {
  while ((UART_STATUS & UART_TX_FIFO_EMPTY) == 0) {
  }
  UART_DATA = (unsigned char)c;
}

/* No status leaves this machine: the console alone tells. */
void port_exit(int status) {
  (void)status;
  for (;;)
    __asm__ volatile("ta 0" : : : "memory");
}

uint32_t port_ticks(void) { return 0; }
uint32_t port_tick_instructions(void) { return 0; }
uint32_t port_tick_mask(void) { return 0; }

_Noreturn void port_start(void) {
  UART_CONTROL = UART_TX_ENABLE;
  port_exit(main());
}
