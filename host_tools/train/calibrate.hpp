// SPDX-License-Identifier: MIT
// Calibration: what healthy runs do, so that an alarm means something.
//
// Every calibration run is judged as a run in flight is: by models learnt from the other runs, with
// the flight code doing the search. The alarm threshold is an order statistic of the runs' largest
// scores: exchangeable runs give a finite-sample promise, but for one odd run, see
// set_alarm_from_runs().
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "image/flight_image.hpp"
#include "train/noise.hpp"

namespace rim {

struct CalibrationOptions {
  double false_alarm = 0.05; // wished rate of runs with any false alarm
  double warn_rate = 0.25;   // the same for the warning level
  std::size_t region_features = 16;
  double redundant =
      0.985;           // correlation, by rank or value, from which on a feature repeats another
  bool flight = false; // searches less per row and holds less: see use_profile
};

// How much search per row, and how much memory. ground (the default): what finds most. flight: what
// a Cortex-M7 can afford (`make size` prints both). Calibration runs by the same profile, so the
// promise holds in either. Call it before calibrating.
void use_profile(FlightPlan *plan, bool flight, bool few_rows);

// Which rank promises the wished rate: the k-th smallest of n maxima bounds the rate by
// (n + 1 - k) / (n + 1). With too few runs k = n and the promise is 1 / (n + 1).
struct Promise {
  std::uint32_t rank = 0;
  double rate = 1.0;
};
Promise promise_for(std::size_t runs, double false_alarm);

// Whether each of so many runs is judged by models and noise that are learnt again without it. With
// more, it is enough that its residuals are those of models without it. But the others' are those
// of models with it: where runs are few, one that is unlike them moves their predictions, and they
// seem to differ about as much as it does from them. external: the predictions are the user's, and
// no run moves them.
constexpr bool is_learnt_again(std::size_t runs, bool external) {
  constexpr std::size_t few = 11;
  return !external && runs <= few;
}

// Ranks, promised rate, alarm and warning score from the largest scores of nominal runs.
void set_alarm(Thresholds *thresholds, std::vector<float> maxima,
               const CalibrationOptions &options);

// The middle of the runs' scores and how far their upper quartile lies above it: that of an
// exponential tail, by the maximum likelihood of the upper half: a quartile of 18 runs is one
// score, and as uncertain as that. The highest tenth may be unlike the others, and counts as the
// next one.
struct ScoreSpread {
  double middle = 0.0, above = 0.0;
  std::size_t runs = 0, counted = 0; // and those that count in full in `above`
  // The score beyond which a run is unlike the others: by ten times the others' own spread.
  double unlike_bar() const { return middle + 10.0 * std::max(above, 2.0); }
};
ScoreSpread score_spread(std::vector<double> scores); // of at least one run

// The order statistic of a few dozen runs is itself uncertain: the rate that it lets through is
// right in the mean over sets of runs, but in one set in seven it is twice as large. So much has to
// be added that the promise holds in a share `kept` of the sets. The r-th largest of n scores with
// an exponential tail of scale `scale` is exceeded at a rate of G / n, G of a gamma distribution of
// shape r, and c further on at that rate times exp(-c / scale): c = scale log(q / r), where q is
// the quantile of G. scale >= 0 nats, r >= 1; returns nats, 1.10 scale for r = 1 and 95 %, less for
// more.
double set_margin(double scale, std::size_t r, double kept);

// The same promise by all scores of the upper half: what one run in 1 / rate exceeds by their
// exponential tail, at most, in a share `kept` of the sets. Two odd runs of fifty move an order
// statistic as far as they are odd, and this one hardly. The scale of the tail is counted / G of
// that of the spread, G of a gamma distribution of shape `counted`; the middle's variance is
// scale^2 / runs. spread.counted >= 1, 0 < rate <= 0.5; returns nats.
double tail_bound(const ScoreSpread &spread, double rate, double kept);

// The alarm is the lower one of the two bounds above, each of which holds in this share of sets ...
constexpr double kEachKept = 0.95;
// ... so that the rate that was asked for, or else the one promised, holds in this share at least,
// where the tail is exponential. Few runs hardly know the scale of set_margin().
constexpr double sets_kept(std::size_t runs) { return runs < 30 ? 0.85 : 0.90; }
// Nats, where runs are learnt again: the scale of a few scores is hardly known itself. Where it is
// the limit, the promise is that of the order statistic, an average over sets of runs.
constexpr double kMostMarginOfFew = 4.0;

// The same where each run has two scores: `alone` uses the inflation phi that the other runs teach,
// `together` the one of the image, which this run has taught as well. A run that is odd in one
// channel would count twice by its score alone: it inflates that channel in the image, and it would
// set the alarm of all channels. Therefore the run with the largest score counts by its score
// together, but at least as much as the largest of the others. Runs that are unlike the others
// (ScoreSpread), up to a tenth of all, count as much as that: models that had not seen their like
// judged them; the image has, and its inflation of the channels that deviate in them is raised to
// that score. set_margin() is added for the set of runs that one happens to have, at most
// most_margin nats. Where so many runs can keep the promise, and that in the upper half of the
// scores, no run counts more than tail_bound() of its place from above. At least two runs.
void set_alarm_from_runs(Thresholds *thresholds, const std::vector<float> &alone,
                         const std::vector<float> &together, const CalibrationOptions &options,
                         double most_margin = std::numeric_limits<double>::infinity());

// Features that may describe a region, with the outcome whose prediction stands for the feature
// (0xffff: as measured): commands and context, then sensors. Those that repeat an earlier one are
// left out, and of more than options.region_features the sensors that are most like others or do
// not last. Cost: a correlation over all blocks for each pair of features.
void choose_region(FlightPlan *plan, const std::vector<SearchRun> &runs,
                   const std::vector<double> &r2, const CalibrationOptions &options);

// What a run's own score tells beside its number, for the report.
struct RunScore {
  double score = 0.0;
  std::size_t channel = 0;
};

// A run as flight would have seen it by models, and searched it with noise, that had not learnt
// from it.
struct JudgedRun {
  SearchRun run;
  const Basis *basis;
  const NoiseModel *noise;
};

// Fills phi of the noise model and the plan's thresholds. Returns every run's score, by the phi of
// the others.
std::vector<RunScore> calibrate_runs(FlightPlan *plan, NoiseModel *noise,
                                     const std::vector<JudgedRun> &runs,
                                     const CalibrationOptions &options);

} // namespace rim
