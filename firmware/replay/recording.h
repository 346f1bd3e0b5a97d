/* SPDX-License-Identifier: MIT */
/* recording.h - a recorded flight in constant memory: the image and the rows it was offered.
 *
 * Layout, every number little-endian, begin aligned to 8:
 *   0   8 bytes  "RIMREC\r\n"
 *   8   u32      bytes of the flight image
 *   12  u32      rows
 *   16  u32      doubles a row: time in seconds, the features in image order, and with an image for
 *                  external predictions the outcomes, their means and their standard deviations
 *   20  u32      CRC-32 of everything after the header
 *   24  8 bytes  0
 *   32  the flight image (rim/image.h), zeroes up to a multiple of 8
 *   ... rows x doubles, IEEE-754 binary64 */
#ifndef RECORDING_H
#define RECORDING_H

#define RECORDING_MAGIC "RIMREC\r\n"
#define RECORDING_HEADER_BYTES 32u
#define RECORDING_MAX_DOUBLES 256u

#endif
