/* SPDX-License-Identifier: MIT */
/* rim/image.h - the flight image: model, thresholds and configuration in one checked blob.
 *
 * Read in place, from flash or a file in memory, on a host of either endianness; nothing is copied.
 * It is validated whole before anything in it is used. Written by
 * host_tools/train/image_writer.hpp.
 *
 * Layout, every number little-endian:
 *   0   8 bytes  "RIMIMG\r\n"       (the line end shows damage by text-mode transfer)
 *   8   u32      0x01020304         endian tag
 *   12  u16      major version      another one is refused
 *   14  u16      minor version      a newer one may have sections that are not known here
 *   16  u32      total bytes        of the image, header included
 *   20  u32      model id           named in alarms
 *   24  u32      sections           0..RIM_IMAGE_MAX_SECTIONS
 *   28  u32      CRC-32             of everything after the header
 *   32  u32      CRC-32             of the header, this field taken as 0
 *   36  28 bytes 0
 *   64  table    sections x {u32 id, u32 offset from byte 0, u32 bytes, u32 count of elements}
 *   ... sections, each at an offset that is a multiple of 8, padding 0 */
#ifndef RIM_IMAGE_H
#define RIM_IMAGE_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/real.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_IMAGE_MAGIC "RIMIMG\r\n" /* 8 bytes without the terminator */
#define RIM_IMAGE_ENDIAN_TAG UINT32_C(0x01020304)
#define RIM_IMAGE_MAJOR 1u
#define RIM_IMAGE_MINOR 0u
#define RIM_IMAGE_HEADER_BYTES 64u
#define RIM_IMAGE_ENTRY_BYTES 16u
#define RIM_IMAGE_MAX_SECTIONS 64u
#define RIM_IMAGE_ALIGN 8u

/* Section id from four letters: RIM_IMAGE_ID('N', 'O', 'M', '1') reads NOM1 in a hex dump. */
#define RIM_IMAGE_ID(a, b, c, d)                                                                   \
  ((uint32_t)(a) | (uint32_t)(b) << 8 | (uint32_t)(c) << 16 | (uint32_t)(d) << 24)

/* A view. All zero has no sections. */
typedef struct rim_image {
  const uint8_t *data; /* not owned: must outlive the view and everything opened in it */
  uint32_t bytes;      /* of the image; the memory may be longer */
  uint32_t model_id;
  uint32_t sections;
  uint16_t major;
  uint16_t minor;
} rim_image;

/* Opens a view of the image at the start of blob[0..bytes); what follows the image is ignored (a
 * flash partition). Checks, in this order, all of: RIM_E_ARGUMENT   a null pointer RIM_E_ALIGN blob
 * not aligned to 8 RIM_E_TRUNCATED  fewer bytes than a header RIM_E_MAGIC      not an image (first
 * 8 bytes, or an endian tag that is neither order) RIM_E_ENDIAN     written big-endian
 *   RIM_E_VERSION    another major version
 *   RIM_E_CRC        header damaged
 *   RIM_E_TRUNCATED  fewer bytes than the image has, or total below header and table
 *   RIM_E_RANGE      too many sections
 *   RIM_E_CRC        table, section or padding damaged
 *   RIM_E_DATA       reserved bytes not 0, or an id twice
 *   RIM_E_ALIGN      a section not at a multiple of 8
 *   RIM_E_RANGE      a section outside the image, inside the table, or overlapping another
 * On error the view is all zero. Cost O(bytes + sections^2); stack below 200 bytes. */
rim_status rim_image_open(rim_image *view, const void *blob, size_t bytes);

/* Finds a section: *data (aligned to 8 as the blob is) and *size in bytes; either may be NULL.
 * RIM_E_ARGUMENT view NULL or not opened; RIM_E_RANGE no such section. On error *data is NULL and
 * *size 0. O(sections). */
rim_status rim_image_section(const rim_image *view, uint32_t id, const uint8_t **data,
                             size_t *size);

/* Returns the number of elements that the table announces for a section; 0 where there is none. */
uint32_t rimi_image_count(const rim_image *view, uint32_t id);

/* Return element `index` of a section seen as an array of little-endian numbers, on any host and at
 * any alignment. No bounds check: the caller knows the section's size. O(1). */
#ifndef __BYTE_ORDER__
#error "the compiler must tell the byte order"
#endif

static inline uint8_t rimi_le_u8(const uint8_t *section, size_t index) { return section[index]; }

static inline uint16_t rimi_le_u16(const uint8_t *section, size_t index) {
  const uint8_t *p = section + 2 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint16_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint16_t)(p[0] | p[1] << 8);
#endif
}

static inline uint32_t rimi_le_u32(const uint8_t *section, size_t index) {
  const uint8_t *p = section + 4 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint32_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
#endif
}

static inline uint64_t rimi_le_u64(const uint8_t *section, size_t index) {
  const uint8_t *p = section + 8 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint64_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint64_t)rimi_le_u32(p, 1) << 32 | rimi_le_u32(p, 0);
#endif
}

static inline float rimi_le_f32(const uint8_t *section, size_t index) {
  const uint32_t bits = rimi_le_u32(section, index);
  float value;
  RIM_COPY(&value, &bits, sizeof value);
  return value;
}

static inline double rimi_le_f64(const uint8_t *section, size_t index) {
  const uint64_t bits = rimi_le_u64(section, index);
  double value;
  RIM_COPY(&value, &bits, sizeof value);
  return value;
}

#ifdef __cplusplus
}
#endif
#endif
