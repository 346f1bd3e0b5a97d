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

#ifdef __cplusplus
}
#endif
#endif
