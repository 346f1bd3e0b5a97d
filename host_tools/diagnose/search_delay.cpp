// SPDX-License-Identifier: MIT
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// Of a delay's shape beside what was found behind it: steps, the first factor, and the nats that a
// change must be worth.
constexpr int kTuneSteps = 8;
constexpr double kTuning = 1.3, kLeastTuned = 2.0;
constexpr double kPlainClip = 10.0; // scales: what counts as plain squares
// Delays and lags behind which all is searched again; by which share of their cost two are one.
constexpr std::size_t kMostDelays = 2;
constexpr double kSameCost = 1e-3;
} // namespace

// Every measured row counting alike, at the scale of what remains: for choices that are judged by
// the root of mean squares. What a model's error leaves somewhere is no noise to be weighed down.
Noise ChannelSearch::plain_noise() const {
  Noise plain = out_.noise;
  plain.weight = measured_rows_;
  plain.clip = kPlainClip;
  plain.scale = 1e6;
  const Vector left = fit_members(y_, out_.members, plain).residual.cwiseProduct(measured_rows_);
  plain.scale = std::sqrt(left.squaredNorm() / std::max(1.0, measured_rows_.sum()));
  return plain;
}

// Shapes and sizes anew with every row counting alike, where the scatter was found to differ or
// something comes late: what a delay explains is in few rows, and large.
void ChannelSearch::refit_plain() {
  const bool is_late = std::any_of(out_.members.begin(), out_.members.end(),
                                   [](const Member &m) { return moves_prediction(m.term); });
  if (out_.variances.empty() && !is_late)
    return;
  const Noise weighed = out_.noise;
  out_.noise = plain_noise();
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (out_.members[j].is_given || out_.members[j].candidate < 0 || out_.members[j].keeps_shape ||
        out_.members[j].term.shape.empty())
      continue;
    const std::vector<Member> others = without(j);
    refine_shape(others, fit_members(y_, others, out_.noise).loss, &out_.members[j]);
  }
  out_.fit = fit_members(y_, out_.members, out_.noise);
  fill_sizes();
  out_.noise = weighed;
}

// Of every form of delay and lag the best with the others behind it, by plain squares: a product of
// commands that is late too tells for a delay, and against it where it is left at once. Of two that
// do the same the first; of all the best few.
std::vector<Member> ChannelSearch::best_delays(const std::vector<Member> &others,
                                               const Noise &plain) const {
  std::map<std::string, std::pair<double, int>> by_form; // least loss and penalty, its candidate
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const Candidate &candidate = library_.candidates[c];
    if (!moves_prediction(candidate.term))
      continue;
    const double cost =
        loss_behind(candidate.term, others, plain) / plain.divisor() + candidate.penalty;
    const auto [at, is_first] =
        by_form.emplace(candidate.term.form, std::make_pair(cost, static_cast<int>(c)));
    if (!is_first && cost < at->second.first)
      at->second = {cost, static_cast<int>(c)};
  }
  std::vector<std::pair<double, int>> best;
  for (const auto &[form, of_form] : by_form) {
    if (std::none_of(best.begin(), best.end(), [&of_form = of_form](const auto &other) {
          return std::abs(other.first - of_form.first) < kSameCost * std::abs(of_form.first);
        }))
      best.push_back(of_form);
  }
  std::stable_sort(best.begin(), best.end());
  if (best.size() > kMostDelays)
    best.resize(kMostDelays);
  std::vector<Member> delays;
  for (const auto &[cost, candidate] : best) {
    const Member delay = form_member(candidate, false);
    const Member better = tuned(delay, others, plain);
    delays.push_back(better.h.cols() > 0 ? better : delay);
  }
  return delays;
}

// The noise that the best of these models leaves.
Noise ChannelSearch::least_noise_of(const std::vector<ChannelFindings> &found,
                                    const Noise &plain) const {
  Noise least = plain;
  for (const ChannelFindings &one : found) {
    double sizes = 0.0;
    for (const Member &member : one.members)
      sizes += static_cast<double>(member.h.cols());
    const NoiseState state = noise_state(
        one.fit.residual, measured_rows_, measured_,
        std::sqrt(y_.squaredNorm() / static_cast<double>(y_.size())), sizes, least_noise(channel_));
    Noise noise = plain;
    noise.scale = std::sqrt(state.variance);
    noise.spread = state.spread;
    if (noise.divisor() < least.divisor())
      least = noise;
  }
  return least;
}

// When a command acts late, what else acts with it is late too: the search once more with the
// delayed prediction as prediction and commands of that moment as features, for the best delay and
// for the best lag; kept where it explains more.
void ChannelSearch::follow_delay() {
  const auto first = std::find_if(out_.members.begin(), out_.members.end(), [](const Member &m) {
    return moves_prediction(m.term) && !m.is_given;
  });
  if (first == out_.members.end() || !may_delay_)
    return;
  const auto at = static_cast<std::size_t>(first - out_.members.begin());
  const Claim claim = out_.claims[at];
  const Noise plain = plain_noise();
  std::vector<Member> delays = best_delays(without(at), plain);
  const bool is_among = std::any_of(delays.begin(), delays.end(), [&first](const Member &delay) {
    return delay.term.form == first->term.form;
  });
  if (!is_among)
    delays.push_back(*first);
  const auto cost = [](const ChannelFindings &found, double loss, const Noise &noise) {
    double sum = loss / noise.divisor();
    for (const Member &member : found.members)
      sum += member.penalty;
    return sum;
  };
  std::vector<ChannelFindings> found;
  const auto consider = [&](const Member &delay) {
    found.push_back(search_behind(delay, plain));
    found.back().members.insert(found.back().members.begin(), delay);
    found.back().claims.insert(found.back().claims.begin(), claim);
  };
  for (const Member &delay : delays)
    consider(delay);
  // They are compared by the noise that the best of them leaves, not by that of before.
  const Noise noise = least_noise_of(found, plain);
  const auto best = [&] {
    return std::min_element(found.begin(), found.end(), [&](const auto &a, const auto &b) {
      return cost(a, a.fit.loss, noise) < cost(b, b.fit.loss, noise);
    });
  };
  // Its shape was found beside other terms than those that are there in the end.
  const Member delay = best()->members.front();
  const Member better = tuned(delay, {best()->members.begin() + 1, best()->members.end()}, noise);
  if (better.h.cols() > 0)
    consider(better);
  if (cost(*best(), best()->fit.loss, noise) >=
      cost(out_, fit_members(y_, out_.members, plain).loss, noise) - 1.0)
    return;
  ChannelFindings chosen = std::move(*best());
  chosen.flagged = out_.flagged;
  chosen.start = out_.start;
  chosen.unconfirmed.insert(chosen.unconfirmed.begin(), out_.unconfirmed.begin(),
                            out_.unconfirmed.end());
  out_ = std::move(chosen);
}

namespace {

// The table as it is when the term is part of the simulation: commands of the moment that acts, and
// the channel's prediction moved.
Measured behind(const Measured &measured, const Term &term) {
  Measured late = measured;
  for (std::size_t f = 0; f < late.features.size(); ++f) {
    if (!late.features[f].is_command)
      continue;
    for (const char *what : {"delay", "lag"}) { // what is late comes to the lag late
      for (const Parameter &p : term.shape) {
        if (p.name == what)
          late.features[f].name += fmt::format("{}{:.6g}", what[0] == 'd' ? '@' : '~', p.value);
      }
    }
    late.x.col(static_cast<Index>(f)) = feature_column(measured, late.features[f].name);
  }
  const int c = measured.find_channel(term.channel);
  if (c >= 0) {
    Channel &channel = late.channels[static_cast<std::size_t>(c)];
    channel.m += mean_effect(term, measured, channel.m);
  }
  return late;
}

} // namespace

// Loss of these members, sizes fitted anew, behind another delay than the one they were found
// behind.
double ChannelSearch::loss_behind(const Term &delay, std::vector<Member> members,
                                  const Noise &noise) const {
  const Measured late = behind(measured_, delay);
  const Channel &moved = late.channels[static_cast<std::size_t>(late.find_channel(channel_.name))];
  const auto rename = [&late](std::string *name) {
    for (const Feature &feature : late.features) {
      if (feature.is_command && base_feature(feature.name) == base_feature(*name))
        *name = feature.name;
    }
  };
  for (Member &member : members) {
    for (auto &[placeholder, feature] : member.term.arguments)
      rename(&feature);
    for (std::string &feature : member.term.gate.features)
      rename(&feature);
    set_columns(late, moved, moved.m, &member);
  }
  return fit_members((moved.z - moved.m).cwiseQuotient(moved.sd), members, noise).loss;
}

// The delay with the shape that is best beside these members; no columns: it is that already.
Member ChannelSearch::tuned(const Member &delay, const std::vector<Member> &beside,
                            const Noise &noise) const {
  Member out = delay;
  const double before = loss_behind(delay.term, beside, noise);
  double best = before;
  for (std::size_t k = 0; k < out.term.shape.size(); ++k) {
    double factor = kTuning;
    for (int step = 0; step < kTuneSteps; ++step) {
      bool moved = false;
      for (const double by : {factor, 1.0 / factor}) {
        Term term = out.term;
        term.shape[k].value *= by;
        const double loss = loss_behind(term, beside, noise);
        if (loss < best) {
          best = loss;
          out.term = term;
          moved = true;
          break;
        }
      }
      if (!moved)
        factor = std::sqrt(factor);
    }
  }
  if (before - best < kLeastTuned * noise.divisor())
    return Member{};
  set_columns(measured_, channel_, channel_.m, &out);
  return out;
}

// What is found when the delay is part of the simulation; its fit's loss is by `noise`.
ChannelFindings ChannelSearch::search_behind(const Member &delay, const Noise &noise) const {
  const Measured late = behind(measured_, delay.term);
  const Channel &moved = late.channels[static_cast<std::size_t>(late.find_channel(channel_.name))];
  SearchOptions options = options_;
  Measured held;
  if (options_.held != nullptr) {
    held = behind(*options_.held, delay.term);
    options.held = &held;
  }
  const Library library = make_library(late, moved, *options_.catalogue, false);
  ChannelSearch second(late, moved, library, options);
  second.prepare({});
  second.find_members(false);
  for (int round = 0; round < 3; ++round)
    second.smooth_unknowns();
  second.formulas_for_tables();
  second.drop_unconfirmed();
  second.drop_contradicted();
  second.fill_sizes();
  second.settle();
  second.refit_plain();
  second.out_.fit = fit_members(second.y_, second.out_.members, noise);
  return std::move(second.out_);
}

} // namespace rim::diagnose
