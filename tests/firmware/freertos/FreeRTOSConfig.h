/* SPDX-License-Identifier: MIT */
/* FreeRTOS without a heap, for the test of the monitor's task: on this machine's POSIX port, and on
 * the Cortex-M7 of mps2-an500 at 25 MHz. */
#ifndef FREERTOS_CONFIG_H
#define FREERTOS_CONFIG_H

#include <stdint.h>

_Noreturn void assert_failed(const char *file, int line);

#define configSUPPORT_STATIC_ALLOCATION 1
#define configSUPPORT_DYNAMIC_ALLOCATION 0
#define configKERNEL_PROVIDED_STATIC_MEMORY 1
#define configUSE_PREEMPTION 1
#define configUSE_IDLE_HOOK 0
#define configUSE_TICK_HOOK 0
#define configUSE_TIMERS 0
#define configMAX_PRIORITIES 5
#define configMAX_TASK_NAME_LEN 8
#define configTICK_RATE_HZ 1000
#define configTICK_TYPE_WIDTH_IN_BITS TICK_TYPE_WIDTH_32_BITS
#define configCHECK_FOR_STACK_OVERFLOW 2
#define INCLUDE_vTaskDelay 1
#define INCLUDE_uxTaskGetStackHighWaterMark 1
#define configASSERT(x) ((x) ? (void)0 : assert_failed(__FILE__, __LINE__))

#ifdef __arm__
#define configMINIMAL_STACK_SIZE 256
#define configCPU_CLOCK_HZ 25000000
#define configPRIO_BITS 3
#define configKERNEL_INTERRUPT_PRIORITY (7 << (8 - configPRIO_BITS))
#define configMAX_SYSCALL_INTERRUPT_PRIORITY (5 << (8 - configPRIO_BITS))
#define vPortSVCHandler SVC_Handler
#define xPortPendSVHandler PendSV_Handler
#define xPortSysTickHandler SysTick_Handler
#else
#define configMINIMAL_STACK_SIZE 4096
#define RIM_TASK_STACK_BYTES 65536u /* a thread's: the C library wants more than the monitor */
#endif

#define RIM_TASK_MAX_VALUES 32u
#define RIM_TASK_MONITOR_BYTES 36864u

#endif
