#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kProposals = 60, kExact = 10;
constexpr double kSwapGain = 0.5;     // nats by which a swap must be better
constexpr double kSeparableBic = 6.0; // the next cause's BIC at least so much worse: odds 20 to 1
// A stated sd that is a tenth out is no finding; nor is a global factor this small.
constexpr double kLeastNoiseFactor = 1.16;
constexpr std::size_t kBlocks = 10; // a log, for what is held out
// Scatter that differs by more than this factor of variance is rather the model's error than noise.
constexpr double kMostWeight = 4.0;
// What a term must gain, in nats, on rows it was not fitted to.
constexpr double kLeastHeldOut = 2.0;
constexpr double kPlainClip = 10.0; // of what counts as plain squares
constexpr double kActs = 0.1;       // sd: with less a term does not act
// Support: the share of a feature's range below which it bounds a term, and the margin beyond.
constexpr double kSupportShare = 0.5, kSupportMargin = 0.2;

double halves_bic(double delta_score) { return 2.0 * delta_score; }

// Features by which a term alone is a function of one feature: bias in an interval, hinge ...
std::string only_feature(const Term &term) {
  std::set<std::string> names(term.gate.features.begin(), term.gate.features.end());
  for (const auto &[placeholder, feature] : term.arguments)
    names.insert(feature);
  for (const std::string &basis : term.basis) {
    if (basis.find('m') != std::string::npos && basis.find("max") == std::string::npos &&
        basis.find("min") == std::string::npos)
      return "";
  }
  const bool is_plain = term.cause == "bias" || term.cause == "coupling" || term.cause == "hinge" ||
                        term.cause == "product" || term.cause == "drift" ||
                        term.cause == "viscous_friction" || term.cause == "coulomb_friction" ||
                        term.cause == "quadratic_drag" || term.cause == "unknown";
  return is_plain && names.size() == 1 ? *names.begin() : "";
}

} // namespace

ChannelSearch::ChannelSearch(const Measured &measured, const Channel &channel,
                             const Library &library, const SearchOptions &options)
    : measured_(measured), channel_(channel), library_(library), options_(options),
      y_((channel.z - channel.m).cwiseQuotient(channel.sd)) {}

Member ChannelSearch::make_member(const Proposal &proposal) const {
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(proposal.candidate)];
  Member member;
  member.term = candidate.term;
  member.term.gate = scanner_->gate(proposal);
  member.candidate = proposal.candidate;
  member.is_fixed = candidate.is_fixed;
  member.is_positive = candidate.is_positive;
  member.penalty = proposal.penalty;
  member.h = library_.g.middleCols(candidate.column, candidate.columns);
  if (!proposal.bounds.empty())
    member.h = scanner_->inside(proposal).asDiagonal() * member.h;
  return member;
}

// Piecewise linear over a feature, zero-mean not asked for: hat functions at quantiles.
Member ChannelSearch::table_member(int feature, int knots) const {
  Member member;
  const std::string &name = measured_.features[static_cast<std::size_t>(feature)].name;
  member.term.channel = channel_.name;
  member.term.cause = "unknown";
  member.term.form = "table";
  member.term.arguments["f"] = name;
  Vector x = measured_.x.col(feature), sorted = x;
  std::sort(sorted.data(), sorted.data() + sorted.size());
  for (int k = 0; k < knots; ++k) {
    const double at = sorted(static_cast<Index>(static_cast<double>(k) / (knots - 1) *
                                                static_cast<double>(sorted.size() - 1)));
    if (member.term.knots.empty() || at > member.term.knots.back())
      member.term.knots.push_back(at);
  }
  const auto count = static_cast<Index>(member.term.knots.size());
  member.h.resize(x.size(), count);
  for (Index k = 0; k < count; ++k) {
    Term hat = member.term;
    hat.values.assign(static_cast<std::size_t>(count), 0.0);
    hat.values[static_cast<std::size_t>(k)] = 1.0;
    if (count >= 2)
      member.h.col(k) = basis_columns(hat, measured_, channel_.m).col(0).cwiseQuotient(channel_.sd);
  }
  member.term.values.assign(static_cast<std::size_t>(count), 0.0);
  member.penalty = 0.5 * static_cast<double>(count) * library_.ln_rows +
                   std::log(static_cast<double>(measured_.features.size()));
  return member;
}

double ChannelSearch::gain_of(const std::vector<Member> &members, double loss_without) const {
  const Fit fit = fit_members(y_, members, out_.noise);
  return fit.is_allowed ? (loss_without - fit.loss) / out_.noise.divisor() : -1e300;
}

void ChannelSearch::refine_shape(const std::vector<Member> &others, double loss,
                                 Member *member) const {
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(member->candidate)];
  if (candidate.shape_low >= candidate.shape_high)
    return;
  double low = candidate.shape_low, high = candidate.shape_high;
  const Vector mask = gate_mask(member->term.gate, measured_);
  std::vector<Member> all = others;
  all.push_back(*member);
  double best = gain_of(all, loss);
  const auto try_at = [&](double value) {
    Member moved = *member;
    moved.term.shape[0].value = value;
    const Eigen::MatrixXd columns = basis_columns(moved.term, measured_, channel_.m);
    for (Index k = 0; k < columns.cols(); ++k)
      moved.h.col(k) = columns.col(k).cwiseQuotient(channel_.sd).cwiseProduct(mask);
    all.back() = moved;
    const double gain = gain_of(all, loss);
    if (gain > best) {
      best = gain;
      *member = moved;
      return true;
    }
    return false;
  };
  for (int step = 0; step < 4; ++step) {
    const double at = member->term.shape[0].value;
    if (try_at(0.5 * (low + at)))
      high = at;
    else if (try_at(0.5 * (at + high)))
      low = at;
    else {
      low = 0.5 * (low + at);
      high = 0.5 * (at + high);
    }
  }
}

// One delay or lag a channel; nothing twice.
bool ChannelSearch::excludes(const Proposal &proposal, const std::vector<Member> &members) const {
  const Term &term = library_.candidates[static_cast<std::size_t>(proposal.candidate)].term;
  if (moves_prediction(term) && !may_delay_)
    return true;
  return std::any_of(members.begin(), members.end(), [&](const Member &m) {
    if (moves_prediction(term) && moves_prediction(m.term))
      return true;
    return proposal.bounds.empty() && m.term.gate.everywhere() && m.term.form == term.form &&
           m.term.arguments == term.arguments && m.term.shape.empty();
  });
}

ChannelSearch::Best ChannelSearch::best_of(const std::vector<Proposal> &proposals,
                                           const std::vector<Member> &members, const Fit &fit,
                                           std::size_t exact) const {
  Best best;
  std::size_t tried = 0;
  for (const Proposal &given : proposals) {
    if (tried == exact)
      break;
    if (excludes(given, members))
      continue;
    ++tried;
    Proposal proposal = given;
    scanner_->refine(fit.residual, out_.noise, &proposal);
    Member member = make_member(proposal);
    if (member.term.shape.size() == 1)
      refine_shape(members, fit.loss, &member);
    std::vector<Member> all = members;
    all.push_back(member);
    const double gain = gain_of(all, fit.loss);
    if (gain - member.penalty > best.score) {
      best.score = gain - member.penalty;
      best.proposal = proposal;
      best.proposal.gain = gain;
      best.member = member;
    }
  }
  return best;
}

std::vector<Member> ChannelSearch::without(std::size_t which) const {
  std::vector<Member> others = out_.members;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(which));
  return others;
}

// Rough: before anything is known of the noise its scale is that of all that is not yet explained.
void ChannelSearch::add_terms(bool is_rough) {
  if (!is_rough && out_.members.size() > 1)
    swap_terms();
  while (out_.members.size() < options_.most_terms) {
    if (is_rough) {
      out_.noise.scale = 1e6;
      const Vector left = fit_members(y_, out_.members, out_.noise).residual;
      const double rows = std::max(1.0, measured_rows_.sum());
      out_.noise.scale =
          std::max(1.0, std::sqrt(left.cwiseAbs2().cwiseProduct(out_.noise.weight).sum() / rows));
    }
    const Fit fit = fit_members(y_, out_.members, out_.noise);
    const auto proposals = scanner_->mean(fit, out_.noise, kProposals);
    const Best best = best_of(proposals, out_.members, fit, kExact);
    if (best.score < options_.threshold)
      break;
    out_.members.push_back(best.member);
    for (int round = 0; round < 3 && swap_terms(); ++round) {
    }
  }
  drop_terms();
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// Every member against the best that could take its place. True when one was replaced.
bool ChannelSearch::swap_terms() {
  bool any = false;
  const double loss = fit_members(y_, out_.members, out_.noise).loss;
  double now = loss;
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (out_.members[j].is_given || out_.members.size() == 1)
      continue;
    const std::vector<Member> others = without(j);
    const Fit fit = fit_members(y_, others, out_.noise);
    const double score = (fit.loss - now) / out_.noise.divisor() - out_.members[j].penalty;
    const Best best = best_of(scanner_->mean(fit, out_.noise, kProposals), others, fit, kExact);
    if (best.score > score + kSwapGain) {
      out_.members[j] = best.member;
      now = fit_members(y_, out_.members, out_.noise).loss;
      any = true;
    }
  }
  return any;
}

void ChannelSearch::drop_terms() {
  for (bool dropped = true; dropped;) {
    dropped = false;
    const double loss = fit_members(y_, out_.members, out_.noise).loss;
    std::size_t worst = 0;
    double least = options_.threshold;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (out_.members[j].is_given)
        continue;
      const double gain =
          (fit_members(y_, without(j), out_.noise).loss - loss) / out_.noise.divisor();
      if (gain - out_.members[j].penalty < least) {
        least = gain - out_.members[j].penalty;
        worst = j;
        dropped = true;
      }
    }
    if (dropped)
      out_.members = without(worst);
  }
}

// From what remains: scale by its robust spread, autocorrelation by the initial positive sequence
// of its lags within logs, excess of its squares.
void ChannelSearch::estimate_noise() {
  const Vector &e = out_.fit.clipped;
  double squares = 0.0, fourth = 0.0, used = 0.0;
  for (Index i = 0; i < e.size(); ++i) {
    if (out_.noise.weight(i) > 0.0) {
      squares += e(i) * e(i);
      fourth += e(i) * e(i) * e(i) * e(i);
      used += 1.0;
    }
  }
  if (used < 20.0 || squares <= 0.0)
    return;
  out_.noise.scale = std::sqrt(squares / used);
  const double kurtosis = fourth / used / (squares / used) / (squares / used);
  double sum = 0.0, sum_of_squares = 0.0;
  for (std::size_t lag = 1; lag <= 50; ++lag) {
    double products = 0.0, both = 0.0;
    for (const LogSpan &log : measured_.logs) {
      for (std::size_t i = log.first; i + lag < log.first + log.rows; ++i) {
        const auto a = static_cast<Index>(i), b = static_cast<Index>(i + lag);
        if (out_.noise.weight(a) > 0.0 && out_.noise.weight(b) > 0.0) {
          products += e(a) * e(b);
          both += 1.0;
        }
      }
    }
    const double rho = both > 0.0 ? products / both / (squares / used) : 0.0;
    if (lag == 1)
      out_.autocorrelation = rho;
    if (rho < 2.0 / std::sqrt(used))
      break;
    sum += rho;
    sum_of_squares += rho * rho;
  }
  out_.noise.spread = 1.0 + 2.0 * sum;
  out_.noise.spread_of_squares =
      std::max(1.0, 0.5 * (kurtosis - 1.0)) * (1.0 + 2.0 * sum_of_squares);
}

// The best change of variance, if it is one. True when one was claimed.
bool ChannelSearch::claim_variance() {
  if (out_.variances.size() >= 2)
    return false;
  const auto proposals = scanner_->variance(out_.fit, out_.noise, 2);
  VarianceClaim claim;
  claim.term.channel = channel_.name;
  claim.term.cause = claim.term.form = "noise";
  claim.term.kind = TermKind::variance;
  if (!proposals.empty() && proposals[0].score() >= options_.threshold) {
    const Proposal &p = proposals[0];
    claim.mask = scanner_->inside(p);
    double ratio = p.ratio;
    claim.term.gate = scanner_->gate(p);
    claim.term.sizes = {
        {"ratio", ratio, ratio * std::sqrt(2.0 / std::max(1.0, claim.mask.sum())), ""}};
    claim.ln_anom = p.gain;
    claim.score = p.score();
    out_.variances.push_back(claim);
    return true;
  }
  return false;
}

void ChannelSearch::fill_sizes() {
  const double divisor = std::sqrt(out_.noise.divisor());
  Index at = 0;
  for (Member &member : out_.members) {
    Term &term = member.term;
    if (member.is_given)
      continue;
    term.sizes.clear();
    for (Index k = 0; k < member.h.cols(); ++k) {
      Parameter size{"size", 1.0, 0.0, ""};
      if (!member.is_fixed) {
        size.value = out_.fit.beta(at);
        size.stderror = divisor * std::sqrt(std::max(0.0, out_.fit.covariance(at, at)));
        ++at;
      }
      if (term.form == "table") {
        term.values[static_cast<std::size_t>(k)] = size.value;
        continue;
      }
      if (member.candidate >= 0)
        size.unit = library_.size_units[static_cast<std::size_t>(member.candidate)];
      if (member.h.cols() == 2)
        size.name = k == 0 ? "sine" : "cosine";
      term.sizes.push_back(size);
    }
    if (term.form == "table")
      term.sizes = {{"size", 1.0, 0.0, ""}};
  }
}

// Where one feature carries what was found, a smooth curve over it may say it better than any name:
// several pieces on one feature, or one with structure left over the same feature.
void ChannelSearch::smooth_unknowns() {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    const std::string feature = only_feature(out_.members[j].term);
    if (!feature.empty() && feature != kTime && !out_.members[j].is_given)
      groups[feature].push_back(j);
  }
  for (const auto &[name, which] : groups) {
    const int feature = measured_.find_feature(name);
    std::vector<Member> others;
    double penalty = 0.0;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (std::find(which.begin(), which.end(), j) == which.end())
        others.push_back(out_.members[j]);
      else
        penalty += out_.members[j].penalty;
    }
    const double loss_named = fit_members(y_, out_.members, out_.noise).loss;
    for (const int knots : {8, 14, 22}) {
      Member table = table_member(feature, knots);
      if (table.h.cols() < 5)
        continue;
      std::vector<Member> both = out_.members, instead = others;
      both.push_back(table);
      instead.push_back(table);
      const double divisor = out_.noise.divisor();
      const double more = (loss_named - fit_members(y_, both, out_.noise).loss) / divisor;
      const double of_table = (loss_named - fit_members(y_, instead, out_.noise).loss) / divisor;
      // 2 more is chi-squared of as many degrees as knots: its .998 quantile by Wilson and
      // Hilferty.
      const double k = static_cast<double>(table.h.cols());
      const double quantile =
          k * std::pow(1.0 - 2.0 / (9.0 * k) + 2.88 * std::sqrt(2.0 / (9.0 * k)), 3.0);
      const bool is_left = 2.0 * more > quantile;
      const bool is_pieced = which.size() > 1 && of_table > -3.0;
      const bool is_as_good = of_table > 0.0 && is_left;
      if (is_pieced || is_as_good) {
        others.push_back(table);
        out_.members = others;
        out_.fit = fit_members(y_, out_.members, out_.noise);
        return;
      }
    }
  }
}

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
    alternative.delta_bic = halves_bic(claim->score - best.score);
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

// Sizes fitted without a part of the rows, judged on it, with the term and without it: each log in
// turn where the term acts in several of at least three logs, every second block otherwise.
void ChannelSearch::hold_out(std::size_t which, Claim *claim) const {
  const Member &member = out_.members[which];
  const Vector acts = member.h.rowwise().squaredNorm();
  double most = 0.0;
  for (const LogSpan &log : measured_.logs)
    most = std::max(
        most, acts.segment(static_cast<Index>(log.first), static_cast<Index>(log.rows)).sum());
  const bool by_log = measured_.logs.size() >= 3 && most < 0.8 * acts.sum();
  const std::size_t folds = by_log ? measured_.logs.size() : 2;
  double with = 0.0, less = 0.0, most_gained = 0.0;
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Noise train = out_.noise;
    Vector held = Vector::Zero(y_.size());
    for (std::size_t l = 0; l < measured_.logs.size(); ++l) {
      const LogSpan &log = measured_.logs[l];
      for (std::size_t i = 0; i < log.rows; ++i) {
        const std::size_t part = by_log ? l : i * kBlocks / log.rows % 2;
        const auto k = static_cast<Index>(log.first + i);
        if (part == fold) {
          held(k) = train.weight(k);
          train.weight(k) = 0.0;
        }
      }
    }
    const double corner = out_.noise.clip * out_.noise.scale;
    const auto loss = [&](const Fit &fit) {
      const Vector e = fit.residual.cwiseProduct(held.cwiseSqrt());
      return 0.5 * e.cwiseMax(-corner).cwiseMin(corner).squaredNorm();
    };
    const double with_it = loss(fit_members(y_, out_.members, train)),
                 without_it = loss(fit_members(y_, without(which), train));
    with += with_it;
    less += without_it;
    most_gained = std::max(most_gained, without_it - with_it);
  }
  // Of logs: not by the merit of one alone.
  const double divisor = out_.noise.divisor();
  claim->heldout_ln = (less - with - (by_log ? most_gained : 0.0)) / divisor;
  claim->heldout_r2 = less > 0.0 ? 1.0 - with / less : 0.0;
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

void ChannelSearch::prepare(const std::vector<Term> &given) {
  out_ = ChannelFindings{};
  out_.flagged = find_flagged(measured_, channel_);
  measured_rows_ = Vector::Ones(y_.size());
  for (Index i = 0; i < y_.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (out_.flagged.stuck[at] != 0 || out_.flagged.dropout[at] != 0)
      measured_rows_(i) = 0.0;
  }
  for (const Term &term : given) {
    if (term.channel != channel_.name || term.kind != TermKind::mean)
      continue;
    Member member;
    member.term = term;
    member.is_fixed = member.is_given = true;
    member.h = mean_effect(term, measured_, channel_.m).cwiseQuotient(channel_.sd);
    out_.members.push_back(member);
  }
  weigh();
}

// Weight of a row: is it a measurement, how much its variance differs inside claimed regions, and
// how much of what remains no multiple of the stated variance explains: where stated sds differ
// from row to row, a common variance may have to be added to all.
void ChannelSearch::weigh() {
  out_.noise.weight = measured_rows_;
  for (const VarianceClaim &claim : out_.variances)
    out_.noise.weight.array() *=
        1.0 - claim.mask.array() * (1.0 - 1.0 / std::clamp(claim.term.sizes[0].value,
                                                           1.0 / kMostWeight, kMostWeight));
  const Vector variance = channel_.sd.cwiseAbs2();
  const double rows = measured_rows_.sum();
  if (out_.fit.residual.size() != y_.size() || rows < 20.0 ||
      variance.maxCoeff() < 1.4 * variance.minCoeff())
    return;
  const Vector squares = out_.fit.residual.cwiseAbs2().cwiseProduct(variance);
  const auto standard = [&](double extra) {
    return (squares.array() / (variance.array() + extra) * out_.noise.weight.array()).sum() / rows;
  };
  extra_variance_ = 0.0;
  const double multiple = standard(0.0);
  if (multiple <= 1.2)
    return;
  double low = 0.0, high = squares.maxCoeff();
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (standard(middle) > 1.0 ? low : high) = middle;
  }
  // Which is likelier: every variance times one factor, or one variance added to all?
  const double of_multiple = (multiple * variance.array()).log().sum(),
               of_sum = (variance.array() + high).log().sum();
  if (of_sum < of_multiple - 10.0) {
    extra_variance_ = high;
    out_.noise.weight.array() *= variance.array() / (variance.array() + high);
  }
}

// Rough first: what the noise is like is known only when the effects are out, and the reverse.
void ChannelSearch::find_members(bool may_delay) {
  may_delay_ = may_delay;
  const std::vector<Member> kept = out_.members;
  for (int pass = 0; pass < 3; ++pass) {
    scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
    const double rough = out_.noise.scale;
    if (pass == 0)
      add_terms(true);
    else {
      // From scratch, unless the effects are so large that they would be cut as outliers.
      const Fit none = fit_members(y_, kept, out_.noise);
      const double all = std::sqrt(none.residual.cwiseAbs2().cwiseProduct(out_.noise.weight).sum() /
                                   std::max(1.0, measured_rows_.sum()));
      if (all < 2.0 * rough)
        out_.members = kept;
      else
        drop_terms();
      add_terms(false);
    }
    estimate_noise();
    weigh();
    if (pass < 2 && claim_variance())
      weigh();
    out_.fit = fit_members(y_, out_.members, out_.noise);
    estimate_noise();
  }
  scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
}

ChannelFindings ChannelSearch::run(const std::vector<Term> &given) {
  prepare(given);
  find_members(true);
  for (int round = 0; round < 3; ++round)
    smooth_unknowns();
  out_.fit = fit_members(y_, out_.members, out_.noise);
  drop_unconfirmed();
  estimate_noise();
  fill_sizes();
  judge();
  claim_overall_variance();
  refit_plain();
  follow_delay();
  limit_support();
  return std::move(out_);
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
      if (out_.members[j].is_given || claim.heldout_ln > kLeastHeldOut)
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
  if (!out_.variances.empty() || channel_.sd_estimated || extra_variance_ > 0.0 ||
      std::abs(std::log(out_.noise.scale)) <= std::log(kLeastNoiseFactor))
    return;
  VarianceClaim claim;
  claim.term.channel = channel_.name;
  claim.term.cause = claim.term.form = "noise";
  claim.term.kind = TermKind::variance;
  const double n = measured_rows_.sum(), v = out_.noise.scale * out_.noise.scale;
  claim.mask = Vector::Ones(y_.size());
  claim.term.sizes = {{"ratio", v, v * std::sqrt(2.0 * out_.noise.spread_of_squares / n), ""}};
  claim.ln_anom = 0.5 * n * (v - 1.0 - std::log(v)) / out_.noise.spread_of_squares;
  claim.score = claim.ln_anom - 0.5 * library_.ln_rows;
  if (claim.score >= options_.threshold)
    out_.variances.push_back(claim);
}

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
  out_ = std::move(chosen);
}

// What is found when the delay is part of the simulation; its fit's loss is by `noise`.
ChannelFindings ChannelSearch::search_behind(const Member &delay, const Noise &noise) const {
  Measured late = measured_;
  for (std::size_t f = 0; f < late.features.size(); ++f) {
    if (!late.features[f].is_command)
      continue;
    late.features[f].name +=
        fmt::format("{}{:.6g}", delay.term.form == "lag" ? '~' : '@', delay.term.shape[0].value);
    late.x.col(static_cast<Index>(f)) = feature_column(measured_, late.features[f].name);
  }
  Channel moved = channel_;
  moved.m += mean_effect(delay.term, measured_, channel_.m);
  const Library library = make_library(late, moved, *options_.catalogue);
  ChannelSearch second(late, moved, library, options_);
  second.prepare({});
  second.find_members(false);
  for (int round = 0; round < 3; ++round)
    second.smooth_unknowns();
  second.drop_unconfirmed();
  second.fill_sizes();
  second.judge();
  second.refit_plain();
  second.out_.fit = fit_members(second.y_, second.out_.members, noise);
  return std::move(second.out_);
}

// A term acts only where the rows it was learnt from are: in features where those are few of all.
void ChannelSearch::limit_support() {
  for (Member &member : out_.members) {
    Term &term = member.term;
    if (member.is_given || moves_prediction(term) || term.kind != TermKind::mean)
      continue;
    const Vector effect = mean_effect(term, measured_, channel_.m).cwiseQuotient(channel_.sd);
    for (std::size_t f = 0; f < measured_.features.size(); ++f) {
      const Feature &feature = measured_.features[f];
      const auto &gated = term.gate.features;
      if (feature.is_angle || std::find(gated.begin(), gated.end(), feature.name) != gated.end())
        continue;
      const auto x = measured_.x.col(static_cast<Index>(f));
      double low = 1e300, high = -1e300;
      for (Index i = 0; i < effect.size(); ++i) {
        if (std::abs(effect(i)) > kActs && measured_rows_(i) > 0.0) {
          low = std::min(low, x(i));
          high = std::max(high, x(i));
        }
      }
      const double margin = kSupportMargin * (high - low);
      if (low > high || high - low > kSupportShare * (x.maxCoeff() - x.minCoeff()))
        continue;
      // A bound only where rows lie beyond it: elsewhere nothing is known to be wrong with it.
      term.support.features.push_back(feature.name);
      term.support.units.push_back(feature.unit);
      term.support.lower.push_back(low - margin);
      term.support.upper.push_back(high + margin);
    }
  }
}

double null_score(const Measured &measured, const Channel &channel, const Library &library,
                  const Scanner &scanner, const Vector &y) {
  (void)measured;
  Noise noise;
  noise.weight = Vector::Ones(y.size());
  const Fit fit = fit_members(y, {}, noise);
  double best = -1e300;
  for (Proposal proposal : scanner.mean(fit, noise, 4)) {
    scanner.refine(fit.residual, noise, &proposal, false);
    const Candidate &candidate = library.candidates[static_cast<std::size_t>(proposal.candidate)];
    if (!proposal.bounds.empty()) {
      const Vector g = scanner.inside(proposal).cwiseProduct(library.g.col(candidate.column));
      const double s = g.dot(fit.clipped), w = g.squaredNorm();
      if (w > 0.0)
        proposal.gain = 0.5 * s * s / w;
    }
    best = std::max(best, proposal.score());
  }
  for (const Proposal &proposal : scanner.variance(fit, noise, 1))
    best = std::max(best, proposal.score());
  (void)channel;
  return best;
}

} // namespace rim::diagnose
