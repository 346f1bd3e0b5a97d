// SPDX-License-Identifier: MIT
// PX4's log macros.
#pragma once
[[gnu::format(printf, 1, 2)]] void px4_log(const char *format, ...);
#define PX4_INFO(...) px4_log(__VA_ARGS__)
#define PX4_WARN(...) px4_log(__VA_ARGS__)
#define PX4_ERR(...) px4_log(__VA_ARGS__)
