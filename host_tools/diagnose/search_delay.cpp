// SPDX-License-Identifier: MIT
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kLeastBeyondLevel = 0.01; // share of the rows: what few go beyond is no limit
// Of a delay's shape beside what was found behind it: steps, the first factor, and the nats that a
// change must be worth.
constexpr int kTuneSteps = 12;
constexpr double kTuning = 1.3, kLeastTuned = 2.0;
constexpr double kPlainClip = 10.0; // scales: what counts as plain squares
// Delays and lags behind which all is searched again; by which share of their cost two are one.
constexpr std::size_t kMostDelays = 2;
constexpr double kSameCost = 1e-3;
// By what share a dead zone before a delay must lower the squares where it was not fitted.
constexpr double kLeastZone = 0.02;
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

// A gain and a constant, with which a dead zone before a delay is looked for: they are searched for
// behind it.
std::vector<Member> ChannelSearch::gain_and_bias() const {
  std::vector<Member> members;
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const std::string &form = library_.candidates[c].term.form;
    if (form == "gain" || form == "bias")
      members.push_back(form_member(static_cast<int>(c), false));
  }
  return members;
}

// The delay or lag with a level of this kind before it, where that fits clearly better: of the
// prediction that a command makes nothing comes below a level, or beyond it, and what does comes
// late. No columns: there is none.
Member ChannelSearch::behind_level(const std::string &kind, const Member &delay,
                                   const std::vector<Member> &beside, const Noise &noise) const {
  Member out = delay;
  double best = (1.0 - kLeastZone) * loss_behind(delay.term, beside, noise);
  bool is_better = false;
  for (const Candidate &candidate : library_.candidates) {
    if (candidate.term.form != kind)
      continue;
    Term term = delay.term;
    term.shape.push_back(candidate.term.shape[0]);
    term.shape.back().name = kind;
    const double loss = loss_behind(term, beside, noise);
    if (loss < best) {
      best = loss;
      out.term = term;
      out.penalty = delay.penalty + candidate.penalty;
      is_better = true;
    }
  }
  if (!is_better)
    return Member{};
  const Member better = tuned(out, beside, noise);
  if (better.h.cols() > 0)
    return better;
  set_columns(measured_, channel_, channel_.m, &out);
  return out;
}

// By what share the squares fall by a level before the delay, where it was not fitted: shapes are
// fitted to every second block of the logs and judged on the others.
double ChannelSearch::level_held_out(const std::string &kind, const Member &delay,
                                     const std::vector<Member> &beside, const Noise &noise) const {
  double with = 0.0, less = 0.0;
  for (std::size_t fold = 0; fold < 2; ++fold) {
    Noise train = noise, test = noise;
    for_each_row([&](Index k, std::size_t, std::size_t block) {
      (block % 2 == fold ? train : test).weight(k) = 0.0;
    });
    const Member better = tuned(delay, beside, train);
    const Member &plain = better.h.cols() > 0 ? better : delay;
    const Member zone = behind_level(kind, plain, beside, train);
    less += loss_behind(plain.term, beside, test);
    with += loss_behind(zone.h.cols() > 0 ? zone.term : plain.term, beside, test);
  }
  return less > 0.0 ? 1.0 - with / less : 0.0;
}

// The delays and lags with a dead zone or saturation before each, where that holds.
std::vector<Member> ChannelSearch::behind_levels(const std::vector<Member> &delays,
                                                 const Noise &noise) const {
  const std::vector<Member> beside = gain_and_bias();
  std::vector<Member> out;
  for (const Member &delay : delays) {
    if (!delay.term.response.empty() || !delay.term.ridges.empty() ||
        !delay.term.arguments.empty() || delay.is_given)
      continue;
    for (const char *kind : {kBeyond, kUpTo}) {
      Member zone = behind_level(kind, delay, beside, noise);
      if (!(zone.h.cols() > 0) || level_held_out(kind, delay, beside, noise) <= kLeastZone)
        continue;
      // Its level trades with a gain: where there is none, the level is better without.
      Member alone = tuned(zone, {}, noise);
      out.push_back(std::move(zone));
      if (alone.h.cols() > 0)
        out.push_back(std::move(alone));
    }
  }
  return out;
}

// The dead zone or saturation before a delay or lag as a member of its own, which stands before it;
// `without`: what the best model without it costs more.
void ChannelSearch::add_level(const Noise &noise, double without) {
  const Parameter *before = level_before(out_.members.front().term);
  if (before == nullptr)
    return;
  const std::string kind = before->name;
  const double level = before->value;
  const auto found = std::find_if(library_.candidates.begin(), library_.candidates.end(),
                                  [&kind](const Candidate &c) { return c.term.form == kind; });
  Member zone, delay = out_.members.front();
  auto &shape = delay.term.shape;
  shape.erase(std::remove_if(shape.begin(), shape.end(), is_level_before), shape.end());
  if (kind == kUpTo &&
      (channel_.m.array().abs() > level).cast<double>().mean() < kLeastBeyondLevel) {
    set_columns(measured_, channel_, channel_.m, &delay);
    delay.penalty -= found->penalty;
    out_.members.front() = delay;
    return;
  }
  zone.term = found->term;
  zone.term.form = kind == kUpTo ? kSaturationBefore : kDeadZoneBefore;
  zone.term.shape[0].value = level;
  zone.is_fixed = true;
  zone.penalty = found->penalty;
  out_.members.front().penalty -= zone.penalty;
  set_columns(measured_, channel_, channel_.m, &zone);
  Claim claim;
  claim.score = without;
  claim.ln_anom = without + zone.penalty;
  claim.heldout_r2 = level_held_out(kind, delay, gain_and_bias(), noise);
  out_.members.insert(out_.members.begin(), zone);
  out_.claims.insert(out_.claims.begin(), claim);
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

// The member that tells that something comes late: a delay or a lag, or a dead zone, of which one
// that stands before a lag shows most. As many as there are members: none does.
std::size_t ChannelSearch::late_member() const {
  std::size_t zone = out_.members.size();
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    const Member &m = out_.members[j];
    if (m.is_given)
      continue;
    if (moves_prediction(m.term))
      return j;
    if (m.term.cause == "dead_zone" && m.term.gate.everywhere())
      zone = j;
  }
  return zone;
}

// The delays and lags behind which all is searched again: the best beside the others, the one that
// was found, and each with a dead zone before it.
std::vector<Member> ChannelSearch::delays_to_follow(std::size_t at, const Noise &plain) const {
  const Member &found = out_.members[at];
  std::vector<Member> delays = best_delays(without(at), plain);
  const bool is_among = std::any_of(delays.begin(), delays.end(), [&found](const Member &delay) {
    return delay.term.form == found.term.form;
  });
  if (!is_among && moves_prediction(found.term))
    delays.push_back(found);
  for (Member &zone : behind_levels(delays, plain))
    delays.push_back(std::move(zone));
  return delays;
}

// When a command acts late, what else acts with it is late too: the search once more with the
// delayed prediction as prediction and commands of that moment as features, for the best delay and
// for the best lag; kept where it explains more.
void ChannelSearch::follow_delay() {
  const std::size_t at = late_member();
  if (at == out_.members.size() || !allowed_.late)
    return;
  const bool has_claim = moves_prediction(out_.members[at].term);
  const Claim claim = has_claim ? out_.claims[at] : Claim{};
  const Noise plain = plain_noise();
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
  for (const Member &delay : delays_to_follow(at, plain))
    consider(delay);
  if (found.empty())
    return;
  // They are compared by the noise that the best of them leaves, not by that of before.
  const Noise noise = least_noise_of(found, plain);
  const auto of = [&](const ChannelFindings &one) { return cost(one, one.fit.loss, noise); };
  const auto best = [&] {
    return std::min_element(found.begin(), found.end(),
                            [&](const auto &a, const auto &b) { return of(a) < of(b); });
  };
  // Its shape was found beside other terms than those that are there in the end.
  const Member delay = best()->members.front();
  const Member better = tuned(delay, {best()->members.begin() + 1, best()->members.end()}, noise);
  if (better.h.cols() > 0)
    consider(better);
  const double before = cost(out_, fit_members(y_, out_.members, plain).loss, noise),
               least = of(*best());
  if (least >= before - 1.0)
    return;
  double without_zone = before;
  for (const ChannelFindings &one : found) {
    if (level_before(one.members.front().term) == nullptr)
      without_zone = std::min(without_zone, of(one));
  }
  take_followed(std::move(*best()));
  if (!has_claim) { // by what the model says more than the one without
    out_.claims.front().score = before - least;
    out_.claims.front().ln_anom = before - least + out_.members.front().penalty;
    out_.claims.front().heldout_r2 = 1.0 - left_where_not_fitted(out_.members, 0);
  }
  add_level(plain, without_zone - least);
}

// What was found behind a delay in place of what was found before.
void ChannelSearch::take_followed(ChannelFindings found) {
  found.flagged = out_.flagged;
  found.start = out_.start;
  found.unconfirmed.insert(found.unconfirmed.begin(), out_.unconfirmed.begin(),
                           out_.unconfirmed.end());
  out_ = std::move(found);
}

namespace {

// The table as it is when the term is part of the simulation: commands of the moment that acts, and
// the channel's prediction moved.
Measured behind(const Measured &measured, const Term &term) {
  Measured late = measured;
  for (std::size_t f = 0; f < late.features.size(); ++f) {
    if (!late.features[f].is_command || term.arguments.count(kAlong) > 0)
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
    const Vector before = channel.m;
    channel.m += mean_effect(term, measured, before);
    channel.m += after_level(before, level_before(term)) - before;
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

namespace {

// Seconds of a delay and of a lag do nearly the same: along their sum's valley neither moves alone.
bool may_trade(const Term &term) {
  return term.shape.size() >= 2 && term.shape[0].name == "lag" && term.shape[1].name == "delay";
}

void trade(double by, Term *term) {
  double &lag = term->shape[0].value, &delay = term->shape[1].value;
  const double seconds = (by - 1.0) * std::min(lag, delay);
  lag += seconds;
  delay -= seconds;
}

} // namespace

// The delay with the shape that is best beside these members; no columns: it is that already.
Member ChannelSearch::tuned(const Member &delay, const std::vector<Member> &beside,
                            const Noise &noise) const {
  Member out = delay;
  const double before = loss_behind(delay.term, beside, noise);
  double best = before;
  const std::size_t shapes = out.term.shape.size(), ways = shapes + (may_trade(out.term) ? 1 : 0);
  for (std::size_t turn = 0; turn < ways * shapes; ++turn) { // what trades is tuned in turns
    const std::size_t k = turn % ways;
    double factor = kTuning;
    for (int step = 0; step < kTuneSteps; ++step) {
      bool moved = false;
      for (const double by : {factor, 1.0 / factor}) {
        Term term = out.term;
        if (k < shapes)
          term.shape[k].value *= by;
        else
          trade(by, &term);
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
  second.swings_ = swings_;
  second.prepare({});
  second.find_members({false, allowed_.levels});
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
