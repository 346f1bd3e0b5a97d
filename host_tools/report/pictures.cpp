// SPDX-License-Identifier: MIT
#include "report/pictures.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "util/error.hpp"

namespace rim::diagnose::report {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kBins = 28, kDots = 900, kSteps = 100;
constexpr int kColours = 11; // c0 .. c10 of the style, c5 is nothing

Index at(std::size_t i) { return static_cast<Index>(i); }

Range span_of(const std::vector<Bin> &bins, bool is_rms, Range range) {
  for (const Bin &b : bins) {
    const double y = is_rms ? b.rms : b.mean, half = is_rms ? b.rms_half : b.half;
    if (!std::isfinite(y + half))
      continue;
    range.low = std::min(range.low, y - half);
    range.high = std::max(range.high, y + half);
  }
  return range;
}

void draw_bins(Svg &svg, const Panel &p, const std::vector<Bin> &bins, bool is_rms,
               const std::string &style) {
  Points line, dots;
  for (const Bin &b : bins) {
    const double y = is_rms ? b.rms : b.mean, half = is_rms ? b.rms_half : b.half;
    const double x = p.x.at(b.x);
    svg.line(x, p.y.at(y - half), x, p.y.at(y + half), ("bar " + style).c_str());
    line.emplace_back(x, p.y.at(y));
    dots.emplace_back(x, p.y.at(y));
  }
  svg.polyline(line, ("thin " + style).c_str());
  svg.dots(dots, ("bead " + style).c_str());
}

// The interval of feature k: in two parts where it runs through pi.
void shade_interval(Svg &svg, const Panel &p, const Gate &gate, std::size_t k) {
  const auto from_to = [&](double low, double high) {
    const double a = std::clamp(std::isfinite(low) ? p.x.at(low) : -1.0, -1.0, p.width + 1.0);
    const double b = std::clamp(std::isfinite(high) ? p.x.at(high) : p.width, -1.0, p.width + 1.0);
    svg.rectangle(a, -1.0, b - a, p.height + 2.0, "gate");
  };
  if (gate.lower[k] > gate.upper[k]) {
    from_to(p.x.data.low, gate.upper[k]);
    from_to(gate.lower[k], p.x.data.high);
  } else {
    from_to(gate.lower[k], gate.upper[k]);
  }
}

std::string without_text(const Share &s) { return s.alone ? "before" : "without this term"; }
std::string with_text(const Share &s) { return s.alone ? "after" : "with it"; }

} // namespace

std::string figure(const std::string &title, const std::string &svg, const std::vector<Key> &keys,
                   const std::string &note) {
  std::string text = "<figure>\n<figcaption><b>" + escape(title) + "</b>";
  if (!keys.empty())
    text += "<span class=\"keys\">";
  for (const Key &key : keys) {
    const std::string style = escape(key.style);
    const std::string mark =
        key.mark == Mark::line ? "<path d=\"M1 7h22\" class=\"" + style + "\"/>"
        : key.mark == Mark::dots
            ? "<path d=\"M5 7h0M12 5h0M19 8h0\" class=\"dots " + style + "\"/>"
            : "<rect x=\"1\" y=\"1\" width=\"22\" height=\"12\" class=\"" + style + "\"/>";
    text += "<span class=\"key\"><svg width=\"24\" height=\"14\" aria-hidden=\"true\">" + mark +
            "</svg>" + escape(key.text) + "</span>";
  }
  text += std::string(keys.empty() ? "" : "</span>") + "</figcaption>\n<div class=\"drawing\">" +
          svg + "</div>\n";
  if (!note.empty())
    text += "<p class=\"note\">" + escape(note) + "</p>\n";
  return text + "</figure>\n";
}

std::string profile_picture(const Finding &finding, const View &view, const std::string &feature,
                            double width) {
  const Gate &gate = finding.term.gate;
  const bool is_rms = finding.term.kind == TermKind::variance;
  const Quantity q = quantity_of(feature, view);
  const Share share = share_of(finding, view, effect_of(finding, view));
  const Rows rows = rows_in_bounds(gate, view, {feature});
  const std::vector<Bin> before = bins_of(q.value, share.without, rows, kBins, view.inflation);
  const std::vector<Bin> after = bins_of(q.value, share.with, rows, kBins, view.inflation);
  Range y = span_of(after, is_rms, span_of(before, is_rms, is_rms ? Range{0.0, 1.2} : Range{0, 0}));
  y = padded(std::min(y.low, is_rms ? 0.0 : -0.3), std::max(y.high, is_rms ? 1.2 : 0.3));
  const Range data = range_of(q.value);
  const Axes axes{padded(data.low, data.high), y, q.text,
                  is_rms ? "rms residual (sd)" : "mean residual (sd)", true};
  Svg svg(width, 300.0, "residual over " + q.text + " before and after");
  const Panel p = draw_axes(svg, 0.0, 0.0, width, 300.0, room_for_y(y, 300.0), axes);
  open(svg, p);
  for (std::size_t k = 0; k < gate.features.size(); ++k) {
    if (gate.features[k] == feature)
      shade_interval(svg, p, gate, k);
  }
  Points dots;
  for (const std::size_t row : thinned(rows, kDots)) {
    const double r = share.without(at(row));
    dots.emplace_back(p.x.at(q.value(at(row))), p.y.at(is_rms ? std::fabs(r) : r));
  }
  svg.dots(dots, "faint");
  svg.line(0.0, p.y.at(is_rms ? 1.0 : 0.0), p.width, p.y.at(is_rms ? 1.0 : 0.0), "zero");
  draw_bins(svg, p, before, is_rms, "before");
  draw_bins(svg, p, after, is_rms, "after");
  close(svg);
  std::vector<Key> keys = {{Mark::line, "before", without_text(share)},
                           {Mark::line, "after", with_text(share)},
                           {Mark::dots, "faint", is_rms ? "|residual| of a row" : "a row"}};
  if (std::find(gate.features.begin(), gate.features.end(), feature) != gate.features.end())
    keys.push_back({Mark::area, "gate", "the region"});
  std::string note = fmt::format("Bars: 95 % intervals of a bin. 1 sd is what the simulation "
                                 "states for its own error{}.",
                                 view.channel->sd_estimated ? " (here estimated)" : "");
  if (gate.features.size() > 1)
    note += " Only rows within the region's other bounds.";
  return figure("Where: residual over " + q.text, svg.markup(), keys, note);
}

namespace {

struct Cells {
  std::size_t columns = 0, rows = 0;
  std::vector<double> sum, squares, count;
};

Cells cells_of(const Panel &p, const Vector &x, const Vector &y, const Vector &value,
               const Rows &members) {
  // About 10 rows a cell where the rows fill the plane; tracks fill less of it.
  Cells c;
  const double wanted = std::clamp(static_cast<double>(members.size()) / 8.0, 60.0, 900.0);
  c.columns = static_cast<std::size_t>(std::sqrt(wanted * p.width / p.height));
  c.rows = static_cast<std::size_t>(std::sqrt(wanted * p.height / p.width));
  c.sum.assign(c.columns * c.rows, 0.0);
  c.squares = c.count = c.sum;
  for (const std::size_t row : members) {
    const double px = p.x.at(x(at(row))) / p.width, py = p.y.at(y(at(row))) / p.height;
    if (!(px >= 0.0 && px < 1.0 && py >= 0.0 && py < 1.0))
      continue;
    const auto i = static_cast<std::size_t>(px * static_cast<double>(c.columns));
    const auto j = static_cast<std::size_t>(py * static_cast<double>(c.rows));
    c.sum[j * c.columns + i] += value(at(row));
    c.squares[j * c.columns + i] += value(at(row)) * value(at(row));
    c.count[j * c.columns + i] += 1.0;
  }
  return c;
}

double cell_value(const Cells &c, std::size_t k, bool is_rms) {
  return is_rms ? std::sqrt(c.squares[k] / c.count[k]) - 1.0 : c.sum[k] / c.count[k];
}

// What the colours end at: the greatest but for a few cells.
double colour_limit(const Cells &c, bool is_rms) {
  std::vector<double> sizes;
  for (std::size_t k = 0; k < c.count.size(); ++k) {
    if (c.count[k] >= 3.0)
      sizes.push_back(std::fabs(cell_value(c, k, is_rms)));
  }
  if (sizes.empty())
    return 1.0;
  std::sort(sizes.begin(), sizes.end());
  const double high = sizes[sizes.size() * 95 / 100];
  return std::max(0.5, high);
}

// One path a colour and a crowd: cells of few rows are paler.
void draw_cells(Svg &svg, const Panel &p, const Cells &c, bool is_rms, double limit) {
  std::vector<std::vector<Svg::Box>> boxes(3 * kColours);
  const double w = p.width / static_cast<double>(c.columns);
  const double h = p.height / static_cast<double>(c.rows);
  for (std::size_t k = 0; k < c.count.size(); ++k) {
    if (c.count[k] < 0.5)
      continue;
    const double share = std::clamp(cell_value(c, k, is_rms) / limit, -1.0, 1.0);
    if (!std::isfinite(share))
      continue;
    const auto colour = static_cast<std::size_t>(std::lround((share + 1.0) * 5.0));
    const std::size_t crowd = c.count[k] < 2.5 ? 0 : (c.count[k] < 5.5 ? 1 : 2);
    boxes[crowd * kColours + colour].push_back({static_cast<double>(k % c.columns) * w,
                                                static_cast<double>(k / c.columns) * h, w - 0.6,
                                                h - 0.6});
  }
  for (std::size_t i = 0; i < boxes.size(); ++i)
    svg.boxes(boxes[i], fmt::format("c{} crowd{}", i % kColours, i / kColours), "");
}

void draw_outline(Svg &svg, const Panel &p, const Gate &gate, std::size_t i, std::size_t j) {
  Points points;
  const auto x_of = [&p](double v) { return std::isfinite(v) ? p.x.at(v) : p.x.at(p.x.data.low); };
  const auto y_of = [&p](double v) { return std::isfinite(v) ? p.y.at(v) : p.y.at(p.y.data.low); };
  if (!gate.is_ellipse && (gate.lower[i] > gate.upper[i] || gate.lower[j] > gate.upper[j])) {
    // A box through pi: each side its own rectangle, up to the edge.
    const auto parts = [&gate](std::size_t k, const Range &r) {
      std::vector<Range> list = {{gate.lower[k], gate.upper[k]}};
      if (gate.lower[k] > gate.upper[k])
        list = {{r.low, gate.upper[k]}, {gate.lower[k], r.high}};
      return list;
    };
    for (const Range &a : parts(i, p.x.data)) {
      for (const Range &b : parts(j, p.y.data))
        svg.polygon({{x_of(a.low), y_of(b.low)},
                     {x_of(a.high), y_of(b.low)},
                     {x_of(a.high), y_of(b.high)},
                     {x_of(a.low), y_of(b.high)}},
                    "outline");
    }
    return;
  }
  for (const auto &[x, y] : outline(gate, i, j))
    points.emplace_back(x_of(x), y_of(y));
  svg.polygon(points, "outline under");
  svg.polygon(points, "outline");
}

// The bar of colours with its ends named.
void draw_colours(Svg &svg, double x, double y, double limit, const std::string &title) {
  const double width = 16.0;
  for (int i = 0; i < kColours; ++i)
    svg.rectangle(x + width * i, y, width, 11.0, "c" + std::to_string(i));
  const double end = x + width * kColours;
  svg.text(x - 7.0, y + 10.0, "tick end", number_text(-limit, 2));
  svg.text(end + 7.0, y + 10.0, "tick", number_text(limit, 2));
  svg.text(end + 7.0 + 8.0 * static_cast<double>(letters(number_text(limit, 2))) + 12.0, y + 10.0,
           "label", title);
}

} // namespace

std::string map_picture(const Finding &finding, const View &view) {
  const Gate &gate = finding.term.gate;
  const auto [i, j] = best_projection(gate, view);
  const bool is_rms = finding.term.kind == TermKind::variance;
  const Quantity qx = quantity_of(gate.features[i], view), qy = quantity_of(gate.features[j], view);
  const Range rx = range_of(qx.value), ry = range_of(qy.value);
  const Rows rows = rows_in_bounds(gate, view, {qx.name, qy.name});
  const Share share = share_of(finding, view, effect_of(finding, view));
  const double height = 350.0;
  Svg svg(kWide, height + 34.0, "mean residual over " + qx.text + " and " + qy.text);
  const Axes axes{padded(rx.low, rx.high), padded(ry.low, ry.high), qx.text, qy.text, true};
  const double room = room_for_y(axes.y, height);
  double limit = 0.0;
  for (int side = 0; side < 2; ++side) {
    const Vector &residual = side == 0 ? share.without : share.with;
    svg.text(side * 510.0 + room, 13.0, "head", side == 0 ? without_text(share) : with_text(share));
    const Panel p = draw_axes(svg, side * 510.0, 16.0, kHalf, height - 16.0, room, axes);
    const Cells cells = cells_of(p, qx.value, qy.value, residual, rows);
    if (side == 0)
      limit = colour_limit(cells, is_rms);
    open(svg, p);
    draw_cells(svg, p, cells, is_rms, limit);
    draw_outline(svg, p, gate, i, j);
    close(svg);
  }
  draw_colours(svg, room + 36.0, height + 14.0, limit,
               is_rms ? "rms residual in a cell, less 1 (sd)" : "mean residual in a cell (sd)");
  std::string note = "Paler cells hold fewer than six rows.";
  if (gate.features.size() > 2)
    note += " Of the region's features these two keep out most rows; only rows within its other "
            "bounds are drawn, and the outline is the region's shadow.";
  return figure("Where: the region over the data", svg.markup(),
                {{Mark::line, "outline", gate.is_ellipse ? "the region" : "the region (a box)"}},
                note);
}

namespace {

// Of what the term is drawn as a function: its argument; of forms without expression (delay, lag),
// and of what swings faster than a picture of the whole time shows, what it adds, along which the
// data should follow the diagonal.
Quantity abscissa(const Finding &finding, const View &view, const Vector &effect) {
  const Term &term = finding.term;
  if (term.form == "table" && !term.arguments.empty())
    return quantity_of(term.arguments.begin()->second, view);
  if (remembers(term) || is_swing(term)) {
    const std::string unit = view.channel->unit.empty() ? "" : " (" + view.channel->unit + ")";
    return {"", "what the term adds" + unit, effect};
  }
  return quantity_of(telling_argument(finding, view, effect), view);
}

// The range that the argument was learnt from, where held-out rows lie beyond it; else none.
const Learnt *extrapolated(const Finding &finding, const Quantity &q) {
  for (const Learnt &range : finding.learnt) {
    if (range.feature == q.name && range.beyond > 0.0)
      return &range;
  }
  return nullptr;
}

// The term of one argument over a range, evaluated as for a new log; empty where it has others.
Points curve_over(const Term &term, double low, double high) {
  Measured table;
  table.features = {{base_feature(term.arguments.begin()->second), "", false, false}};
  table.x = Vector::LinSpaced(at(kSteps), low, high);
  table.t_s.assign(kSteps, 0.0);
  table.elapsed_s = table.t_s;
  Points points;
  try {
    const Vector effect = mean_effect(term, table, Vector::Zero(at(kSteps)));
    for (Index i = 0; i < effect.size(); ++i)
      points.emplace_back(table.x(i, 0), effect(i));
  } catch (const DataError &) { // bounds of other features
  }
  return points;
}

// Shades what lies beyond the rows that a law was learnt from, as far as the held-out rows go, and
// draws how the law goes on there.
void draw_beyond(Svg &svg, const Panel &p, const Finding &finding, const Learnt &range) {
  const auto mentions_more = [](const std::string &basis) {
    return basis.find_first_of("mt") != std::string::npos; // at worst a curve that is not drawn
  };
  const bool is_one =
      finding.term.arguments.size() == 1 &&
      std::none_of(finding.term.basis.begin(), finding.term.basis.end(), mentions_more);
  for (const auto &[from, to] :
       {std::make_pair(range.least, range.low), std::make_pair(range.high, range.most)}) {
    if (!(to > from))
      continue;
    svg.rectangle(p.x.at(from), -1.0, p.x.at(to) - p.x.at(from), p.height + 2.0, "gate",
                  "beyond the rows that it was learnt from");
    Points line;
    for (const auto &[x, y] : is_one ? curve_over(finding.term, from, to) : Points{})
      line.emplace_back(p.x.at(x), p.y.at(y));
    svg.polyline(line, "fit dashed");
  }
}

// Up to half as much again on either side for the rows about the curve: what scatters more is cut.
Range with_rows(Range y, const Vector &share, const std::vector<std::size_t> &rows) {
  std::vector<double> values;
  for (const std::size_t row : rows)
    if (std::isfinite(share(at(row))))
      values.push_back(share(at(row)));
  if (values.empty())
    return y;
  std::sort(values.begin(), values.end());
  const std::size_t skip = values.size() / 50;
  const double low = values[skip], high = values[values.size() - 1 - skip];
  const double room = 0.5 * (y.high - y.low);
  return {std::min(y.low, std::max(low, y.low - room)),
          std::max(y.high, std::min(high, y.high + room))};
}

} // namespace

std::string argument_picture(const Finding &finding, const View &view, double width) {
  const Vector effect = effect_of(finding, view);
  const Quantity q = abscissa(finding, view, effect);
  const bool is_one = finding.term.arguments.size() <= 1;
  // What is left for this term when the others have theirs.
  const Vector share = view.channel->z - view.m_after + effect;
  const Rows rows = rows_in_bounds(finding.term.gate, view, {});
  const std::vector<Bin> bins = bins_of(q.value, share, rows, kBins, view.inflation);
  // Of several arguments the means in the data's own bins: they average over the others alike.
  const std::vector<Bin> curve =
      is_one ? steps_of(q.value, effect, rows, kSteps) : bins_of(q.value, effect, rows, kBins, 1.0);
  Range y = span_of(bins, false, {0.0, 0.0});
  for (const Bin &b : curve)
    y = {std::min(y.low, b.mean), std::max(y.high, b.mean)};
  y = with_rows(y, share, thinned(rows, kDots));
  y = padded(y.low, y.high);
  Range data = range_of(q.value);
  const Learnt *beyond = extrapolated(finding, q);
  if (beyond != nullptr)
    data = {std::min(data.low, beyond->least), std::max(data.high, beyond->most)};
  const std::string unit = view.channel->unit.empty() ? "" : " (" + view.channel->unit + ")";
  const Axes axes{padded(data.low, data.high), y, q.text, "measured less simulated" + unit, true};
  Svg svg(width, 300.0, "residual over " + q.text + " with the fitted curve");
  const Panel p = draw_axes(svg, 0.0, 0.0, width, 300.0, room_for_y(y, 300.0), axes);
  open(svg, p);
  if (beyond != nullptr)
    draw_beyond(svg, p, finding, *beyond);
  Points dots, line;
  for (const std::size_t row : thinned(rows, kDots))
    dots.emplace_back(p.x.at(q.value(at(row))), p.y.at(share(at(row))));
  svg.dots(dots, "faint");
  svg.line(0.0, p.y.at(0.0), p.width, p.y.at(0.0), "zero");
  const Vector raw = view.channel->z - view.channel->m;
  const bool has_others = (raw - share).cwiseAbs().maxCoeff() > 0.0;
  Points raw_line;
  for (const Bin &b : bins_of(q.value, raw, rows, kBins, view.inflation))
    raw_line.emplace_back(p.x.at(b.x), p.y.at(b.mean));
  if (has_others)
    svg.polyline(raw_line, "normal");
  draw_bins(svg, p, bins, false, "before");
  for (const Bin &b : curve)
    line.emplace_back(p.x.at(b.x), p.y.at(b.mean));
  svg.polyline(line, "fit");
  close(svg);
  std::string note = "The binned residual, less what other findings explain, with 95 % intervals; "
                     "the curve is the term as fitted";
  note += is_one ? "." : ", its mean in the same bins.";
  if (!finding.term.gate.everywhere())
    note += " Rows inside the region.";
  std::vector<Key> keys{{Mark::line, "before", "measured less simulated"},
                        {Mark::line, "fit", "the fitted term"},
                        {Mark::dots, "faint", "a row"}};
  if (has_others) {
    keys[0].text += ", less the other findings";
    keys.push_back({Mark::line, "normal", "measured less simulated, raw"});
  }
  if (beyond != nullptr)
    keys.push_back({Mark::area, "gate", "only in held-out rows: the law is extrapolated"});
  return figure("Why: residual over " + q.text, svg.markup(), keys, note);
}

} // namespace rim::diagnose::report
