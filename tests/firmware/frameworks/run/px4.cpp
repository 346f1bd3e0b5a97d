// SPDX-License-Identifier: MIT
// px4 IMAGE: the module's work item, run for each new sample.
#include "rows.h"

#include <cstdarg>
#include <cstdint>
#include <cstring>

#define private public // Run(), which the work queue calls
#include "RimWatch.hpp"
#undef private
#include <px4_platform_common/getopt.h>
#include <systemlib/mavlink_log.h>

static int taken;

hrt_abstime hrt_absolute_time() { return static_cast<uint64_t>(1e6 * RUN_STEP_S * taken) + 1; }
hrt_abstime hrt_elapsed_time(const hrt_abstime *then) { return hrt_absolute_time() - *then; }

const orb_metadata __orb_vehicle_angular_velocity{"vehicle_angular_velocity"};
const orb_metadata __orb_vehicle_acceleration{""}, __orb_vehicle_thrust_setpoint{""},
    __orb_vehicle_torque_setpoint{""}, __orb_rim_alarm{""};
static bool has_sample;

namespace uORB {
Subscription::Subscription(const orb_metadata *, uint8_t) {}
SubscriptionCallbackWorkItem::SubscriptionCallbackWorkItem(px4::ScheduledWorkItem *,
                                                           const orb_metadata *meta, uint8_t)
    : Subscription(meta) {}
bool SubscriptionCallbackWorkItem::registerCallback() { return true; }
void SubscriptionCallbackWorkItem::unregisterCallback() {}

/* Setpoints and acceleration never change: what this is about is the time of the samples. */
bool Subscription::update(void *to) {
  if (!has_sample)
    return false;
  has_sample = false; // the first that asks is angular velocity, which every run begins with
  double value[RUN_VALUES];
  vehicle_angular_velocity_s sample{};
  const double t_s = run_row(taken, value);
  sample.timestamp_sample = static_cast<uint64_t>(1e6 * t_s + 0.5);
  for (int axis = 0; axis < 3; axis++)
    sample.xyz[axis] = static_cast<float>(value[axis]);
  std::memcpy(to, &sample, sizeof sample);
  return true;
}
template <typename T> Publication<T>::Publication(const orb_metadata *) {}
template <typename T> bool Publication<T>::publish(const T &) { return true; }
template class Publication<rim_alarm_s>;
} // namespace uORB

namespace px4 {
ScheduledWorkItem::ScheduledWorkItem(const char *, const wq_config_t &) {}
ScheduledWorkItem::~ScheduledWorkItem() {}
void ScheduledWorkItem::ScheduleOnInterval(uint32_t, uint32_t) {}
void ScheduledWorkItem::ScheduleClear() {}
template <typename T> T atomic<T>::load() const { return _value; }
template <typename T> void atomic<T>::store(T value) { _value = value; }
} // namespace px4

template <class T> px4::atomic<T *> ModuleBase<T>::_object;
template <class T> int ModuleBase<T>::_task_id;
template <class T> bool ModuleBase<T>::should_exit() const { return false; }
template <class T> void ModuleBase<T>::exit_and_cleanup() {}
template <class T> int ModuleBase<T>::print_status() { return 0; }
template <class T> int ModuleBase<T>::main(int, char *[]) { return 0; }
template class ModuleBase<RimWatch>;
template class px4::atomic<RimWatch *>;

void px4_log(const char *format, ...) {
  va_list more;
  va_start(more, format);
  vfprintf(stderr, format, more);
  va_end(more);
  fputc('\n', stderr);
}
void mavlink_vasprintf(orb_advert_t *, const char *, ...) {}
int px4_getopt(int, char *[], const char *, int *, const char **) { return EOF; }
void PRINT_MODULE_DESCRIPTION(const char *) {}
void PRINT_MODULE_USAGE_NAME(const char *, const char *) {}
void PRINT_MODULE_USAGE_COMMAND_DESCR(const char *, const char *) {}
void PRINT_MODULE_USAGE_PARAM_STRING(char, const char *, const char *, const char *, bool) {}

int main(int argc, char **argv) {
  static RimWatch watch;
  if (argc < 2 || !watch.init(argv[1]))
    return 3;
  run_limit(watch._watch.monitor);
  watch._period_us = static_cast<uint32_t>(1e6 * RUN_STEP_S); // an image of such rows has none
  watch._newest_acceleration.xyz[2] = 1.0f; // the standard deviation of the row's prediction
  for (taken = 0; taken < RUN_GOOD + RUN_REFUSED; taken++) {
    has_sample = true;
    watch.Run();
    if (taken == RUN_GOOD - 1)
      printf("level %u\n", watch._watch.level);
  }
  printf("level %u\n", watch._watch.level);
}
