// SPDX-License-Identifier: MIT
// PX4's work queue.
#pragma once
#include <cstdint>
namespace px4 {
struct wq_config_t {
  const char *name;
};
namespace wq_configurations {
static constexpr wq_config_t lp_default{"wq:lp_default"};
}
class ScheduledWorkItem {
public:
  bool ScheduleDelayed(uint32_t delay_us);
  void ScheduleOnInterval(uint32_t interval_us, uint32_t delay_us = 0);
  void ScheduleClear();

protected:
  ScheduledWorkItem(const char *name, const wq_config_t &config);
  virtual ~ScheduledWorkItem();
  virtual void Run() = 0;
};
} // namespace px4
