// SPDX-License-Identifier: MIT
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// A stated sd that is a tenth out is no finding; nor is a global factor this small.
constexpr double kLeastNoiseFactor = 1.16;
// Healthy runs scatter differently from each other by about as much as this.
constexpr double kLeastRunFactor = 1.3;
// What a term must gain, in nats, on rows it was not fitted to.
constexpr double kLeastHeldOut = 2.0;
// By what share the held-out squares must fall, and in what share of the parts that a term touches:
// where it acts with a tenth of the mean strength at least.
constexpr double kLeastFall = 0.005, kLeastBetter = 0.6, kTouches = 0.1;
// Support: the share of a feature's range below which it bounds a term, and the margin beyond.
constexpr double kSupportShare = 0.5, kSupportMargin = 0.2;
// By what share the held logs' squares must fall for a term to go; rounds of a claim's settling.
constexpr double kLeastHarm = 0.002, kClearHarm = 0.03;
// BIC by which a rival may be behind that the held logs prefer, and by what share of their squares.
constexpr double kNearBic = 20.0, kClearlyBetter = 0.1;
// By what share of those squares a rival may be worse whose BIC is as much better.
constexpr double kHardlyWorse = 0.015;
constexpr int kMostVaried = 4;
constexpr double kLeastErrors = 1.96; // standard errors that a size must be away from none
constexpr double kHeldClip = 10.0;    // scales at which a held-out residual is cut
constexpr int kMostSettling = 6;
constexpr std::size_t kMostLogs = 40; // of which each may have a size of its own
constexpr double kOwnMargin = 0.1;    // of the range of a term's own argument
constexpr double kFar = 10.0;         // ranges: where no bound is meant

// In its own arguments a term goes on a little way beyond what was seen.
void limit_own(const Feature &feature, const Vector &x, Term *term) {
  const auto &gated = term->gate.features;
  if (std::find(gated.begin(), gated.end(), feature.name) != gated.end())
    return;
  const double least = x.minCoeff(), most = x.maxCoeff();
  term->support.features.push_back(feature.name);
  term->support.units.push_back(feature.unit);
  term->support.lower.push_back(least - kOwnMargin * (most - least));
  term->support.upper.push_back(most + kOwnMargin * (most - least));
}

// Whether a term names the feature itself: then how it goes on there is what the term says.
bool is_own(const Term &term, const std::string &feature) {
  const auto &gated = term.gate.features;
  return std::find(gated.begin(), gated.end(), feature) != gated.end() ||
         std::any_of(term.arguments.begin(), term.arguments.end(),
                     [&feature](const auto &argument) { return argument.second == feature; });
}

// One size, and its standard error says that it may as well be none.
bool is_within_error(const Term &term) {
  return term.sizes.size() == 1 && term.sizes[0].per_log.empty() && term.sizes[0].stderror > 0.0 &&
         std::abs(term.sizes[0].value) < kLeastErrors * term.sizes[0].stderror;
}

} // namespace

// Score of the members where each has the shape that is best beside the others. A band of rest that
// the held-out logs chose suits what it was chosen beside: which of two causes of about the same
// merit stands beside it is no merit of that band.
double ChannelSearch::tuned_score(std::vector<Member> members) const {
  double best = score_of(members, out_.noise);
  for (std::size_t j = 0; j < members.size(); ++j) {
    if (members[j].is_given || members[j].candidate < 0 || members[j].differs ||
        members[j].term.shape.empty() || moves_prediction(members[j].term))
      continue;
    std::vector<Member> others = members;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(j));
    std::vector<Member> tried = members;
    for (const int variant : variants(members[j])) {
      if (library_.candidates[static_cast<std::size_t>(variant)].term.form != members[j].term.form)
        continue;
      tried[j] = form_member(variant, false);
      refine_shape(others, 0.0, &tried[j]);
      const double score = score_of(tried, out_.noise);
      if (score > best) {
        best = score;
        members[j] = tried[j];
      }
    }
  }
  return best;
}

Member ChannelSearch::judge_alternatives(std::size_t which, const std::vector<Member> &others,
                                         Claim *claim) const {
  const Member &member = out_.members[which];
  const Fit fit = fit_members(y_, others, out_.noise);
  std::map<std::string, Best> by_cause;
  std::map<std::string, int> tried;
  for (const Proposal &proposal : scanner_->mean(fit, out_.noise, 400)) {
    const std::string &cause =
        library_.candidates[static_cast<std::size_t>(proposal.candidate)].term.cause;
    if (cause == member.term.cause || ++tried[cause] > 2)
      continue;
    Best best = best_of({proposal}, others, fit, 1);
    if (best.score > by_cause[cause].score)
      by_cause[cause] = best;
  }
  Member rival;
  double most = -1e299;
  for (auto &[cause, best] : by_cause) {
    if (best.score < -1e299)
      continue;
    if (best.score > most) {
      most = best.score;
      rival = best.member;
    }
    Alternative alternative;
    alternative.cause = cause;
    std::vector<Member> all = others;
    all.push_back(best.member);
    alternative.delta_bic = 2.0 * (claim->score - best.score);
    if (std::abs(alternative.delta_bic) < kNearBic)
      alternative.delta_bic = 2.0 * (tuned_score(out_.members) - tuned_score(all));
    const Fit with = fit_members(y_, all, out_.noise);
    Index at = with.beta.size() - best.member.h.cols();
    for (Index k = 0; k < best.member.h.cols(); ++k)
      best.member.term.sizes.push_back(
          {"size", best.member.is_fixed ? 1.0 : with.beta(at + k), 0.0, ""});
    alternative.expression = expression_text(best.member.term);
    if (!best.member.term.gate.everywhere())
      alternative.expression += " where " + gate_text(best.member.term.gate);
    alternative.heldout_r2 = heldout_r2_of(all);
    if (best.score >= most) {
      claim->rival_bic = alternative.delta_bic;
      claim->rival_r2 = alternative.heldout_r2;
    }
    claim->alternatives.push_back(alternative);
  }
  if (member.term.form == "expression")
    add_rival_expressions(others, fit, claim);
  std::sort(claim->alternatives.begin(), claim->alternatives.end(),
            [](const Alternative &a, const Alternative &b) { return a.delta_bic < b.delta_bic; });
  if (claim->alternatives.size() > 5)
    claim->alternatives.resize(5);
  claim->is_separable =
      claim->alternatives.empty() || claim->alternatives.front().delta_bic > kSeparableBic;
  return rival;
}

// Of the last of these members.
double ChannelSearch::heldout_r2_of(const std::vector<Member> &members) const {
  return 1.0 - left_where_not_fitted(members, members.size() - 1);
}

// Sizes fitted without a part of the rows, judged on it, with the term and without it: each log in
// turn where the term acts in several of at least three logs, every second block otherwise. So too
// where a term has a size, or a phase, of its own in every log: that of a log which was not fitted
// is unknown.
void ChannelSearch::hold_out(std::size_t which, Claim *claim) const {
  const Member &member = out_.members[which];
  const Vector acts = member.h.rowwise().squaredNorm();
  double most = 0.0;
  for (const LogSpan &log : measured_.logs)
    most = std::max(
        most, acts.segment(static_cast<Index>(log.first), static_cast<Index>(log.rows)).sum());
  const bool any_differs =
      std::any_of(out_.members.begin(), out_.members.end(), [](const Member &m) {
        return m.differs || (is_swing(m.term) && !m.term.logs.empty());
      });
  const bool by_log = measured_.logs.size() >= 3 && most < 0.8 * acts.sum() && !any_differs;
  const std::size_t folds = by_log ? measured_.logs.size() : 2;
  std::vector<Part> parts(measured_.logs.size() * kBlocks);
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Noise train = out_.noise;
    for_each_row([&](Index k, std::size_t log, std::size_t block) {
      if ((by_log ? log : block % 2) == fold)
        train.weight(k) = 0.0;
    });
    // Wide: what a delay explains is in few rows, and large.
    const double corner = kHeldClip * out_.noise.scale;
    const Vector with = fit_members(y_, out_.members, train).residual,
                 less = fit_members(y_, without(which), train).residual;
    const auto loss = [&](double e, Index k) {
      return 0.5 * std::pow(std::clamp(e * std::sqrt(out_.noise.weight(k)), -corner, corner), 2.0);
    };
    for_each_row([&](Index k, std::size_t log, std::size_t block) {
      if ((by_log ? log : block % 2) != fold || !(out_.noise.weight(k) > 0.0))
        return;
      Part &part = parts[by_log ? log : log * kBlocks + block];
      part.with += loss(with(k), k);
      part.less += loss(less(k), k);
      part.acts += acts(k);
    });
  }
  judge_parts(parts, by_log, is_swing(member.term) ? member.background : out_.noise.divisor(),
              claim);
}

void ChannelSearch::judge_parts(const std::vector<Part> &parts, bool by_log, double divisor,
                                Claim *claim) const {
  double with = 0.0, less = 0.0, acts = 0.0, most_gained = 0.0, touched = 0.0, better = 0.0;
  for (const Part &part : parts) {
    with += part.with;
    less += part.less;
    acts += part.acts;
    most_gained = std::max(most_gained, part.less - part.with);
  }
  for (const Part &part : parts) {
    if (part.acts * static_cast<double>(parts.size()) < kTouches * acts)
      continue;
    touched += 1.0;
    better += part.with < part.less ? 1.0 : 0.0;
  }
  // Of logs: not by the merit of one alone.
  claim->heldout_ln = (less - with - (by_log ? most_gained : 0.0)) / divisor;
  claim->heldout_r2 = less > 0.0 ? 1.0 - with / less : 0.0;
  claim->is_confirmed = claim->heldout_ln > kLeastHeldOut && claim->heldout_r2 > kLeastFall &&
                        (touched < 3.0 || better > kLeastBetter * touched);
}

void ChannelSearch::judge() {
  out_.claims.clear();
  const double loss = out_.fit.loss;
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    Claim claim;
    const std::vector<Member> others = without(j);
    claim.ln_anom =
        (fit_members(y_, others, out_.noise).loss - loss) /
        (is_swing(out_.members[j].term) ? out_.members[j].background : out_.noise.divisor());
    claim.score = claim.ln_anom - out_.members[j].penalty;
    hold_out(j, &claim);
    const bool has_rivals =
        out_.members[j].candidate >= 0 || out_.members[j].term.form == "expression";
    if (!out_.members[j].is_given && has_rivals)
      claim.rival = judge_alternatives(j, others, &claim);
    out_.claims.push_back(claim);
  }
}

// Terms with the sizes that a fit of just these members gives them. The members found so far come
// back to where they were: a caller may hold a reference to one of them.
std::vector<Term> ChannelSearch::sized(const std::vector<Member> &members) {
  std::vector<Member> kept = members;
  Fit fit = out_.fit;
  std::swap(out_.members, kept);
  out_.fit = fit_members(y_, members, out_.noise);
  fill_sizes();
  std::vector<Term> terms;
  for (const Member &member : out_.members)
    terms.push_back(member.term);
  std::swap(out_.members, kept);
  out_.fit = std::move(fit);
  return terms;
}

// Takes a term out of the model and remembers it.
void ChannelSearch::set_aside(std::size_t which, const std::string &reason) {
  Term term = sized(out_.members)[which];
  swings_.erase(std::remove_if(swings_.begin(), swings_.end(),
                               [&term](const Member &swing) {
                                 return is_swing(term) &&
                                        swing.term.shape[0].value == term.shape[0].value;
                               }),
                swings_.end());
  turn_sign(&term);
  out_.unconfirmed.push_back({term, reason});
  out_.members = without(which);
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// A law that does not hold in logs which it was not fitted to may be one whose size differs between
// them: with a size of its own in each it stays where it then holds and says more.
bool ChannelSearch::let_differ(std::size_t which) {
  const Member &member = out_.members[which];
  const bool any_differs = std::any_of(out_.members.begin(), out_.members.end(),
                                       [](const Member &m) { return m.differs; });
  if (measured_.logs.size() < 2 || measured_.logs.size() > kMostLogs || any_differs ||
      !is_law(member) || member.h.cols() != 1 || member.is_fixed || moves_prediction(member.term))
    return false;
  const ChannelFindings before = out_;
  out_.members[which] = form_member(member.candidate, true);
  out_.fit = fit_members(y_, out_.members, out_.noise);
  estimate_noise();
  out_.fit = fit_members(y_, out_.members, out_.noise);
  Claim claim;
  hold_out(which, &claim);
  if (claim.is_confirmed &&
      score_of(out_.members, out_.noise) > score_of(before.members, out_.noise))
    return true;
  out_ = before;
  return false;
}

// Sizes that agree after all, beside what was found since or within their standard errors, are one.
void ChannelSearch::join_sizes() {
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (!out_.members[j].differs || out_.members[j].is_given || out_.members[j].candidate < 0)
      continue;
    std::vector<Member> joined = out_.members;
    joined[j] = form_member(joined[j].candidate, false);
    const std::vector<Parameter> sizes = sized(out_.members)[j].sizes;
    if (!(sizes[0].between_logs_sd > 0.0) ||
        score_of(joined, out_.noise) >= score_of(out_.members, out_.noise))
      out_.members = std::move(joined);
  }
}

// A term that does not hold where it was not fitted is no finding: of those the one that explains
// least goes first, and the others are fitted anew.
void ChannelSearch::drop_unconfirmed() {
  for (;;) {
    std::size_t worst = out_.members.size();
    double least = 1e300;
    const double loss = fit_members(y_, out_.members, out_.noise).loss;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      Claim claim;
      hold_out(j, &claim);
      if (out_.members[j].is_given || claim.is_confirmed)
        continue;
      const double explains = fit_members(y_, without(j), out_.noise).loss - loss;
      if (explains < least) {
        least = explains;
        worst = j;
      }
    }
    if (worst == out_.members.size())
      break;
    if (!let_differ(worst))
      set_aside(worst, kNotElsewhere);
  }
  join_sizes();
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

namespace {

// Where a size differs between logs a new log has one of its own: that its form holds there is
// judged with the size that fits best, one log after the other.
Vector with_own_sizes(const std::vector<Term> &terms, const std::vector<Member> &members,
                      const Channel &channel, const Measured &held) {
  Vector m = extended_prediction(terms, channel, held).m;
  for (std::size_t j = 0; j < terms.size(); ++j) {
    if (!members[j].differs)
      continue;
    const Vector effect = mean_effect(terms[j], held, channel.m);
    for (const LogSpan &log : held.logs) {
      const auto first = static_cast<Index>(log.first), rows = static_cast<Index>(log.rows);
      const Vector
          e = effect.segment(first, rows).cwiseQuotient(channel.sd.segment(first, rows)),
          r = (channel.z - m).segment(first, rows).cwiseQuotient(channel.sd.segment(first, rows));
      const double squares = e.squaredNorm();
      if (squares > 0.0)
        m.segment(first, rows) += e.dot(r) / squares * effect.segment(first, rows);
    }
  }
  return m;
}

} // namespace

// Mean square on the held logs, in stated sd, of the model of these members.
double ChannelSearch::held_loss(const std::vector<Member> &members) {
  const Channel &channel = held_channel();
  const std::vector<double> squares =
      held_squares(with_own_sizes(sized(members), members, channel, *options_.held));
  return std::accumulate(squares.begin(), squares.end(), 0.0);
}

const Channel &ChannelSearch::held_channel() const {
  const Measured &held = *options_.held;
  return held.channels[static_cast<std::size_t>(held.find_channel(channel_.name))];
}

// Squares that a prediction leaves on each of the held logs, in stated sd.
std::vector<double> ChannelSearch::held_squares(const Vector &after) const {
  const Measured &held = *options_.held;
  const Channel &channel = held_channel();
  const Flagged flagged = find_flagged(held, channel);
  std::vector<double> sums;
  for (const LogSpan &log : held.logs) {
    double sum = 0.0;
    for (std::size_t at = log.first; at < log.first + log.rows; ++at) {
      const auto i = static_cast<Index>(at);
      if (flagged.stuck[at] == 0 && flagged.dropout[at] == 0)
        sum += std::pow((channel.z(i) - after(i)) / channel.sd(i), 2.0);
    }
    sums.push_back(sum);
  }
  return sums;
}

bool ChannelSearch::has_held() const {
  return options_.held != nullptr && options_.held->find_channel(channel_.name) >= 0;
}

// Other forms of the same thing that may stand in a member's place: a friction with another band of
// rest or none, from the plainest on.
std::vector<int> ChannelSearch::variants(const Member &member) const {
  std::vector<int> found;
  if (member.is_given || member.candidate < 0 || !member.term.gate.everywhere() || member.differs)
    return found;
  const Candidate &own = library_.candidates[static_cast<std::size_t>(member.candidate)];
  for (std::size_t c = 0; own.is_physical && c < library_.candidates.size(); ++c) {
    const Candidate &other = library_.candidates[c];
    if (static_cast<int>(c) != member.candidate && other.group == own.group &&
        !moves_prediction(other.term))
      found.push_back(static_cast<int>(c));
  }
  return found;
}

// Terms go one by one, always the one whose going harms the held logs least, until none is left; of
// the models on the way the best on the held logs is kept. One by one is not enough: of two terms
// that hold each other neither can go alone.
void ChannelSearch::shrink_to_held() {
  std::vector<Member> now = out_.members;
  std::vector<std::string> going; // in the order of their going
  double least = held_loss(now) * (1.0 - kLeastHarm);
  std::size_t best = 0;
  const auto key = [](const Member &m) {
    return expression_text(m.term) + gate_text(m.term.gate) + m.term.form;
  };
  for (;;) {
    std::size_t next = now.size();
    double loss_of_next = 1e300;
    for (std::size_t j = 0; j < now.size(); ++j) {
      if (now[j].is_given || is_swing(now[j].term)) // no phase is known in another log
        continue;
      std::vector<Member> less = now;
      less.erase(less.begin() + static_cast<std::ptrdiff_t>(j));
      const double loss = held_loss(less);
      if (loss < loss_of_next) {
        loss_of_next = loss;
        next = j;
      }
    }
    if (next == now.size())
      break;
    going.push_back(key(now[next]));
    now.erase(now.begin() + static_cast<std::ptrdiff_t>(next));
    if (loss_of_next < least) {
      least = loss_of_next;
      best = going.size();
    }
  }
  for (std::size_t k = 0; k < best; ++k) {
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (!out_.members[j].is_given && key(out_.members[j]) == going[k]) {
        set_aside(j, kWorseHeld);
        break;
      }
    }
  }
}

// Other forms of the same thing where they do better on the held logs: a plainer one if it does at
// all, one with a shape of its own if it does clearly.
bool ChannelSearch::vary_to_held() {
  const double now = held_loss(out_.members);
  double least = now * (1.0 - kLeastHarm);
  std::vector<Member> best;
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    for (const int variant : variants(out_.members[j])) {
      std::vector<Member> members = out_.members;
      members[j] = form_member(variant, false);
      members[j].keeps_shape = true;
      const Candidate &candidate = library_.candidates[static_cast<std::size_t>(variant)];
      const bool is_plain = candidate.columns == 1 && candidate.term.shape.empty();
      const double loss = held_loss(members);
      if (loss < (is_plain ? least : std::min(least, now * (1.0 - kClearHarm)))) {
        least = loss;
        best = std::move(members);
      }
    }
  }
  if (best.empty())
    return false;
  out_.members = std::move(best);
  out_.fit = fit_members(y_, out_.members, out_.noise);
  return true;
}

// Share of the squares without the member that are left with it, where the sizes were not fitted.
double ChannelSearch::left_where_not_fitted(const std::vector<Member> &members,
                                            std::size_t which) const {
  ChannelSearch copy(measured_, channel_, library_, options_);
  copy.y_ = y_;
  copy.out_.members = members;
  copy.out_.noise = out_.noise;
  Claim claim;
  copy.hold_out(which, &claim);
  return 1.0 - claim.heldout_r2;
}

// What makes the held logs worse is not claimed, or claimed in its plainer form.
void ChannelSearch::drop_contradicted() {
  // What comes beside a delay is judged behind it.
  const bool is_late = std::any_of(out_.members.begin(), out_.members.end(),
                                   [](const Member &m) { return moves_prediction(m.term); });
  if (is_late || !has_held())
    return;
  for (int round = 0; round < kMostVaried && vary_to_held(); ++round) {
  }
  shrink_to_held();
  for (int round = 0; round < kMostVaried && vary_to_held(); ++round) {
  }
}

// Whether the claim is rather its rival: one that fits better and holds no worse where it was not
// fitted, or fits clearly better and holds hardly worse; or one that fits about as well and does
// clearly better there (a drift, where what it
// stands for is the charge that falls with the time).
bool ChannelSearch::is_beaten(const Claim &claim) const {
  if (claim.rival.h.cols() == 0)
    return false;
  return (claim.rival_bic < 0.0 && claim.rival_r2 >= claim.heldout_r2) ||
         (claim.rival_bic < -kNearBic &&
          1.0 - claim.rival_r2 <= (1.0 + kHardlyWorse) * (1.0 - claim.heldout_r2)) ||
         (claim.rival_bic < kNearBic &&
          1.0 - claim.rival_r2 < (1.0 - kClearlyBetter) * (1.0 - claim.heldout_r2));
}

// Squares of what is new in every row, beside these members and the noise of the start.
double ChannelSearch::innovations(std::vector<Member> members) {
  out_.members.swap(members);
  const Vector left = left_beside_start((channel_.z - channel_.m).cwiseQuotient(channel_.sd));
  out_.members.swap(members);
  return whitened(left).squaredNorm();
}

// Whether the rival is better too where that noise is taken off beside it: taken off beside the
// claim, it holds what the claim leaves, and a rival gains by saying that.
bool ChannelSearch::is_beaten_beside_start(std::size_t which) {
  if (out_.start.theta <= 0.0)
    return true;
  const Member &rival = out_.claims[which].rival;
  std::vector<Member> instead = out_.members;
  instead[which] = rival;
  const double gain = -0.5 * measured_rows_.sum() *
                      std::log(innovations(instead) / std::max(1e-300, innovations(out_.members)));
  return gain > rival.penalty - out_.members[which].penalty;
}

// The claims, until none is too weak in the joint model and none has a better rival.
void ChannelSearch::settle() {
  for (int round = 0; round < kMostSettling; ++round) {
    judge();
    std::size_t weakest = out_.members.size(), beaten = weakest;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (out_.members[j].is_given)
        continue;
      const Claim &claim = out_.claims[j];
      if ((claim.score < options_.least || is_within_error(out_.members[j].term) ||
           claim.heldout_r2 < 0.0) &&
          (weakest == out_.members.size() || claim.score < out_.claims[weakest].score))
        weakest = j;
      if (is_beaten(claim) && is_beaten_beside_start(j))
        beaten = j;
    }
    if (weakest < out_.members.size())
      set_aside(weakest, out_.claims[weakest].heldout_r2 < 0.0
                             ? kNotElsewhere
                             : "beside the other terms it is not significant");
    else if (beaten < out_.members.size())
      out_.members[beaten] = out_.claims[beaten].rival;
    else
      return;
    out_.fit = fit_members(y_, out_.members, out_.noise);
    estimate_noise();
    fill_sizes();
  }
  judge();
}

// Scatter other than stated, everywhere.
void ChannelSearch::claim_overall_variance() {
  // Of the whole residual: noise of the start, which y_ is without, is in the stated sd.
  const Vector left =
      (has_run() ? y_ : Vector((channel_.z - channel_.m).cwiseQuotient(channel_.sd))) -
      out_.fit.fitted;
  const double scatter = noise_state(left, out_.noise.weight, measured_, 0.0, 0.0, 0.0).scatter;
  if (!out_.variances.empty() || channel_.sd_estimated || extra_variance_ > 0.0 ||
      std::abs(std::log(scatter)) <= std::log(has_run() ? kLeastRunFactor : kLeastNoiseFactor))
    return;
  if (has_run() && out_.noise.spread_of_sizes > kMostSpread)
    return; // a slow wander of the run is no noise of the readings
  VarianceClaim claim;
  claim.term.channel = channel_.name;
  claim.term.cause = claim.term.form = "noise";
  claim.term.kind = TermKind::variance;
  const double n = measured_rows_.sum(), v = scatter * scatter;
  claim.mask = Vector::Ones(y_.size());
  claim.term.sizes = {{"ratio", v, v * std::sqrt(2.0 * out_.noise.spread_of_squares / n), ""}};
  claim.ln_anom = 0.5 * n * (v - 1.0 - std::log(v)) / out_.noise.spread_of_squares;
  claim.score = claim.ln_anom - 0.5 * library_.ln_rows;
  if (claim.score >= options_.threshold)
    out_.variances.push_back(claim);
}

namespace {

// What holds everywhere and is a formula goes on beyond the rows that it was learnt from, with or
// without a name in physics. So does a straight line with bends: were the bends dropped out there,
// the line would go where nothing was seen.
bool goes_on_by_itself(const Term &term) {
  return term.form == "expression" || is_swing(term) ||
         (term.gate.everywhere() &&
          (term.cause == "coupling" || term.cause == "product" || term.cause == "hinge"));
}

} // namespace

// Patches and tables act only where the rows they were learnt from are: in features where those are
// few of all.
void ChannelSearch::limit_support() {
  for (Member &member : out_.members) {
    Term &term = member.term;
    const bool goes_on =
        goes_on_by_itself(term) ||
        (member.candidate >= 0 &&
         library_.candidates[static_cast<std::size_t>(member.candidate)].is_physical);
    if (member.is_given || goes_on || moves_prediction(term) || term.kind != TermKind::mean)
      continue;
    const Vector effect = mean_effect(term, measured_, channel_.m).cwiseQuotient(channel_.sd);
    for (std::size_t f = 0; f < measured_.features.size(); ++f) {
      const Feature &feature = measured_.features[f];
      if (feature.is_angle)
        continue;
      if (is_own(term, feature.name)) {
        limit_own(feature, measured_.x.col(static_cast<Index>(f)), &term);
        continue;
      }
      const auto x = measured_.x.col(static_cast<Index>(f));
      double low = 1e300, high = -1e300;
      for (Index i = 0; i < effect.size(); ++i) {
        if (std::abs(effect(i)) > kActs && measured_rows_(i) > 0.0) {
          low = std::min(low, x(i));
          high = std::max(high, x(i));
        }
      }
      const double least = x.minCoeff(), most = x.maxCoeff(), range = most - least;
      const double margin = kSupportMargin * (high - low);
      if (low > high || !(range > 0.0) || high - low > kSupportShare * range)
        continue;
      term.support.features.push_back(feature.name);
      term.support.units.push_back(feature.unit);
      // A bound only where rows lie beyond it; towards the other side nothing was seen at all.
      term.support.lower.push_back(low - margin > least ? low - margin : least - kFar * range);
      term.support.upper.push_back(high + margin < most ? high + margin : most + kFar * range);
    }
  }
}

} // namespace rim::diagnose
