#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// A stated sd that is a tenth out is no finding; nor is a global factor this small.
constexpr double kLeastNoiseFactor = 1.16;
constexpr std::size_t kBlocks = 10; // a log, for what is held out
// What a term must gain, in nats, on rows it was not fitted to.
constexpr double kLeastHeldOut = 2.0;
// By what share the held-out squares must fall, and in what share of the parts that a term touches:
// where it acts with a tenth of the mean strength at least.
constexpr double kLeastFall = 0.005, kLeastBetter = 0.6, kTouches = 0.1;
// Support: the share of a feature's range below which it bounds a term, and the margin beyond.
constexpr double kSupportShare = 0.5, kSupportMargin = 0.2;
constexpr double kOwnMargin = 0.1; // of the range of a term's own argument
constexpr double kFar = 10.0;      // ranges: where no bound is meant

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

} // namespace

void ChannelSearch::judge_alternatives(std::size_t which, const std::vector<Member> &others,
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
  for (auto &[cause, best] : by_cause) {
    if (best.score < -1e299)
      continue;
    Alternative alternative;
    alternative.cause = cause;
    alternative.delta_bic = 2.0 * (claim->score - best.score);
    std::vector<Member> all = others;
    all.push_back(best.member);
    const Fit with = fit_members(y_, all, out_.noise);
    Index at = with.beta.size() - best.member.h.cols();
    for (Index k = 0; k < best.member.h.cols(); ++k)
      best.member.term.sizes.push_back(
          {"size", best.member.is_fixed ? 1.0 : with.beta(at + k), 0.0, ""});
    alternative.expression = expression_text(best.member.term);
    if (!best.member.term.gate.everywhere())
      alternative.expression += " where " + gate_text(best.member.term.gate);
    ChannelSearch copy(measured_, channel_, library_, options_);
    copy.out_.members = all;
    copy.out_.noise = out_.noise;
    Claim of_it;
    copy.hold_out(all.size() - 1, &of_it);
    alternative.heldout_r2 = of_it.heldout_r2;
    claim->alternatives.push_back(alternative);
  }
  std::sort(claim->alternatives.begin(), claim->alternatives.end(),
            [](const Alternative &a, const Alternative &b) { return a.delta_bic < b.delta_bic; });
  if (claim->alternatives.size() > 5)
    claim->alternatives.resize(5);
  claim->is_separable =
      claim->alternatives.empty() || claim->alternatives.front().delta_bic > kSeparableBic;
}

template <class See> void ChannelSearch::for_each_row(See see) const {
  for (std::size_t l = 0; l < measured_.logs.size(); ++l) {
    const LogSpan &log = measured_.logs[l];
    for (std::size_t i = 0; i < log.rows; ++i)
      see(static_cast<Index>(log.first + i), l, i * kBlocks / log.rows);
  }
}

// Sizes fitted without a part of the rows, judged on it, with the term and without it: each log in
// turn where the term acts in several of at least three logs, every second block otherwise.
void ChannelSearch::hold_out(std::size_t which, Claim *claim) const {
  const Member &member = out_.members[which];
  const Vector acts = member.h.rowwise().squaredNorm();
  double most = 0.0;
  for (const LogSpan &log : measured_.logs)
    most = std::max(
        most, acts.segment(static_cast<Index>(log.first), static_cast<Index>(log.rows)).sum());
  const bool by_log = measured_.logs.size() >= 3 && most < 0.8 * acts.sum() && !member.differs;
  const std::size_t folds = by_log ? measured_.logs.size() : 2;
  std::vector<Part> parts(measured_.logs.size() * kBlocks);
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Noise train = out_.noise;
    for_each_row([&](Index k, std::size_t log, std::size_t block) {
      if ((by_log ? log : block % 2) == fold)
        train.weight(k) = 0.0;
    });
    const double corner = out_.noise.clip * out_.noise.scale;
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
  judge_parts(parts, by_log, claim);
}

void ChannelSearch::judge_parts(const std::vector<Part> &parts, bool by_log, Claim *claim) const {
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
  const double divisor = out_.noise.divisor();
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
    claim.ln_anom = (fit_members(y_, others, out_.noise).loss - loss) / out_.noise.divisor();
    claim.score = claim.ln_anom - out_.members[j].penalty;
    hold_out(j, &claim);
    if (!out_.members[j].is_given && out_.members[j].candidate >= 0)
      judge_alternatives(j, others, &claim);
    out_.claims.push_back(claim);
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
    out_.members = without(worst);
  }
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// Scatter other than stated, everywhere.
void ChannelSearch::claim_overall_variance() {
  // Of the whole residual: noise of the start, which y_ is without, is in the stated sd.
  const Vector left = (channel_.z - channel_.m).cwiseQuotient(channel_.sd) - out_.fit.fitted;
  const double scatter =
      noise_state(left, out_.noise.weight, measured_, 0.0, 0.0).scatter;
  if (!out_.variances.empty() || channel_.sd_estimated || extra_variance_ > 0.0 ||
      std::abs(std::log(scatter)) <= std::log(kLeastNoiseFactor))
    return;
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

// A term that is no law of physics acts only where the rows it was learnt from are: in features where
// those are few of all.
void ChannelSearch::limit_support() {
  for (Member &member : out_.members) {
    Term &term = member.term;
    const bool is_law =
        member.candidate >= 0 &&
        library_.candidates[static_cast<std::size_t>(member.candidate)].is_physical;
    if (member.is_given || is_law || moves_prediction(term) || term.kind != TermKind::mean)
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
