// SPDX-License-Identifier: MIT
// util/atomic_file.hpp - a file that appears whole under its name or not at all.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "util/interrupt.hpp"

namespace rim {

// Writes PATH.tmp.PID beside PATH; commit() flushes it to the disk and renames it. Without a commit
// the destructor, or the signal that ends the program, removes it and PATH stays as it was. A
// device or pipe (/dev/stdout) is written directly. Every failure throws DataError "PATH: reason".
class AtomicFile {
public:
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile &) = delete;
  AtomicFile &operator=(const AtomicFile &) = delete;

  void write(const void *data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  void commit();
  const std::string &path() const { return path_; }

private:
  void flush();
  [[noreturn]] void fail(int error);

  std::string path_, temporary_, buffer_;
  std::optional<Unfinished> unfinished_;
  int descriptor_ = -1;
};

// The whole of a small or large regular file. Throws DataError: missing, a folder, unreadable.
std::string read_file(const std::string &path);

// Makes the folder and its parents; DataError when that fails or a file is in the way.
void make_folder(const std::string &path);

} // namespace rim
