/* SPDX-License-Identifier: MIT */
#include "RimWatch.hpp"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include <drivers/drv_hrt.h>
#include <px4_platform_common/getopt.h>
#include <px4_platform_common/log.h>
#include <systemlib/mavlink_log.h>

namespace {
constexpr const char *kImage = "/fs/microsd/rim/model.rim";
constexpr uint32_t kIdle_us = 100000; /* without a row: how often it looks whether it is STALE */
} // namespace

RimWatch::RimWatch() : ScheduledWorkItem(MODULE_NAME, px4::wq_configurations::lp_default) {}

RimWatch::~RimWatch() {
  _rate.unregisterCallback();
  ScheduleClear();
}

bool RimWatch::init(const char *path) {
  const int file = ::open(path, O_RDONLY);
  if (file < 0) {
    PX4_ERR("%s: %s", path, strerror(errno));
    return false;
  }
  const ssize_t bytes = ::read(file, _image, sizeof(_image));
  ::close(file);
  const rim_status status = bytes < 0
                                ? RIM_E_TRUNCATED
                                : rim_watch_open(&_watch, _monitor, sizeof(_monitor), _image,
                                                 static_cast<size_t>(bytes), &RimWatch::take, this);
  if (status != RIM_OK || _watch.values != kValues) {
    PX4_ERR("%s: %s", path, status != RIM_OK ? rim_status_text(status) : "rows of other columns");
    return false;
  }
  _period_us = rim_monitor_config(_watch.monitor, RIM_CONFIG_PERIOD_US);
  if (!_rate.registerCallback()) {
    PX4_ERR("no callback");
    return false;
  }
  ScheduleOnInterval(kIdle_us);
  return true;
}

void RimWatch::fill(double *value, const vehicle_angular_velocity_s &rate) {
  _acceleration.update(&_newest_acceleration);
  _thrust.update(&_newest_thrust);
  _torque.update(&_newest_torque);
  for (unsigned axis = 0; axis < 3; axis++) {
    value[axis] = static_cast<double>(_newest_thrust.xyz[axis]);
    value[3 + axis] = static_cast<double>(_newest_torque.xyz[axis]);
    value[6 + axis] = static_cast<double>(rate.xyz[axis]);
    value[9 + axis] = static_cast<double>(_newest_acceleration.xyz[axis]);
  }
}

void RimWatch::Run() {
  if (should_exit()) {
    _rate.unregisterCallback();
    ScheduleClear();
    exit_and_cleanup();
    return;
  }
  vehicle_angular_velocity_s rate;
  if (_rate.update(&rate))
    take_sample(rate);
  rim_watch_tick(&_watch, 1e-6 * static_cast<double>(hrt_absolute_time()));
}

void RimWatch::take_sample(const vehicle_angular_velocity_s &rate) {
  /* The sensor is faster than the image: the next row is due a period after the last. */
  if (rate.timestamp_sample + _period_us / 20 < _next_row)
    return;
  const bool late = rate.timestamp_sample > _next_row + _period_us;
  _next_row = (late ? rate.timestamp_sample : _next_row) + _period_us;
  double value[kValues];
  fill(value, rate);
  (void)rim_watch_row(&_watch, 1e-6 * static_cast<double>(rate.timestamp_sample), value, kValues,
                      nullptr);
}

void RimWatch::take(void *self, const rim_alarm *record) {
  static_cast<RimWatch *>(self)->publish(*record);
}

void RimWatch::publish(const rim_alarm &record) {
  rim_alarm_s message{};
  message.timestamp = hrt_absolute_time();
  message.sequence = record.seq;
  message.model_id = record.model_id;
  message.state = record.state;
  message.level = record.level;
  message.kind = record.kind;
  message.outcome = record.channel[0];
  message.shift = static_cast<float>(record.shift[0]);
  message.shift_sd = static_cast<float>(record.shift_sd[0]);
  message.since = static_cast<float>(record.t_s - record.since_s);
  message.since_sd = static_cast<float>(record.since_sd_s);
  _alarm.publish(message);
  char words[100];
  (void)rim_watch_words(&_watch, &record, words, sizeof(words));
  if (record.level == RIM_LEVEL_ERROR)
    mavlink_log_critical(&_mavlink_log, "rim: %s", words);
  else
    mavlink_log_info(&_mavlink_log, "rim: %s", words);
}

int RimWatch::print_status() {
  PX4_INFO("rows %u, refused %u, records %u, level %u, digest %08x%08x",
           static_cast<unsigned>(_watch.rows), static_cast<unsigned>(_watch.refused),
           static_cast<unsigned>(_watch.records), static_cast<unsigned>(_watch.level),
           static_cast<unsigned>(_watch.digest >> 32), static_cast<unsigned>(_watch.digest));
  return 0;
}

int RimWatch::task_spawn(int argc, char *argv[]) {
  RimWatch *instance = new RimWatch();
  if (instance == nullptr) {
    PX4_ERR("alloc failed");
    return PX4_ERROR;
  }
  _object.store(instance);
  _task_id = task_id_is_work_queue;
  int index = 1, option;
  const char *argument = nullptr, *path = kImage;
  while ((option = px4_getopt(argc, argv, "f:", &index, &argument)) != EOF)
    path = option == 'f' ? argument : path;
  if (instance->init(path))
    return PX4_OK;
  delete instance;
  _object.store(nullptr);
  _task_id = -1;
  return PX4_ERROR;
}

int RimWatch::custom_command(int argc, char *argv[]) {
  (void)argc;
  (void)argv;
  return print_usage("unknown command");
}

int RimWatch::print_usage(const char *reason) {
  if (reason != nullptr)
    PX4_WARN("%s\n", reason);
  PRINT_MODULE_DESCRIPTION("Watches the vehicle's model of itself, and says where it is wrong.");
  PRINT_MODULE_USAGE_NAME("rim_watch", "system");
  PRINT_MODULE_USAGE_COMMAND("start");
  PRINT_MODULE_USAGE_PARAM_STRING('f', kImage, "<file>", "flight image", true);
  PRINT_MODULE_USAGE_DEFAULT_COMMANDS();
  return 0;
}

extern "C" __EXPORT int rim_watch_main(int argc, char *argv[]) {
  return RimWatch::main(argc, argv);
}
