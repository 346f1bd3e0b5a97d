#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "diagnose/report_pictures.hpp"

namespace rim::diagnose::report {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kStretch = 600; // rows: a point each on 1000 px
constexpr double kTop = 200.0, kBottom = 220.0;

Index at(std::size_t i) { return static_cast<Index>(i); }

// The stretch's share of a column.
Vector part(const Vector &column, const Stretch &s) {
  return column.segment(at(s.first), at(s.rows));
}

// A line over time, parted where rows are missing.
Points over_time(const Panel &p, const Vector &t, const Vector &value) {
  std::vector<double> steps;
  for (Index i = 1; i < t.size(); ++i)
    steps.push_back(t(i) - t(i - 1));
  if (!steps.empty())
    std::nth_element(steps.begin(), steps.begin() + at(steps.size() / 2), steps.end());
  const double gap = steps.empty() ? INFINITY : 5.0 * steps[steps.size() / 2];
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

void shade_runs(Svg &svg, const Panel &p, const Finding &finding, const Stretch &s, const Vector &t,
                bool has_strip) {
  for (const auto &[first, last] : runs_of(finding.acts, s.first, s.rows)) {
    const double a = p.x.at(t(at(first - s.first)));
    const double b = p.x.at(t(std::min(t.size() - 1, at(last - s.first))));
    svg.rectangle(a, -1.0, std::max(1.0, b - a), p.height + 2.0, "acts");
    if (has_strip)
      svg.rectangle(a, 0.0, std::max(1.5, b - a), 6.0, "acts strip");
  }
}

std::string file_name(const std::string &path) {
  return std::filesystem::path(path).filename().string();
}

} // namespace

std::string time_picture(const Finding &finding, const View &view) {
  const Vector effect = effect_of(finding, view);
  const Stretch s = telling_stretch(finding, view, effect, kStretch);
  if (s.rows < 2)
    return "";
  const Channel &c = *view.channel;
  const Vector t = part(quantity_of(kTime, view).value, s);
  const Vector z = part(c.z, s), m = part(c.m, s), after = part(view.m_after, s);
  const Vector sd = part(view.sd_after, s);
  std::vector<double> all;
  for (const Vector &v : {z, m, after})
    append(all, v);
  const Range levels = most_of(all, 0.0);
  const Share share = share_of(finding, view, effect);
  const Vector r0 = z - part(share.m_without, s), r1 = z - after;
  std::vector<double> residuals(sd.data(), sd.data() + sd.size());
  for (double &half : residuals)
    half *= 2.0;
  const std::vector<double> halves = residuals;
  for (const double half : halves)
    residuals.push_back(-half);
  const std::size_t width = std::max<std::size_t>(5, s.rows / 40);
  const Vector mean0 = running_mean(r0, width), mean1 = running_mean(r1, width);
  append(residuals, r0);
  append(residuals, r1);
  const Range spread = most_of(residuals, 0.004);
  const std::string unit = c.unit.empty() ? "" : " (" + c.unit + ")";
  Axes top{padded(t(0), t(t.size() - 1)), padded(levels.low, levels.high), "",
           axis_text(c.name, c.unit), false};
  Axes bottom{top.x, padded(spread.low, spread.high), "time since the log began (s)",
              "residual" + unit, true};
  const double room = std::max(room_for_y(top.y, kTop), room_for_y(bottom.y, kBottom));
  Svg svg(kWide, kTop + kBottom, "measured and simulated " + c.name + " over time");
  const Panel a = draw_axes(svg, 0.0, 0.0, kWide, kTop, room, top);
  open(svg, a);
  shade_runs(svg, a, finding, s, t, true);
  svg.polyline(over_time(a, t, z), "measured");
  svg.polyline(over_time(a, t, m), "before");
  svg.polyline(over_time(a, t, after), "after");
  close(svg);
  const Panel b = draw_axes(svg, 0.0, kTop, kWide, kBottom, room, bottom);
  open(svg, b);
  shade_runs(svg, b, finding, s, t, false);
  Points band = over_time(b, t, 2.0 * sd), under = over_time(b, t, -2.0 * sd);
  band.insert(band.end(), under.rbegin(), under.rend());
  svg.polygon(band, "band");
  if (finding.term.kind == TermKind::variance) {
    const Vector stated = part(share.sd_without, s);
    for (const double half : {2.0, -2.0})
      svg.polyline(over_time(b, t, half * stated), "before dashed");
  }
  svg.line(0.0, b.y.at(0.0), b.width, b.y.at(0.0), "zero");
  svg.dots(over_time(b, t, r0), "before speck");
  svg.dots(over_time(b, t, r1), "after speck");
  svg.polyline(over_time(b, t, mean0), "before");
  svg.polyline(over_time(b, t, mean1), "after");
  close(svg);
  return figure("Measured against simulated: " + axis_text(c.name, "") + ", " +
                    file_name(view.measured->logs[s.log].path),
                svg.markup(),
                {{Mark::line, "measured", "measured"},
                 {Mark::line, "before", "simulated, before"},
                 {Mark::line, "after", "extended, after"},
                 {Mark::area, "acts strip", "the finding acts"},
                 {Mark::area, "band", "\u00b12 sd, after"}},
                fmt::format("Above the levels, below measured less simulated: a dot a row, lines "
                            "are means of {} rows. The stretch of {} rows in which the finding "
                            "matters most, one step ahead.{}{}",
                            width | 1u, s.rows,
                            share.alone || finding.term.kind > TermKind::variance
                                ? ""
                                : " Below, orange is without this finding's term alone: "
                                  "the others' stand.",
                            finding.term.kind == TermKind::variance
                                ? " Dashed: \u00b12 sd without it."
                                : ""));
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
  double from = -10.0, to = -10.0;
  const std::string style = fmt::format("f{}", (finding.number - 1) % 7);
  const auto flush = [&] {
    if (to > -1.0)
      svg.rectangle(from, y, std::max(1.2, to - from), kLane - 1.5, style,
                    fmt::format("finding {}, {}", finding.number, log.path));
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
  std::string note = "A row is counted to a finding where its effect exceeds 0.1 sd; of stuck or "
                     "dropped readings every one. labels.csv has them row by row.";
  if (shown < measured.logs.size())
    note += fmt::format(" The first {} of {} logs.", shown, measured.logs.size());
  return figure("When each finding acts", svg.markup(), keys, note);
}

} // namespace rim::diagnose::report
