/* SPDX-License-Identifier: MIT */
/* RimWatch.hpp - the monitor as a PX4 module: a row for each new angular velocity, thinned to the
 * image's rate; the newest values of the other topics go with it. The image's columns are, in this
 * order:
 *
 *   u.thrust_x u.thrust_y u.thrust_z u.torque_x u.torque_y u.torque_z
 *   s.rate_x_radps s.rate_y_radps s.rate_z_radps
 *   s.accel_x_mps2 s.accel_y_mps2 s.accel_z_mps2 */
#pragma once

#include <px4_platform_common/module.h>
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>

#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/SubscriptionCallback.hpp>
#include <uORB/topics/rim_alarm.h>
#include <uORB/topics/vehicle_acceleration.h>
#include <uORB/topics/vehicle_angular_velocity.h>
#include <uORB/topics/vehicle_thrust_setpoint.h>
#include <uORB/topics/vehicle_torque_setpoint.h>

#include "rim_watch.h"

class RimWatch : public ModuleBase<RimWatch>, public px4::ScheduledWorkItem {
public:
  RimWatch();
  ~RimWatch() override;

  static int task_spawn(int argc, char *argv[]);
  static int custom_command(int argc, char *argv[]);
  static int print_usage(const char *reason = nullptr);
  int print_status() override;

  /* Reads the flight image, or says why not. */
  bool init(const char *path);

private:
  static constexpr unsigned kValues = 12;
  static constexpr unsigned kMonitorBytes = 65536; /* `rim show` prints what an image needs */
  static constexpr unsigned kImageBytes = 32768;

  void Run() override;
  void take_sample(const vehicle_angular_velocity_s &rate);
  void fill(double *value, const vehicle_angular_velocity_s &rate);
  void publish(const rim_alarm &record);
  static void take(void *self, const rim_alarm *record);

  uORB::SubscriptionCallbackWorkItem _rate{this, ORB_ID(vehicle_angular_velocity)};
  uORB::Subscription _acceleration{ORB_ID(vehicle_acceleration)};
  uORB::Subscription _thrust{ORB_ID(vehicle_thrust_setpoint)};
  uORB::Subscription _torque{ORB_ID(vehicle_torque_setpoint)};
  uORB::Publication<rim_alarm_s> _alarm{ORB_ID(rim_alarm)};

  vehicle_acceleration_s _newest_acceleration{};
  vehicle_thrust_setpoint_s _newest_thrust{};
  vehicle_torque_setpoint_s _newest_torque{};
  orb_advert_t _mavlink_log{nullptr};
  rim_watch _watch{};
  hrt_abstime _next_row{0};
  uint32_t _period_us{0};

  alignas(8) unsigned char _image[kImageBytes];
  alignas(8) unsigned char _monitor[kMonitorBytes];
};
