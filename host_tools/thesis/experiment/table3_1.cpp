// SPDX-License-Identifier: MIT
#include "thesis/experiment/table3_1.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>

#include "batch/faro.h"
#include "search/cem.h"
#include "thesis/experiment/alarm_score.hpp"
#include "thesis/experiment/cobot_watch.hpp"
#include "thesis/experiment/plan_figure.hpp"
#include "thesis/experiment/precision_recall.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"
#include "util/table.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "table3.1";
constexpr std::size_t kDims = 7;
constexpr double kFalseAlarms = 0.05;
constexpr std::size_t kThesisNominal = 7; // drives: 20 minutes
constexpr std::size_t kThesisDims = 6, kThesisOutcomes = 3;
constexpr double kThesisThreshold = 2.0; // times the largest of them

struct Failure {
  CobotCase which;
  double thesis_points, thesis_precision, thesis_recall;
};
constexpr Failure kFailures[] = {
    {CobotCase::encoder, 58.0, 1.0, 0.92},
    {CobotCase::collision, 4.5, 1.0, 0.85},
    {CobotCase::corridor, 60.0, 0.97, 0.90},
    {CobotCase::left_turn, 31.0, 0.80, 0.47},
};
constexpr std::size_t kKinds = sizeof kFailures / sizeof kFailures[0];

// The thesis's own: ln anom of its best candidate after every point, and that candidate.
struct Faro {
  const CobotDrive &drive;
  const std::vector<double> &r;
  std::size_t n = 0;

  const double *x(std::size_t i) const { return &drive.u[i * kDims + 1]; } // all but time
};

double faro_value(const rim_ellipsoid *ellipsoid, void *context) {
  const auto &f = *static_cast<const Faro *>(context);
  double sum[kThesisOutcomes] = {0.0, 0.0, 0.0}, n = 0.0;
  for (std::size_t i = 0; i < f.n; ++i) {
    if (!rimi_ellipsoid_contains(ellipsoid, f.x(i)))
      continue;
    n += 1.0;
    for (std::size_t o = 0; o < kThesisOutcomes; ++o)
      sum[o] += f.r[i * kThesisOutcomes + o];
  }
  double square = 0.0;
  for (const double s : sum)
    square += s * s;
  return n > 0.0 ? square / (2.0 * n) : 0.0;
}

std::vector<double> faro_scores(const CobotDrive &drive, const std::vector<double> &r,
                                std::uint64_t seed, std::vector<bool> &inside) {
  rim_faro_config config{};
  config.dims = kThesisDims;
  config.candidates = 3;
  config.seed = seed;
  config.radius = 0.2;
  config.cem.samples = 16;
  config.cem.elites = 4;
  config.cem.iterations = 2;
  config.cem.most_axis = 2.0;
  rim_faro faro;
  if (rimi_faro_init(&faro, &config) != RIM_OK)
    throw std::logic_error("table3.1: FARO refused its configuration");
  Faro context{drive, r};
  std::vector<double> out;
  for (context.n = 1; context.n <= drive.size(); ++context.n) {
    bool found = false;
    if (rimi_faro_step(&faro, context.x(context.n - 1), faro_value, &context, 0.0, &found) !=
        RIM_OK)
      throw std::logic_error("table3.1: FARO refused a point");
    out.push_back(faro.value[0]);
  }
  for (std::size_t i = 0; i < drive.size(); ++i)
    inside.push_back(rimi_ellipsoid_contains(&faro.candidate[0], context.x(i)));
  return out;
}

struct Nominal {
  std::vector<CobotDrive> drives;
  CobotScatter scatter;
  std::array<double, 3> sd;
  explicit Nominal(std::uint64_t seed)
      : drives(nominal_drives(seed)), scatter(drives), sd(thesis_deviations(drives)) {}
};

std::size_t nominal_units(const Table31 &e) { return e.calibration + e.nominal; }

nlohmann::json nominal_json(const Table31 &e, const Nominal &nominal, std::size_t unit) {
  const std::uint64_t seed = e.seed + kCobotNominal + unit;
  const CobotDrive drive = drive_cobot(CobotCase::nominal, kDims, kCobotDrive_s, seed);
  const std::vector<double> score = watch_cobot(drive, nominal.scatter, seed);
  nlohmann::json out = {{"largest", *std::max_element(score.begin(), score.end())}};
  if (e.thesis && unit < kThesisNominal) {
    std::vector<bool> inside;
    const std::vector<double> faro =
        faro_scores(drive, thesis_residuals(drive, nominal.sd), seed, inside);
    out["thesis"] = *std::max_element(faro.begin(), faro.end());
  }
  return out;
}

nlohmann::json failure_json(const Table31 &e, const Nominal &nominal, std::size_t unit) {
  const Failure &failure = kFailures[unit / e.runs];
  const std::uint64_t seed = e.seed + kCobotNominal + nominal_units(e) + unit % e.runs;
  const CobotDrive drive = drive_cobot(failure.which, kDims, kCobotDrive_s, seed);
  const CobotRegion region = explain_cobot(drive, nominal.scatter, seed);
  const PrecisionRecall pr = compare_points(region.inside, drive.anomalous);
  nlohmann::json out = {
      {"records", score_records(watch_cobot(drive, nominal.scatter, seed), drive.anomalous)},
      {"anomalous", drive.anomalies()},
      {"ln_anom", region.ln_anom},
      {"precision", pr.precision},
      {"recall", pr.recall}};
  if (e.thesis) {
    std::vector<bool> inside;
    const std::vector<double> faro =
        faro_scores(drive, thesis_residuals(drive, nominal.sd), seed, inside);
    const PrecisionRecall own = compare_points(inside, drive.anomalous);
    out["thesis"] = {{"records", score_records(faro, drive.anomalous)},
                     {"precision", own.precision},
                     {"recall", own.recall}};
  }
  return out;
}

Table31 experiment_of(const Campaign &campaign) {
  require_whole(campaign, kKind);
  Table31 e;
  e.runs = campaign.config.at("runs");
  e.nominal = campaign.config.at("nominal");
  e.calibration = campaign.config.at("calibration");
  e.thesis = campaign.config.at("thesis");
  e.seed = campaign.config.at("seed");
  return e;
}

// Over the drives of one failure.
struct Outcome {
  std::vector<double> points, precision, recall;
  std::size_t missed = 0, too_early = 0;

  void add(const nlohmann::json &records, std::size_t anomalous, double threshold) {
    const PointsToAlarm alarm = points_to_alarm(records, threshold);
    missed += alarm.found ? 0 : 1;
    if (alarm.found && alarm.points == 0.0)
      ++too_early;
    else
      points.push_back(alarm.found ? alarm.points : static_cast<double>(anomalous));
  }
  void add_end(const nlohmann::json &j) {
    precision.push_back(j.at("precision"));
    recall.push_back(j.at("recall"));
  }
};

struct Thresholds {
  double ours = 0.0, thesis = INFINITY;
  std::size_t false_alarms = 0;
};

Thresholds thresholds_of(const Table31 &e, const Campaign &campaign) {
  std::vector<double> maxima;
  Thresholds out;
  double largest = 0.0;
  for (std::size_t i = 0; i < nominal_units(e); ++i) {
    const nlohmann::json &unit = campaign.units.at(i);
    if (i < e.calibration)
      maxima.push_back(unit.at("largest"));
    if (unit.contains("thesis"))
      largest = std::max(largest, unit.at("thesis").get<double>());
  }
  out.ours = run_level_threshold(maxima, kFalseAlarms);
  if (largest > 0.0)
    out.thesis = kThesisThreshold * largest;
  for (std::size_t i = e.calibration; i < nominal_units(e); ++i)
    out.false_alarms += campaign.units.at(i).at("largest").get<double>() > out.ours ? 1 : 0;
  return out;
}

Outcome outcome_of(const Table31 &e, const Campaign &campaign, std::size_t k, double threshold,
                   bool thesis) {
  Outcome out;
  for (std::size_t i = 0; i < e.runs; ++i) {
    const nlohmann::json &unit = campaign.units.at(nominal_units(e) + k * e.runs + i);
    const nlohmann::json &part = thesis ? unit.at("thesis") : unit;
    out.add(part.at("records"), unit.at("anomalous"), threshold);
    out.add_end(part);
  }
  return out;
}

std::string mean_text(const std::vector<double> &values, int digits) {
  return values.empty() ? "-" : interval_text(bootstrap_mean(values), digits);
}

std::string bars(const std::vector<Outcome> &ours) {
  std::string data = "$points << EOD\n";
  for (std::size_t k = 0; k < kKinds; ++k) {
    const Bootstrapped p = ours[k].points.empty() ? Bootstrapped{} : bootstrap_mean(ours[k].points);
    data += fmt::format("\"{}\" {:.6g} {:.6g} {:.6g} {:.6g}\n", cobot_case_name(kFailures[k].which),
                        p.value, p.low, p.high, kFailures[k].thesis_points);
  }
  data += "EOD\n$ends << EOD\n";
  for (std::size_t k = 0; k < kKinds; ++k) {
    const Bootstrapped p = bootstrap_mean(ours[k].precision), r = bootstrap_mean(ours[k].recall);
    data += fmt::format("\"{}\" {:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g} {:.6g}\n",
                        cobot_case_name(kFailures[k].which), p.value, p.low, p.high, r.value, r.low,
                        r.high, kFailures[k].thesis_precision, kFailures[k].thesis_recall);
  }
  return data + "EOD\n";
}

void plot(const std::vector<Outcome> &ours, const std::string &path) {
  write_gnuplot(
      [&](const std::string &to, bool svg) {
        return fmt::format(
            "set terminal {} size 960,380 {}\nset output {}\nset tics nomirror out\n"
            "set grid y lc rgb '#dddddd'\nset key top right\nset xrange [-0.6:3.8]\n{}"
            "set multiplot layout 1,2\nset title 'data points until the alarm'\nset yrange "
            "[1:100]\n"
            "set logscale y\n"
            "plot $points using 0:2:3:4:xtic(1) with yerrorbars pt 7 lw 2 lc rgb '#1f5fa8' title "
            "'ours, 95 %', $points using ($0+0.15):5 with points pt 4 ps 1.2 lc rgb '#444444' "
            "title 'thesis'\n"
            "unset logscale y\nset yrange [0.3:1.05]\nset key bottom left\n"
            "set title 'precision and recall at the end'\n"
            "plot $ends using 0:2:3:4:xtic(1) with yerrorbars pt 7 lw 2 lc rgb '#1f5fa8' title "
            "'precision', $ends using ($0+0.1):5:6:7 with yerrorbars pt 5 lw 2 lc rgb '#2e8b57' "
            "title 'recall', $ends using ($0+0.25):8 with points pt 6 ps 1.2 lc rgb '#444444' "
            "title 'thesis, precision', $ends using ($0+0.35):9 with points pt 4 ps 1.2 lc rgb "
            "'#444444' title 'thesis, recall'\nunset multiplot\nunset output\n",
            svg ? "svg" : "pngcairo",
            svg ? "dynamic font 'sans,13' background rgb 'white'" : "font 'sans,10'", to,
            bars(ours));
      },
      path);
}

void print_thesis(const Table31 &e, const Campaign &campaign, double threshold) {
  std::printf("the thesis's own procedure on these drives (FARO, 6-D, threshold %.1f):\n",
              threshold);
  Table table({{"failure", ""},
               {"points to alarm", "mean, 95 %"},
               {"in the thesis", "points"},
               {"missed", "drives"},
               {"precision", "95 %"},
               {"recall", "95 %"}});
  for (std::size_t k = 0; k < kKinds; ++k) {
    const Outcome o = outcome_of(e, campaign, k, threshold, true);
    table.add({cobot_case_name(kFailures[k].which), mean_text(o.points, 1),
               cell(kFailures[k].thesis_points), cell(o.missed), mean_text(o.precision, 3),
               mean_text(o.recall, 3)});
  }
  table.print();
}

} // namespace

Campaign run_table3_1(const Table31 &experiment, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {{"runs", experiment.runs},
                     {"nominal", experiment.nominal},
                     {"calibration", experiment.calibration},
                     {"thesis", experiment.thesis},
                     {"seed", experiment.seed}};
  campaign.total = nominal_units(experiment) + kKinds * experiment.runs;
  const Nominal nominal(experiment.seed);
  compute_units(&campaign, shard, kKind, [&](std::uint64_t unit) {
    return unit < nominal_units(experiment)
               ? nominal_json(experiment, nominal, unit)
               : failure_json(experiment, nominal, unit - nominal_units(experiment));
  });
  return campaign;
}

void print_table3_1(const Campaign &campaign, const std::string &path) {
  const Table31 e = experiment_of(campaign);
  const Thresholds thresholds = thresholds_of(e, campaign);
  const auto last =
      static_cast<unsigned long long>(e.seed + kCobotNominal + nominal_units(e) + e.runs - 1);
  std::printf("table 3.1: drives of %g s, seeds %llu-%llu; a data point is the mean of %zu rows "
              "(%.1f s)\n",
              kCobotDrive_s, static_cast<unsigned long long>(e.seed), last, kCobotPointRows,
              0.05 * static_cast<double>(kCobotPointRows));
  Table table({{"failure", ""},
               {"points to alarm", "mean, 95 %"},
               {"thesis", "points"},
               {"missed", "drives"},
               {"too early", "drives"},
               {"precision", "95 %"},
               {"thesis", ""},
               {"recall", "95 %"},
               {"thesis", ""}});
  std::vector<Outcome> ours;
  for (std::size_t k = 0; k < kKinds; ++k) {
    const Failure &f = kFailures[k];
    ours.push_back(outcome_of(e, campaign, k, thresholds.ours, false));
    const Outcome &o = ours.back();
    table.add({cobot_case_name(f.which), mean_text(o.points, 1), cell(f.thesis_points),
               cell(o.missed), cell(o.too_early), mean_text(o.precision, 3),
               cell(f.thesis_precision), mean_text(o.recall, 3), cell(f.thesis_recall)});
  }
  table.print();
  std::printf("a missed drive counts with all its anomalous points; too early: alarm before the "
              "first of them\nnominal drives with an alarm: %zu of %zu; promised: at most 5 %%\n",
              thresholds.false_alarms, e.nominal);
  if (e.thesis)
    print_thesis(e, campaign, thresholds.thesis);
  if (!path.empty())
    plot(ours, path);
}

} // namespace rim
