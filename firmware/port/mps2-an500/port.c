/* SPDX-License-Identifier: MIT */
/* Cortex-M7 of Arm's MPS2 board, application note AN500: UART 0 (CMSDK APB UART), SysTick, and
 * semihosting for the end of the run. */
#include "port/port.h"

#include <string.h>

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define UART_DATA REGISTER(0x40004000)
#define UART_STATE REGISTER(0x40004004)
#define UART_CONTROL REGISTER(0x40004008)
#define UART_DIVIDER REGISTER(0x40004010)
#define UART_TX_FULL 1u
#define UART_TX_ENABLE 1u
#define CPACR REGISTER(0xe000ed88)
#define CPACR_FPU_FULL (UINT32_C(0xf) << 20)
#define SYSTICK_CONTROL REGISTER(0xe000e010)
#define SYSTICK_RELOAD REGISTER(0xe000e014)
#define SYSTICK_VALUE REGISTER(0xe000e018)
#define SYSTICK_CORE_CLOCK 5u /* enabled, from the core's clock, without interrupt */
#define SYSTICK_MASK UINT32_C(0xffffff)

extern uint32_t bss_start[], bss_end[], data_start[], data_end[], data_load[], stack_top[];
int main(void);
_Noreturn void start(void);
_Noreturn void fault(void);
/* An operating system brings its own; by default each is a fault. Names of Arm's CMSIS. */
void SVC_Handler(void) __attribute__((weak, alias("fault")));
void PendSV_Handler(void) __attribute__((weak, alias("fault")));
void SysTick_Handler(void) __attribute__((weak, alias("fault")));

void port_putchar(char c) {
  while ((UART_STATE & UART_TX_FULL) != 0) {
  }
  UART_DATA = (unsigned char)c;
}

void port_exit(int status) {
  const uint32_t arguments[2] = {0x20026, (uint32_t)status}; /* ADP_Stopped_ApplicationExit */
  register uint32_t operation __asm__("r0") = 0x20;          /* SYS_EXIT_EXTENDED */
  register const uint32_t *block __asm__("r1") = arguments;
  __asm__ volatile("bkpt 0xab" : : "r"(operation), "r"(block) : "memory");
  for (;;) {
  }
}

/* QEMU's core clock of this board is 25 MHz and -icount shift=0 makes an instruction a nanosecond.
 */
uint32_t port_ticks(void) { return SYSTICK_MASK - SYSTICK_VALUE; }
uint32_t port_tick_instructions(void) { return 40; }
uint32_t port_tick_mask(void) { return SYSTICK_MASK; }

_Noreturn void fault(void) {
  for (const char *text = "fault\n"; *text != '\0'; ++text)
    port_putchar(*text);
  port_exit(3);
}

/* The FPU is on before anything may use it: nothing but integers in this function. */
_Noreturn void start(void) {
  CPACR |= CPACR_FPU_FULL;
  __asm__ volatile("dsb\n\tisb" : : : "memory");
  memcpy(data_start, data_load, (size_t)((char *)data_end - (char *)data_start));
  memset(bss_start, 0, (size_t)((char *)bss_end - (char *)bss_start));
  UART_DIVIDER = 16;
  UART_CONTROL = UART_TX_ENABLE;
  SYSTICK_RELOAD = SYSTICK_MASK;
  SYSTICK_VALUE = 0;
  SYSTICK_CONTROL = SYSTICK_CORE_CLOCK;
  port_exit(main());
}

/* Armv7-M, B1.5.2: initial stack pointer, reset, NMI, HardFault and the rest. */
typedef union vector {
  uint32_t *stack;
  void (*handler)(void);
} vector;
extern const vector vectors[16];
const vector vectors[16] __attribute__((section(".vectors"), used)) = {
    {.stack = stack_top},         {.handler = start}, {.handler = fault},
    {.handler = fault},           {.handler = fault}, {.handler = fault},
    {.handler = fault},           {.handler = fault}, {.handler = fault},
    {.handler = fault},           {.handler = fault}, {.handler = SVC_Handler},
    {.handler = fault},           {.handler = fault}, {.handler = PendSV_Handler},
    {.handler = SysTick_Handler},
};
