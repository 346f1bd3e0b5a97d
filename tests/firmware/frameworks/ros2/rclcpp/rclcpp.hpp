// SPDX-License-Identifier: MIT
// What rim_node.cpp uses of rclcpp (Humble to Jazzy), declarations alone.
#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace rclcpp {
struct Duration {
  double seconds() const;
};
struct Stamp {
  int32_t sec;
  uint32_t nanosec;
};
class Time {
public:
  Time();
  Duration operator-(const Time &other) const;
  operator Stamp() const;
};
class QoS {
public:
  explicit QoS(size_t history_depth);
};
class Logger {};
class Clock {};
Logger get_logger(const std::string &name);
[[gnu::format(printf, 2, 3)]] void say(const Logger &logger, const char *format, ...);
#define RCLCPP_INFO(logger, ...) rclcpp::say(logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) rclcpp::say(logger, __VA_ARGS__)
#define RCLCPP_FATAL(logger, ...) rclcpp::say(logger, __VA_ARGS__)
#define RCLCPP_WARN_THROTTLE(logger, clock, duration, ...)                                         \
  (static_cast<void>(clock), static_cast<void>(duration), rclcpp::say(logger, __VA_ARGS__))
template <typename M> class Publisher {
public:
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const M &message);
};
template <typename M> class Subscription {
public:
  using SharedPtr = std::shared_ptr<Subscription>;
};
template <typename S> class Service {
public:
  using SharedPtr = std::shared_ptr<Service>;
};
class TimerBase {
public:
  using SharedPtr = std::shared_ptr<TimerBase>;
};
class Node {
public:
  explicit Node(const std::string &name);
  virtual ~Node();
  template <typename T> T declare_parameter(const std::string &name, const T &value);
  template <typename M>
  typename Publisher<M>::SharedPtr create_publisher(const std::string &topic, const QoS &qos);
  template <typename M>
  typename Subscription<M>::SharedPtr
  create_subscription(const std::string &topic, const QoS &qos,
                      std::function<void(std::shared_ptr<const M>)> callback);
  template <typename D>
  TimerBase::SharedPtr create_wall_timer(D period, std::function<void()> callback);
  template <typename S>
  typename Service<S>::SharedPtr
  create_service(const std::string &name, std::function<void(std::shared_ptr<typename S::Request>,
                                                             std::shared_ptr<typename S::Response>)>
                                              callback);
  Time now() const;
  Logger get_logger() const;
  std::shared_ptr<Clock> get_clock();
  const char *get_name() const;
};
void init(int argc, char const *const *argv);
void spin(std::shared_ptr<Node> node);
bool shutdown();
} // namespace rclcpp
