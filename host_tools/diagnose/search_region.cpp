// SPDX-License-Identifier: MIT
// Regions: how many features they need, where they end, and scatter that differs in one.
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kBesideLaw = 0.15; // share of the rows
// A step, in standard deviations of what remains, beyond which the error goes with where within the
// step the outcome is: by .2 % of the step here, by 15 % at 2.9.
constexpr double kCoarseStep = 1.75;
// Share of what the steps do not explain that a term must take off.
constexpr double kBeyondSteps = 0.03;
constexpr double kStepsOfRegion = 2.0;
constexpr double kOneForTwo = 5.0; // nats that one finding in the place of two may cost

} // namespace

// The edges of a box, and more so the axes of an ellipse, fit noise that an interval cannot: a
// second feature must say more than what cannot be told apart.
void ChannelSearch::leave_out_features(const std::vector<Member> &members, const Fit &fit,
                                       Best *best) const {
  Best simpler;
  for (std::size_t k = 0; k < best->proposal.bounds.size(); ++k) {
    Proposal proposal = best->proposal;
    proposal.is_ellipse = false;
    proposal.bounds.erase(proposal.bounds.begin() + static_cast<std::ptrdiff_t>(k));
    proposal.penalty += library_.gate_penalty(1) - library_.gate_penalty(2);
    try_proposal(proposal, members, fit, &simpler);
  }
  if (simpler.score > best->score - kOfFeature && simpler.score >= options_.threshold)
    *best = simpler;
}

// Squares of the residual beyond half a step: a coarse reading says no more of the outcome.
double ChannelSearch::beyond_steps(const std::vector<Member> &members, double step) const {
  const Fit fit = fit_members(y_, members, out_.noise);
  const Eigen::ArrayXd half = 0.5 * step / channel_.sd.array();
  return ((fit.residual.array().abs() - half).max(0.0).square() * out_.noise.weight.array()).sum();
}

// The error of a coarse reading is a saw over what is predicted; pieces of its teeth are no gains
// or biases, nor is it noise that differs from tooth to tooth.
void ChannelSearch::drop_feigned_by_steps() {
  const double step = resolution(channel_.z);
  const auto is_coarse = [&] {
    const Vector left = out_.fit.residual.cwiseProduct(channel_.sd);
    return step > kCoarseStep * std::sqrt(left.cwiseAbs2().dot(measured_rows_) /
                                          std::max(1.0, measured_rows_.sum()));
  };
  while (is_coarse()) {
    const double all = beyond_steps(out_.members, step);
    std::size_t worst = out_.members.size();
    double least = 0.0;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      const double fall = beyond_steps(without(j), step) * (1.0 - kBeyondSteps) - all;
      if (!out_.members[j].is_given && fall < least) {
        least = fall;
        worst = j;
      }
    }
    if (worst == out_.members.size())
      break;
    out_.members = without(worst);
    out_.fit = fit_members(y_, out_.members, out_.noise);
    out_.step = step;
  }
  const auto is_of_steps = [&](const VarianceClaim &claim) {
    double low = 1e300, high = -1e300;
    for (Index i = 0; i < claim.mask.size(); ++i) {
      low = claim.mask(i) > 0.0 ? std::min(low, channel_.m(i)) : low;
      high = claim.mask(i) > 0.0 ? std::max(high, channel_.m(i)) : high;
    }
    return !claim.term.gate.everywhere() && high - low < kStepsOfRegion * step;
  };
  if (is_coarse() && std::any_of(out_.variances.begin(), out_.variances.end(), is_of_steps)) {
    out_.variances.clear(); // there is one at most
    out_.step = step;
    weigh();
    out_.fit = fit_members(y_, out_.members, out_.noise);
  }
}

// A limit of the prediction, above or below, in the place of a hinge that does no better: sets of
// forms are of such as have a size, which a limit has not.
void ChannelSearch::limit_hinges() {
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    const Member &hinge = out_.members[j];
    if (hinge.is_given || hinge.term.cause != "hinge" || !hinge.term.gate.everywhere())
      continue;
    const std::vector<Member> others = without(j);
    const Fit fit = fit_members(y_, others, out_.noise);
    Best best;
    for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
      const std::string &form = library_.candidates[c].term.form;
      Proposal proposal;
      proposal.candidate = static_cast<int>(c);
      proposal.penalty = library_.candidates[c].penalty;
      if ((form == "saturation_above" || form == "saturation_below") && !excludes(proposal, others))
        try_proposal(proposal, others, fit, &best);
    }
    std::vector<Member> all = others;
    all.push_back(best.member);
    if (best.score > 0.0 && score_of(all, out_.noise) > score_of(out_.members, out_.noise)) {
      out_.members[j] = best.member;
      out_.fit = fit_members(y_, out_.members, out_.noise);
    }
  }
}

// A gain and as much of the magnitude of a quantity are a gain where that quantity has one sign: a
// command that does more, or less, in one direction. True where that was so.
bool ChannelSearch::join_one_way_gain() {
  const auto find = [this](const char *form) {
    return static_cast<std::size_t>(std::find_if(out_.members.begin(), out_.members.end(),
                                                 [form](const Member &m) {
                                                   return !m.is_given && !m.differs &&
                                                          m.term.form == form &&
                                                          m.term.gate.everywhere();
                                                 }) -
                                    out_.members.begin());
  };
  const std::size_t gain = find("gain"), magnitude = find("coupling_magnitude");
  if (std::max(gain, magnitude) >= out_.members.size())
    return false;
  const std::string name = out_.members[magnitude].term.arguments.begin()->second;
  const int f = measured_.find_feature(name);
  if (f < 0)
    return false;
  const auto x = measured_.x.col(f);
  GateFeature over;
  over.name = name;
  over.unit = measured_.features[static_cast<std::size_t>(f)].unit;
  double best = score_of(out_.members, out_.noise) - kOneForTwo;
  std::vector<Member> joined;
  for (const bool is_above : {true, false}) {
    std::vector<Member> all = without(std::max(gain, magnitude));
    all.erase(all.begin() + static_cast<std::ptrdiff_t>(std::min(gain, magnitude)));
    Member one = out_.members[gain];
    one.penalty += library_.gate_penalty(1);
    add_bounds(over, is_above ? 0.0 : x.minCoeff(), is_above ? x.maxCoeff() : 0.0, &one.term.gate);
    one.h = gate_mask(one.term.gate, measured_).asDiagonal() * one.h;
    all.push_back(one);
    if (const double score = score_of(all, out_.noise); score > best) {
      best = score;
      joined = all;
    }
  }
  if (joined.empty())
    return false;
  out_.members = joined;
  out_.fit = fit_members(y_, out_.members, out_.noise);
  fill_sizes();
  return true;
}

// Wider in a few rows, in a place that only names what a claimed term is made of: that is how the
// term departs from the truth there (friction near rest), no noise.
bool ChannelSearch::is_beside_law(const Proposal &variance) const {
  const Gate gate = scanner_->gate(variance);
  if (variance.ratio < 1.0 || scanner_->inside(variance).mean() > kBesideLaw)
    return false;
  return std::all_of(gate.features.begin(), gate.features.end(), [this](const std::string &name) {
    return std::any_of(out_.members.begin(), out_.members.end(), [&name](const Member &m) {
      return std::any_of(m.term.arguments.begin(), m.term.arguments.end(),
                         [&name](const auto &argument) { return argument.second == name; });
    });
  });
}

// The best change of variance, if it is one. True when one was claimed.
bool ChannelSearch::claim_variance() {
  if (!out_.variances.empty())
    return false;
  const auto proposals = scanner_->variance(out_.fit, out_.noise);
  VarianceClaim claim;
  claim.term.channel = channel_.name;
  claim.term.cause = claim.term.form = "noise";
  claim.term.kind = TermKind::variance;
  if (!proposals.empty() && proposals[0].score() >= options_.threshold &&
      !is_beside_law(proposals[0]) && !is_of_one_step(channel_, scanner_->inside(proposals[0]))) {
    const Proposal &p = proposals[0];
    claim.mask = scanner_->inside(p);
    claim.term.gate = scanner_->gate(p);
    claim.term.sizes = {
        {"ratio", p.ratio, p.ratio * std::sqrt(2.0 / std::max(1.0, claim.mask.sum())), ""}};
    claim.ln_anom = p.gain;
    claim.score = p.score();
    out_.variances.push_back(claim);
    return true;
  }
  return false;
}

// A box's edge beyond which, within its other bounds, no row lies is only the end of the data.
void ChannelSearch::open_edges() {
  std::vector<Gate *> gates;
  for (Member &member : out_.members) {
    if (!member.is_given && !member.term.gate.is_ellipse)
      gates.push_back(&member.term.gate);
  }
  for (VarianceClaim &claim : out_.variances)
    gates.push_back(&claim.term.gate);
  for (Gate *at : gates) {
    Gate &gate = *at;
    for (std::size_t k = 0; k < gate.features.size(); ++k) {
      const int f = measured_.find_feature(base_feature(gate.features[k]));
      if (f >= 0 && measured_.features[static_cast<std::size_t>(f)].is_angle)
        continue;
      const Vector x = feature_column(measured_, gate.features[k]);
      gate.open_lower.resize(gate.features.size());
      gate.open_upper.resize(gate.features.size());
      const double slack = 1e-9 * (x.maxCoeff() - x.minCoeff());
      gate.open_lower[k] = gate.lower[k] <= x.minCoeff() + slack;
      gate.open_upper[k] = gate.upper[k] >= x.maxCoeff() - slack;
    }
  }
}

} // namespace rim::diagnose
