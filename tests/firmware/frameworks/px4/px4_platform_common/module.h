// SPDX-License-Identifier: MIT
// What RimWatch.cpp uses of PX4-Autopilot (1.13 to 1.16: modules as templates), declarations alone.
#pragma once
#include <cstddef>
#include <cstdint>
#include <cstdio>
#define __EXPORT
#define MODULE_NAME "rim_watch"
#define PX4_OK 0
#define PX4_ERROR (-1)
#include <drivers/drv_hrt.h>
#include <px4_platform_common/log.h>

namespace px4 {
template <typename T> class atomic {
public:
  atomic() = default;
  explicit constexpr atomic(T value) : _value(value) {}
  T load() const;
  void store(T value);

private:
  T _value;
};
} // namespace px4

template <class T> class ModuleBase {
public:
  ModuleBase() = default;
  virtual ~ModuleBase() = default;
  static int main(int argc, char *argv[]);
  virtual int print_status();

protected:
  bool should_exit() const;
  static void exit_and_cleanup();
  static px4::atomic<T *> _object;
  static int _task_id;
  static constexpr const int task_id_is_work_queue = -2;
};

void PRINT_MODULE_DESCRIPTION(const char *description);
void PRINT_MODULE_USAGE_NAME(const char *executable_name, const char *category);
void PRINT_MODULE_USAGE_COMMAND_DESCR(const char *name, const char *description);
#define PRINT_MODULE_USAGE_COMMAND(name) PRINT_MODULE_USAGE_COMMAND_DESCR(name, NULL);
#define PRINT_MODULE_USAGE_DEFAULT_COMMANDS()                                                      \
  PRINT_MODULE_USAGE_COMMAND("stop");                                                              \
  PRINT_MODULE_USAGE_COMMAND_DESCR("status", "print status info");
void PRINT_MODULE_USAGE_PARAM_STRING(char option_char, const char *default_val, const char *values,
                                     const char *description, bool is_optional);
