// SPDX-License-Identifier: MIT
#include "report/output_folder.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <unistd.h>

#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/interrupt.hpp"

namespace rim::diagnose {

namespace fs = std::filesystem;

const std::vector<std::string> kOutputNames = {"diagnosis.json", "labels.csv", "extension.toml",
                                               "report.html"};

namespace {

enum class Place { absent, empty, earlier };

[[noreturn]] void refuse(const std::string &folder, const std::string &reason) {
  throw DataError(folder + ": " + reason);
}

// "out/" and links are the folder they lead to: the link stays and its folder is replaced.
fs::path resolved(const std::string &folder) {
  if (folder.empty())
    throw UsageError("--out: a folder's name is needed");
  std::error_code error;
  fs::path path = fs::weakly_canonical(fs::absolute(fs::path(folder), error), error);
  if (error)
    refuse(folder, error.message());
  if (path.filename().empty())
    path = path.parent_path();
  return path;
}

void check_contents(const std::string &folder, const fs::path &path) {
  bool has_json = false;
  std::error_code error;
  fs::directory_iterator entry(path, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const bool known =
        std::find(kOutputNames.begin(), kOutputNames.end(), name) != kOutputNames.end();
    if (!known || !fs::is_regular_file(entry->symlink_status()))
      refuse(folder, "holds '" + name + "', which is not of a diagnosis: not touched");
    has_json = has_json || name == kOutputNames.front();
  }
  if (error)
    refuse(folder, error.message());
  if (!has_json || read_file((path / kOutputNames.front()).string()).find("\"rim-diagnosis/") ==
                       std::string::npos)
    refuse(folder, "holds files but no diagnosis.json of rim diagnose: not touched");
}

Place place_of(const std::string &folder, const fs::path &path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found)
    return Place::absent;
  if (error)
    refuse(folder, error.message());
  if (!fs::is_directory(status))
    refuse(folder, "is a file, not a folder");
  if (path == path.root_path() || fs::equivalent(path, fs::current_path(error), error))
    refuse(folder, "is the current folder; name one of its own");
  const bool is_empty = fs::is_empty(path, error);
  if (error)
    refuse(folder, error.message());
  if (is_empty)
    return Place::empty;
  check_contents(folder, path);
  return Place::earlier;
}

// Only what a diagnosis leaves is removed: a file that someone put there meanwhile stays, and so
// does its folder.
void remove_outputs(const fs::path &path) {
  std::error_code ignored;
  for (const std::string &name : kOutputNames)
    fs::remove(path / name, ignored);
  ::rmdir(path.c_str());
}

struct Temporary {
  fs::path path;
  ~Temporary() { remove_outputs(path); }
};

void flush_folder(const fs::path &path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0)
    return;
  ::fsync(descriptor); // some file systems cannot: the rename is still whole
  ::close(descriptor);
}

// Afterwards `to` is the new folder and `from` the old one (for the caller to remove).
bool exchange(const fs::path &from, const fs::path &to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) == 0)
    return true;
  if (errno != EINVAL && errno != ENOSYS)
    return false;
  // A file system without exchange: two renames, undone when the second fails.
  const std::string aside = to.string() + ".old." + std::to_string(::getpid());
  if (::rename(to.c_str(), aside.c_str()) != 0)
    return false;
  const bool placed = ::rename(from.c_str(), to.c_str()) == 0;
  const int error = errno;
  if (::rename(aside.c_str(), (placed ? from : to).c_str()) != 0)
    std::fprintf(stderr, "rim: the earlier diagnosis is in %s\n", aside.c_str());
  errno = error;
  return placed;
}

} // namespace

void check_output_folder(const std::string &folder) { place_of(folder, resolved(folder)); }

void write_output_folder(const std::vector<std::pair<std::string, std::string>> &files,
                         const std::string &folder) {
  const fs::path path = resolved(folder);
  if (place_of(folder, path) == Place::absent)
    make_folder(path.parent_path().string());
  const HoldInterrupts whole; // a moment: the whole folder or none of it
  const Temporary temporary{path.string() + ".tmp." + std::to_string(::getpid())};
  if (::mkdir(temporary.path.c_str(), 0777) != 0)
    refuse(folder, std::string("cannot make a folder beside it: ") + std::strerror(errno));
  for (const auto &[name, content] : files) {
    AtomicFile file((temporary.path / name).string());
    file.write(content);
    file.commit();
  }
  flush_folder(temporary.path);
  const Place place = place_of(folder, path); // again: the writing took a while
  if (place == Place::earlier) {
    struct stat info {};
    if (::stat(path.c_str(), &info) == 0)
      ::chmod(temporary.path.c_str(), info.st_mode & 07777);
  }
  const bool placed = place == Place::earlier ? exchange(temporary.path, path)
                                              : ::rename(temporary.path.c_str(), path.c_str()) == 0;
  if (!placed)
    refuse(folder, std::string("cannot be put in place: ") + std::strerror(errno));
  if (!files.empty())
    note_renamed((path / files.back().first).string());
  flush_folder(path.parent_path());
}

} // namespace rim::diagnose
