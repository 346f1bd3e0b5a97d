// SPDX-License-Identifier: MIT
// The search looks at some rows of a large table; sizes are fitted to all.
#include "diagnose/search.hpp"

#include <cmath>

#include "diagnose/mixed.hpp"
#include "diagnose/swing.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;

// A table's columns: one for each knot.
Eigen::MatrixXd hats(const Term &term, const Measured &whole, const Vector &m) {
  Eigen::MatrixXd h(m.size(), static_cast<Index>(term.knots.size()));
  for (std::size_t k = 0; k < term.knots.size(); ++k) {
    Term hat = term;
    hat.values.assign(term.knots.size(), 0.0);
    hat.values[k] = 1.0;
    h.col(static_cast<Index>(k)) = basis_columns(hat, whole, m).col(0);
  }
  return h;
}

} // namespace

void set_columns(const Measured &whole, const Channel &channel, const Vector &m, Member *member) {
  const Term &term = member->term;
  if (member->is_given) {
    member->h = mean_effect(term, whole, m).cwiseQuotient(channel.sd);
    return;
  }
  const Eigen::MatrixXd columns = term.form == "table" ? hats(term, whole, m)
                                  : is_swing(term)     ? swing_columns(term, whole)
                                                       : basis_columns(term, whole, m);
  const Vector scale = gate_mask(term.gate, whole).cwiseQuotient(channel.sd);
  const Eigen::MatrixXd all = scale.asDiagonal() * columns;
  if (!member->differs) {
    member->h = all;
    return;
  }
  member->h = Eigen::MatrixXd::Zero(m.size(), static_cast<Index>(whole.logs.size()));
  for (std::size_t l = 0; l < whole.logs.size(); ++l) {
    const auto first = static_cast<Index>(whole.logs[l].first),
               rows = static_cast<Index>(whole.logs[l].rows);
    member->h.col(static_cast<Index>(l)).segment(first, rows) = all.col(0).segment(first, rows);
  }
}

namespace {

void take_sizes(const Fit &fit, double divisor, Index at, Member *member) {
  Term &term = member->term;
  std::vector<double> sizes, errors;
  for (Index k = at; k < at + member->h.cols(); ++k) {
    sizes.push_back(fit.beta(k));
    errors.push_back(divisor * std::sqrt(std::max(0.0, fit.covariance(k, k))));
  }
  if (term.form == "table") {
    term.values = sizes;
  } else if (member->differs) {
    const MixedSize mixed = mixed_size(sizes, errors);
    term.sizes[0].value = mixed.mean;
    term.sizes[0].stderror = mixed.stderror;
    term.sizes[0].between_logs_sd = mixed.between_sd;
    if (term.sizes[0].new_log != 0.0)
      term.sizes[0].new_log = mixed.new_log;
    term.sizes[0].per_log = sizes;
  } else {
    for (std::size_t k = 0; k < sizes.size() && k < term.sizes.size(); ++k) {
      term.sizes[k].value = sizes[k];
      term.sizes[k].stderror = errors[k];
      term.sizes[k].near_rest = 0.0;
    }
  }
}

} // namespace

void refit_on(const Measured &whole, const Channel &channel, ChannelFindings *found) {
  const Vector y = (channel.z - channel.m).cwiseQuotient(channel.sd);
  found->flagged = find_flagged(whole, channel);
  Vector used = Vector::Ones(y.size());
  for (Index i = 0; i < y.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (found->flagged.stuck[k] != 0 || found->flagged.dropout[k] != 0)
      used(i) = 0.0;
  }
  for (VarianceClaim &claim : found->variances)
    claim.mask = gate_mask(claim.term.gate, whole);
  Vector m = channel.m;
  for (const Member &member : found->members) {
    if (moves_prediction(member.term))
      m += mean_effect(member.term, whole, channel.m);
  }
  for (Member &member : found->members)
    set_columns(whole, channel, moves_prediction(member.term) ? channel.m : m, &member);
  found->noise.weight = used;
  found->fit = fit_members(y, found->members, found->noise);
  const NoiseState noise =
      noise_state(found->fit.residual, used, whole, 0.0, 0.0, least_noise(channel));
  found->noise.scatter = noise.scatter;
  found->noise.spread_of_sizes = noise.spread_of_sizes;
  found->autocorrelation = noise.autocorrelation;
  Index at = 0;
  for (Member &member : found->members) {
    if (member.is_fixed)
      continue;
    const Index columns = member.h.cols();
    if (is_swing(member.term))
      set_swing(found->fit.beta.segment(at, columns),
                found->fit.covariance.block(at, at, columns, columns), member.background,
                &member.term);
    else
      take_sizes(found->fit, noise.scatter * std::sqrt(noise.spread_of_sizes), at, &member);
    at += member.h.cols();
  }
  set_near_rest(&found->members);
  for (Member &member : found->members) {
    if (!member.is_given)
      widen_sizes(&member.term);
  }
}

} // namespace rim::diagnose
