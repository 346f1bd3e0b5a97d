// SPDX-License-Identifier: MIT
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kPlainClip = 10.0; // scales: what counts as plain squares
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
    if (out_.members[j].is_given || out_.members[j].candidate < 0 ||
        out_.members[j].term.shape.empty())
      continue;
    const std::vector<Member> others = without(j);
    refine_shape(others, fit_members(y_, others, out_.noise).loss, &out_.members[j]);
  }
  out_.fit = fit_members(y_, out_.members, out_.noise);
  fill_sizes();
  out_.noise = weighed;
}

// The best delay and the best lag beside the others, by plain squares; of two that do the same the
// first.
std::vector<Member> ChannelSearch::best_delays(const std::vector<Member> &others,
                                               const Noise &plain) {
  const Noise weighed = out_.noise;
  out_.noise = plain;
  const Fit fit = fit_members(y_, others, plain);
  std::map<std::string, std::vector<Proposal>> by_form;
  for (const Proposal &p : scanner_->mean(fit, plain, 1000)) {
    const Term &term = library_.candidates[static_cast<std::size_t>(p.candidate)].term;
    if (moves_prediction(term))
      by_form[term.form].push_back(p);
  }
  std::vector<Member> delays;
  std::vector<double> scores;
  for (const auto &[form, proposals] : by_form) {
    const Best best = best_of(proposals, others, fit, 3);
    const bool is_new = std::none_of(scores.begin(), scores.end(), [&](double score) {
      return std::abs(score - best.score) < 1e-3 * std::abs(score);
    });
    if (best.score > -1e299 && is_new) {
      delays.push_back(best.member);
      scores.push_back(best.score);
    }
  }
  out_.noise = weighed;
  return delays;
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
  delays.push_back(*first);
  const auto cost = [this](const ChannelFindings &found, double loss, const Noise &noise) {
    double sum = loss / noise.divisor();
    for (const Member &member : found.members)
      sum += member.penalty;
    return sum;
  };
  double least = cost(out_, fit_members(y_, out_.members, plain).loss, plain) - 1.0;
  ChannelFindings chosen;
  for (const Member &delay : delays) {
    ChannelFindings found = search_behind(delay, plain);
    const double then = cost(found, found.fit.loss, plain) + delay.penalty;
    if (then < least) {
      least = then;
      chosen = std::move(found);
      chosen.members.insert(chosen.members.begin(), delay);
      chosen.claims.insert(chosen.claims.begin(), claim);
    }
  }
  if (chosen.members.empty())
    return;
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
    if (!late.features[f].is_command || term.form == "lag_delay")
      continue;
    late.features[f].name +=
        fmt::format("{}{:.6g}", term.form.rfind("lag", 0) == 0 ? '~' : '@', term.shape[0].value);
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
  const Library library = make_library(late, moved, *options_.catalogue);
  ChannelSearch second(late, moved, library, options);
  second.prepare({});
  second.find_members(false);
  for (int round = 0; round < 3; ++round)
    second.smooth_unknowns();
  second.drop_unconfirmed();
  second.drop_contradicted();
  second.fill_sizes();
  second.settle();
  second.refit_plain();
  second.out_.fit = fit_members(second.y_, second.out_.members, noise);
  return std::move(second.out_);
}

} // namespace rim::diagnose
