// SPDX-License-Identifier: MIT
// Sizes of frictions that trade with what stands beside them.
#include "diagnose/search.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;

std::string velocity_of(const Member &member) {
  const auto v = member.term.arguments.find("v");
  return v == member.term.arguments.end() ? std::string() : v->second;
}

bool is_friction(const Member &m) {
  return m.term.cause == "coulomb_friction" || m.term.cause == "viscous_friction";
}

// A law that is searched for, of the same size in every log and everywhere.
bool is_plain(const Member &m) {
  return !m.is_given && m.candidate >= 0 && !m.differs && !m.is_fixed && m.term.gate.everywhere();
}

constexpr double kOfSet = 0.5; // nats by which a set must be better

// Of two accounts of one law each may be right: the interval spans both.
void widen(double other, Parameter *size) {
  size->stderror = std::hypot(size->stderror, 0.5 * (other - size->value));
}

} // namespace

// Sets are compared with the shapes of a coarse grid, where a friction that falls from rest may
// look like one that grows with the square of the speed: such sets, with their shapes refined, in
// the place of all resistances over the velocity.
void ChannelSearch::try_stribeck() {
  std::vector<Member> best;
  double most = -1e300;
  std::size_t kept = 0;
  for (const std::vector<int> &set : library_.sets) {
    const Member first = form_member(set[0], false);
    if (first.term.form.rfind("stribeck", 0) != 0)
      continue;
    std::vector<Member> members;
    bool has_coulomb = false;
    for (const Member &m : out_.members) {
      if (is_plain(m) && is_law(m) && velocity_of(m) == velocity_of(first))
        has_coulomb = has_coulomb || m.term.cause == "coulomb_friction";
      else
        members.push_back(m);
    }
    if (!has_coulomb || out_.members.size() - members.size() < set.size())
      continue;
    const std::size_t others = members.size();
    for (const int candidate : set)
      members.push_back(form_member(candidate, false));
    if (const double score = score_of(members, out_.noise); score > most) {
      most = score;
      kept = others;
      best = std::move(members);
    }
  }
  if (best.empty())
    return;
  std::vector<Member> others = best;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(kept));
  refine_shape(others, fit_members(y_, others, out_.noise).loss, &best[kept]);
  if (score_of(best, out_.noise) > score_of(out_.members, out_.noise) + kOfSet)
    out_.members = std::move(best);
}

void widen_sizes(Term *term) {
  for (Parameter &size : term->sizes) {
    if (size.unrefined != 0.0)
      widen(size.unrefined, &size);
    if (size.near_rest != 0.0)
      widen(size.near_rest, &size);
  }
}

// The friction's size near rest, from its size over all speeds: the part of `by_speed` that its own
// column had a share in goes back to it.
void set_near_rest(std::vector<Member> *members) {
  for (const Member &bent : *members) {
    if (bent.term.form != kViscousBySpeed || bent.term.sizes.size() < 2)
      continue;
    const double by_speed = bent.term.sizes[1].value;
    for (Member &member : *members) {
      if (!is_friction(member) || velocity_of(member) != velocity_of(bent) ||
          member.term.sizes.empty() || !member.term.gate.everywhere())
        continue;
      Parameter &size = member.term.sizes[0];
      const std::string share = &member == &bent ? "linear" : "constant";
      for (const Parameter &p : bent.term.shape) {
        if (p.name == share)
          size.near_rest = size.value + (share == "linear" ? -by_speed : by_speed) * p.value;
      }
    }
  }
}

// Friction's sizes trade with what refines it over the same velocity (a drag, a share of the load):
// what they would be without that is what others, who fit less, would find.
void ChannelSearch::add_unrefined() {
  std::vector<Member> plain;
  for (const Member &member : out_.members) {
    const bool refines =
        std::any_of(out_.members.begin(), out_.members.end(), [&](const Member &friction) {
          return is_friction(friction) && !is_friction(member) && !velocity_of(member).empty() &&
                 velocity_of(member) == velocity_of(friction);
        });
    if (!refines || member.is_given || !member.term.gate.everywhere())
      plain.push_back(member);
  }
  if (plain.size() < out_.members.size()) {
    const std::vector<Term> terms = sized(plain);
    for (const Term &term : terms) {
      for (Member &member : out_.members) {
        if (is_friction(member) && member.term.form == term.form && !member.is_given &&
            member.term.arguments == term.arguments && member.term.gate.everywhere())
          member.term.sizes[0].unrefined = term.sizes[0].value;
      }
    }
  }
  set_near_rest(&out_.members);
  for (Member &member : out_.members) {
    if (!member.is_given)
      widen_sizes(&member.term);
  }
}

// The viscous friction that grows less than with the speed: a square of the speed that helps is no
// drag but how the friction bends. One finding, and its second column is made orthogonal to the
// frictions beside it, so that their sizes are those of all speeds, not of rest. What is predicted
// stays as it was.
void ChannelSearch::bend_friction() {
  const std::size_t none = out_.members.size();
  const auto find = [&](const std::string &cause, const std::string &v) {
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      const Member &m = out_.members[j];
      if (is_plain(m) && m.term.cause == cause && (v.empty() || velocity_of(m) == v) &&
          m.term.sizes.size() == m.term.basis.size() && !m.term.sizes.empty())
        return j;
    }
    return none;
  };
  const std::size_t drag = find("quadratic_drag", "");
  if (drag == none || out_.members[drag].term.form != "quadratic_drag")
    return;
  const std::string v = velocity_of(out_.members[drag]);
  const std::size_t viscous = find("viscous_friction", v), coulomb = find("coulomb_friction", v);
  if (viscous == none || out_.members[viscous].term.basis.size() != 1 ||
      out_.members[viscous].term.sizes[0].value * out_.members[drag].term.sizes[0].value >= 0.0)
    return;
  Member bent = out_.members[viscous];
  bent.term.form = kViscousBySpeed;
  Eigen::MatrixXd beside(y_.size(), coulomb == none ? 1 : 2);
  beside.col(0) = bent.h.col(0);
  if (coulomb != none) {
    beside.col(1) = out_.members[coulomb].h.col(0);
    bent.term.shape = out_.members[coulomb].term.shape;
  }
  const Eigen::MatrixXd weighted = out_.noise.weight.asDiagonal() * beside;
  const Vector share = (beside.transpose() * weighted)
                           .ldlt()
                           .solve(weighted.transpose() * out_.members[drag].h.col(0));
  const Parameter &square = out_.members[drag].term.sizes[0];
  bent.term.shape.push_back({"linear", share(0), 0.0, ""});
  std::string second = "v*abs(v) - linear*v";
  if (coulomb != none) { // the share is below none: v abs(v) bends away from both
    bent.term.shape.push_back({"constant", -share(1), 0.0, ""});
    second += " + constant*" + out_.members[coulomb].term.basis[0].substr(1);
  }
  bent.term.basis = {"-v", "-(" + second + ")"};
  bent.penalty += out_.members[drag].penalty;
  bent.size_names = {"size", "by_speed"};
  bent.size_units = {bent.term.sizes[0].unit, square.unit};
  set_columns(measured_, channel_, channel_.m, &bent);
  if (!bent.h.allFinite())
    return;
  out_.members[viscous] = bent;
  const auto at = static_cast<std::ptrdiff_t>(drag);
  out_.members.erase(out_.members.begin() + at);
  out_.claims.erase(out_.claims.begin() + at);
  out_.fit = fit_members(y_, out_.members, out_.noise);
  fill_sizes();
  // Other causes were tried in the place of each of the three alone, and stay.
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    Claim &claim = out_.claims[j];
    claim.ln_anom =
        (fit_members(y_, without(j), out_.noise).loss - out_.fit.loss) / out_.noise.divisor();
    claim.score = claim.ln_anom - out_.members[j].penalty;
    hold_out(j, &claim);
  }
}

} // namespace rim::diagnose
