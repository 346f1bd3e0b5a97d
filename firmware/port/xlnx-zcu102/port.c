/* SPDX-License-Identifier: MIT */
/* Cortex-A53 of the Zynq UltraScale+: UART 0 (Cadence), and semihosting for the end of the run. */
#include "port/port.h"

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define UART_CONTROL REGISTER(0xff000000)
#define UART_STATUS REGISTER(0xff00002c)
#define UART_FIFO REGISTER(0xff000030)
#define UART_TX_ENABLE 0x10u
#define UART_TX_FULL 0x10u

int main(void);
_Noreturn void port_start(void);
_Noreturn void port_fault(void);

void port_putchar(char c) {
  while ((UART_STATUS & UART_TX_FULL) != 0) {
  }
  UART_FIFO = (unsigned char)c;
}

void port_exit(int status) {
  const uint64_t arguments[2] = {0x20026, (uint64_t)status}; /* ADP_Stopped_ApplicationExit */
  register uint64_t operation __asm__("x0") = 0x18;          /* SYS_EXIT */
  register const uint64_t *block __asm__("x1") = arguments;
  __asm__ volatile("hlt #0xf000" : : "r"(operation), "r"(block) : "memory");
  for (;;) {
  }
}

uint32_t port_ticks(void) { return 0; }
uint32_t port_tick_instructions(void) { return 0; }
uint32_t port_tick_mask(void) { return 0; }

_Noreturn void port_fault(void) {
  for (const char *text = "fault\n"; *text != '\0'; ++text)
    port_putchar(*text);
  port_exit(3);
}

_Noreturn void port_start(void) {
  UART_CONTROL = UART_TX_ENABLE;
  port_exit(main());
}
