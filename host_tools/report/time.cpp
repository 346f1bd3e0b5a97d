// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "log/log.hpp"
#include "report/pictures.hpp"
#include "stats/robust.hpp"

namespace rim::diagnose::report {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kStretch = 600; // rows: a point each on 1000 px
constexpr std::size_t kQuick = 150;   // of a lag or delay, which is seen in the course of a few
constexpr double kTop = 200.0, kBottom = 220.0;

Index at(std::size_t i) { return static_cast<Index>(i); }

// The stretch's share of a column.
Vector part(const Vector &column, const Stretch &s) {
  return column.segment(at(s.first), at(s.rows));
}

// A step longer than this is a gap in the log.
double gap_of(const Vector &t) {
  std::vector<double> steps;
  for (Index i = 1; i < t.size(); ++i)
    steps.push_back(t(i) - t(i - 1));
  if (steps.empty())
    return INFINITY;
  return 5.0 * median(std::move(steps));
}

// A line over time, parted where rows are missing.
Points over_time(const Panel &p, const Vector &t, const Vector &value) {
  const double gap = gap_of(t);
  Points points;
  for (Index i = 0; i < t.size(); ++i) {
    if (i > 0 && t(i) - t(i - 1) > gap)
      points.emplace_back(NAN, NAN);
    points.emplace_back(p.x.at(t(i)), p.y.at(value(i)));
  }
  return points;
}

// From the lowest to the highest but for `share` of the values on either side.
Range most_of(std::vector<double> values, double share) {
  values.erase(
      std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }),
      values.end());
  if (values.empty())
    return {-1.0, 1.0};
  std::sort(values.begin(), values.end());
  const auto skip = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return {values[skip], values[values.size() - 1 - skip]};
}

void append(std::vector<double> &all, const Vector &values) {
  all.insert(all.end(), values.data(), values.data() + values.size());
}

// Where the finding acts: parted at gaps of the log, joined where no pixel lies between.
void shade_runs(Svg &svg, const Panel &p, const Finding &finding, const Stretch &s, const Vector &t,
                bool has_strip) {
  const double gap = gap_of(t);
  std::vector<Svg::Box> tint, strip;
  double from = 0.0, to = -1e9;
  const auto flush = [&] {
    if (to < -1e8)
      return;
    tint.push_back({from, -1.0, std::max(1.0, to - from), p.height + 2.0});
    strip.push_back({from, 0.0, std::max(1.5, to - from), 6.0});
  };
  for (std::size_t i = s.first; i < s.first + s.rows && i < finding.acts.size(); ++i) {
    if (finding.acts[i] == 0)
      continue;
    const Index k = at(i - s.first);
    const bool has_next = k + 1 < t.size() && t(k + 1) - t(k) <= gap;
    const double a = p.x.at(t(k)), b = p.x.at(has_next ? t(k + 1) : t(k));
    if (a > to + 1.0) {
      flush();
      from = a;
    }
    to = b;
  }
  flush();
  svg.boxes(tint, "acts", "");
  if (has_strip)
    svg.boxes(strip, "acts strip", "the finding acts");
}

std::string file_name(const std::string &path) {
  return std::filesystem::path(path).filename().string();
}

bool is_sensor(const Finding &finding) {
  return finding.term.kind == TermKind::stuck || finding.term.kind == TermKind::dropout;
}

// A stretch with its columns: levels, and the residual without the finding's term and with it.
struct Scene {
  Stretch stretch;
  Share share;
  Vector t, z, m, after, sd_without, sd_with, without, with;
  std::size_t width = 5; // rows of a running mean
  Range time, levels, residuals;
};

Scene scene_of(const Finding &finding, const View &view) {
  Scene s;
  const Vector effect = effect_of(finding, view);
  s.stretch =
      telling_stretch(finding, view, effect, moves_prediction(finding.term) ? kQuick : kStretch);
  if (s.stretch.rows < 2)
    return s;
  s.share = share_of(finding, view, effect);
  s.t = part(quantity_of(kTime, view).value, s.stretch);
  s.z = part(view.channel->z, s.stretch);
  s.m = part(view.channel->m, s.stretch);
  s.after = part(view.m_after, s.stretch);
  s.sd_without = part(s.share.sd_without, s.stretch);
  s.sd_with = part(view.sd_after, s.stretch);
  s.without = s.z - part(s.share.m_without, s.stretch);
  s.with = s.z - s.after;
  s.width = moves_prediction(finding.term) ? 1 : std::max<std::size_t>(5, s.stretch.rows / 40) | 1u;
  std::vector<double> levels, residuals;
  for (const Vector &v : {s.z, s.m, s.after})
    append(levels, v);
  for (const Vector &v : {Vector(2.0 * s.sd_with), Vector(-2.0 * s.sd_with), s.without, s.with})
    append(residuals, v);
  const Range r = most_of(residuals, 0.004), l = most_of(levels, 0.0);
  s.time = padded(s.t(0), s.t(s.t.size() - 1));
  s.levels = padded(l.low, l.high);
  s.residuals = padded(r.low, r.high);
  return s;
}

// Between -half and half, a polygon a gapless part.
void draw_band(Svg &svg, const Panel &p, const Vector &t, const Vector &half) {
  const Points upper = over_time(p, t, half), lower = over_time(p, t, -half);
  for (std::size_t first = 0; first < upper.size();) {
    std::size_t last = first;
    while (last < upper.size() && std::isfinite(upper[last].first))
      ++last;
    Points part(upper.begin() + at(first), upper.begin() + at(last));
    for (std::size_t i = last; i > first; --i)
      part.push_back(lower[i - 1]);
    svg.polygon(part, "band");
    first = last + 1;
  }
}

// Readings that are none.
void mark_flagged(Svg &svg, const Panel &p, const Finding &finding, const Scene &s) {
  Points flagged;
  for (std::size_t i = s.stretch.first; i < s.stretch.first + s.stretch.rows; ++i) {
    const Index k = at(i - s.stretch.first);
    if (i < finding.acts.size() && finding.acts[i] != 0)
      flagged.emplace_back(p.x.at(s.t(k)), p.y.at(s.z(k)));
  }
  svg.dots(flagged, "flagged");
}

void draw_levels(Svg &svg, const Panel &p, const Finding &finding, const Scene &s) {
  open(svg, p);
  shade_runs(svg, p, finding, s.stretch, s.t, true);
  svg.polyline(over_time(p, s.t, s.z), "measured");
  svg.polyline(over_time(p, s.t, s.m), "before");
  svg.polyline(over_time(p, s.t, s.after), "after");
  if (is_sensor(finding))
    mark_flagged(svg, p, finding, s);
  close(svg);
}

void draw_residuals(Svg &svg, const Panel &p, const Finding &finding, const Scene &s) {
  open(svg, p);
  shade_runs(svg, p, finding, s.stretch, s.t, false);
  draw_band(svg, p, s.t, 2.0 * s.sd_with);
  for (const double half : {2.0, -2.0}) {
    if (finding.term.kind == TermKind::variance)
      svg.polyline(over_time(p, s.t, half * s.sd_without), "before dashed");
  }
  svg.line(0.0, p.y.at(0.0), p.width, p.y.at(0.0), "zero");
  svg.dots(over_time(p, s.t, s.without), "before speck");
  Points with = over_time(p, s.t, s.with);
  const Points without = over_time(p, s.t, s.without);
  for (std::size_t i = 0; i < with.size(); ++i) { // the same dot is drawn once
    if (std::fabs(with[i].second - without[i].second) < 0.05)
      with[i].second = NAN;
  }
  svg.dots(with, "after speck");
  svg.polyline(over_time(p, s.t, running_mean(s.without, s.width)), "before");
  svg.polyline(over_time(p, s.t, running_mean(s.with, s.width)), "after");
  close(svg);
}

std::string time_note(const Finding &finding, const Scene &s) {
  std::string note = "Above: the levels. Below: measured less simulated, one dot per row";
  if (s.width > 1)
    note += fmt::format(", lines are means of {} rows", s.width);
  note += fmt::format(". These are the {} rows in which the finding matters most, one step ahead.",
                      s.stretch.rows);
  const TermKind kind = finding.term.kind;
  if (!s.share.alone && (kind == TermKind::mean || kind == TermKind::variance))
    note += " In the lower plot, orange leaves out this finding's term alone.";
  if (kind == TermKind::variance)
    note += " Dashed: \u00b12 sd without it.";
  return note;
}

} // namespace

std::string time_picture(const Finding &finding, const View &view) {
  const Scene s = scene_of(finding, view);
  if (s.stretch.rows < 2)
    return "";
  const Channel &c = *view.channel;
  const std::string unit = c.unit.empty() ? "" : " (" + c.unit + ")";
  const double room = std::max(room_for_y(s.levels, kTop), room_for_y(s.residuals, kBottom));
  Svg svg(kWide, kTop + kBottom, "measured and simulated " + c.name + " over time");
  const Panel top = draw_axes(svg, 0.0, 0.0, kWide, kTop, room,
                              {s.time, s.levels, "", axis_text(c.name, c.unit), false});
  draw_levels(svg, top, finding, s);
  const Panel bottom =
      draw_axes(svg, 0.0, kTop, kWide, kBottom, room,
                {s.time, s.residuals, feature_text(kTime) + " (s)", "residual" + unit, true});
  draw_residuals(svg, bottom, finding, s);
  return figure("Measured against simulated: " + plain_name(c.name) + ", " +
                    file_name(view.measured->logs[s.stretch.log].path),
                svg.markup(),
                {{Mark::line, "measured", "measured"},
                 {Mark::line, "before", "simulated, before"},
                 {Mark::line, "after", "extended, after"},
                 {Mark::area, "acts strip", "the finding acts"},
                 {Mark::area, "band", "\u00b12 sd, after"}},
                time_note(finding, s));
}

namespace {

constexpr std::size_t kMostLogs = 40;
constexpr double kLane = 7.0;

double log_duration(const Measured &measured, const LogSpan &log) {
  return log.rows == 0 ? 0.0 : measured.elapsed_s[log.first + log.rows - 1];
}

// Runs nearer than a pixel are drawn as one.
void draw_lane(Svg &svg, const Panel &p, const Finding &finding, const LogSpan &log,
               const Measured &measured, double y) {
  double from = 0.0, to = -1e9;
  std::vector<Svg::Box> boxes;
  const auto flush = [&] {
    if (to > -1e8)
      boxes.push_back({from, y, std::max(1.2, to - from), kLane - 1.5});
  };
  for (const auto &[first, last] : runs_of(finding.acts, log.first, log.rows)) {
    const double a = p.x.at(measured.elapsed_s[first]), b = p.x.at(measured.elapsed_s[last - 1]);
    if (a > to + 1.5) {
      flush();
      from = a;
    }
    to = b;
  }
  flush();
  svg.boxes(boxes, fmt::format("f{}", (finding.number - 1) % 7),
            fmt::format("finding {}, {}", finding.number, log.path));
}

} // namespace

std::string logs_picture(const Diagnosis &diagnosis, const Measured &measured) {
  const std::size_t shown = std::min(kMostLogs, measured.logs.size());
  double longest = 0.0;
  std::size_t letters_most = 4;
  for (std::size_t i = 0; i < shown; ++i) {
    longest = std::max(longest, log_duration(measured, measured.logs[i]));
    letters_most = std::max(letters_most, letters(file_name(measured.logs[i].path)));
  }
  const double lanes = std::max<double>(1.0, static_cast<double>(diagnosis.findings.size()));
  const double row = kLane * lanes + 9.0, height = row * static_cast<double>(shown) + 60.0;
  const double room = std::min(230.0, 20.0 + 7.0 * static_cast<double>(letters_most));
  Svg svg(kWide, height, "when each finding acts, by log");
  Panel p{room, 6.0, kWide - room - 14.0, row * static_cast<double>(shown), {}, {}};
  p.x = {{0.0, std::max(1e-9, longest)}, 0.0, p.width, false};
  const Ticks ticks = linear_ticks(p.x.data, 9);
  for (std::size_t i = 0; i < ticks.at.size(); ++i) {
    const double x = p.left + p.x.at(ticks.at[i]);
    svg.line(x, p.top, x, p.top + p.height, "grid");
    svg.text(x, p.top + p.height + 16.0, "tick middle", ticks.text[i]);
  }
  svg.text(p.left + p.width / 2.0, p.top + p.height + 36.0, "label middle",
           "time since the log began (s)");
  for (std::size_t i = 0; i < shown; ++i) {
    const LogSpan &log = measured.logs[i];
    const double y = row * static_cast<double>(i) + 3.0;
    svg.text(p.left - 8.0, p.top + y + row / 2.0, "tick end",
             fitted(file_name(log.path), room - 12.0));
    open(svg, p);
    svg.rectangle(0.0, y, p.x.at(log_duration(measured, log)), row - 7.0, "lane");
    for (std::size_t f = 0; f < diagnosis.findings.size(); ++f)
      draw_lane(svg, p, diagnosis.findings[f], log, measured,
                y + 1.5 + kLane * static_cast<double>(f));
    close(svg);
  }
  std::vector<Key> keys;
  for (const Finding &f : diagnosis.findings)
    keys.push_back({Mark::area, fmt::format("f{}", (f.number - 1) % 7),
                    fmt::format("{} {}", f.number, plain_cause(f.term.cause))});
  std::string note = "A row belongs to a finding where the effect exceeds 0.1 sd, or where the "
                     "reading is stuck or dropped. labels.csv lists all rows.";
  if (shown < measured.logs.size())
    note += fmt::format(" The first {} of {} logs.", shown, measured.logs.size());
  return figure("When each finding acts", svg.markup(), keys, note);
}

} // namespace rim::diagnose::report
