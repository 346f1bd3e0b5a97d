// SPDX-License-Identifier: MIT
// What is periodic in time and in nothing that the logs hold: an unbalanced rotor, an orbit, hum.
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

#include "diagnose/swing.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kMostSwings = 3, kRivals = 60;
constexpr int kSharpenings = 2;
constexpr double kNoClip = 1e6; // scales: nothing is cut
// A quantity is itself periodic where a line has this share of its squares; then its harmonics up
// to this one are none of the time.
constexpr double kOwnLine = 0.03;
constexpr int kHarmonics = 8;

const Form *swing_form(const Catalogue *catalogue) {
  if (catalogue == nullptr)
    return nullptr;
  const auto found = std::find_if(catalogue->forms.begin(), catalogue->forms.end(),
                                  [](const Form &form) { return form.form == kPeriodicTime; });
  return found == catalogue->forms.end() ? nullptr : &*found;
}

double frequency_of(const Member &swing) { return 1.0 / swing.term.shape[0].value; }

} // namespace

// Of a thinned table the whole one: a period may be shorter than the rows of a search are apart.
ChannelSearch::Whole ChannelSearch::whole_table() const {
  const Measured &table = measured_.whole != nullptr ? *measured_.whole : measured_;
  const auto c = static_cast<std::size_t>(table.find_channel(channel_.name));
  const Channel &channel = table.channels[c];
  Whole whole{table, channel, (channel.z - channel.m).cwiseQuotient(channel.sd),
              Vector::Ones(channel.z.size())};
  const Flagged flagged = find_flagged(table, channel);
  for (Index i = 0; i < whole.used.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (flagged.stuck[k] != 0 || flagged.dropout[k] != 0)
      whole.used(i) = 0.0;
  }
  return whole;
}

// Fitted to all rows; what the last of the members adds, where it is asked for.
Fit ChannelSearch::fit_on(const Whole &whole, const std::vector<Member> &members,
                          Vector *of_last) const {
  std::vector<Member> all = members;
  for (Member &member : all) {
    if (&whole.table != &measured_)
      set_columns(whole.table, whole.channel, whole.channel.m, &member);
  }
  Noise noise = out_.noise;
  noise.weight = whole.used;
  const Fit fit = fit_members(whole.y, all, noise);
  if (of_last != nullptr) {
    const Eigen::MatrixXd &h = all.back().h;
    *of_last = h * fit.beta.tail(h.cols());
  }
  return fit;
}

Member ChannelSearch::swing_member(const Swing &swing, bool is_shared) const {
  Member member;
  Term &term = member.term;
  const Form *form = swing_form(options_.catalogue);
  const double period = 1.0 / swing.frequency_hz;
  term.channel = channel_.name;
  term.cause = form->cause;
  term.form = form->form;
  term.shape = {{"period", period, swing.stderror_hz * period * period, "s"},
                {"phase", 0.0, 0.0, "rad"}};
  term.sizes = {{"amplitude", 1.0, 0.0, channel_.unit}};
  if (!is_shared)
    term.logs = paths_of(measured_);
  member.background = swing.background;
  member.p_value = swing.p_value;
  set_columns(measured_, channel_, channel_.m, &member);
  member.penalty = 0.5 * static_cast<double>(member.h.cols()) * library_.ln_rows +
                   std::log(swing.frequencies) + form->cost;
  return member;
}

// The spectrum of what is left, in the channel's unit: the stated sd may differ from row to row.
static Spectrum spectrum_of(const Measured &table, const Channel &channel, const Vector &used,
                            const Vector &left) {
  return {table, left.cwiseProduct(channel.sd), used.cwiseQuotient(channel.sd.cwiseAbs2())};
}

// Its frequency by least squares beside the others, whose sizes are fitted anew with it.
void ChannelSearch::sharpen(const Whole &whole, const std::vector<Member> &others,
                            Member *swing) const {
  const bool is_shared = swing->term.logs.empty();
  for (int round = 0; round < kSharpenings; ++round) {
    std::vector<Member> all = others;
    all.push_back(*swing);
    Vector of_swing;
    const Vector left = fit_on(whole, all, &of_swing).residual + of_swing;
    const Swing found =
        spectrum_of(whole.table, whole.channel, whole.used, left).near(frequency_of(*swing));
    if (!(found.frequency_hz > 0.0)) {
      swing->p_value = 1.0;
      return;
    }
    *swing = swing_member(found, is_shared);
  }
}

// The line that stands out most from what these members leave; no columns: noise has such ones.
Member ChannelSearch::swing_beside(const Whole &whole, const std::vector<Member> &others) const {
  const Swing found =
      spectrum_of(whole.table, whole.channel, whole.used, fit_on(whole, others, nullptr).residual)
          .strongest();
  if (!(found.frequency_hz > 0.0) || found.p_value > options_.most_p)
    return {};
  Member swing = swing_member(found, false);
  sharpen(whole, others, &swing);
  if (swing.p_value > options_.most_p)
    return {};
  return swing;
}

// One phase for all logs, counted from the begin of each, where that says as much as one for each.
void ChannelSearch::share_phase(const Whole &whole, const std::vector<Member> &others,
                                Member *swing) const {
  if (swing->term.logs.size() < 2)
    return;
  std::vector<Member> all = others;
  all.push_back(*swing);
  const double own = fit_on(whole, all, nullptr).loss;
  Swing at{frequency_of(*swing), 0.0, 0.0, swing->background, 1.0, swing->p_value};
  Member shared = swing_member(at, true);
  shared.term.shape[0] = swing->term.shape[0];
  shared.penalty = swing->penalty -
                   0.5 * static_cast<double>(swing->h.cols() - shared.h.cols()) * library_.ln_rows;
  all.back() = shared;
  const double one = fit_on(whole, all, nullptr).loss;
  if ((one - own) / swing->background < swing->penalty - shared.penalty)
    *swing = shared;
}

// Whether a form of the catalogue says what the swing does, or as much of it as its price is less:
// the sine of an angle that turns steadily, a gain of a command that is periodic. Both are held
// against what noise has at that frequency.
bool ChannelSearch::is_of_form(const Member &swing) const {
  std::vector<Member> all = out_.members;
  all.push_back(swing);
  const Fit with = fit_members(y_, all, out_.noise);
  Fit fit = fit_members(y_, out_.members, out_.noise);
  fit.residual = fit.clipped = swing.h * with.beta.tail(swing.h.cols());
  Noise noise = out_.noise;
  noise.scale = std::sqrt(swing.background);
  noise.spread = 1.0;
  noise.clip = kNoClip;
  const double score =
      0.5 * fit.residual.cwiseAbs2().dot(noise.weight) / noise.divisor() - swing.penalty;
  const std::vector<Proposal> rivals = scanner_->mean(fit, noise, kRivals);
  return std::any_of(rivals.begin(), rivals.end(), [&](const Proposal &rival) {
    return rival.score() > score && !excludes(rival, out_.members);
  });
}

// Whether a quantity is itself periodic so that the swing is its line or a harmonic of it. What is
// measured may answer the swing, and tells by its harmonics alone.
bool ChannelSearch::is_of_feature(const Whole &whole, const Member &swing) const {
  for (std::size_t f = 0; f < whole.table.features.size(); ++f) {
    const Feature &feature = whole.table.features[f];
    Vector x = whole.table.x.col(static_cast<Index>(f));
    if (feature.is_angle)
      x = (x.array() * (2.0 * M_PI / std::max(1e-300, turn_in(feature.unit)))).sin();
    const Spectrum spectrum(whole.table, x, Vector::Ones(x.size()));
    const bool is_cause =
        feature.is_command || feature.is_angle || feature.name.rfind("x.", 0) == 0;
    for (int k = is_cause ? 1 : 2; k <= kHarmonics; ++k) {
      if (spectrum.line_share(frequency_of(swing) / k) > kOwnLine)
        return true;
    }
  }
  return false;
}

// Whether it does better than what was found, or than some of that: other terms may stand for it.
bool ChannelSearch::says_more_than_found(const Member &swing) const {
  std::vector<Member> now = out_.members;
  now.push_back(swing);
  double score = score_of(now, out_.noise);
  for (bool any = true; any;) {
    any = false;
    for (std::size_t j = 0; j + 1 < now.size(); ++j) {
      std::vector<Member> less = now;
      less.erase(less.begin() + static_cast<std::ptrdiff_t>(j));
      const double of_less = score_of(less, out_.noise);
      if (now[j].is_given || is_swing(now[j].term) || of_less <= score)
        continue;
      score = of_less;
      now = less;
      any = true;
      break;
    }
  }
  return score > score_of(out_.members, out_.noise);
}

// One swing more, and everything searched anew beside it. True where that is better.
bool ChannelSearch::add_swing(const Whole &whole, const std::vector<Term> &given) {
  Member swing = swing_beside(whole, out_.members);
  const bool is_left = swing.h.cols() > 0 && !is_of_form(swing);
  if (!is_left) {
    std::vector<Member> base;
    for (const Member &member : out_.members) {
      if (member.is_given || is_swing(member.term))
        base.push_back(member);
    }
    if (base.size() == out_.members.size())
      return false;
    swing = swing_beside(whole, base);
    if (swing.h.cols() == 0 || !says_more_than_found(swing))
      return false;
  }
  if (is_of_feature(whole, swing))
    return false;
  const ChannelFindings before = out_;
  const Vector y = y_;
  const Allowed allowed = allowed_;
  swings_.push_back(swing);
  y_ = (channel_.z - channel_.m).cwiseQuotient(channel_.sd);
  prepare(given);
  find_beside_start(given);
  const auto at = static_cast<std::size_t>(std::find_if(out_.members.begin(), out_.members.end(),
                                                        [&](const Member &m) {
                                                          return is_swing(m.term) && !m.is_given &&
                                                                 m.term.shape[0].value ==
                                                                     swing.term.shape[0].value;
                                                        }) -
                                           out_.members.begin());
  if (at < out_.members.size()) {
    sharpen(whole, without(at), &swing);
    share_phase(whole, without(at), &swing);
    const Noise &noise = out_.noise.divisor() < before.noise.divisor() ? out_.noise : before.noise;
    if (swing.p_value <= options_.most_p &&
        (is_left || score_of(out_.members, noise) > score_of(before.members, noise))) {
      swings_.back() = out_.members[at] = swing;
      out_.fit = fit_members(y_, out_.members, out_.noise);
      return true;
    }
  }
  swings_.pop_back();
  out_ = before;
  y_ = y;
  allowed_ = allowed;
  scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
  return false;
}

void ChannelSearch::find_swings(const std::vector<Term> &given) {
  if (swing_form(options_.catalogue) == nullptr || !(options_.most_p > 0.0))
    return;
  const Whole whole = whole_table();
  while (swings_.size() < kMostSwings && add_swing(whole, given)) {
  }
}

// What the held-out logs have in another phase, or not at all, has a phase of its own in each log.
void ChannelSearch::part_phases() {
  for (std::size_t j = 0; has_held() && j < out_.members.size(); ++j) {
    Member &member = out_.members[j];
    if (!is_swing(member.term) || member.is_given || !member.term.logs.empty() ||
        held_loss(out_.members) <= held_loss(without(j)))
      continue;
    member.term.logs = paths_of(measured_);
    set_columns(measured_, channel_, channel_.m, &member);
    out_.fit = fit_members(y_, out_.members, out_.noise);
  }
}

} // namespace rim::diagnose
