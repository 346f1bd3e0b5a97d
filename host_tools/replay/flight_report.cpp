// SPDX-License-Identifier: MIT
#include "replay/flight_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "bus/sentence.hpp"
#include "predict/predictor.hpp"
#include "report/explore.hpp"
#include "report/parts.hpp"
#include "report/pictures.hpp"
#include "report/svg.hpp"
#include "util/error.hpp"
#include "util/version.hpp"

namespace rim {

namespace {

using namespace rim::diagnose::report;
using Index = Eigen::Index;
constexpr double kLevels = 210.0, kScore = 150.0;
constexpr std::size_t kDrawn = 1500; // points of a line on 1000 px
constexpr std::size_t kMostChannels = 16, kMostFeatures = 12;

std::string file_name(const std::string &path) {
  return std::filesystem::path(path).filename().string();
}

std::string fact(const std::string &name, const std::string &value) {
  return "<div><dt>" + escape(name) + "</dt><dd>" + escape(value) + "</dd></div>\n";
}

std::vector<double> column(const Log &log, const std::string &name) {
  const int c = find_column(log, name);
  std::vector<double> values;
  for (Index r = 0; c >= 0 && r < log.values.rows(); ++r)
    values.push_back(log.values(r, c));
  return values;
}

// One outcome: what was measured, what was expected, and how far healthy readings scatter.
struct Course {
  std::string name; // without role
  std::vector<double> z, m, sd;
};

Course course_of(const Log &rows, const std::string &outcome) {
  Course c{outcome.substr(outcome.find('.') + 1), {}, {}, {}};
  c.z = column(rows, "z." + c.name);
  c.m = column(rows, "m." + c.name);
  c.sd = column(rows, "sd." + c.name);
  return c;
}

Range range_of(const std::vector<const std::vector<double> *> &columns) {
  double low = INFINITY, high = -INFINITY;
  for (const auto *values : columns) {
    for (const double v : *values) {
      if (std::isfinite(v)) {
        low = std::min(low, v);
        high = std::max(high, v);
      }
    }
  }
  return low <= high ? padded(low, high) : Range{};
}

std::size_t step_for(std::size_t rows) { return std::max<std::size_t>(1, rows / kDrawn); }

Points line_of(const Panel &p, const std::vector<double> &t_s, const std::vector<double> &values) {
  Points points;
  for (std::size_t i = 0; i < std::min(t_s.size(), values.size()); i += step_for(t_s.size()))
    points.emplace_back(p.x.at(t_s[i]), p.y.at(values[i]));
  return points;
}

void draw_band(Svg &svg, const Panel &p, const std::vector<double> &t_s, const Course &c) {
  Points outline;
  const std::size_t n = std::min({t_s.size(), c.m.size(), c.sd.size()}), step = step_for(n);
  for (std::size_t i = 0; i < n; i += step)
    outline.emplace_back(p.x.at(t_s[i]), p.y.at(c.m[i] + 2.0 * c.sd[i]));
  for (std::size_t i = outline.size(); i-- > 0;)
    outline.emplace_back(p.x.at(t_s[i * step]), p.y.at(c.m[i * step] - 2.0 * c.sd[i * step]));
  svg.polygon(outline, "band");
}

// Of each row of the predictions the finding whose deviation was in it, from 1; 0: none.
std::vector<std::uint32_t> findings_of(const Log &rows, const ReplayedLog &result) {
  std::vector<std::uint32_t> numbers;
  for (const std::uint32_t row : rows.row)
    numbers.push_back(
        row >= 1 && row <= result.labels.finding.size() ? result.labels.finding[row - 1] : 0);
  return numbers;
}

std::vector<std::uint8_t> marked(const Log &rows, const ReplayedLog &result) {
  std::vector<std::uint8_t> marks;
  for (const std::uint32_t number : findings_of(rows, result))
    marks.push_back(number != 0);
  return marks;
}

void shade(Svg &svg, const Panel &p, const Log &rows, const std::vector<std::uint8_t> &marks) {
  std::vector<Svg::Box> boxes;
  for (std::size_t i = 0; i < marks.size();) {
    std::size_t end = i + 1;
    while (end < marks.size() && marks[end] == marks[i])
      ++end;
    const double a = p.x.at(rows.t_s[i]), b = p.x.at(rows.t_s[std::min(end, marks.size() - 1)]);
    if (marks[i] != 0)
      boxes.push_back({a, -1.0, std::max(1.5, b - a), p.height + 2.0});
    i = end;
  }
  svg.boxes(boxes, "acts", "the deviation");
}

std::string since_text(const rim_alarm &a) {
  return a.since_sd_s > 0.0
             ? fmt::format("{:.2f} \u00b1 {} s", a.since_s, number_text(a.since_sd_s, 2))
             : fmt::format("{:.2f} s", a.since_s);
}

std::string shift_text(const rim_alarm &a, const Names &names) {
  std::string unit = a.channels > 0 ? names.outcome(a.channel[0]).unit : "";
  if (a.kind == RIM_KIND_GAIN || a.kind == RIM_KIND_REPEAT)
    return value_text(100.0 * a.shift[0], 100.0 * a.shift_sd[0], "%");
  if (a.kind == RIM_KIND_VARIANCE)
    unit.clear();
  return value_text(a.shift[0], a.shift_sd[0], unit);
}

// Mean of (z - m) / sd over the rows that are marked, and over the others.
struct Means {
  double in = 0.0, out = 0.0;
};
Means means_of(const Course &c, const std::vector<std::uint8_t> &marks) {
  Means mean;
  double in = 0.0, out = 0.0;
  for (std::size_t i = 0; i < std::min({marks.size(), c.z.size(), c.m.size(), c.sd.size()}); ++i) {
    const double residual = (c.z[i] - c.m[i]) / c.sd[i];
    (marks[i] != 0 ? mean.in : mean.out) += residual;
    (marks[i] != 0 ? in : out) += 1.0;
  }
  mean.in = in > 0.0 ? mean.in / in : NAN;
  mean.out = out > 0.0 ? mean.out / out : NAN;
  return mean;
}

std::string others_table(const Log &rows, const std::vector<std::uint8_t> &marks,
                         const Names &names, std::size_t named) {
  std::string text =
      "<h3>What the others say</h3>\n<div class=\"scroll\"><table class=\"channels\">"
      "<thead><tr><th>outcome</th><th class=\"number\">mean residual in the "
      "deviation, sd</th><th class=\"number\">elsewhere, sd</th></tr></thead>"
      "<tbody>\n";
  for (std::size_t o = 0; o < names.outcomes.size(); ++o) {
    const Course c = course_of(rows, names.outcomes[o].name);
    if (c.sd.empty())
      continue;
    const Means mean = means_of(c, marks);
    text += fmt::format("<tr><th scope=\"row\">{}{}</th><td class=\"number\">{}</td>"
                        "<td class=\"number\">{}</td></tr>\n",
                        escape(names.outcomes[o].words), o == named ? " (named)" : "",
                        escape(number_text(mean.in, 3)), escape(number_text(mean.out, 3)));
  }
  return text + "</tbody></table></div>\n<p class=\"note\">Healthy runs have offsets of their own: "
                "compare the two columns. They say how the outcomes follow what is "
                "expected of them.</p>\n";
}

void draw_score(Svg &svg, const Range &time, double room, const std::vector<double> &t_s,
                const std::vector<double> &score, double alarm_score) {
  const std::vector<double> limit{alarm_score, 0.0};
  const Panel p = draw_axes(svg, 0.0, kLevels, kWide, kScore, room,
                            {time, range_of({&score, &limit}), "time (s)", "score", true});
  open(svg, p);
  svg.line(0.0, p.y.at(alarm_score), p.width, p.y.at(alarm_score), "warn");
  svg.polyline(line_of(p, t_s, score), "measured");
  close(svg);
}

// The outcome above, the score below.
std::string course_picture(const Log &rows, const Course &c, const rim::Quantity &q,
                           const ReplayedLog &result, const rim_alarm &alarm, double raised_s,
                           const std::vector<double> &t_s, const std::vector<double> &score) {
  const Range time = padded(rows.t_s.front(), rows.t_s.back());
  const Range levels = range_of({&c.z, &c.m});
  const double room = std::max(room_for_y(levels, kLevels), 70.0);
  Svg svg(kWide, kLevels + kScore, "measured and expected " + q.words + ", and the score");
  const Panel p = draw_axes(svg, 0.0, 0.0, kWide, kLevels, room,
                            {time, levels, "", axis_text(q.name, q.unit), false});
  open(svg, p);
  shade(svg, p, rows, marked(rows, result));
  draw_band(svg, p, rows.t_s, c);
  svg.polyline(line_of(p, rows.t_s, c.m), "after");
  svg.polyline(line_of(p, rows.t_s, c.z), "measured");
  const double onset = p.x.at(alarm.since_s), told = p.x.at(raised_s);
  svg.line(onset, 0.0, onset, p.height, "outline");
  svg.line(told, 0.0, told, p.height, "warn");
  close(svg);
  draw_score(svg, time, room, t_s, score, result.alarm_score);
  return figure("Measured against expected: " + q.words, svg.markup(),
                {{Mark::line, "measured", "measured; below, the score"},
                 {Mark::line, "after", "expected"},
                 {Mark::area, "band", "\u00b12 sd"},
                 {Mark::area, "acts strip", "where the deviation was"},
                 {Mark::line, "warn", "the alarm; below, its threshold"}},
                "Dashed: the estimated onset. Expected is what the commands, or the log's own "
                "predictions, let the outcome be.");
}

} // namespace

FlightReport::FlightReport(std::string model, std::string made_by, std::size_t outcomes)
    : model_(std::move(model)), made_by_(std::move(made_by)), outcomes_(outcomes) {}

void FlightReport::begin(const Log &log) {
  flights_.emplace_back();
  blocks_ = 0;
  Flight &flight = flights_.back();
  try {
    flight.rows = model_.empty() || !role_columns(log, Role::outcome).empty()
                      ? log
                      : world::make_image_predictor(model_)->predict(log);
  } catch (const DataError &e) { // another rate, for one: the text says what the monitor says
    flight.why_not_drawn = e.what();
  }
}

void FlightReport::verdict(const rim_verdict &v, const double *residuals, std::size_t channels) {
  if (v.blocks == blocks_)
    return;
  blocks_ = v.blocks;
  Flight &flight = flights_.back();
  flight.t_s.push_back(v.t_s);
  flight.score.push_back(v.score);
  flight.channel.push_back(v.channel);
  flight.residual.emplace_back();
  if (residuals != nullptr)
    flight.residual.back().assign(residuals, residuals + channels);
}

void FlightReport::record(const rim_alarm &record) {
  if (record.state != RIM_ALARM_NONE)
    flights_.back().records.emplace_back(record, flights_.back().t_s.size());
}

void FlightReport::end(const ReplayedLog &result, const Names &names) {
  Flight &flight = flights_.back();
  names_ = names;
  flight.result = result;
  flight.text = replay_text(result, names);
  for (const auto &[r, block] : flight.records) {
    if (r.state == RIM_ALARM_RAISED)
      flight.alarms.push_back({r, r, block, ""});
    for (auto a = flight.alarms.rbegin(); a != flight.alarms.rend(); ++a) {
      if (a->raised.detector != r.detector)
        continue;
      if (r.state != RIM_ALARM_CLEARED) {
        a->last = r;
        a->block = block;
      }
      break;
    }
  }
  for (Alarm &a : flight.alarms)
    a.sentence = alarm_sentence(a.last, names);
}

// What the commands say of an outcome is drawn above; the alarm may come from another look at it.
std::string FlightReport::judged_picture(const Flight &flight, const Alarm &alarm,
                                         const Names &names) const {
  static constexpr std::array<const char *, RIM_MONITOR_KINDS + 1> kLooks = {
      "", "less what the other outcomes say of it", "logarithm of its scatter",
      "share of readings that repeat or are 0", "less what it should be after the block before"};
  if (alarm.block >= flight.channel.size() || outcomes_ == 0)
    return "";
  // The largest score may be another outcome's that disagrees with the one named.
  const std::size_t look = flight.channel[alarm.block] / outcomes_;
  if (look == 0 || look >= kLooks.size() || alarm.last.channel[0] >= outcomes_)
    return "";
  const std::size_t channel = look * outcomes_ + alarm.last.channel[0];
  std::vector<double> t_s, residual;
  for (std::size_t i = 0; i < flight.residual.size(); ++i) {
    if (channel < flight.residual[i].size()) {
      t_s.push_back(flight.t_s[i]);
      residual.push_back(static_cast<double>(flight.residual[i][channel]));
    }
  }
  if (t_s.size() < 2)
    return "";
  const rim::Quantity q = names.outcome(alarm.last.channel[0]);
  const std::string of_residual = look == RIM_CHANNEL_REPEAT ? "share"
                                  : look == RIM_CHANNEL_AGREEMENT && !q.unit.empty()
                                      ? "residual (" + q.unit + ")"
                                      : "residual";
  const Range time = padded(flight.rows.t_s.front(), flight.rows.t_s.back());
  const Range levels = range_of({&residual});
  Svg svg(kWide, kLevels, q.words + " as the alarm judged it");
  const Panel p =
      draw_axes(svg, 0.0, 0.0, kWide, kLevels, std::max(room_for_y(levels, kLevels), 70.0),
                {time, levels, "time (s)", of_residual, true});
  open(svg, p);
  shade(svg, p, flight.rows, marked(flight.rows, flight.result));
  if (levels.low < 0.0 && levels.high > 0.0)
    svg.line(0.0, p.y.at(0.0), p.width, p.y.at(0.0), "zero");
  svg.polyline(line_of(p, t_s, residual), "after");
  const double onset = p.x.at(alarm.last.since_s), told = p.x.at(alarm.raised.t_s);
  svg.line(onset, 0.0, onset, p.height, "outline");
  svg.line(told, 0.0, told, p.height, "warn");
  close(svg);
  return figure("As the alarm judged it: " + q.words + ", " + kLooks[look], svg.markup(),
                {{Mark::line, "after", "a block's residual"},
                 {Mark::area, "acts strip", "where the deviation was"},
                 {Mark::line, "warn", "the alarm"}},
                "A healthy run has an offset of its own here too: what counts is how the marked "
                "blocks differ from it. Dashed: the estimated onset.");
}

std::string FlightReport::alarm_card(const Flight &flight, std::size_t number,
                                     const Names &names) const {
  const Alarm &alarm = flight.alarms[number];
  const rim_alarm &a = alarm.last;
  std::string text = fmt::format("<h3>Alarm {} at t = {:.2f} s</h3>\n<p class=\"lead\">{}</p>\n",
                                 number + 1, alarm.raised.t_s, escape(alarm.sentence));
  text += "<dl class=\"facts\">\n" + fact("kind", kind_text(a.kind));
  if (a.channels > 0)
    text += fact("how much", shift_text(a, names));
  const std::string where = region_words(a.region, names);
  text += fact("where", where.empty() ? "everywhere" : where) + fact("since", since_text(a)) +
          fact("observations", count_text(a.observations)) +
          fact("ln anom",
               number_text(a.ln_anom, 4) + " (alarm at " + number_text(a.threshold, 3) + ")") +
          fact("p, whole run", number_text(a.p_value, 2)) + "</dl>\n";
  if (a.channels == 0 || a.detector == RIM_DETECTOR_INTERFERENCE || flight.rows.t_s.size() < 2)
    return text;
  const rim::Quantity q = names.outcome(a.channel[0]);
  const Course c = course_of(flight.rows, q.name);
  if (c.m.empty())
    return text;
  return text +
         course_picture(flight.rows, c, q, flight.result, a, alarm.raised.t_s, flight.t_s,
                        flight.score) +
         judged_picture(flight, alarm, names) +
         others_table(flight.rows, marked(flight.rows, flight.result), names, a.channel[0]);
}

std::string FlightReport::card(const Flight &flight) const {
  const std::size_t number = static_cast<std::size_t>(&flight - flights_.data());
  std::string text = fmt::format(
      "<section class=\"finding f{}\" id=\"log-{}\">\n<h2>{}</h2>\n<pre>{}</pre>\n", number % 7,
      number + 1, escape(file_name(flight.result.path)), escape(flight.text));
  if (!flight.why_not_drawn.empty())
    text += "<p class=\"note\">Not drawn: " + escape(flight.why_not_drawn) + "</p>\n";
  for (std::size_t i = 0; i < flight.alarms.size(); ++i)
    text += alarm_card(flight, i, names_);
  return text + "</section>\n";
}

namespace {

void append(std::vector<double> *to, const std::vector<double> &from) {
  to->insert(to->end(), from.begin(), from.end());
}

// The features of the first log that was drawn; further logs have the same.
void append_features(const Log &rows, bool is_first, report::Explore *data) {
  std::size_t k = 0;
  for (const int index : feature_columns(rows)) {
    const Column &feature = rows.columns[static_cast<std::size_t>(index)];
    if (k == kMostFeatures)
      return;
    if (is_first)
      data->features.push_back({feature_text(feature.name), feature.unit, feature.name, {}});
    if (k < data->features.size())
      append(&data->features[k++].values, column(rows, feature.name));
  }
}

// On board a region with a shape that leans is an ellipse, any other is described by its box. Of
// what is watched, the prediction describes a region.
report::ExploreRegion explore_region(const rim_region &region, const Names &names,
                                     const std::vector<report::ExploreChannel> &channels) {
  const auto key_of = [&](const std::string &name) {
    const std::string bare = name.substr(name.find('.') + 1);
    const bool watched = std::any_of(channels.begin(), channels.end(),
                                     [&](const auto &channel) { return channel.key == bare; });
    return watched && name.rfind("s.", 0) == 0 ? "m." + bare : name;
  };
  report::ExploreRegion out;
  const std::size_t dims = std::min<std::size_t>(region.dims, RIM_REGION_MAX_DIMS);
  for (std::size_t d = 0; d < dims; ++d) {
    out.features.push_back(key_of(names.feature(region.feature[d]).name));
    out.lower.push_back(region.lower[d]);
    out.upper.push_back(region.upper[d]);
    out.center.push_back(region.center[d]);
    out.open.emplace_back(false, false);
    for (std::size_t e = 0; e < dims; ++e) {
      out.inverse_shape.push_back(region.inverse_shape[d * dims + e]);
      out.is_ellipse = out.is_ellipse || (d != e && out.inverse_shape.back() != 0.0);
    }
  }
  return out;
}

std::string counted(std::size_t alarms) {
  return fmt::format("{} {}", alarms, alarms == 1 ? "alarm" : "alarms");
}

} // namespace

// The alarms of a log, in the order in which its rows count them (ReplayedLog::labels).
void FlightReport::add_findings(const Flight &flight, int log, report::Explore *data) const {
  unsigned bit = 0;
  for (const Alarm &alarm : flight.alarms) {
    const rim_alarm &a = alarm.last;
    if (a.detector == RIM_DETECTOR_INTERFERENCE || bit > 15)
      continue;
    report::ExploreFinding finding;
    finding.number = static_cast<int>(bit) + 1;
    const std::string what = a.channels > 0 ? names_.outcome(a.channel[0]).words : "";
    finding.text = fmt::format("{} at {:.1f} s: {} {}", file_name(flight.result.path),
                               alarm.raised.t_s, kind_text(a.kind), what);
    finding.log = log;
    finding.bit = bit++;
    finding.channel = a.channels > 0 && a.channel[0] < data->channels.size() ? a.channel[0] : -1;
    finding.region = explore_region(a.region, names_, data->channels);
    data->findings.push_back(std::move(finding));
  }
}

// What can be touched.
report::Explore FlightReport::explore() const {
  report::Explore data;
  data.is_replay = true;
  for (std::size_t o = 0; o < std::min(kMostChannels, names_.outcomes.size()); ++o)
    data.channels.push_back({names_.outcomes[o].words,
                             names_.outcomes[o].unit,
                             names_.outcomes[o].name.substr(names_.outcomes[o].name.find('.') + 1),
                             {},
                             {},
                             {},
                             {}});
  for (const Flight &f : flights_) {
    if (f.rows.t_s.empty())
      continue;
    if (data.findings.empty() && !f.alarms.empty()) { // opens with the first alarm
      data.first_log = data.logs.size();
      const rim_alarm &a = f.alarms.front().last;
      data.first_channel = a.channels > 0 && a.channel[0] < data.channels.size() ? a.channel[0] : 0;
    }
    add_findings(f, static_cast<int>(data.logs.size()), &data);
    data.logs.push_back({file_name(f.result.path), data.time.size(), f.rows.t_s.size()});
    append(&data.time, f.rows.t_s);
    for (const std::uint32_t number : findings_of(f.rows, f.result))
      data.acts.push_back(number == 0
                              ? std::uint16_t{0}
                              : static_cast<std::uint16_t>(1u << std::min(15u, number - 1)));
    for (std::size_t o = 0; o < data.channels.size(); ++o) {
      Course c = course_of(f.rows, names_.outcomes[o].name);
      c.sd.resize(f.rows.t_s.size(), 0.0); // where the log has none
      append(&data.channels[o].z, c.z);
      append(&data.channels[o].m, c.m);
      append(&data.channels[o].sd, c.sd);
    }
    append_features(f.rows, data.logs.size() == 1, &data);
  }
  return data;
}

std::string FlightReport::html() const {
  std::size_t alarms = 0;
  std::string contents, cards;
  for (const Flight &f : flights_) {
    alarms += f.alarms.size();
    const std::size_t from = f.result.path.size() + 2; // "PATH: what the first line says"
    contents += fmt::format("<li><a href=\"#log-{}\">{}</a>: {}</li>\n", &f - flights_.data() + 1,
                            escape(file_name(f.result.path)),
                            escape(f.alarms.empty() ? f.text.substr(from, f.text.find('\n') - from)
                                                    : f.alarms.back().sentence));
    cards += card(f);
  }
  const report::ExploreParts parts = report::explore_parts(explore());
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n"
         "<link rel=\"icon\" href=\"data:,\">\n<title>rim replay: " +
         counted(alarms) + "</title>\n<style>\n" + style_sheet() +
         "</style>\n</head>\n<body>\n<main>\n<header>\n<p class=\"top\"><span>rim replay</span>" +
         (alarms == 0 ? "<span class=\"verdict fine\">\u2713 no alarm</span>"
                      : "<span class=\"verdict bad\">\u2717 " + counted(alarms) + "</span>") +
         "</p>\n<ol class=\"contents\">\n" + contents + "</ol>\n" +
         report::jump_list({{"again", "How to make this again"}}) + "</header>\n" + parts.section +
         cards + "<section id=\"again\">\n<h2>How to make this again</h2>\n<pre>" +
         escape(made_by_) +
         "</pre>\n</section>\n<footer>rimwatch " RIM_VERSION "</footer>\n</main>\n" +
         parts.scripts + "</body>\n</html>\n";
}

} // namespace rim
