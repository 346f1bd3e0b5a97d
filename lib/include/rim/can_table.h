/* SPDX-License-Identifier: MIT */
/* rim/can_table.h - rows from CAN frames, by a table that `rim can-table` compiles from a DBC.
 *
 * The table is section RIM_SECTION_CAN_TABLE of a flight image. It says which signal of which frame
 * is which value of a row: the features in image order and, where rows bring their own predictions,
 * then outcomes, means and standard deviations. It is read in place and validated whole before use.
 * The gatherer holds the newest value of each signal and reports when a row is complete. The same
 * code makes rows from a bus on board and from a `candump -L` log on the ground.
 *
 * Layout, little-endian. Header, 16 bytes:
 *   offset  type  meaning
 *   0       u32   1, the layout
 *   4       u16   values of a row
 *   6       u16   frames
 *   8       u16   signals
 *   10      u16   index of the frame that triggers a row; 0xffff: none does
 *   12      u16   signal that carries the time; 0xffff: none does
 *   14      u16   0
 * Then the frames, 12 bytes each, with different identifiers:
 *   0       u32   identifier; bit 31: it has 29 bits
 *   4       u8    bytes of data
 *   5       u8    1 for CAN FD
 *   6       u16   its first signal
 *   8       u16   its signals
 *   10      u16   0
 * Then the signals, 48 bytes each, those of a frame together:
 *   0       u16   value of the row; 0xffff: the time
 *   2       u8    rim_can_number
 *   3       u8    1 for Motorola byte order
 *   4       u16   start bit as in a DBC
 *   6       u8    bits
 *   7       u8    bits of the selector; 0: not multiplexed
 *   8       u16   start bit of the selector
 *   10      u8    1 for a selector in Motorola byte order
 *   11      u8    0
 *   12      u32   the selector's value
 *   16      f64   scale, offset, low, high */
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

/* A view of a table; the bytes must outlive it. */
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

/* Validates the whole table. RIM_E_ARGUMENT: NULL; RIM_E_TRUNCATED, RIM_E_SIZE: another length than
 * it announces; RIM_E_VERSION: another layout; RIM_E_RANGE: a count, index, bit position or code
 * out of range, a value without a signal or with two under the same selector; RIM_E_DATA: a number
 * not finite, scale 0, or low above high. O(signals^2 + frames^2), both of which have a MAX. */
rim_status rim_can_table_open(rim_can_table *table, const void *data, size_t bytes);

/* Returns identifier i of the frames that the table reads; 0 for NULL and where there is none. */
uint32_t rim_can_table_id(const rim_can_table *table, uint16_t index);

/* Takes a frame that came at t_s. Where *complete becomes true, gather->value[values] is a row and
 * *row_s its time. A row is complete when the trigger comes or, without a trigger, when every value
 * has come since the last row. RIM_E_ARGUMENT: NULL; RIM_E_MAGIC: the table does not read this
 * identifier; RIM_E_SIZE: another length, or FD where classic is expected; RIM_E_DATA: a value is
 * not finite or outside low..high (it is not taken, the others of the frame are); RIM_E_TRUNCATED:
 * the trigger came, but a value has never come or not for age_s, so that there is no row.
 * O(frames + 64 * signals of the frame + values). */
rim_status rim_can_gather_frame(rim_can_gather *gather, const rim_can_table *table,
                                const rim_can_frame *frame, double t_s, double age_s,
                                bool *complete, double *row_s);

#ifdef __cplusplus
}
#endif
#endif
