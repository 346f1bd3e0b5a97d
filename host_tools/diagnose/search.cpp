// SPDX-License-Identifier: MIT
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include <fmt/format.h>

#include "diagnose/mixed.hpp"
#include "diagnose/roles.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kProposals = 60, kExact = 10;
constexpr int kShapeSteps = 4;
// Of two parameters together: steps, the first this share of where each may be.
constexpr int kPatternSteps = 14;
constexpr double kFirstPattern = 0.25;
constexpr int kLagSteps = 8; // of a lagged argument, the first by this factor
constexpr double kLagFactor = 1.4;
constexpr double kTableCost = 10.0; // nats: a curve without a name, where laws of physics hold
// Share of the rows that are few, and of the whole error, as amplitude, that a term in so few must
// account for beside a law.
constexpr double kFewRows = 0.05, kRelevantPatch = 0.1;
constexpr double kSwapGain = 0.5; // nats by which a swap must be better
// Scatter that differs by more than this factor of variance is rather the model's error than noise.
constexpr double kMostWeight = 4.0;

// Kish's number of rows that carry a column: in few, one outlier makes a region.
constexpr double kLeastEffective = 25.0;
double effective_rows(const Eigen::MatrixXd &h) {
  const auto squares = h.rowwise().squaredNorm().array().eval();
  const double fourth = squares.square().sum();
  return fourth > 0.0 ? squares.sum() * squares.sum() / fourth : 0.0;
}

// Inside a region a form that hardly varies there (a gain of a prediction that rests) is a constant
// under another name: sd over |mean| of its column where it acts.
constexpr double kLeastSpreadInside = 0.1;
bool is_constant_inside(const Member &member, const Vector &sd) {
  if (member.term.basis.size() != 1 || member.term.basis[0] == "1")
    return false;
  const Vector x = member.h.col(0).cwiseProduct(sd);
  const double n = (x.array() != 0.0).cast<double>().sum(), mean = x.sum() / std::max(1.0, n);
  return x.squaredNorm() / std::max(1.0, n) - mean * mean <
         std::pow(kLeastSpreadInside * mean, 2.0);
}

// Whether a parameter of it is more than a choice.
bool is_marked(const Term &term) {
  return term.form == kLaggedCoupling || term.form == kHysteresis;
}
bool is_tunable(const Term &term) { return !term.shape.empty() || is_marked(term); }

// Features that a term of the context alone is made of: a bias in an interval, a hinge ...; none of
// a term of the prediction.
std::set<std::string> features_of(const Term &term) {
  std::set<std::string> names(term.gate.features.begin(), term.gate.features.end());
  for (const auto &[placeholder, feature] : term.arguments)
    names.insert(feature);
  // No curve over a feature has its memory, and a square is a law, no piece of a curve.
  if (is_marked(term) || term.form == kSquare)
    return {};
  const bool is_plain = term.cause == "bias" || term.cause == "coupling" || term.cause == "hinge" ||
                        term.cause == "product" || term.cause == "drift" || term.cause == "unknown";
  return is_plain ? names : std::set<std::string>{};
}

} // namespace

void turn_sign(Term *term) {
  if (term->basis.empty() || term->sizes.empty() || !(term->sizes[0].value < 0.0) ||
      std::any_of(term->basis.begin(), term->basis.end(),
                  [](const std::string &basis) { return basis[0] != '-'; }))
    return;
  for (std::string &basis : term->basis)
    basis.erase(0, 1);
  for (Parameter &size : term->sizes) {
    size.value = -size.value;
    size.unrefined = -size.unrefined;
    size.near_rest = -size.near_rest;
    size.new_log = -size.new_log;
    std::for_each(size.per_log.begin(), size.per_log.end(), [](double &v) { v = -v; });
  }
}

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

// The lag of a lagged argument, or the reach of one that is held, between its neighbours on the
// grid.
void ChannelSearch::refine_lag(const std::vector<Member> &others, double loss,
                               Member *member) const {
  std::vector<Member> all = others;
  all.push_back(*member);
  double best = gain_of(all, loss), factor = kLagFactor;
  for (int step = 0; step < kLagSteps; ++step) {
    bool moved = false;
    for (const double by : {factor, 1.0 / factor}) {
      Member next = *member;
      std::string &name = next.term.arguments.begin()->second;
      const std::string base = base_feature(name);
      name = fmt::format("{}{}{:.4g}", base, name[base.size()],
                         by * std::stod(name.substr(base.size() + 1)));
      set_columns(measured_, channel_, channel_.m, &next);
      all.back() = next;
      const double gain = gain_of(all, loss);
      if (gain > best) {
        best = gain;
        *member = next;
        moved = true;
        break;
      }
    }
    if (!moved)
      factor = std::sqrt(factor);
  }
}

void ChannelSearch::refine_shape(const std::vector<Member> &others, double loss,
                                 Member *member) const {
  if (is_marked(member->term) && !member->differs)
    refine_lag(others, loss, member);
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(member->candidate)];
  const Vector mask = gate_mask(member->term.gate, measured_);
  std::vector<Member> all = others;
  all.push_back(*member);
  double best = gain_of(all, loss);
  const auto try_at = [&](const std::vector<std::pair<std::size_t, double>> &to) {
    Member moved = *member;
    for (const auto &[which, value] : to)
      moved.term.shape[which].value = value;
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
  for (std::size_t which = 0; which < candidate.shape_range.size(); ++which) {
    auto [low, high] = candidate.shape_range[which];
    for (int step = 0; step < kShapeSteps && low < high && !member->differs; ++step) {
      const double at = member->term.shape[which].value;
      if (try_at({{which, 0.5 * (low + at)}}))
        high = at;
      else if (try_at({{which, 0.5 * (at + high)}}))
        low = at;
      else {
        low = 0.5 * (low + at);
        high = 0.5 * (at + high);
      }
    }
  }
  if (candidate.shape_range.size() != 2 || remembers(member->term) || member->differs)
    return;
  // What two parameters do they do together: along their valley neither moves alone.
  double share = kFirstPattern;
  for (int step = 0; step < kPatternSteps; ++step) {
    bool moved = false;
    for (int direction = 0; direction < 9 && !moved; ++direction) {
      const double by[2] = {share * (direction % 3 - 1), share * (direction / 3 - 1)};
      std::vector<std::pair<std::size_t, double>> to;
      for (std::size_t which = 0; which < 2; ++which) {
        const auto &[low, high] = candidate.shape_range[which];
        to.emplace_back(which, member->term.shape[which].value + by[which] * (high - low));
      }
      moved = direction != 4 && try_at(to);
    }
    if (!moved)
      share *= 0.5;
  }
}

// One delay or lag a channel; nothing twice.
bool ChannelSearch::excludes(const Proposal &proposal, const std::vector<Member> &members) const {
  const Term &term = library_.candidates[static_cast<std::size_t>(proposal.candidate)].term;
  if (!allowed_(term))
    return true;
  return std::any_of(members.begin(), members.end(), [&](const Member &m) {
    if (moves_prediction(term) && moves_prediction(m.term))
      return true;
    return proposal.bounds.empty() && m.term.gate.everywhere() && m.candidate >= 0 &&
           library_.candidates[static_cast<std::size_t>(m.candidate)].group ==
               library_.candidates[static_cast<std::size_t>(proposal.candidate)].group;
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
    try_proposal(given, members, fit, &best);
  }
  if (best.proposal.bounds.size() > 1)
    leave_out_features(members, fit, &best);
  return best;
}

// Refined, it is the best where its score is better.
void ChannelSearch::try_proposal(Proposal proposal, const std::vector<Member> &members,
                                 const Fit &fit, Best *best) const {
  scanner_->refine(fit.residual, out_.noise, &proposal);
  Member member = make_member(proposal);
  if (!proposal.bounds.empty() &&
      (effective_rows(member.h) < kLeastEffective || is_constant_inside(member, channel_.sd)))
    return;
  if (is_tunable(member.term))
    refine_shape(members, fit.loss, &member);
  std::vector<Member> all = members;
  all.push_back(member);
  const double gain = gain_of(all, fit.loss);
  if (gain - member.penalty > best->score) {
    best->score = gain - member.penalty;
    best->proposal = proposal;
    best->proposal.gain = gain;
    best->member = member;
  }
}

std::vector<Member> ChannelSearch::without(std::size_t which) const {
  std::vector<Member> others = out_.members;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(which));
  return others;
}

// Rough: before anything is known of the noise its scale is that of all that is not yet explained.
void ChannelSearch::add_terms(bool is_rough) {
  while (out_.members.size() < options_.most_terms) {
    if (is_rough) {
      out_.noise.scale = 1e6;
      out_.noise.spread = 1.0;
      const Vector left = fit_members(y_, out_.members, out_.noise).residual;
      const double rows = std::max(1.0, measured_rows_.sum());
      out_.noise.scale =
          std::max(1.0, std::sqrt(left.cwiseAbs2().cwiseProduct(out_.noise.weight).sum() / rows));
    }
    const Fit fit = fit_members(y_, out_.members, out_.noise);
    const auto proposals = scanner_->mean(fit, out_.noise, kProposals);
    const Best best = best_of(proposals, out_.members, fit, kExact);
    if (best.score < options_.threshold || !is_relevant(best.proposal.gain, best.member, fit.loss))
      break;
    out_.members.push_back(best.member);
    for (int round = 0; round < 3 && swap_terms(); ++round) {
    }
  }
  drop_terms();
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// A form that holds everywhere, of a size of its own in every log where they differ.
Member ChannelSearch::form_member(int candidate, bool differs) const {
  Proposal proposal;
  proposal.candidate = candidate;
  proposal.penalty = library_.candidates[static_cast<std::size_t>(candidate)].penalty;
  Member member = make_member(proposal);
  if (!differs)
    return member;
  const Vector all = member.h.col(0);
  member.differs = true;
  member.h = Eigen::MatrixXd::Zero(all.size(), static_cast<Index>(measured_.logs.size()));
  member.penalty +=
      kSizesDiffer + 0.5 * static_cast<double>(measured_.logs.size() - 1) * library_.ln_rows;
  for (std::size_t l = 0; l < measured_.logs.size(); ++l) {
    const auto first = static_cast<Index>(measured_.logs[l].first),
               rows = static_cast<Index>(measured_.logs[l].rows);
    member.h.col(static_cast<Index>(l)).segment(first, rows) = all.segment(first, rows);
  }
  return member;
}

void ChannelSearch::take_noise(const NoiseState &state) {
  out_.noise.scale = std::sqrt(state.variance);
  out_.noise.spread = state.spread;
  out_.noise.scatter = state.scatter;
  out_.noise.spread_of_sizes = state.spread_of_sizes;
  out_.noise.spread_of_squares = state.spread_of_squares;
  out_.autocorrelation = state.autocorrelation;
}

// The best set of forms beside the terms that are given or hold in a region.
void ChannelSearch::join_forms() {
  std::vector<Member> kept;
  for (const Member &member : out_.members) {
    if (member.is_given || is_swing(member.term) || !member.term.gate.everywhere())
      kept.push_back(member);
  }
  join_forms_beside(std::move(kept));
}

// And beside these.
void ChannelSearch::join_forms_beside(std::vector<Member> kept) {
  NoiseState noise;
  const FormSet set =
      SetSearch(measured_, library_, y_, out_.noise.weight, kept, least_noise(channel_), &products_)
          .best(allowed_, &noise);
  take_noise(noise);
  for (std::size_t j = 0; j < set.candidates.size(); ++j) {
    Member member = form_member(set.candidates[j], static_cast<int>(j) == set.differs);
    if (is_tunable(member.term))
      refine_shape(kept, fit_members(y_, kept, out_.noise).loss, &member);
    kept.push_back(std::move(member));
  }
  out_.members = std::move(kept);
  // A band of rest is what it is beside all of the set. What comes late is not tuned so: beside the
  // prediction and its gain a lag would run away to where they all but cancel.
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (is_law(out_.members[j]) && !remembers(out_.members[j].term))
      refine_shape(without(j), 0.0, &out_.members[j]);
  }
  try_stribeck();
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

double ChannelSearch::score_of(const std::vector<Member> &members, const Noise &noise) const {
  const Fit fit = fit_members(y_, members, noise);
  double score = fit.is_allowed ? -fit.loss / noise.divisor() : -1e300;
  for (const Member &member : members)
    score -= member.is_given ? 0.0 : member.penalty;
  return score;
}

// Every member against the best that could take its place. True when one was replaced.
bool ChannelSearch::swap_terms() {
  bool any = false;
  const double loss = fit_members(y_, out_.members, out_.noise).loss;
  double now = loss;
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (out_.members[j].is_given || is_swing(out_.members[j].term) || out_.members[j].differs ||
        out_.members.size() == 1)
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

// Whether a fall of the log likelihood ratio is more than a trifle beside the whole error, or, of a
// form that holds everywhere, beside the loss that is left without it. In few rows, beside a law
// that holds everywhere, more is asked: that is how the law departs from the truth there.
bool ChannelSearch::is_relevant(double gain, const Member &member, double without) const {
  const double whole = 0.5 * y_.cwiseAbs2().dot(out_.noise.weight);
  const bool is_patch =
      !member.term.gate.everywhere() &&
      (member.h.rowwise().squaredNorm().array() > 0.0).cast<double>().mean() < kFewRows &&
      std::any_of(out_.members.begin(), out_.members.end(),
                  [this](const Member &m) { return is_law(m); });
  const double fall = gain * out_.noise.divisor();
  if (is_patch)
    return fall > kRelevantPatch * kRelevantPatch * whole;
  const bool is_form = member.candidate >= 0 && member.term.gate.everywhere();
  return !is_trifle(fall, is_form ? without : whole, whole);
}

void ChannelSearch::drop_terms() {
  for (bool dropped = true; dropped;) {
    dropped = false;
    const double loss = fit_members(y_, out_.members, out_.noise).loss;
    std::size_t worst = 0;
    double least = options_.threshold;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (out_.members[j].is_given || is_swing(out_.members[j].term))
        continue;
      const double less = fit_members(y_, without(j), out_.noise).loss,
                   gain = (less - loss) / out_.noise.divisor();
      const double score =
          is_relevant(gain, out_.members[j], less) ? gain - out_.members[j].penalty : -1e300;
      if (score < least) {
        least = score;
        worst = j;
        dropped = true;
      }
    }
    if (dropped)
      out_.members = without(worst);
  }
}

// From what remains.
void ChannelSearch::estimate_noise() {
  double sizes = 0.0;
  for (const Member &member : out_.members)
    sizes += static_cast<double>(member.h.cols());
  const double rms = std::sqrt(y_.cwiseAbs2().cwiseProduct(out_.noise.weight).sum() /
                               std::max(1.0, out_.noise.weight.sum()));
  take_noise(noise_state(out_.fit.residual, out_.noise.weight, measured_, rms, sizes,
                         least_noise(channel_)));
}

// Of a form with a column for every log, whose first size is beta[first].
Parameter ChannelSearch::mixed_size(Index first, const Member &member) const {
  const double divisor = out_.noise.scatter * std::sqrt(out_.noise.spread_of_sizes);
  std::vector<double> sizes, errors;
  Parameter size{"size", 0.0, 0.0, ""};
  for (Index k = first; k < first + member.h.cols(); ++k) {
    size.per_log.push_back(out_.fit.beta(k));
    if (member.h.col(k - first).squaredNorm() <= 0.0)
      continue;
    sizes.push_back(out_.fit.beta(k));
    errors.push_back(divisor * std::sqrt(std::max(0.0, out_.fit.covariance(k, k))));
  }
  const MixedSize mixed = diagnose::mixed_size(sizes, errors);
  size.value = mixed.mean;
  size.stderror = mixed.stderror;
  size.between_logs_sd = mixed.between_sd;
  size.new_log = mixed.new_log;
  size.unit = library_.size_units[static_cast<std::size_t>(member.candidate)];
  return size;
}

void ChannelSearch::fill_sizes() {
  const double divisor = out_.noise.scatter * std::sqrt(out_.noise.spread_of_sizes);
  Index at = 0;
  for (Member &member : out_.members) {
    Term &term = member.term;
    if (member.is_given)
      continue;
    if (is_swing(term)) {
      const Index columns = member.h.cols();
      set_swing(out_.fit.beta.segment(at, columns),
                out_.fit.covariance.block(at, at, columns, columns), member.background, &term);
      at += columns;
      continue;
    }
    term.sizes.clear();
    if (member.differs) {
      term.sizes = {mixed_size(at, member)};
      at += member.h.cols();
      continue;
    }
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
      if (member.h.cols() == 2 && member.candidate >= 0)
        size.name = k == 0 ? "sine" : "cosine";
      else if (k > 0)
        size.name = fmt::format("size_{}", k + 1);
      if (member.candidate >= 0) {
        const auto &names =
            library_.candidates[static_cast<std::size_t>(member.candidate)].size_names;
        if (!names.empty())
          size.name = names[static_cast<std::size_t>(k)];
      }
      if (!member.size_names.empty()) {
        size.name = member.size_names[static_cast<std::size_t>(k)];
        size.unit = member.size_units[static_cast<std::size_t>(k)];
      }
      term.sizes.push_back(size);
    }
    if (term.form == "table")
      term.sizes = {{"size", 1.0, 0.0, ""}};
  }
}

// Every feature that carries a term alone, with all terms that it has a part in.
std::map<std::string, std::vector<std::size_t>> ChannelSearch::pieces() const {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (const Member &member : out_.members) {
    const std::set<std::string> names = features_of(member.term);
    const bool is_formula = member.term.form == "expression";
    if (names.size() == 1 && *names.begin() != kTime && !member.is_given && !is_formula)
      groups[*names.begin()].clear();
  }
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    // Of terms of several features only constants: a drag is not explained away by an altitude.
    const std::set<std::string> names = features_of(out_.members[j].term);
    for (const std::string &name : names) {
      const bool is_piece = (names.size() == 1 || out_.members[j].term.cause == "bias") &&
                            out_.members[j].term.form != "expression";
      if (is_piece && groups.count(name) > 0 && !out_.members[j].is_given)
        groups[name].push_back(j);
    }
  }
  return groups;
}

// Returns whether one curve explains at least as much as the `pieces` that it would replace (all
// members except `others`), or significantly more beside one of them.
bool ChannelSearch::is_smoother(const Member &table, const std::vector<Member> &others,
                                std::size_t pieces) const {
  std::vector<Member> both = out_.members, instead = others;
  both.push_back(table);
  instead.push_back(table);
  const double divisor = out_.noise.divisor();
  const double loss = fit_members(y_, out_.members, out_.noise).loss;
  const double more = (loss - fit_members(y_, both, out_.noise).loss) / divisor;
  const double of_table = (loss - fit_members(y_, instead, out_.noise).loss) / divisor;
  // 2 more is chi-squared of as many degrees as knots: its .998 quantile by Wilson and Hilferty.
  const std::string &over = table.term.arguments.at("f");
  if (std::any_of(others.begin(), others.end(), [&](const Member &m) {
        return std::any_of(m.term.arguments.begin(), m.term.arguments.end(),
                           [&over](const auto &argument) { return argument.second == over; });
      })) // a law of physics holds there
    return score_of(instead, out_.noise) - kTableCost > score_of(out_.members, out_.noise);
  const double k = static_cast<double>(table.h.cols());
  const double quantile =
      k * std::pow(1.0 - 2.0 / (9.0 * k) + 2.88 * std::sqrt(2.0 / (9.0 * k)), 3.0);
  // Real machines depart from a straight line a little, and so does one over a noisy reading: a
  // curve in its place must take off more than a trifle.
  const double whole = 0.5 * y_.cwiseAbs2().dot(out_.noise.weight);
  return (pieces > 1 && of_table > -3.0) ||
         (of_table > 0.0 && 2.0 * more > quantile && !is_trifle(more * divisor, loss, whole));
}

// Where one feature carries what was found, a smooth curve over it may say it better than any name:
// several pieces on one feature, or one with structure left over the same feature.
void ChannelSearch::smooth_unknowns() {
  for (const auto &[name, which] : pieces()) {
    std::vector<Member> others;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      if (std::find(which.begin(), which.end(), j) == which.end())
        others.push_back(out_.members[j]);
    }
    for (const int knots : {8, 14, 22}) {
      const Member table = table_member(measured_.find_feature(name), knots);
      if (table.h.cols() < 5 || !is_smoother(table, others, which.size()))
        continue;
      const std::vector<Member> named = out_.members;
      others.push_back(table);
      out_.members = others;
      Claim claim;
      hold_out(out_.members.size() - 1, &claim);
      if (claim.heldout_ln <= 0.0) // a curve that holds nowhere else explains nothing
        out_.members = named;
      else
        out_.fit = fit_members(y_, out_.members, out_.noise);
      return;
    }
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
  out_.members.insert(out_.members.end(), swings_.begin(), swings_.end());
  weigh();
}

// Weight of a row: is it a measurement, how much its variance differs inside claimed regions, and
// how much of what remains no multiple of the stated variance explains: where stated sds differ
// from row to row, a common variance may have to be added to all.
void ChannelSearch::weigh() {
  out_.noise.weight = measured_rows_;
  if (out_.noise.spread_of_sizes > kMostSpread)
    return; // what remains is the model's own error, no noise to be weighed
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

// Forms first and then regions; regions first and then forms: what enters first may take the place
// of what enters second.
void ChannelSearch::search_from(const std::vector<Member> &kept) {
  out_.members = kept;
  join_forms();
  add_terms(false);
  estimate_noise();
  add_terms(false);
  const ChannelFindings forms_first = out_;
  Noise noise = out_.noise;
  out_.members = kept;
  add_terms(true);
  estimate_noise();
  add_terms(false);
  const bool has_region =
      std::any_of(out_.members.begin(), out_.members.end(),
                  [](const Member &m) { return !m.is_given && !m.term.gate.everywhere(); });
  if (has_region) {
    join_forms();
    add_terms(false);
    estimate_noise();
    if (out_.noise.scale < noise.scale)
      noise = out_.noise;
  }
  if (!has_region || score_of(forms_first.members, noise) >= score_of(out_.members, noise))
    out_ = forms_first;
  try_expressions(kept);
}

void ChannelSearch::find_members(const Allowed &allowed) {
  allowed_ = allowed;
  const std::vector<Member> kept = out_.members;
  for (int pass = 0; pass < 3; ++pass) {
    scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
    search_from(kept);
    estimate_noise();
    const Vector before = out_.noise.weight;
    weigh();
    if (claim_variance())
      weigh();
    out_.fit = fit_members(y_, out_.members, out_.noise);
    estimate_noise();
    if ((out_.noise.weight - before).cwiseAbs().maxCoeff() < 1e-6)
      break;
  }
  scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
}

ChannelFindings ChannelSearch::run(const std::vector<Term> &given) {
  prepare(given);
  find_beside_start(given);
  find_swings(given);
  limit_hinges();
  for (int round = 0; round < 3; ++round)
    smooth_unknowns();
  formulas_for_tables();
  out_.fit = fit_members(y_, out_.members, out_.noise);
  drop_unconfirmed();
  drop_regions_of_noise();
  drop_feigned_by_steps();
  part_phases();
  drop_contradicted();
  name_parts();
  estimate_noise();
  fill_sizes();
  settle();
  if (join_one_way_gain())
    settle();
  search_beside_run(given);
  claim_overall_variance();
  refit_plain();
  follow_delay();
  bend_friction();
  add_unrefined();
  limit_support();
  open_edges();
  for (Member &member : out_.members) {
    if (!member.is_given)
      turn_sign(&member.term);
  }
  return std::move(out_);
}

double null_score(const Library &library, const Scanner &scanner, const Vector &y) {
  Noise noise;
  noise.weight = Vector::Ones(y.size());
  const Fit fit = fit_members(y, {}, noise);
  double best = -1e300;
  for (Proposal proposal : scanner.mean(fit, noise, 4)) {
    scanner.refine(fit.residual, noise, &proposal, false);
    const Candidate &candidate = library.candidates[static_cast<std::size_t>(proposal.candidate)];
    if (!proposal.bounds.empty() && candidate.columns == 1) {
      const Vector g = scanner.inside(proposal).cwiseProduct(library.g.col(candidate.column));
      const double s = g.dot(fit.clipped), w = g.squaredNorm();
      if (w > 0.0)
        proposal.gain = 0.5 * s * s / w;
    }
    best = std::max(best, proposal.score());
  }
  for (const Proposal &proposal : scanner.variance(fit, noise))
    best = std::max(best, proposal.score());
  return best;
}

} // namespace rim::diagnose
