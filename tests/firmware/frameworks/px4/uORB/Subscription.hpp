// SPDX-License-Identifier: MIT
// uORB.
#pragma once
#include <cstdint>
struct orb_metadata {
  const char *o_name;
};
typedef void *orb_advert_t;
#define ORB_ID(name) (&__orb_##name)
namespace uORB {
class Subscription {
public:
  explicit Subscription(const orb_metadata *meta, uint8_t instance = 0);
  bool update(void *dst);
};
} // namespace uORB
