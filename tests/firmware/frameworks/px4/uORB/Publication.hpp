// SPDX-License-Identifier: MIT
// uORB.
#pragma once
#include <uORB/Subscription.hpp>
namespace uORB {
template <typename T> class Publication {
public:
  explicit Publication(const orb_metadata *meta);
  bool publish(const T &data);
};
} // namespace uORB
