// SPDX-License-Identifier: MIT
#include "train/run_store.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

#include "util/error.hpp"

namespace rim {

namespace {

std::string folder_for_files(const std::string &asked) {
  const char *set = std::getenv("TMPDIR");
  return !asked.empty() ? asked : set != nullptr && set[0] != '\0' ? set : "/tmp";
}

std::size_t bytes_of(const Matrix &m) {
  return sizeof(double) * static_cast<std::size_t>(m.size());
}

} // namespace

BlockFile::BlockFile(int descriptor, std::string path)
    : descriptor_(descriptor), path_(std::move(path)) {}

BlockFile::BlockFile(const std::string &path)
    : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)), path_(path) {
  if (descriptor_ < 0)
    throw DataError(path + ": " + std::strerror(errno));
}

std::shared_ptr<BlockFile> BlockFile::unnamed(const std::string &folder) {
  std::string name = folder + "/rim_blocks_XXXXXX";
  const int descriptor = ::mkstemp(name.data());
  if (descriptor < 0)
    throw DataError(
        folder + ": no file for the blocks of the runs can be made there: " + std::strerror(errno));
  ::unlink(name.c_str());
  return std::shared_ptr<BlockFile>(new BlockFile(descriptor, name));
}

BlockFile::~BlockFile() {
  if (descriptor_ >= 0)
    ::close(descriptor_);
}

std::uint64_t BlockFile::bytes() const {
  struct stat info {};
  if (::fstat(descriptor_, &info) != 0)
    throw DataError(path_ + ": " + std::strerror(errno));
  return S_ISREG(info.st_mode) ? static_cast<std::uint64_t>(info.st_size) : 0;
}

void BlockFile::read(std::uint64_t at, void *to, std::size_t bytes) const {
  auto *place = static_cast<char *>(to);
  while (bytes > 0) {
    const ssize_t got = ::pread(descriptor_, place, bytes, static_cast<off_t>(at));
    if (got < 0 && errno == EINTR)
      continue;
    if (got <= 0)
      throw DataError(path_ + ": " + (got < 0 ? std::strerror(errno) : "is cut off"));
    place += got;
    at += static_cast<std::uint64_t>(got);
    bytes -= static_cast<std::size_t>(got);
  }
}

void BlockFile::write(std::uint64_t at, const void *from, std::size_t bytes) {
  const auto *place = static_cast<const char *>(from);
  while (bytes > 0) {
    const ssize_t put = ::pwrite(descriptor_, place, bytes, static_cast<off_t>(at));
    if (put < 0 && errno == EINTR)
      continue;
    if (put <= 0)
      throw DataError(path_ + ": the blocks of the runs cannot be written: " +
                      std::strerror(put < 0 ? errno : ENOSPC));
    place += put;
    at += static_cast<std::uint64_t>(put);
    bytes -= static_cast<std::size_t>(put);
  }
}

struct RunStore::Room {
  std::mutex guard;
  std::size_t left = 0; // bytes of memory
  std::string folder;
  std::shared_ptr<BlockFile> file; // made when it is needed
  std::uint64_t used = 0;          // bytes of the file
};

RunStore::RunStore(std::size_t n, std::size_t wide_bytes, std::string folder)
    : runs_(n), places_(n), learnt_(n), room_(std::make_shared<Room>()) {
  room_->left = wide_bytes;
  room_->folder = std::move(folder);
}

RunStore::RunStore(const std::vector<BlockRun> &runs) : RunStore(runs.size()) {
  for (std::size_t r = 0; r < runs.size(); ++r)
    put(r, runs[r]);
}

void RunStore::put(std::size_t r, BlockRun run) {
  auto wide = std::make_shared<WideBlocks>();
  Matrix *const from[3] = {&run.terms, &run.early, &run.late};
  Matrix *const to[3] = {&wide->terms, &wide->early, &wide->late};
  std::size_t bytes = 0;
  for (std::size_t m = 0; m < 3; ++m) {
    bytes += bytes_of(*from[m]);
    places_[r].columns[m] = static_cast<std::size_t>(from[m]->cols());
    to[m]->swap(*from[m]);
    from[m]->resize(0, 0);
  }
  runs_[r] = std::move(run);
  {
    const std::lock_guard<std::mutex> lock(room_->guard);
    if (bytes <= room_->left) {
      room_->left -= bytes;
      places_[r].memory = std::move(wide);
      return;
    }
    room_->left = 0; // from here on all go to the file
    if (room_->file == nullptr)
      room_->file = BlockFile::unnamed(folder_for_files(room_->folder));
    places_[r].file = room_->file;
    places_[r].at = room_->used;
    room_->used += bytes;
  }
  std::uint64_t at = places_[r].at;
  for (const Matrix *m : to) {
    places_[r].file->write(at, m->data(), bytes_of(*m));
    at += bytes_of(*m);
  }
}

void RunStore::put_from(std::size_t r, BlockRun narrow, std::shared_ptr<BlockFile> file,
                        std::uint64_t at, const std::size_t columns[3]) {
  runs_[r] = std::move(narrow);
  places_[r].file = std::move(file);
  places_[r].at = at;
  std::copy(columns, columns + 3, places_[r].columns);
}

RunStore RunStore::without(std::size_t run) const {
  RunStore some = *this;
  const auto at = static_cast<std::ptrdiff_t>(run);
  std::rotate(some.runs_.begin() + at, some.runs_.begin() + at + 1, some.runs_.end());
  std::rotate(some.places_.begin() + at, some.places_.begin() + at + 1, some.places_.end());
  some.learnt_ = learnt_ - 1;
  return some;
}

void RunStore::forget_wide() {
  places_.clear();
  room_.reset();
}

std::shared_ptr<const WideBlocks> RunStore::wide(std::size_t r) const {
  const Place &place = places_[r];
  if (place.memory != nullptr)
    return place.memory;
  auto wide = std::make_shared<WideBlocks>();
  std::uint64_t at = place.at;
  Matrix *const to[3] = {&wide->terms, &wide->early, &wide->late};
  for (std::size_t m = 0; m < 3; ++m) {
    to[m]->resize(runs_[r].blocks(), static_cast<Eigen::Index>(place.columns[m]));
    if (bytes_of(*to[m]) > 0)
      place.file->read(at, to[m]->data(), bytes_of(*to[m]));
    at += bytes_of(*to[m]);
  }
  return wide;
}

} // namespace rim
