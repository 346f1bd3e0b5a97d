// SPDX-License-Identifier: MIT
#include "replay/plot.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>

#include "util/atomic_file.hpp"
#include "util/error.hpp"

namespace rim {

namespace {

constexpr double kFloor = 1.0; // ln anom is drawn no lower on the logarithmic scale
constexpr int kWidth = 1000, kPanel = 260, kMargin = 60;

bool ends_in(const std::string &path, const std::string &ending) {
  return path.size() > ending.size() &&
         path.compare(path.size() - ending.size(), ending.size(), ending) == 0;
}

// Inside a single-quoted string of gnuplot a quote is doubled.
std::string quoted(const std::string &text) {
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

std::string data_block(const Trace &trace, std::size_t number) {
  std::string text = fmt::format("$d{} << EOD\n", number);
  for (const TracePoint &p : trace.points) {
    text += fmt::format("{:.3f} {:.6g} {:.6g}\n", p.t_s, std::max(kFloor, p.ln_anom),
                        std::max(kFloor, p.threshold));
  }
  if (trace.points.empty())
    text += "0 1 1\n";
  return text + "EOD\n";
}

double top_of(const Trace &trace) {
  double top = 10.0;
  for (const TracePoint &p : trace.points)
    top = std::max({top, p.ln_anom, p.threshold});
  return std::pow(10.0, std::ceil(std::log10(1.05 * top)));
}

std::string title_of(const Trace &trace) {
  if (trace.alarms_s.empty())
    return trace.title + ": nothing found";
  return fmt::format("{}: alarm at t = {:.2f} s, {}", trace.title, trace.alarms_s.front(),
                     trace.sentence);
}

// The label of an alarm stands on the side where there is room.
std::string alarm_mark(double t_s, const Trace &trace, double top) {
  const double middle = 0.5 * (trace.points.front().t_s + trace.points.back().t_s);
  const bool right = t_s < middle;
  return fmt::format("set arrow from {0:.3f},{1} to {0:.3f},{2} nohead lc rgb '#b22222' lw 1.5 "
                     "dt 3 front\nset label '{3}' at {0:.3f},{4} {5} tc rgb '#b22222' front\n",
                     t_s, kFloor, top, right ? " alarm" : "alarm ", 1.5 * kFloor,
                     right ? "left" : "right");
}

std::string panel(const Trace &trace, std::size_t number, bool last) {
  const double top = top_of(trace);
  std::string text =
      fmt::format("unset arrow\nunset label\nset label {} at graph 0,1.08 left noenhanced\n"
                  "set yrange [{}:{}]\nset xlabel {}\n",
                  quoted(title_of(trace)), kFloor, top, last ? "'time (s)'" : "''");
  for (const double t_s : trace.alarms_s)
    text += alarm_mark(t_s, trace, top);
  return text + fmt::format("plot $d{0} using 1:3 with lines lw 1.5 dt 2 lc rgb '#444444' title "
                            "'threshold', '' using 1:2 with lines lw 2 lc rgb "
                            "'#1f5fa8' title "
                            "'ln anom'\n",
                            number);
}

std::string script(const std::vector<Trace> &traces, const std::string &path, bool svg) {
  const int height = kMargin + kPanel * static_cast<int>(std::max<std::size_t>(1, traces.size()));
  std::string text =
      svg ? fmt::format("set terminal svg size {},{} dynamic font 'sans,14' background rgb "
                        "'white'\n",
                        kWidth, height)
          : fmt::format("set terminal pngcairo size {},{} font 'sans,11'\n", kWidth, height);
  text += "set output " + quoted(path) +
          "\nset logscale y\nset ylabel 'ln anom (nat)'\nset format y '10^{%T}'\n"
          "set key at graph 1,1.14 right horizontal\nset grid y lc rgb '#dddddd'\nset lmargin "
          "11\nset rmargin 3\nset tmargin 2.6\nset bmargin 3.6\n"
          "set tics nomirror out\nset autoscale xfix\n";
  for (std::size_t i = 0; i < traces.size(); ++i)
    text += data_block(traces[i], i);
  text += fmt::format("set multiplot layout {},1\n", std::max<std::size_t>(1, traces.size()));
  for (std::size_t i = 0; i < traces.size(); ++i)
    text += panel(traces[i], i, i + 1 == traces.size());
  return text + "unset multiplot\nunset output\n";
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

void check_plot_path(const std::string &path) {
  if (!ends_in(path, ".svg") && !ends_in(path, ".png"))
    throw UsageError("--plot: the name must end in .svg or .png: " + path);
}

void write_plot(const std::vector<Trace> &traces, const std::string &path) {
  write_gnuplot([&traces](const std::string &to, bool svg) { return script(traces, to, svg); },
                path);
}

void write_gnuplot(const PlotScript &script_of, const std::string &path) {
  check_plot_path(path);
  const Leftover drawn{path + ".gnuplot." + std::to_string(::getpid())};
  const IgnoreBrokenPipe ignore;
  std::FILE *gnuplot = ::popen("gnuplot", "w");
  if (gnuplot == nullptr)
    throw DataError(path + ": gnuplot cannot be started");
  const std::string text = script_of(drawn.path, ends_in(path, ".svg"));
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
