// SPDX-License-Identifier: MIT
#include "thesis/experiment/keepaway.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "batch/stats.h"
#include "image/correct.h"

namespace rim {
namespace {

using world::kKeepawayFeatures;
using world::PassContext;
using world::PassOption;

constexpr std::uint64_t kNullStream = 91;
constexpr std::size_t kDrawsAPlay = 10;   // outcomes drawn anew over the same contexts
constexpr std::uint64_t kSeedStep = 1009; // from one explanation of a run to the next
constexpr std::size_t kNullSteps[] = {10, 20, 40, 80, 160, 320, 640, 1280};

// Where passes happen, as [0, 1]; what lies outside counts as on the edge.
PassContext unit_of(const PassContext &context, const world::KeepawayParams &p) {
  const double top = p.limits.speed_mps, half = 0.5 * p.field_width_m;
  const PassContext low = {-0.25 * p.field_length_m, -half, -top, -top, 0.0};
  const PassContext high = {0.75 * p.field_length_m, half, top, top, p.kick_max_mps};
  PassContext u;
  for (std::size_t k = 0; k < kKeepawayFeatures; ++k)
    u[k] = std::clamp((context[k] - low[k]) / (high[k] - low[k]), 0.0, 1.0);
  return u;
}

// z_i: taker i did not win the ball, and did not decide a pass that nobody touched.
bool held(const world::KeepawayParams &p, const PassOption &option, const world::PassResult &result,
          std::size_t taker) {
  return result.touched_by < 0 ? taker != option.decisive
                               : result.touched_by != static_cast<int>(p.keeper_count() + taker);
}

void must(rim_status status, const char *what) {
  if (status != RIM_OK)
    throw std::logic_error(std::string("keepaway: ") + what + ": " + rim_status_text(status));
}

} // namespace

KeepawayMonitor::KeepawayMonitor(const world::KeepawayParams &params,
                                 const KeepawayLearner &learner, const KeepawayNull *null,
                                 std::uint64_t seed)
    : params_(params), learner_(learner), null_(null), seed_(seed) {}

void KeepawayMonitor::add(const PassContext &context, double expected, bool kept) {
  const PassContext u = unit_of(context, params_);
  unit_.insert(unit_.end(), u.begin(), u.end());
  deviation_.push_back((kept ? 1.0 : 0.0) - expected);
  variance_.push_back(std::max(learner_.least_var, expected * (1.0 - expected)));
  residual_.push_back(deviation_.back() / std::sqrt(variance_.back()));
}

void KeepawayMonitor::observe(const PassOption &option, const world::PassResult &result) {
  ++passes_;
  for (std::size_t i = 0; i < params_.taker_count(); ++i)
    add(option.context[i], option.expected[i], held(params_, option, result, i));
  if (result.success && waited_ < learner_.patience) {
    ++waited_;
    return;
  }
  waited_ = 0;
  update();
}

rim_batch_data KeepawayMonitor::data() const {
  rim_batch_data data{};
  data.n = static_cast<std::uint32_t>(residual_.size());
  data.features = kKeepawayFeatures;
  data.outcomes = 1;
  data.u = unit_.data();
  data.r = residual_.data();
  return data;
}

double KeepawayMonitor::lambda() const { return null_ == nullptr ? 1e-9 : null_->lambda(passes_); }

void KeepawayMonitor::search(rim_dmaps_result *found) {
  const rim_batch_data observed = data();
  rim_dmaps_config config{};
  config.least = learner_.least;
  config.lambda = lambda();
  config.lambda_dim = learner_.lambda_dim;
  config.regions = static_cast<std::uint8_t>(learner_.regions);
  config.sweeps = static_cast<std::uint8_t>(learner_.sweeps);
  config.cem.samples = static_cast<std::uint16_t>(learner_.samples);
  config.cem.elites = static_cast<std::uint16_t>(learner_.elites);
  config.cem.iterations = static_cast<std::uint16_t>(learner_.iterations);
  config.search.cem = config.cem;
  config.search.balls = 1;
  config.border = learner_.border;
  config.search.max_dims = static_cast<std::uint8_t>(learner_.max_dims);
  config.search.nodes = static_cast<std::uint16_t>(learner_.nodes);
  config.search.seed = seed_ + kSeedStep * (searches_ % learner_.explanations);
  const std::size_t bytes = RIM_DMAPS_SIZE(observed.n, observed.features, 1, learner_.nodes);
  if (8 * work_.size() < bytes)
    work_.resize(bytes / 4 + 1);
  must(rimi_dmaps_find(&config, &observed, nullptr, work_.data(), 8 * work_.size(), found),
       "DMAPS");
}

// Shifts, ln anom and F by all observations so far, whenever the regions were found.
void KeepawayMonitor::judge(Explanation *explanation) const {
  rim_dmaps_result &found = explanation->found;
  const rim_batch_data observed = data();
  std::vector<std::uint8_t> owner(observed.n);
  must(rimi_dmaps_assign(&found, &observed, nullptr, owner.data()), "assignment");
  std::vector<rim_stats> shifted(found.count, rim_stats{}), anomalous(found.count, rim_stats{});
  for (std::size_t i = 0; i < owner.size(); ++i) {
    if (owner[i] == 0)
      continue;
    must(rimi_stats_add(&shifted[owner[i] - 1U], deviation_[i], variance_[i]), "statistics");
    must(rimi_stats_add(&anomalous[owner[i] - 1U], residual_[i], 1.0), "statistics");
  }
  explanation->worth = 0.0;
  explanation->shift.assign(found.count, 0.0);
  for (std::size_t k = 0; k < found.count; ++k) {
    explanation->shift[k] = rimi_stats_shift(&shifted[k]);
    rim_dmaps_region &region = found.region[k];
    region.ln_anom = rimi_stats_ln_anom(&anomalous[k]);
    region.count = static_cast<std::uint32_t>(anomalous[k].n);
    region.price = lambda() + learner_.lambda_dim * region.region.unit.dims;
    explanation->worth += region.ln_anom - region.price;
  }
}

void KeepawayMonitor::correct(Explanation *explanation) const {
  const rim_dmaps_result &found = explanation->found;
  std::vector<rim_correct_region> regions(found.count);
  for (std::size_t k = 0; k < found.count; ++k) {
    regions[k].region = found.region[k].region.unit; // its features are unit coordinates
    regions[k].confidence =
        null_ == nullptr ? 1.0 : null_->confidence(passes_, found.region[k].ln_anom);
  }
  rim_correct_model model{};
  model.features = kKeepawayFeatures;
  model.outcomes = 1;
  model.regions = found.count;
  model.overlap = RIM_OVERLAP_FIRST;
  model.region = regions.data();
  model.shift = explanation->shift.data();
  const std::size_t section = RIM_CORRECT_BYTES(1, found.count);
  explanation->section.assign((section + 7) / 8, 0);
  auto *packed = reinterpret_cast<std::uint8_t *>(explanation->section.data());
  must(rimi_correct_pack(&model, packed, section), "the corrected model");
  must(rimi_correct_open(&explanation->model, packed, section), "the corrected model");
}

void KeepawayMonitor::update() {
  const std::size_t slot = searches_ % learner_.explanations;
  if (slot == latest_.size())
    latest_.emplace_back();
  search(&latest_[slot].found);
  ++searches_;
  const Explanation *best = nullptr;
  for (Explanation &explanation : latest_) {
    judge(&explanation);
    correct(&explanation);
    if (best == nullptr || explanation.worth > best->worth)
      best = &explanation;
  }
  for (Explanation &explanation : latest_)
    explanation.weight = std::exp(learner_.temper * (explanation.worth - best->worth));
  found_ = best->found;
  shift_ = best->shift;
}

double KeepawayMonitor::corrected(const PassOption &option, std::size_t taker,
                                  std::size_t *region) const {
  const double nominal = option.expected[taker];
  const PassContext u = unit_of(option.context[taker], params_);
  if (region != nullptr) {
    *region = 0;
    for (std::size_t k = found_.count; k > 0; --k) {
      if (rimi_unit_region_contains(&found_.region[k - 1].region, u.data()))
        *region = k;
    }
  }
  // What is added to the nominal prediction, so that it stays as it is to the bit without regions.
  double added = 0.0, weights = 0.0;
  for (const Explanation &explanation : latest_) {
    weights += explanation.weight;
    if (explanation.found.count == 0)
      continue;
    double mean = nominal;
    must(rimi_correct_mean(&explanation.model, u.data(), &nominal, &mean), "eq. 3.30");
    added += explanation.weight * (mean - nominal);
  }
  return added == 0.0 ? nominal : std::clamp(nominal + added / weights, 0.0, 1.0);
}

double KeepawayMonitor::value(const PassOption &option) const {
  double least = 1.0;
  for (std::size_t i = 0; i < params_.taker_count(); ++i)
    least = std::min(least, corrected(option, i));
  return least;
}

const PassOption *choose_pass(const std::vector<PassOption> &options,
                              const KeepawayMonitor *monitor) {
  return world::best_pass(options, [monitor](const PassOption &option) {
    return monitor == nullptr ? option.nominal() : monitor->value(option);
  });
}

KeepawayNull::KeepawayNull(const world::KeepawayParams &params, const KeepawayLearner &learner,
                           std::size_t passes, std::uint64_t seed)
    : quantile_(learner.quantile) {
  for (const std::size_t after : kNullSteps) {
    if (after_.empty() || after_.back() < passes)
      after_.push_back(std::min(after, passes));
  }
  largest_.resize(after_.size());
  world::KeepawayParams plain = params;
  plain.habits.clear();
  const world::KeepawayModel model(plain);
  KeepawayLearner searcher = learner; // eq. 3.26 is about what one search finds
  searcher.explanations = 1;
  const std::size_t plays = (learner.nominal_runs + kDrawsAPlay - 1) / kDrawsAPlay;
  for (std::size_t play = 0; play < plays; ++play) {
    std::vector<PassOption> played;
    world::Keepaway keepaway(plain, seed + play);
    world::play_passes(
        model, keepaway, plain, passes,
        [](const std::vector<PassOption> &options) { return choose_pass(options, nullptr); },
        [&](const PassOption &option, const world::PassResult &) { played.push_back(option); });
    for (std::size_t run = play; run < learner.nominal_runs; run += plays)
      add_run(params, searcher, played, seed + play, run);
  }
  for (std::vector<double> &values : largest_)
    std::sort(values.begin(), values.end());
}

void KeepawayNull::add_run(const world::KeepawayParams &params, const KeepawayLearner &learner,
                           const std::vector<PassOption> &played, std::uint64_t seed,
                           std::uint64_t draw) {
  KeepawayMonitor monitor(params, learner, nullptr, seed + draw);
  world::Random random(seed, draw, kNullStream);
  std::size_t n = 0, next = 0;
  for (const PassOption &option : played) {
    for (std::size_t i = 0; i < params.taker_count(); ++i)
      monitor.add(option.context[i], option.expected[i], random.uniform() < option.expected[i]);
    if (++n != after_[next])
      continue;
    monitor.update();
    double most = 0.0;
    for (std::size_t k = 0; k < monitor.found().count; ++k)
      most = std::max(most, monitor.found().region[k].ln_anom);
    largest_[next++].push_back(most);
  }
}

std::size_t KeepawayNull::row(std::size_t passes) const {
  const auto at = std::lower_bound(after_.begin(), after_.end(), passes);
  return at == after_.end() ? after_.size() - 1 : static_cast<std::size_t>(at - after_.begin());
}

double KeepawayNull::lambda(std::size_t passes) const {
  const std::vector<double> &values = largest_[row(passes)];
  const auto at = static_cast<std::size_t>(quantile_ * static_cast<double>(values.size()));
  return std::max(1e-9, values[std::min(at, values.size() - 1)]);
}

double KeepawayNull::confidence(std::size_t passes, double ln_anom) const {
  const std::vector<double> &values = largest_[row(passes)];
  const auto above = values.end() - std::lower_bound(values.begin(), values.end(), ln_anom);
  return 1.0 - (1.0 + static_cast<double>(above)) / (1.0 + static_cast<double>(values.size()));
}

KeepawayRun run_keepaway(const world::KeepawayParams &params, const KeepawayLearner &learner,
                         const KeepawayNull &null, KeepawayPlay play, std::size_t passes,
                         std::uint64_t seed) {
  KeepawayRun run;
  KeepawayMonitor monitor(params, learner, &null, seed);
  const bool adapts = play == KeepawayPlay::adaptive;
  const world::KeepawayModel model(params);
  world::Keepaway keepaway(params, seed);
  world::play_passes(
      model, keepaway, params, passes,
      [&](const std::vector<PassOption> &options) {
        return choose_pass(options, adapts ? &monitor : nullptr);
      },
      [&](const PassOption &option, const world::PassResult &result) {
        run.success.push_back(result.success ? 1.0 : 0.0);
        if (play == KeepawayPlay::baseline)
          return;
        for (std::size_t i = 0; i < params.taker_count(); ++i) {
          std::size_t region = 0;
          const double p = monitor.corrected(option, i, &region);
          if (region == 0)
            continue;
          const bool z = held(params, option, result, i);
          run.corrected.push_back(z ? p : 1.0 - p);
          run.nominal.push_back(z ? option.expected[i] : 1.0 - option.expected[i]);
        }
        monitor.observe(option, result);
      });
  return run;
}

} // namespace rim
