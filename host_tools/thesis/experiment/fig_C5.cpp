// SPDX-License-Identifier: MIT
#include "thesis/experiment/fig_C5.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>

#include "stats/robust.hpp"
#include "thesis/experiment/plan_figure.hpp"
#include "thesis/poisson.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"
#include "util/table.hpp"
#include "world/cobot.hpp"

namespace rim {
namespace {

using world::Cobot;
using world::CobotEffect;
using world::CobotEffectKind;
using world::CobotPhase;

constexpr const char *kKind = "fig_C5";
constexpr std::size_t kCollisions = 15, kHolds = 6, kStuck = 8, kControls = 2;
constexpr std::size_t kEvents = kCollisions + kHolds + kStuck;
constexpr double kControl_s = 180.0, kLongest_s = 90.0, kAfter_s = 3.0;

struct Floor {
  world::CobotParams params;
  world::CobotMap map;
  Floor() { world::read_cobot(data_path("cobot.toml"), "", &params, &map); }
};

// Six in ten strike at constant speed, the others as it begins to move or gathers speed.
CobotEffect event_of(std::size_t i) {
  CobotEffect effect;
  effect.kind = i < kCollisions            ? CobotEffectKind::collision
                : i < kCollisions + kHolds ? CobotEffectKind::hold
                                           : CobotEffectKind::stuck;
  const std::size_t turn = i % 5;
  effect.phase = turn == 1   ? CobotPhase::starting
                 : turn == 3 ? CobotPhase::accelerating
                             : CobotPhase::moving;
  effect.wheel = i % 4;
  return effect;
}

InterferenceRun record(Cobot &cobot, double seconds, bool has_event) {
  InterferenceRun run;
  cobot.next();
  for (;;) {
    const world::CobotRow row = cobot.next();
    run.t_s.push_back(row.t_s);
    run.command_mps.push_back(row.command[0]);
    run.speed_mps.push_back(row.velocity[0]);
    run.intervals = cobot.intervals();
    const bool is_over = !run.intervals.empty() && row.t_s > run.intervals[0].end_s + kAfter_s;
    if (row.t_s > seconds || (has_event && is_over))
      return run;
  }
}

// Alarms and time of nominal driving.
std::size_t false_alarms(const rim_interference_model &model, const Floor &floor,
                         std::uint64_t seed, double hours) {
  rim_interference state;
  if (rimi_interference_init(&state, &model) != RIM_OK)
    throw std::logic_error("fig_C5: the model was refused");
  std::size_t alarms = 0;
  for (double left = hours; left > 1e-9; left -= 1.0) { // runs of an hour, each a day of its own
    Cobot cobot(floor.params, floor.map, {}, seed, 1000 + static_cast<std::uint64_t>(left * 16.0));
    rimi_interference_reset(&state);
    const double until_s = 3600.0 * std::min(left, 1.0);
    cobot.next();
    for (double t_s = 0.0; t_s < until_s;) {
      const world::CobotRow row = cobot.next();
      rim_interference_verdict v;
      rimi_interference_step(&state, row.t_s, row.command[0], row.velocity[0], &v);
      alarms += v.raised;
      t_s = row.t_s;
    }
  }
  return alarms;
}

nlohmann::json counts_json(const std::vector<InterferenceOutcome> &outcomes, std::size_t detector) {
  std::size_t hits = 0, wrong = 0;
  std::vector<double> delays;
  for (const InterferenceOutcome &o : outcomes) {
    const auto &d = o.detector[detector];
    hits += d.hits;
    wrong += d.false_positives;
    delays.insert(delays.end(), d.delays_s.begin(), d.delays_s.end());
  }
  return {{"hits", hits}, {"wrong", wrong}, {"delays", delays}};
}

nlohmann::json world_json(const FigC5 &e, std::uint64_t seed) {
  const Floor floor;
  const std::vector<InterferenceRun> runs = interference_world(seed);
  const InterferenceTrainer trainer(runs, e.options);
  nlohmann::json out;
  for (const double p_mi : p_mi_grid()) { // the thesis's full tests
    std::vector<InterferenceOutcome> outcomes;
    for (std::size_t r = 0; r < runs.size(); ++r)
      outcomes.push_back(detect(trainer.with_p_mi(r, p_mi), runs[r]));
    out["sweep"].push_back(counts_json(outcomes, 0));
  }
  std::vector<InterferenceOutcome> outcomes;
  for (std::size_t r = 0; r < runs.size(); ++r)
    outcomes.push_back(detect(trainer.train(r).model, runs[r]));
  out["whole"] = counts_json(outcomes, 1);
  out["nested"] = counts_json(outcomes, 0); // the HMM with p_mi chosen without the run
  out["false_alarms"] = false_alarms(trainer.train(runs.size()).model, floor, seed, e.nominal_h);
  return out;
}

struct Pooled {
  std::size_t hits = 0, wrong = 0;
  std::vector<double> delays_s;
  void add(const nlohmann::json &j) {
    hits += j.at("hits").get<std::size_t>();
    wrong += j.at("wrong").get<std::size_t>();
    const auto more = j.at("delays").get<std::vector<double>>();
    delays_s.insert(delays_s.end(), more.begin(), more.end());
  }
};

double mean(const std::vector<double> &values) {
  double sum = 0.0;
  for (const double v : values)
    sum += v;
  return values.empty() ? NAN : sum / static_cast<double>(values.size());
}

// The thesis's choice in each world: of the p_mi without a false positive the one of most hits.
const nlohmann::json *chosen(const nlohmann::json &world) {
  const nlohmann::json *best = nullptr;
  for (const nlohmann::json &test : world.at("sweep")) {
    if (test.at("wrong") == 0 && (best == nullptr || test.at("hits") > best->at("hits")))
      best = &test;
  }
  return best;
}

// Worlds are drawn again, with the statistic of the pool of those drawn.
template <class Statistic, class Part>
Bootstrapped over_worlds(std::size_t worlds, const Part &part, const Statistic &statistic) {
  return bootstrap(worlds, [&](const std::vector<std::size_t> &pick) {
    Pooled pool;
    for (const std::size_t i : pick) {
      const nlohmann::json *j = part(i);
      if (j != nullptr)
        pool.add(*j);
    }
    return statistic(pool, pick.size());
  });
}

template <class Part>
void add_row(Table &table, const char *name, std::size_t worlds, const Part &part) {
  Pooled all;
  for (std::size_t i = 0; i < worlds; ++i) {
    const nlohmann::json *j = part(i);
    if (j != nullptr)
      all.add(*j);
  }
  const Bootstrapped recall = over_worlds(worlds, part, [](const Pooled &p, std::size_t n) {
    return 100.0 * static_cast<double>(p.hits) / static_cast<double>(n * kEvents);
  });
  const Bootstrapped average =
      over_worlds(worlds, part, [](const Pooled &p, std::size_t) { return mean(p.delays_s); });
  const Bootstrapped middle = over_worlds(
      worlds, part, [](const Pooled &p, std::size_t) { return median_midpoint(p.delays_s); });
  table.add({name, fmt::format("{}/{}", all.hits, worlds * kEvents), interval_text(recall, 1),
             fmt::format("{}", all.wrong), interval_text(average, 3), interval_text(middle, 3)});
}

// The p_mi that the thesis would choose in each world.
void print_choices(const Campaign &campaign, std::size_t worlds) {
  std::vector<double> choices;
  for (std::size_t i = 0; i < worlds; ++i) {
    const nlohmann::json &world = campaign.units.at(i);
    if (const nlohmann::json *best = chosen(world)) {
      std::size_t k = 0;
      while (&world.at("sweep").at(k) != best)
        ++k;
      choices.push_back(p_mi_grid().at(k));
    }
  }
  if (choices.empty()) {
    std::printf("HMM alone: no p_mi is without a false positive\n");
    return;
  }
  const auto [least, most] = std::minmax_element(choices.begin(), choices.end());
  std::printf("HMM alone: p_mi of most recall without a false positive, of each world: median %.2g "
              "(%.2g to %.2g); thesis 5e-08\n",
              median_midpoint(choices), *least, *most);
}

void plot_curve(const Campaign &campaign, std::size_t worlds, const std::string &path) {
  std::string points;
  for (std::size_t k = 0; k < p_mi_grid().size(); ++k) {
    Pooled pool;
    for (std::size_t i = 0; i < worlds; ++i)
      pool.add(campaign.units.at(i).at("sweep").at(k));
    if (pool.hits > 0)
      points +=
          fmt::format("{:.6g} {:.6g} {:.3g}\n",
                      static_cast<double>(pool.hits) / static_cast<double>(worlds * kEvents),
                      static_cast<double>(pool.hits) / static_cast<double>(pool.hits + pool.wrong),
                      p_mi_grid()[k]);
  }
  Pooled whole;
  for (std::size_t i = 0; i < worlds; ++i)
    whole.add(campaign.units.at(i).at("whole"));
  const double recall = static_cast<double>(whole.hits) / static_cast<double>(worlds * kEvents);
  const double precision = static_cast<double>(whole.hits) /
                           static_cast<double>(std::max<std::size_t>(1, whole.hits + whole.wrong));
  write_gnuplot(
      [&](const std::string &to, bool svg) {
        return fmt::format(
            "set terminal {}\nset output {}\nset xlabel 'recall'\nset ylabel 'precision'\n"
            "set xrange [0:1.02]\nset yrange [0:1.05]\nset key bottom left\nset grid\n"
            "$hmm << EOD\n{}EOD\n$whole << EOD\n{} {}\nEOD\n$thesis << EOD\n0.931 1\nEOD\n"
            "plot $hmm using 1:2 with linespoints pt 7 ps 0.5 title 'HMM alone, p_{{mi}} varied', "
            "$whole with points pt 5 ps 1.2 title 'whole detector', "
            "$thesis with points pt 4 ps 1.2 title 'thesis, p_{{mi}} = 5 10^{{-8}}'\n",
            svg ? "svg size 640,480" : "pngcairo size 960,720", to, points, recall, precision);
      },
      path);
}

} // namespace

std::vector<InterferenceRun> interference_world(std::uint64_t seed) {
  const Floor floor;
  std::vector<InterferenceRun> runs;
  for (std::size_t i = 0; i < kEvents + kControls; ++i) {
    const bool has_event = i < kEvents;
    for (std::uint64_t attempt = 0;; ++attempt) { // the drawn course may not offer the occasion
      std::vector<CobotEffect> effects;
      if (has_event)
        effects.push_back(event_of(i));
      Cobot cobot(floor.params, floor.map, effects, seed, i + 1 + 100 * attempt);
      InterferenceRun run = record(cobot, has_event ? kLongest_s : kControl_s, has_event);
      if (has_event && (run.intervals.empty() || run.t_s.back() < run.intervals[0].end_s + 1.0))
        continue;
      run.name = fmt::format("seed {} run {}", seed, i + 1);
      runs.push_back(std::move(run));
      break;
    }
  }
  return runs;
}

Campaign run_fig_C5(const FigC5 &experiment, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {
      {"worlds", experiment.worlds},
      {"nominal_h", experiment.nominal_h},
      {"seed", experiment.seed},
      {"slack", {experiment.options.slack_one_step, experiment.options.slack_open_loop}},
      {"quiet_h", experiment.options.quiet_h},
      {"margin", experiment.options.margin},
      {"tail", {experiment.options.tail, experiment.options.tail_z}}};
  campaign.total = experiment.worlds;
  compute_units(&campaign, shard, kKind, [&](std::uint64_t world) {
    return world_json(experiment, experiment.seed + world);
  });
  return campaign;
}

void print_fig_C5(const Campaign &campaign, const std::string &plot) {
  require_whole(campaign, kKind);
  const std::size_t worlds = campaign.config.at("worlds");
  const std::uint64_t seed = campaign.config.at("seed");
  const double hours = campaign.config.at("nominal_h");
  std::printf(
      "fig. C.5: %zu worlds of seeds %llu-%llu, each %zu events and %zu control runs, leave "
      "one out\n",
      worlds, static_cast<unsigned long long>(seed),
      static_cast<unsigned long long>(seed + worlds - 1), kEvents, kControls);
  Table table({{"detector", ""},
               {"found", "events"},
               {"recall", "%, 95 %"},
               {"false", "positives"},
               {"mean delay", "s, 95 %"},
               {"median delay", "s, 95 %"}});
  const auto unit = [&](std::size_t i) -> const nlohmann::json & { return campaign.units.at(i); };
  add_row(table, "whole detector", worlds, [&](std::size_t i) { return &unit(i).at("whole"); });
  add_row(table, "HMM alone, as in the thesis", worlds,
          [&](std::size_t i) { return chosen(unit(i)); });
  add_row(table, "HMM alone, p_mi from the others", worlds,
          [&](std::size_t i) { return &unit(i).at("nested"); });
  table.add({"thesis (HMM)", "27/29", "93.1", "0", "0.647", "0.36"});
  table.print();
  print_choices(campaign, worlds);
  std::size_t alarms = 0, most = 0;
  for (std::size_t i = 0; i < worlds; ++i) {
    const std::size_t n = unit(i).at("false_alarms");
    alarms += n;
    most = std::max(most, n);
  }
  const double all_h = hours * static_cast<double>(worlds);
  const RateInterval interval = poisson_interval(alarms);
  std::printf(
      "whole detector, false alarms in nominal driving: %zu in %g h, at most %zu in the %g h "
      "of a world; in 10 h %.2f (95 %% Poisson %.2f to %.2f)\n",
      alarms, all_h, most, hours, 10.0 * static_cast<double>(alarms) / all_h,
      10.0 * interval.low / all_h, 10.0 * interval.high / all_h);
  if (!plot.empty())
    plot_curve(campaign, worlds, plot);
}

} // namespace rim
