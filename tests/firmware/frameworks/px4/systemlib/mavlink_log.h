// SPDX-License-Identifier: MIT
// PX4's messages to the ground.
#pragma once
#include <uORB/Subscription.hpp>
[[gnu::format(printf, 2, 3)]] void mavlink_vasprintf(orb_advert_t *pub, const char *format, ...);
#define mavlink_log_info(pub, ...) mavlink_vasprintf(pub, __VA_ARGS__)
#define mavlink_log_critical(pub, ...) mavlink_vasprintf(pub, __VA_ARGS__)
