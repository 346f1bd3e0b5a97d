/* SPDX-License-Identifier: MIT */
#include "rim/image.h"

#include <stdbool.h>

#include "base/crc.h"

/* Words of the header, by index of u32. */
enum {
  WORD_TAG = 2,
  WORD_TOTAL = 4,
  WORD_MODEL = 5,
  WORD_SECTIONS = 6,
  WORD_BODY_CRC = 7,
  WORD_HEADER_CRC = 8,
  WORD_RESERVED = 9,
  WORDS = 16
};

static uint32_t header_crc(const uint8_t *data) {
  static const uint8_t zero[4] = {0};
  const uint32_t crc = rimi_crc32(0, data, 4 * WORD_HEADER_CRC);
  return rimi_crc32(rimi_crc32(crc, zero, 4), data + 4 * WORD_RESERVED,
                    4 * (WORDS - WORD_RESERVED));
}

static rim_status check_header(const uint8_t *data) {
  if (memcmp(data, RIM_IMAGE_MAGIC, 8) != 0) {
    return RIM_E_MAGIC;
  }
  const uint32_t tag = rimi_le_u32(data, WORD_TAG);
  if (tag != RIM_IMAGE_ENDIAN_TAG) {
    return tag == UINT32_C(0x04030201) ? RIM_E_ENDIAN : RIM_E_MAGIC;
  }
  if (rimi_le_u16(data, 6) != RIM_IMAGE_MAJOR) {
    return RIM_E_VERSION;
  }
  return rimi_le_u32(data, WORD_HEADER_CRC) == header_crc(data) ? RIM_OK : RIM_E_CRC;
}

static const uint8_t *entry(const uint8_t *data, uint32_t index) {
  return data + RIM_IMAGE_HEADER_BYTES + RIM_IMAGE_ENTRY_BYTES * index;
}

/* Whether sections a and b share bytes or an id. Offsets and sizes were found inside the image. */
static rim_status check_pair(const uint8_t *a, const uint8_t *b) {
  if (rimi_le_u32(a, 0) == rimi_le_u32(b, 0)) {
    return RIM_E_DATA;
  }
  const uint32_t a_begin = rimi_le_u32(a, 1), a_end = a_begin + rimi_le_u32(a, 2);
  const uint32_t b_begin = rimi_le_u32(b, 1), b_end = b_begin + rimi_le_u32(b, 2);
  return a_begin < b_end && b_begin < a_end ? RIM_E_RANGE : RIM_OK;
}

static rim_status check_table(const uint8_t *data, uint32_t sections, uint32_t total) {
  const uint32_t first = RIM_IMAGE_HEADER_BYTES + RIM_IMAGE_ENTRY_BYTES * sections;
  for (uint32_t i = 0; i < sections; ++i) {
    const uint32_t offset = rimi_le_u32(entry(data, i), 1);
    if (offset % RIM_IMAGE_ALIGN != 0) {
      return RIM_E_ALIGN;
    }
    if (offset < first || offset > total || rimi_le_u32(entry(data, i), 2) > total - offset) {
      return RIM_E_RANGE;
    }
    for (uint32_t j = 0; j < i; ++j) {
      const rim_status status = check_pair(entry(data, j), entry(data, i));
      if (status != RIM_OK) {
        return status;
      }
    }
  }
  return RIM_OK;
}

static rim_status check_body(const uint8_t *data, size_t bytes) {
  const uint32_t total = rimi_le_u32(data, WORD_TOTAL);
  const uint32_t sections = rimi_le_u32(data, WORD_SECTIONS);
  if (sections > RIM_IMAGE_MAX_SECTIONS) {
    return RIM_E_RANGE;
  }
  if (total > bytes || total < RIM_IMAGE_HEADER_BYTES + RIM_IMAGE_ENTRY_BYTES * sections) {
    return RIM_E_TRUNCATED;
  }
  const uint32_t crc = rimi_crc32(0, data + RIM_IMAGE_HEADER_BYTES, total - RIM_IMAGE_HEADER_BYTES);
  if (crc != rimi_le_u32(data, WORD_BODY_CRC)) {
    return RIM_E_CRC;
  }
  for (uint32_t i = WORD_RESERVED; i < WORDS; ++i) {
    if (rimi_le_u32(data, i) != 0) {
      return RIM_E_DATA;
    }
  }
  return check_table(data, sections, total);
}

rim_status rim_image_open(rim_image *view, const void *blob, size_t bytes) {
  if (view == NULL) {
    return RIM_E_ARGUMENT;
  }
  *view = (rim_image){0};
  if (blob == NULL) {
    return RIM_E_ARGUMENT;
  }
  if ((uintptr_t)blob % RIM_IMAGE_ALIGN != 0) {
    return RIM_E_ALIGN;
  }
  if (bytes < RIM_IMAGE_HEADER_BYTES) {
    return RIM_E_TRUNCATED;
  }
  const uint8_t *data = blob;
  rim_status status = check_header(data);
  if (status == RIM_OK) {
    status = check_body(data, bytes);
  }
  if (status != RIM_OK) {
    return status;
  }
  view->data = data;
  view->bytes = rimi_le_u32(data, WORD_TOTAL);
  view->model_id = rimi_le_u32(data, WORD_MODEL);
  view->sections = rimi_le_u32(data, WORD_SECTIONS);
  view->major = rimi_le_u16(data, 6);
  view->minor = rimi_le_u16(data, 7);
  return RIM_OK;
}

/* The table entry of a section, NULL where there is none. */
static const uint8_t *find(const rim_image *view, uint32_t id) {
  for (uint32_t i = 0; i < view->sections; ++i) {
    const uint8_t *e = entry(view->data, i);
    if (rimi_le_u32(e, 0) == id) {
      return e;
    }
  }
  return NULL;
}

rim_status rim_image_section(const rim_image *view, uint32_t id, const uint8_t **data,
                             size_t *size) {
  const bool opened = view != NULL && view->data != NULL;
  const uint8_t *e = opened ? find(view, id) : NULL;
  if (data != NULL) {
    *data = e != NULL ? view->data + rimi_le_u32(e, 1) : NULL;
  }
  if (size != NULL) {
    *size = e != NULL ? rimi_le_u32(e, 2) : 0;
  }
  return !opened ? RIM_E_ARGUMENT : e == NULL ? RIM_E_RANGE : RIM_OK;
}

uint32_t rimi_image_count(const rim_image *view, uint32_t id) {
  const uint8_t *e = view != NULL && view->data != NULL ? find(view, id) : NULL;
  return e != NULL ? rimi_le_u32(e, 3) : 0;
}
