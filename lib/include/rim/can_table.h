/* SPDX-License-Identifier: MIT */
/* rim/can_table.h - observations from CAN frames, by a table that `rim can-table` compiles from a
 * DBC.
 *
 * The table is section RIM_SECTION_CAN_TABLE of a flight image: which signal of which frame is
 * which value of a row (the features in image order; with external predictions then outcomes, means
 * and standard deviations). It is read in place and validated whole before use. The gatherer holds
 * the newest value of each signal and says when a row is complete. The same code makes rows from a
 * bus on board and from a `candump -L` log on the ground.
 *
 * Layout, little-endian:
 *   0   u32 1 (layout) | u16 values | u16 frames | u16 signals | u16 index of the trigger, 0xffff:
 *       none | u16 signal that carries the time, 0xffff: none | u16 0
 *   16  frames x {u32 id, bit 31: 29 bits | u8 bytes of data | u8 1: FD | u16 first signal | u16
 *       signals | u16 0}, identifiers all different
 *   ... signals x {u16 value, 0xffff: the time | u8 rim_can_number | u8 1: Motorola order | u16
 * start bit as in a DBC | u8 bits | u8 bits of the selector, 0: not multiplexed | u16 start bit of
 *       the selector | u8 1: selector in Motorola order | u8 0 | u32 selector's value | f64 scale |
 *       f64 offset | f64 low | f64 high}, 48 bytes each, those of a frame together */
#ifndef RIM_CAN_TABLE_H
#define RIM_CAN_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/can.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_SECTION_CAN_TABLE 13u
#define RIM_CAN_TABLE_LAYOUT 1u
#define RIM_CAN_TABLE_HEADER_BYTES 16u
#define RIM_CAN_TABLE_FRAME_BYTES 12u
#define RIM_CAN_TABLE_SIGNAL_BYTES 48u
#define RIM_CAN_TABLE_MAX_VALUES 256u
#define RIM_CAN_TABLE_MAX_FRAMES 64u
#define RIM_CAN_TABLE_MAX_SIGNALS 1024u /* with those that a selector tells apart */
#define RIM_CAN_TABLE_NONE 0xffffu
#define RIM_CAN_EXTENDED 0x80000000u /* in an identifier */

typedef enum rim_can_number {
  RIM_CAN_UNSIGNED = 0,
  RIM_CAN_SIGNED = 1,
  RIM_CAN_F32 = 2,
  RIM_CAN_F64 = 3
} rim_can_number;

/* A view; the bytes must outlive it. */
typedef struct rim_can_table {
  const uint8_t *frame, *signal;
  uint16_t values, frames, signals;
  uint16_t trigger; /* frame that completes a row; RIM_CAN_TABLE_NONE: whichever is the last */
  uint16_t time;    /* signal; RIM_CAN_TABLE_NONE: the time of reception */
} rim_can_table;

/* The newest value of every signal. All zero: none yet. */
typedef struct rim_can_gather {
  double value[RIM_CAN_TABLE_MAX_VALUES];
  double value_s[RIM_CAN_TABLE_MAX_VALUES]; /* when it came */
  double time_s;                            /* of the time signal */
  bool has[RIM_CAN_TABLE_MAX_VALUES];       /* ever */
  bool fresh[RIM_CAN_TABLE_MAX_VALUES];     /* since the last row */
  bool has_time;
  uint16_t waiting; /* values not fresh; counted from the first frame on */
  bool started;
} rim_can_gather;

/* Validates the whole table. RIM_E_ARGUMENT NULL; RIM_E_TRUNCATED, RIM_E_SIZE another length than
 * it announces; RIM_E_VERSION another layout; RIM_E_RANGE a count, index, bit position or code out
 * of range, a value without a signal or with two under the same selector; RIM_E_DATA a number not
 * finite, scale 0, or low above high. O(signals^2 + frames^2), both of which have a MAX. */
rim_status rim_can_table_open(rim_can_table *table, const void *data, size_t bytes);

/* Returns identifier i of the frames that the table reads; 0 for NULL and where there is none. */
uint32_t rim_can_table_id(const rim_can_table *table, uint16_t index);

/* Takes a frame that came at t_s. *complete tells whether a row is complete: then gather->value
 * [values] is the row and *row_s its time. A row is complete when the trigger comes, or, without
 * one, when every value has come since the last row. RIM_E_ARGUMENT NULL; RIM_E_MAGIC an identifier
 * that is not read; RIM_E_SIZE another length, or FD where classic is expected; RIM_E_DATA a value
 * not finite or outside low..high (not taken; the others of the frame are); RIM_E_TRUNCATED the
 * trigger came, and a value never did or not for age_s: no row. O(frames + signals of the frame *
 * 64 + values). */
rim_status rim_can_gather_frame(rim_can_gather *gather, const rim_can_table *table,
                                const rim_can_frame *frame, double t_s, double age_s,
                                bool *complete, double *row_s);

#ifdef __cplusplus
}
#endif
#endif
