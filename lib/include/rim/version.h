/* SPDX-License-Identifier: MIT */
/* rim/version.h - the version of the library, by semantic versioning (https://semver.org).
 *
 * A new major version may change these headers; a new minor version only adds to them. */
#ifndef RIM_VERSION_H
#define RIM_VERSION_H

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_VERSION_MAJOR 0
#define RIM_VERSION_MINOR 1
#define RIM_VERSION_PATCH 0

/* Version of these headers as one number that can be compared. */
#define RIM_VERSION_NUMBER                                                                         \
  (RIM_VERSION_MAJOR * 1000000 + RIM_VERSION_MINOR * 1000 + RIM_VERSION_PATCH)

/* Returns the version of the library that is linked, as RIM_VERSION_NUMBER. A program that was
 * compiled against other headers can find that out. O(1). */
int rim_version(void);

#ifdef __cplusplus
}
#endif
#endif
