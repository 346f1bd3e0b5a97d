// SPDX-License-Identifier: MIT
#include "util/interrupt.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <unistd.h>

namespace rim {

namespace {

constexpr std::size_t kLongest = 4096; // of a path, with its end

// Everything that the handler touches has a fixed place and is written before it is published: a
// signal may come at any moment.
struct Slot {
  std::atomic<bool> taken{false}, live{false};
  std::array<char, kLongest> path;
};
std::array<Slot, 64> slots;
std::array<std::array<char, kLongest>, 2> kept_path;
std::atomic<unsigned> kept{0};
// Taken by the thread that holds interruptions, and by the handler for good. `depth` is how often
// this thread holds: when it writes to a closed pipe meanwhile, its own handler must not wait.
std::atomic<bool> holding{false};
thread_local volatile std::sig_atomic_t depth = 0;

void take_hold() {
  while (holding.exchange(true))
    continue; // another thread is between two system calls, or its handler ends the program
}

const char *program_name = "";

// stderr without the buffers and locks of stdio, which a handler must not use.
class Line {
public:
  Line &operator<<(const char *text) {
    while (*text != '\0' && used_ < text_.size())
      text_[used_++] = *text++;
    return *this;
  }
  Line &operator<<(unsigned number) {
    std::array<char, 12> digits{};
    std::size_t at = digits.size() - 1;
    do {
      digits[--at] = static_cast<char>('0' + number % 10);
      number /= 10;
    } while (number != 0);
    return *this << &digits[at];
  }
  void write() const {
    const ssize_t ignored = ::write(STDERR_FILENO, text_.data(), used_);
    (void)ignored;
  }

private:
  std::array<char, kLongest + 256> text_;
  std::size_t used_ = 0;
};

void say(unsigned removed) {
  const unsigned count = kept.load();
  Line line;
  line << (::isatty(STDERR_FILENO) == 1 ? "\r\033[K" : "") << program_name << ": interrupted: ";
  if (count == 0)
    line << "no file was written or changed";
  else if (count == 1)
    line << "one file is complete and kept: " << kept_path[1].data();
  else
    line << count << " files are complete and kept, the last " << kept_path[count % 2].data();
  if (removed > 0)
    line << "; " << removed << (removed == 1 ? " that was" : " that were")
         << " not finished went away";
  line << "\n";
  line.write();
}

// What is said may go into a pipe whose reader was interrupted as well: that must not come here
// again, to wait for the hold that this thread has.
extern "C" void interrupted(int signal) {
  std::signal(SIGPIPE, SIG_IGN);
  if (depth == 0)
    take_hold();
  unsigned removed = 0;
  for (Slot &slot : slots)
    if (slot.live && ::unlink(slot.path.data()) == 0)
      removed++;
  if (signal != SIGPIPE)
    say(removed);
  std::signal(signal, SIG_DFL);
  ::raise(signal); // delivered when the handler returns
}

sigset_t those_held() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    sigaddset(&set, signal);
  return set;
}

} // namespace

void clean_up_when_interrupted(const char *program) {
  program_name = program;
  struct sigaction action {};
  action.sa_handler = interrupted;
  action.sa_mask = those_held();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) {
    struct sigaction before {};
    if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      ::sigaction(signal, &action, nullptr);
  }
}

Unfinished::Unfinished(const std::string &path) : slot_(-1) {
  if (path.size() >= kLongest)
    return;
  for (std::size_t i = 0; i < slots.size() && slot_ < 0; ++i) {
    if (slots[i].taken.exchange(true))
      continue;
    std::memcpy(slots[i].path.data(), path.c_str(), path.size() + 1);
    slots[i].live = true;
    slot_ = static_cast<int>(i);
  }
}

Unfinished::~Unfinished() {
  if (slot_ < 0)
    return;
  slots[static_cast<std::size_t>(slot_)].live = false;
  slots[static_cast<std::size_t>(slot_)].taken = false;
}

namespace {
void name_kept(unsigned number, const std::string &path) {
  std::array<char, kLongest> &place = kept_path[number % 2];
  const std::size_t length = std::min(path.size(), kLongest - 1);
  std::memcpy(place.data(), path.c_str(), length);
  place[length] = '\0';
}
} // namespace

void note_kept(const std::string &path) {
  const unsigned next = kept.load() + 1;
  name_kept(next, path);
  kept = next;
}

void note_renamed(const std::string &path) { name_kept(kept.load(), path); }

HoldInterrupts::HoldInterrupts() {
  const sigset_t set = those_held();
  ::pthread_sigmask(SIG_BLOCK, &set, &before_);
  if (depth == 0)
    take_hold();
  depth = depth + 1;
}

HoldInterrupts::~HoldInterrupts() {
  depth = depth - 1;
  if (depth == 0)
    holding = false;
  ::pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

} // namespace rim
