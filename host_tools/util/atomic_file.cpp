// SPDX-License-Identifier: MIT
#include "util/atomic_file.hpp"

#include "util/error.hpp"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>

namespace rim {

namespace {
constexpr std::size_t kBuffer = 1u << 18;
}

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  struct stat info {};
  const bool exists = ::stat(path_.c_str(), &info) == 0;
  if (exists && S_ISDIR(info.st_mode))
    throw DataError(path_ + ": is a folder");
  const bool direct = exists && !S_ISREG(info.st_mode);
  std::optional<HoldInterrupts> made; // no file that an interruption does not know of
  if (!direct) {
    made.emplace();
    temporary_ = path_ + ".tmp." + std::to_string(::getpid());
    unfinished_.emplace(temporary_);
  }
  const char *name = direct ? path_.c_str() : temporary_.c_str();
  descriptor_ = ::open(name, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    throw DataError(path_ + ": cannot write: " + std::strerror(errno));
  buffer_.reserve(kBuffer);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ < 0)
    return;
  ::close(descriptor_);
  if (!temporary_.empty())
    ::unlink(temporary_.c_str());
}

void AtomicFile::fail(int error) {
  if (!temporary_.empty())
    ::unlink(temporary_.c_str());
  throw DataError(path_ + ": write failed: " + std::strerror(error));
}

void AtomicFile::write(const void *data, std::size_t bytes) {
  buffer_.append(static_cast<const char *>(data), bytes);
  if (buffer_.size() >= kBuffer)
    flush();
}

void AtomicFile::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (n < 0 && errno == EINTR)
      continue;
    if (n <= 0)
      fail(n < 0 ? errno : ENOSPC);
    done += static_cast<std::size_t>(n);
  }
  buffer_.clear();
}

void AtomicFile::commit() {
  flush();
  // A device or pipe cannot be synchronised: EINVAL.
  if (!temporary_.empty() && ::fsync(descriptor_) != 0)
    fail(errno);
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (::close(descriptor) != 0)
    fail(errno);
  if (temporary_.empty())
    return;
  const HoldInterrupts whole; // what is in place is counted
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    fail(errno);
  unfinished_.reset();
  note_kept(path_);
}

std::string read_file(const std::string &path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0)
    throw DataError(path + ": cannot read: " + std::strerror(errno));
  struct stat info {};
  const bool known = ::fstat(descriptor, &info) == 0;
  if (known && S_ISDIR(info.st_mode)) {
    ::close(descriptor);
    throw DataError(path + ": is a folder");
  }
  std::string text;
  const std::size_t chunk = 1u << 20;
  // One byte more than the size, so that the end is seen without growing again.
  std::size_t room = known && info.st_size > 0 ? static_cast<std::size_t>(info.st_size) + 1 : chunk;
  std::size_t used = 0;
  for (;;) {
    text.resize(used + room);
    const ssize_t n = ::read(descriptor, &text[used], room);
    if (n < 0 && errno == EINTR)
      continue;
    if (n < 0) {
      const int error = errno;
      ::close(descriptor);
      throw DataError(path + ": cannot read: " + std::strerror(error));
    }
    used += static_cast<std::size_t>(n);
    if (n == 0)
      break;
    room = std::max(room - static_cast<std::size_t>(n), chunk);
  }
  ::close(descriptor);
  text.resize(used);
  return text;
}

void make_folder(const std::string &path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error || !std::filesystem::is_directory(path))
    throw DataError(path + ": cannot make the folder" + (error ? ": " + error.message() : ""));
}

} // namespace rim
