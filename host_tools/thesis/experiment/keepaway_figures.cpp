// SPDX-License-Identifier: MIT
#include "thesis/experiment/keepaway_figures.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "thesis/experiment/plan_figure.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/table.hpp"

namespace rim {
namespace {

constexpr const char *kKind34 = "fig3.4", *kKind35 = "fig3.5";
constexpr std::size_t kWindow = 50;        // p. 43
constexpr double kThesisReduction = 0.40;  // FRR of fig. 3.4, within kWithin passes
constexpr std::size_t kWithin = 300;       // passes
constexpr double kLeastLikelihood = 0.001; // of one observation, for the mean logarithm

using Series = std::vector<std::vector<double>>;

Campaign begin(const char *kind, const KeepawayFigure &e) {
  const KeepawayLearner &l = e.learner;
  Campaign campaign;
  campaign.kind = kind;
  campaign.config = {{"runs", e.runs},
                     {"passes", e.passes},
                     {"seed", e.seed},
                     {"nominal_runs", l.nominal_runs},
                     {"least_var", l.least_var},
                     {"quantile", l.quantile},
                     {"lambda_dim", l.lambda_dim},
                     {"border", l.border},
                     {"least", l.least},
                     {"patience", l.patience},
                     {"explanations", l.explanations},
                     {"temper", l.temper},
                     {"max_dims", l.max_dims},
                     {"search", {l.regions, l.nodes, l.sweeps, l.samples, l.elites, l.iterations}}};
  campaign.total = e.runs;
  return campaign;
}

Series series_of(const Campaign &campaign, const char *name) {
  Series out;
  for (const auto &[unit, value] : campaign.units)
    out.push_back(value.at(name).get<std::vector<double>>());
  return out;
}

void print_head(const Campaign &campaign, const char *what) {
  const std::uint64_t seed = campaign.config.at("seed"),
                      nominal = campaign.config.at("nominal_runs");
  std::printf(
      "%s: %zu runs of seeds %llu-%llu, %zu passes each; eq. 3.26 from %llu nominal runs of "
      "seeds %llu-%llu\n",
      what, static_cast<std::size_t>(campaign.total), static_cast<unsigned long long>(seed),
      static_cast<unsigned long long>(seed + campaign.total - 1),
      campaign.config.at("passes").get<std::size_t>(), static_cast<unsigned long long>(nominal),
      static_cast<unsigned long long>(seed + campaign.total),
      static_cast<unsigned long long>(seed + campaign.total + nominal - 1));
}

// Mean over the picked runs' passes first .. last - 1.
double mean_of(const Series &runs, const std::vector<std::size_t> &pick, std::size_t first,
               std::size_t last) {
  double sum = 0.0;
  for (const std::size_t i : pick) {
    for (std::size_t t = first; t < last; ++t)
      sum += runs[i][t];
  }
  return sum / static_cast<double>(pick.size() * (last - first));
}

// Eq. 3.37; 0 where the baseline never fails.
double reduction(double corrected_tp, double baseline_tp) {
  return baseline_tp < 1.0 ? 1.0 - (1.0 - corrected_tp) / (1.0 - baseline_tp) : 0.0;
}

void plot_34(const Series &baseline, const Series &adaptive, double tp0, const std::string &plot) {
  Series frr = adaptive, frr0 = baseline;
  for (Series *series : {&frr, &frr0}) {
    for (std::vector<double> &run : *series) {
      for (double &success : run)
        success = reduction(success, tp0);
    }
  }
  plot_panels(
      {{"fig. 3.4: task performance",
        "passes",
        "completed passes, moving average of 50",
        {curve_of("corrected", adaptive, kWindow), curve_of("baseline", baseline, kWindow)}},
       {"fig. 3.4: failure reduction rate",
        "passes",
        "FRR, moving average of 50",
        {curve_of("corrected", frr, kWindow), curve_of("baseline", frr0, kWindow)}}},
      plot);
}

// After how many passes the moving average of FRR first is what the thesis has; 0: never.
std::size_t first_reached(const Series &adaptive, double tp0) {
  std::vector<std::size_t> all(adaptive.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = i;
  for (std::size_t last = kWindow; last <= adaptive.front().size(); ++last) {
    if (reduction(mean_of(adaptive, all, last - kWindow, last), tp0) >= kThesisReduction)
      return last;
  }
  return 0;
}

// Of the runs that have so many observations inside regions, the first of them.
Series cut(const Series &runs, std::size_t length) {
  Series out;
  for (const std::vector<double> &run : runs) {
    if (run.size() >= length)
      out.emplace_back(run.begin(), run.begin() + static_cast<std::ptrdiff_t>(length));
  }
  return out;
}

struct Pooled {
  std::vector<double> sum, count; // a run
  double mean(const std::vector<std::size_t> &pick) const {
    double s = 0.0, n = 0.0;
    for (const std::size_t i : pick) {
      s += sum[i];
      n += count[i];
    }
    return n > 0.0 ? s / n : 0.0;
  }
};

template <class Of> Pooled pooled(const Series &runs, const Of &of) {
  Pooled out;
  for (const std::vector<double> &run : runs) {
    double sum = 0.0;
    for (const double x : run)
      sum += of(x);
    out.sum.push_back(sum);
    out.count.push_back(static_cast<double>(run.size()));
  }
  return out;
}

void add_score(Table &table, const std::string &name, const Pooled &corrected,
               const Pooled &nominal) {
  const std::size_t runs = corrected.sum.size();
  const auto of = [&](const auto &statistic) { return bootstrap(runs, statistic); };
  using Pick = std::vector<std::size_t>;
  const Bootstrapped plus = of([&](const Pick &pick) { return corrected.mean(pick); });
  const Bootstrapped zero = of([&](const Pick &pick) { return nominal.mean(pick); });
  const Bootstrapped gain =
      of([&](const Pick &pick) { return corrected.mean(pick) - nominal.mean(pick); });
  table.add({name, interval_text(plus, 3), interval_text(zero, 3), interval_text(gain, 3)});
}

template <class Value>
Campaign measure(const char *kind, const KeepawayFigure &e, const Shard &shard,
                 const Value &value_of) {
  const world::KeepawayParams params = world::read_keepaway_params(data_path("keepaway.toml"));
  Campaign campaign = begin(kind, e);
  const KeepawayNull null(params, e.learner, e.passes, e.seed + e.runs);
  compute_units(&campaign, shard, kind, [&](std::uint64_t unit) {
    return value_of([&](KeepawayPlay play) {
      return run_keepaway(params, e.learner, null, play, e.passes, e.seed + unit);
    });
  });
  return campaign;
}

} // namespace

Campaign run_fig3_4(const KeepawayFigure &e, const Shard &shard) {
  return measure(kKind34, e, shard, [](const auto &play) {
    return nlohmann::json{{"baseline", play(KeepawayPlay::baseline).success},
                          {"corrected", play(KeepawayPlay::adaptive).success}};
  });
}

// Judged by eq. 3.38 is one set of regions that are declared, not the mean over explanations that
// plans: the likelihood itself is no proper score, it pays for being sure where an outcome is
// merely the likelier one, and takes every doubt for an error.
Campaign run_fig3_5(const KeepawayFigure &e, const Shard &shard) {
  KeepawayFigure declared = e;
  declared.learner = e.learner.certain();
  return measure(kKind35, declared, shard, [](const auto &play) {
    const KeepawayRun run = play(KeepawayPlay::shadow);
    return nlohmann::json{{"corrected", run.corrected}, {"nominal", run.nominal}};
  });
}

void print_fig3_4(const Campaign &campaign, const std::string &plot) {
  require_whole(campaign, kKind34);
  print_head(campaign, "fig. 3.4");
  const Series baseline = series_of(campaign, "baseline"),
               adaptive = series_of(campaign, "corrected");
  const std::size_t passes = campaign.config.at("passes"), runs = campaign.total;
  using Pick = std::vector<std::size_t>;
  Table table({{"passes", ""},
               {"TP(theta+)", "95 %"},
               {"TP(theta0)", "95 %"},
               {"FRR", "95 %"},
               {"thesis", ""}});
  const std::size_t window = std::min(kWindow, passes);
  for (std::size_t last = window; last <= passes; last += window) {
    const std::size_t first = last - window;
    const auto tp = [&](const Series &series, std::size_t from, std::size_t to) {
      return bootstrap(runs, [&](const Pick &pick) { return mean_of(series, pick, from, to); });
    };
    const Bootstrapped frr = bootstrap(runs, [&](const Pick &pick) {
      return reduction(mean_of(adaptive, pick, first, last), mean_of(baseline, pick, 0, passes));
    });
    table.add({fmt::format("{}-{}", first + 1, last), interval_text(tp(adaptive, first, last), 3),
               interval_text(tp(baseline, first, last), 3), interval_text(frr, 3),
               last == kWindow   ? "about 0.1"
               : last == kWithin ? fmt::format("about {:.2f}", kThesisReduction)
                                 : "-"});
  }
  table.print();
  std::vector<std::size_t> all(runs);
  for (std::size_t i = 0; i < runs; ++i)
    all[i] = i;
  const double tp0 = mean_of(baseline, all, 0, passes);
  std::printf("average baseline performance TP(theta0) %.3f\n", tp0);
  if (const std::size_t reached = first_reached(adaptive, tp0))
    std::printf("the moving average of FRR first is %.2f after %zu passes\n", kThesisReduction,
                reached);
  else
    std::printf("the moving average of FRR is never %.2f\n", kThesisReduction);
  if (!plot.empty())
    plot_34(baseline, adaptive, tp0, plot);
}

void print_fig3_5(const Campaign &campaign, const std::string &plot) {
  require_whole(campaign, kKind35);
  print_head(campaign, "fig. 3.5");
  const Series corrected = series_of(campaign, "corrected"),
               nominal = series_of(campaign, "nominal");
  const auto same = [](double x) { return x; };
  const auto log_of = [](double x) { return std::log(std::max(kLeastLikelihood, x)); };
  const Pooled plus = pooled(corrected, same);
  double inside = 0.0;
  for (const double count : plus.count)
    inside += count;
  std::printf("%.0f observations inside regions found before\n", inside);
  Table table(
      {{"inside RIMs", ""}, {"theta+", "95 %"}, {"theta0", "95 %"}, {"theta+ - theta0", "95 %"}});
  add_score(table, "MPA (eq. 3.38)", plus, pooled(nominal, same));
  add_score(table, "mean ln likelihood", pooled(corrected, log_of), pooled(nominal, log_of));
  table.print();
  if (plot.empty())
    return;
  std::vector<std::size_t> lengths; // three runs in four reach the end of the picture
  for (const std::vector<double> &run : corrected)
    lengths.push_back(run.size());
  std::sort(lengths.begin(), lengths.end());
  const std::size_t length = std::max<std::size_t>(1, lengths[lengths.size() / 4]);
  if (lengths.back() < length)
    throw DataError("fig3.5: no observation lies inside a region: nothing to draw");
  plot_panels({{"fig. 3.5: prediction accuracy inside RIMs",
                "observations inside RIMs",
                "MPA, moving average of 50",
                {curve_of("corrected", cut(corrected, length), kWindow),
                 curve_of("nominal", cut(nominal, length), kWindow)}}},
              plot);
}

} // namespace rim
