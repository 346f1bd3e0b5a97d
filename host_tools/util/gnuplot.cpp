// SPDX-License-Identifier: MIT
#include "util/gnuplot.hpp"

#include <csignal>
#include <cstdio>
#include <sys/wait.h>
#include <unistd.h>

#include "util/atomic_file.hpp"
#include "util/error.hpp"

namespace rim {

namespace {

bool ends_in(const std::string &path, const std::string &ending) {
  return path.size() > ending.size() &&
         path.compare(path.size() - ending.size(), ending.size(), ending) == 0;
}

// Removes gnuplot's own file however the function ends.
struct Leftover {
  std::string path;
  ~Leftover() { ::unlink(path.c_str()); }
};

// Without gnuplot the shell that popen() starts ends before it has read anything.
struct IgnoreBrokenPipe {
  struct sigaction before {};
  IgnoreBrokenPipe() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before);
  }
  ~IgnoreBrokenPipe() { ::sigaction(SIGPIPE, &before, nullptr); }
};

} // namespace

std::string gnuplot_text(const std::string &text) {
  std::string out = "'";
  for (const char letter : text) {
    if (letter == '\n' || letter == '\r')
      continue;
    out += letter;
    if (letter == '\'')
      out += letter;
  }
  return out + "'";
}

void check_plot_path(const std::string &path) {
  if (!ends_in(path, ".svg") && !ends_in(path, ".png"))
    throw UsageError("--plot: the name must end in .svg or .png: " + path);
}

void write_gnuplot(const PlotScript &script_of, const std::string &path) {
  check_plot_path(path);
  const Leftover drawn{path + ".gnuplot." + std::to_string(::getpid())};
  const IgnoreBrokenPipe ignore;
  std::FILE *gnuplot = ::popen("gnuplot", "w");
  if (gnuplot == nullptr)
    throw DataError(path + ": gnuplot cannot be started");
  const std::string text = script_of(gnuplot_text(drawn.path), ends_in(path, ".svg"));
  const bool sent = std::fwrite(text.data(), 1, text.size(), gnuplot) == text.size();
  const int status = ::pclose(gnuplot);
  if (!sent || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw DataError(path + ": gnuplot " +
                    (WIFEXITED(status) && WEXITSTATUS(status) == 127
                         ? "is not installed (Debian: gnuplot-nox)"
                         : "failed"));
  }
  const std::string picture = read_file(drawn.path);
  if (picture.empty())
    throw DataError(path + ": gnuplot drew nothing (disk full?)");
  AtomicFile file(path);
  file.write(picture);
  file.commit();
}

} // namespace rim
