// SPDX-License-Identifier: MIT
// Regions: how many features they need, where they end, and scatter that differs in one.
#include "diagnose/search.hpp"

#include <algorithm>

namespace rim::diagnose {

namespace {

constexpr double kBesideLaw = 0.15; // share of the rows

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
