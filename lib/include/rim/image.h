/* SPDX-License-Identifier: MIT */
/* rim/image.h - the flight image: models, thresholds and configuration in one checked blob.
 *
 * The image is read in place, from flash or from a file in memory, on a host of either byte order;
 * nothing is copied. It is validated whole before anything in it is used. `rim train` writes it.
 *
 * Layout, every number little-endian:
 *   0   8 bytes  "RIMIMG\r\n"       (a transfer in text mode damages the line end, and shows)
 *   8   u32      0x01020304         tag of the byte order
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

/* A view of an image. All zero has no sections. */
typedef struct rim_image {
  const uint8_t *data; /* not owned: must outlive the view and everything opened in it */
  uint32_t bytes;      /* of the image; the memory may be longer */
  uint32_t model_id;
  uint32_t sections;
  uint16_t major;
  uint16_t minor;
} rim_image;

/* Opens a view of the image at the start of blob[0..bytes); what follows the image is ignored, as
 * in a flash partition. Makes these checks in this order:
 *
 *   status           what is wrong
 *   RIM_E_ARGUMENT   a pointer is NULL
 *   RIM_E_ALIGN      blob is not aligned to 8
 *   RIM_E_TRUNCATED  there are fewer bytes than a header
 *   RIM_E_MAGIC      not an image: the first 8 bytes, or a tag that is neither byte order
 *   RIM_E_ENDIAN     the image was written big-endian
 *   RIM_E_VERSION    another major version
 *   RIM_E_CRC        the header is damaged
 *   RIM_E_TRUNCATED  fewer bytes than the image has, or total below header and table
 *   RIM_E_RANGE      too many sections
 *   RIM_E_CRC        the table, a section or the padding is damaged
 *   RIM_E_DATA       reserved bytes are not 0, or an id stands twice
 *   RIM_E_ALIGN      a section is not at a multiple of 8
 *   RIM_E_RANGE      a section lies outside the image, inside the table, or on another
 *
 * On error the view is all zero. Cost O(bytes + sections^2); stack below 200 bytes. */
rim_status rim_image_open(rim_image *view, const void *blob, size_t bytes);

/* Finds a section: *data, aligned to 8, and *size in bytes; either pointer may be NULL.
 * RIM_E_ARGUMENT: the view is NULL or not open; RIM_E_RANGE: there is no such section. On an
 * error *data is NULL and *size 0. O(sections). */
rim_status rim_image_section(const rim_image *view, uint32_t id, const uint8_t **data,
                             size_t *size);

/* Finds the name of feature `index`, or from the number of features on of an outcome: length bytes
 * at *text, inside the image, without a terminator: "s.speed_mps". Results and errors as
 * rim_image_section; also RIM_E_RANGE: the image has fewer names. O(bytes of the names). */
rim_status rim_image_name(const rim_image *view, uint32_t index, const char **text, size_t *length);

/* Returns the unit that a name of `length` bytes ends in: "m/s" for "s.speed_mps"; "" for none and
 * for NULL. The table is part of the data format (data/README.md). O(length + units). */
const char *rim_unit_of_name(const char *name, size_t length);

/* The sections that the monitor reads, and NAMES for the ground. Types without a prefix are those
 * of private headers in lib/src/image. */
typedef enum rim_section {
  RIM_SECTION_CONFIG = 1,    /* u32[RIM_CONFIG_WORDS]: see rim_config_word */
  RIM_SECTION_LEVEL = 3,     /* nominal.h: a block's outcomes from its other features; optional. An
                                 angle is its cosine there, and its sine after all features */
  RIM_SECTION_SCALES = 5,    /* f32[outcomes], > 0: factors of the caller's standardised residuals;
                                 only without NOISE; absent: 1 */
  RIM_SECTION_THRESHOLD = 6, /* threshold.h */
  RIM_SECTION_FEATURES = 7,  /* f32 low[features], f32 high[features]: the trained range */
  RIM_SECTION_REGION = 8,    /* u16[region features][2]: a feature, and 0xffff or the outcome whose
                                 prediction stands for it */
  RIM_SECTION_OUTCOMES = 9,  /* u16[outcomes]: feature of each outcome; absent where rows bring
                                 their own predictions */
  RIM_SECTION_COMMANDS = 10, /* u8[features]: 1 a command, + 2 an angle in rad, + 4 in degrees */
  RIM_SECTION_NAMES = 11,    /* text: the features' then the outcomes' names, '\n' after each */
  RIM_SECTION_CORRECT = 14,  /* correct.h: corrections of the predictions; optional */
  /* Motion interference: both or neither. */
  RIM_SECTION_INTERFERENCE = 15,        /* interference/detector.h */
  RIM_SECTION_INTERFERENCE_INPUTS = 16, /* u16 feature: forward velocity commanded, m/s; u16
                                           outcome: the one measured, m/s */
  /* Of a trained image: all or none; BEHAVIOUR not where rows bring their own predictions. */
  RIM_SECTION_BASIS = 17,     /* basis.h: inputs of the models, filtered commands */
  RIM_SECTION_BEHAVIOUR = 18, /* basis.h: outcomes from the commands */
  RIM_SECTION_AGREEMENT = 19, /* basis.h: an outcome's residual from the others' residuals */
  RIM_SECTION_NOISE = 20,     /* noise.h: healthy residuals: run effects, autocorrelation, scale */
  RIM_SECTION_CUTS = 21,      /* u8[region features][23]: where a feature is cut into bins */
  RIM_SECTION_QUADRATIC = 22  /* quadratic.h: outcomes from products of readings; optional */
} rim_section;

/* What a residual channel looks at. A channel's index is kind * outcomes + outcome. */
typedef enum rim_channel {
  RIM_CHANNEL_BEHAVIOUR = 0, /* the outcome less its prediction from the commands */
  RIM_CHANNEL_AGREEMENT = 1, /* that, less what the other outcomes' residuals say of it */
  RIM_CHANNEL_SCATTER = 2,   /* logarithm of the mean square second difference */
  RIM_CHANNEL_REPEAT = 3,    /* share of readings equal to the one before, or to 0 */
  RIM_CHANNEL_STEP = 4       /* the outcome less its prediction from the block before, if trained */
} rim_channel;

/* Words of RIM_SECTION_CONFIG. Zero of an optional word takes the default named here. */
typedef enum rim_config_word {
  RIM_CONFIG_FEATURES = 0,
  RIM_CONFIG_OUTCOMES = 1,
  RIM_CONFIG_SMALL = 2, /* 1: the small profile, for small processors: ellipses are fewer and are
                           evaluated on the grid alone; only without NOISE */
  RIM_CONFIG_BLOCK_ROWS = 3,
  RIM_CONFIG_EXTERNAL = 4,  /* 1: every row brings its own prediction */
  RIM_CONFIG_PERIOD_US = 5, /* nominal time between rows; 0: rows have no rate */
  RIM_CONFIG_STALE_MS = 6,  /* STALE after longer than this without a valid row; 0: never */
  RIM_CONFIG_REGION_FEATURES = 7,
  RIM_CONFIG_RING = 8, /* blocks, or rows with predictions, that are kept */
  RIM_CONFIG_BINS = 9, /* of these, BINS to PAIRS and SCANS to MOVES only without NOISE */
  RIM_CONFIG_GRID = 10,
  RIM_CONFIG_PAIRS = 11,
  RIM_CONFIG_PERSISTENCE = 12, /* blocks above the threshold before an alarm; 0: 1 */
  RIM_CONFIG_INHIBIT_MS = 13,  /* least time between records of one alarm; 0: none */
  RIM_CONFIG_SEED = 14,
  RIM_CONFIG_CLEAR = 15,  /* blocks below the warning score before an alarm is cleared; 0: never
                             (`rim train` writes 30) */
  RIM_CONFIG_SCANS = 16,  /* work of one unit of search: intervals rescanned; */
  RIM_CONFIG_EDGES = 17,  /* exact conditional intervals; */
  RIM_CONFIG_MOVES = 18,  /* ellipses proposed; 0 of each: the search's default */
  RIM_CONFIG_BUDGET = 19, /* units of search per row; 0: 1 */
  RIM_CONFIG_WORDS = 20
} rim_config_word;

#ifdef __cplusplus
}
#endif
#endif
