// SPDX-License-Identifier: MIT
// rim_node: the monitor as a ROS 2 node.
//
//   parameter image (string)        the flight image (rim train --out)
//   subscribes ~/row                std_msgs/Float64MultiArray: time in seconds, then the values in
//                                   the order that `rim show` prints
//   publishes  /diagnostics         diagnostic_msgs/DiagnosticArray: every record, and each second
//   services   ~/acknowledge ~/clear  std_srvs/Trigger, of the alarm that stands
#include <chrono>
#include <cstdint>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <diagnostic_msgs/msg/diagnostic_status.hpp>
#include <diagnostic_msgs/msg/key_value.hpp>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>
#include <std_srvs/srv/trigger.hpp>

#include "rim_watch.h"

namespace {

using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;
using diagnostic_msgs::msg::KeyValue;
using std_msgs::msg::Float64MultiArray;
using std_srvs::srv::Trigger;

// Memory aligned to 8, as the image and the monitor want it.
using Memory = std::vector<std::uint64_t>;

Memory read_file(const std::string &path, std::size_t &bytes) {
  std::ifstream file(path, std::ios::binary);
  if (!file)
    throw std::runtime_error(path + ": cannot be read");
  const std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  bytes = text.size();
  Memory memory((bytes + 7) / 8);
  std::copy(text.begin(), text.end(), reinterpret_cast<char *>(memory.data()));
  return memory;
}

class RimNode : public rclcpp::Node {
public:
  RimNode() : Node("rim") {
    const std::string path = declare_parameter<std::string>("image", "");
    open(path);
    diagnostics_ = create_publisher<DiagnosticArray>("/diagnostics", rclcpp::QoS(10));
    rows_ = create_subscription<Float64MultiArray>(
        "~/row", rclcpp::QoS(100),
        [this](const Float64MultiArray::ConstSharedPtr row) { take_row(*row); });
    timer_ = create_wall_timer(std::chrono::seconds(1), [this]() { each_second(); });
    acknowledge_ = service("~/acknowledge", RIM_COMMAND_ACKNOWLEDGE);
    clear_ = service("~/clear", RIM_COMMAND_CLEAR);
  }

private:
  using Asked = Trigger::Request::SharedPtr;
  using Answer = Trigger::Response::SharedPtr;

  rclcpp::Service<Trigger>::SharedPtr service(const char *name, rim_command_code code) {
    return create_service<Trigger>(
        name, [this, code](const Asked, Answer answer) { command(code, *answer); });
  }

  void open(const std::string &path) {
    std::size_t bytes = 0, needed = 0;
    image_ = read_file(path, bytes);
    rim_status status = rim_monitor_size(image_.data(), bytes, &needed);
    monitor_.resize((needed + 7) / 8);
    if (status == RIM_OK)
      status = rim_watch_open(&watch_, monitor_.data(), 8 * monitor_.size(), image_.data(), bytes,
                              &RimNode::take_record, this);
    if (status != RIM_OK)
      throw std::runtime_error(path + ": " + rim_status_text(status));
    RCLCPP_INFO(get_logger(), "%s: model %08x, rows of %u values", path.c_str(),
                watch_.image.model_id, watch_.values);
  }

  void take_row(const Float64MultiArray &row) {
    if (row.data.empty() || rim_watch_row(&watch_, row.data[0], row.data.data() + 1,
                                          row.data.size() - 1, nullptr) != RIM_OK)
      RCLCPP_WARN_THROTTLE(get_logger(), *get_clock(), 5000,
                           "a row of %zu numbers is refused; wanted are the time and %u values",
                           row.data.size(), watch_.values);
    rim_watch_tick(&watch_, (now() - started_).seconds());
  }

  void each_second() {
    rim_watch_tick(&watch_, (now() - started_).seconds());
    publish();
  }

  static void take_record(void *self, const rim_alarm *record) {
    static_cast<RimNode *>(self)->note(*record);
  }

  void note(const rim_alarm &record) {
    char words[160];
    (void)rim_watch_words(&watch_, &record, words, sizeof words);
    words_ = words;
    if (record.level == RIM_LEVEL_ERROR)
      RCLCPP_ERROR(get_logger(), "%s", words);
    else
      RCLCPP_INFO(get_logger(), "%s", words);
    if (diagnostics_ != nullptr)
      publish();
  }

  static KeyValue key_value(const std::string &key, const std::string &value) {
    KeyValue pair;
    pair.key = key;
    pair.value = value;
    return pair;
  }

  void publish() {
    DiagnosticStatus status;
    const std::uint8_t level = watch_.level;
    status.level = level == RIM_LEVEL_OK      ? DiagnosticStatus::OK
                   : level == RIM_LEVEL_WARN  ? DiagnosticStatus::WARN
                   : level == RIM_LEVEL_STALE ? DiagnosticStatus::STALE
                                              : DiagnosticStatus::ERROR;
    status.name = get_name();
    status.hardware_id = std::to_string(watch_.image.model_id);
    status.message = words_;
    status.values = {key_value("rows", std::to_string(watch_.rows)),
                     key_value("refused", std::to_string(watch_.refused)),
                     key_value("records", std::to_string(watch_.records)),
                     key_value("reason", std::to_string(watch_.reason)),
                     key_value("digest", std::to_string(watch_.digest))};
    DiagnosticArray message;
    message.header.stamp = now();
    message.status.push_back(status);
    diagnostics_->publish(message);
  }

  void command(rim_command_code code, Trigger::Response &response) {
    const rim_alarm_status alarms = rim_monitor_alarms(watch_.monitor);
    const rim_command command = {alarms.newest.seq, watch_.image.model_id,
                                 static_cast<std::uint8_t>(code)};
    const rim_status status = alarms.stands ? rim_watch_command(&watch_, &command) : RIM_E_DATA;
    response.success = status == RIM_OK;
    response.message = status == RIM_OK ? "done"
                       : alarms.stands  ? rim_status_text(status)
                                        : "no alarm stands";
  }

  Memory image_, monitor_;
  rim_watch watch_{};
  std::string words_ = "no record yet";
  rclcpp::Time started_ = now();
  rclcpp::Publisher<DiagnosticArray>::SharedPtr diagnostics_;
  rclcpp::Subscription<Float64MultiArray>::SharedPtr rows_;
  rclcpp::TimerBase::SharedPtr timer_;
  rclcpp::Service<Trigger>::SharedPtr acknowledge_, clear_;
};

} // namespace

int main(int argc, char **argv) {
  rclcpp::init(argc, argv);
  int status = 0;
  try {
    rclcpp::spin(std::make_shared<RimNode>());
  } catch (const std::exception &problem) {
    RCLCPP_FATAL(rclcpp::get_logger("rim"), "%s", problem.what());
    status = 3;
  }
  rclcpp::shutdown();
  return status;
}
