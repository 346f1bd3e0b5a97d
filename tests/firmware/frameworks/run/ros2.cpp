// SPDX-License-Identifier: MIT
// ros2 IMAGE: the node's callbacks, as an executor would call them: twenty rows, then its timer.
#include "rows.h"

#include <chrono>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#define main node_main
#define private public // the node's monitor
#include "rim_node.cpp"
#undef private
#undef main

static std::string path;
static double here_s;
static unsigned newest_level = 99;
static std::function<void()> each_second;
static std::function<void(std::shared_ptr<const Float64MultiArray>)> take_row;

namespace rclcpp {
double Duration::seconds() const { return here_s; }
Time::Time() {}
Duration Time::operator-(const Time &) const { return {}; }
Time::operator Stamp() const { return {}; }
QoS::QoS(size_t) {}
Node::Node(const std::string &) {}
Node::~Node() {}
Time Node::now() const { return {}; }
Logger Node::get_logger() const { return {}; }
std::shared_ptr<Clock> Node::get_clock() { return std::make_shared<Clock>(); }
const char *Node::get_name() const { return "rim"; }
Logger get_logger(const std::string &) { return {}; }
void init(int, char const *const *) {}
bool shutdown() { return true; }
void say(const Logger &, const char *, ...) {}

template <typename T> T Node::declare_parameter(const std::string &, const T &) { return path; }
template <typename M>
typename Publisher<M>::SharedPtr Node::create_publisher(const std::string &, const QoS &) {
  return std::make_shared<Publisher<M>>();
}
template <typename M> void Publisher<M>::publish(const M &message) {
  newest_level = message.status.at(0).level;
}
template <typename M>
typename Subscription<M>::SharedPtr
Node::create_subscription(const std::string &, const QoS &,
                          std::function<void(std::shared_ptr<const M>)> callback) {
  take_row = callback;
  return nullptr;
}
template <typename D> TimerBase::SharedPtr Node::create_wall_timer(D, std::function<void()> call) {
  each_second = call;
  return nullptr;
}
template <typename S>
typename Service<S>::SharedPtr
Node::create_service(const std::string &,
                     std::function<void(std::shared_ptr<typename S::Request>,
                                        std::shared_ptr<typename S::Response>)>) {
  return nullptr;
}

void spin(std::shared_ptr<Node> node) {
  run_limit(static_cast<RimNode &>(*node).watch_.monitor);
  const int second = static_cast<int>(1.0 / RUN_STEP_S);
  for (int i = 0; i < RUN_GOOD + RUN_REFUSED; i++) {
    auto row = std::make_shared<Float64MultiArray>();
    row->data.resize(RUN_VALUES + 1);
    here_s = RUN_STEP_S * i;
    row->data[0] = run_row(i, row->data.data() + 1);
    take_row(row);
    if (i % second == second - 1)
      each_second();
    if (i == RUN_GOOD - 1 || i == RUN_GOOD + RUN_REFUSED - 1)
      printf("level %u\n", newest_level);
  }
}
} // namespace rclcpp

int main(int argc, char **argv) {
  path = argc > 1 ? argv[1] : "";
  return node_main(argc, argv);
}
