// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/pictures.hpp"

namespace rim::diagnose::report {

namespace {

using Index = Eigen::Index;
constexpr double kWidth = 322.0, kHeight = 210.0;
constexpr std::size_t kBins = 16, kMostFeatures = 8;

struct Small {
  Quantity quantity;
  std::vector<Bin> before, after;
  double surprise = 0.0; // mean square of (mean / standard error) over bins, before
};

std::vector<Small> telling_features(const View &view) {
  std::vector<Small> list;
  const auto add = [&](const std::string &name) {
    Small s;
    s.quantity = quantity_of(name, view);
    s.before = bins_of(s.quantity.value, view.before, view.usable, kBins, view.inflation);
    s.after = bins_of(s.quantity.value, view.after, view.usable, kBins, view.inflation);
    for (const Bin &b : s.before) {
      const double z = b.half > 0.0 ? 1.96 * b.mean / b.half : 0.0;
      s.surprise += z * z / static_cast<double>(s.before.size());
    }
    list.push_back(s);
  };
  for (const Feature &feature : view.measured->features)
    add(feature.name);
  add(kTime);
  std::stable_sort(list.begin(), list.end(),
                   [](const Small &a, const Small &b) { return a.surprise > b.surprise; });
  if (list.size() > kMostFeatures)
    list.resize(kMostFeatures);
  return list;
}

void draw(Svg &svg, const Panel &p, const std::vector<Bin> &bins, const std::string &style) {
  Points line;
  for (const Bin &b : bins) {
    const double x = p.x.at(b.x);
    svg.line(x, p.y.at(b.mean - b.half), x, p.y.at(b.mean + b.half), ("bar " + style).c_str());
    line.emplace_back(x, p.y.at(b.mean));
  }
  svg.polyline(line, ("thin " + style).c_str());
  svg.dots(line, ("bead " + style).c_str());
}

std::string small_picture(const Small &s, const Range &y, bool both) {
  Svg svg(kWidth, kHeight, "mean residual over " + s.quantity.text);
  const Range data = range_of(s.quantity.value);
  const Panel p =
      draw_axes(svg, 0.0, 0.0, kWidth, kHeight, room_for_y(y, kHeight),
                {padded(data.low, data.high), y, s.quantity.text, "mean residual (sd)", true});
  open(svg, p);
  svg.line(0.0, p.y.at(0.0), p.width, p.y.at(0.0), "zero");
  draw(svg, p, s.before, "before");
  if (both)
    draw(svg, p, s.after, "after");
  close(svg);
  return svg.markup();
}

constexpr int kClasses = 36;
constexpr double kEnd = 4.5; // sd

std::vector<double> histogram(const Vector &residual, const Rows &rows) {
  std::vector<double> share(kClasses, 0.0);
  for (const std::size_t row : rows) {
    const double r = residual(static_cast<Index>(row));
    if (r < -kEnd || r >= kEnd)
      continue; // beyond the picture
    share[static_cast<std::size_t>((r + kEnd) / (2.0 * kEnd) * kClasses)] += 1.0;
  }
  const double width = 2.0 * kEnd / kClasses;
  for (double &s : share)
    s /= width * std::max<double>(1.0, static_cast<double>(rows.size()));
  return share;
}

Points steps(const Panel &p, const std::vector<double> &density) {
  Points line;
  const double width = 2.0 * kEnd / kClasses;
  for (std::size_t i = 0; i < density.size(); ++i) {
    const double x = -kEnd + width * static_cast<double>(i);
    line.emplace_back(p.x.at(x), p.y.at(density[i]));
    line.emplace_back(p.x.at(x + width), p.y.at(density[i]));
  }
  return line;
}

std::string histogram_picture(const View &view, bool both) {
  const std::vector<double> before = histogram(view.before, view.usable);
  const std::vector<double> after = histogram(view.after, view.usable);
  double top = 0.42;
  for (const double d : before)
    top = std::max(top, d);
  for (const double d : after)
    top = std::max(top, d);
  Svg svg(kWidth, kHeight, "histogram of the residual");
  const Range y{0.0, 1.05 * top};
  const Panel p = draw_axes(svg, 0.0, 0.0, kWidth, kHeight, room_for_y(y, kHeight),
                            {{-kEnd, kEnd}, y, "residual (sd)", "density", true});
  open(svg, p);
  Points normal;
  for (int i = 0; i <= 90; ++i) {
    const double r = -kEnd + kEnd * i / 45.0;
    normal.emplace_back(p.x.at(r), p.y.at(0.398942 * std::exp(-0.5 * r * r)));
  }
  svg.polyline(normal, "normal");
  svg.polyline(steps(p, before), "before");
  if (both)
    svg.polyline(steps(p, after), "after");
  close(svg);
  return svg.markup();
}

} // namespace

namespace {

// The range that shows what remains: what was there before may leave the picture.
Range common_range(const std::vector<Small> &list) {
  Range after{-0.15, 0.15}, before = after;
  for (const Small &s : list) {
    for (const Bin &b : s.after)
      after = {std::min(after.low, b.mean - b.half), std::max(after.high, b.mean + b.half)};
    for (const Bin &b : s.before)
      before = {std::min(before.low, b.mean - b.half), std::max(before.high, b.mean + b.half)};
  }
  const double most = 3.0 * std::max(-after.low, after.high);
  return padded(std::max(before.low, -most), std::min(before.high, most));
}

} // namespace

std::string channel_pictures(const View &view) {
  const bool both = view.before != view.after;
  const std::vector<Small> list = telling_features(view);
  const Range y = common_range(list);
  std::string drawings = "<div class=\"small\">" + histogram_picture(view, both);
  for (const Small &s : list)
    drawings += small_picture(s, y, both);
  std::vector<Key> keys = {{Mark::line, "before", both ? "before" : "as simulated"}};
  if (both)
    keys.push_back({Mark::line, "after", "after"});
  keys.push_back({Mark::line, "normal", "what the stated sd promises"});
  const std::size_t all = view.measured->features.size() + 1;
  std::string note;
  if (all > list.size())
    note = fmt::format("The {} of {} features along which the residual moved most. ", list.size(),
                       all);
  if (both)
    note += "The scale is that of what remains; what was there before may exceed the picture.";
  return figure(axis_text(view.channel->name, view.channel->unit), drawings + "</div>", keys, note);
}

} // namespace rim::diagnose::report
