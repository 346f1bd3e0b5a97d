// SPDX-License-Identifier: MIT
// util/interrupt.hpp - what a program that is interrupted leaves behind: no unfinished file, and a
// line on stderr that says which files are complete.
#pragma once

#include <csignal>
#include <string>

namespace rim {

// From now on SIGINT, SIGTERM, SIGHUP and SIGPIPE remove every Unfinished file, say what was kept
// (SIGPIPE: nothing is said) and end the program by that signal, as a shell expects. A signal that
// the caller ignores (nohup, a background job) stays ignored. `program` begins the line; it must
// outlive the program.
void clean_up_when_interrupted(const char *program);

// A file that an interruption removes, from its construction to the end of its life. At most 64 at
// a time; a further one is not removed. Where other threads work, make it and the file while
// interruptions are held: the file of one that is late would stay.
class Unfinished {
public:
  explicit Unfinished(const std::string &path);
  ~Unfinished();
  Unfinished(const Unfinished &) = delete;
  Unfinished &operator=(const Unfinished &) = delete;

private:
  int slot_;
};

// Counts a file or folder that is complete under its own name. Call it while interruptions are
// held, together with the step that completed it.
void note_kept(const std::string &path);

// The one that was counted last has another name by now. Call it while interruptions are held.
void note_renamed(const std::string &path);

// Interruptions wait while it lives, whichever thread they reach: for steps of which either all or
// none should be seen. One thread holds at a time and the others wait: keep it short. It may be
// nested.
class HoldInterrupts {
public:
  HoldInterrupts();
  ~HoldInterrupts();
  HoldInterrupts(const HoldInterrupts &) = delete;
  HoldInterrupts &operator=(const HoldInterrupts &) = delete;

private:
  sigset_t before_;
};

} // namespace rim
