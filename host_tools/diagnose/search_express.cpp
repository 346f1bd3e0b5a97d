// SPDX-License-Identifier: MIT
// Formulas where no set of named forms explains.
#include "diagnose/search.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include <Eigen/Cholesky>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// Nats that a formula must be better by than laws or one name, and than several patches.
constexpr double kWithoutName = 20.0, kThanPatches = 3.0;
// Nats that a name may cost a formula's part, and the cosines from which it may be one of a
// friction or drag, and of another form.
constexpr double kForName = 5.0, kAlike = 0.9, kSame = 1.0 - 1e-6;
constexpr double kOfStated = 0.95;  // of the stated variance, what noise leaves at least
constexpr double kMuch = 0.1;       // share of the whole error, as amplitude, that is much more
constexpr double kHeldSlack = 1.02; // and by what it may be worse on the held logs
constexpr int kRounds = 2;
constexpr double kMuchLess = 0.7;
constexpr double kSettled = 0.1; // rounds end when the noise moves by less
// What laws of physics leave is smooth, or wider than stated: they may not be the right ones.
constexpr double kSmooth = 1.5, kWide = 1.2;

bool has_word(const std::string &text, const std::string &word) {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
  };
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_part(text[at - 1])) && (end == text.size() || !is_part(text[end])))
      return true;
  }
  return false;
}

// Takes a product out of a formula, with what it alone named.
void take_out(std::size_t part, Member *formula) {
  Term &term = formula->term;
  const auto at = static_cast<std::ptrdiff_t>(part);
  formula->penalty -= formula->part_penalty[part];
  formula->part_penalty.erase(formula->part_penalty.begin() + at);
  term.basis.erase(term.basis.begin() + at);
  const auto k = static_cast<Index>(part), more = formula->h.cols() - 1 - k;
  const Eigen::MatrixXd all = formula->h;
  formula->h.resize(all.rows(), k + more);
  formula->h << all.leftCols(k), all.rightCols(more);
  const auto is_used = [&term](const std::string &word) {
    return std::any_of(term.basis.begin(), term.basis.end(),
                       [&word](const std::string &basis) { return has_word(basis, word); });
  };
  for (auto it = term.arguments.begin(); it != term.arguments.end();)
    it = is_used(it->first) ? std::next(it) : term.arguments.erase(it);
  term.shape.erase(std::remove_if(term.shape.begin(), term.shape.end(),
                                  [&](const Parameter &p) { return !is_used(p.name); }),
                   term.shape.end());
}

// Features that a product of a formula is of.
std::set<std::string> features_of_product(const Term &formula, std::size_t part) {
  std::set<std::string> out;
  for (const auto &[placeholder, feature] : formula.arguments) {
    if (has_word(formula.basis[part], placeholder))
      out.insert(feature);
  }
  return out;
}

// Whether a product of a formula is of features that another product is of too, of all of them or
// of all that the other has: x beside x cubed is one law, and x beside x*y; x*y beside x*z are two.
bool shares_features(const Term &formula, std::size_t part) {
  const std::set<std::string> mine = features_of_product(formula, part);
  for (std::size_t k = 0; k < formula.basis.size(); ++k) {
    const std::set<std::string> others = features_of_product(formula, k);
    const auto both = static_cast<std::size_t>(
        std::count_if(mine.begin(), mine.end(),
                      [&others](const std::string &name) { return others.count(name) > 0; }));
    if (k != part && both > 0 && (both == mine.size() || both == others.size()))
      return true;
  }
  return false;
}

// Cosine between a column and the nearest combination of one or two others.
double cosine(const Vector &column, const Eigen::MatrixXd &others) {
  Eigen::MatrixXd gram = others.transpose() * others;
  gram.diagonal().array() *= 1.0 + 1e-12;
  const Vector s = others.transpose() * column;
  return std::sqrt(std::max(0.0, s.dot(gram.ldlt().solve(s)))) / std::max(1e-300, column.norm());
}

// Whether a formula is nothing but the product of two features: it is the form of that name, which
// is not tried where one of them (a temperature) varies little beside its mean.
bool is_plain_product(const Term &term) {
  if (term.form != "expression" || term.basis.size() != 1 || term.arguments.size() != 2)
    return false;
  const std::string &f = term.arguments.begin()->first, &g = term.arguments.rbegin()->first;
  return term.basis[0] == f + "*" + g || term.basis[0] == g + "*" + f;
}

// Whether it is nothing but a feature: a coupling, which is not tried for the same reason.
bool is_plain_coupling(const Term &term) {
  return term.form == "expression" && term.basis.size() == 1 && term.arguments.size() == 1 &&
         term.basis[0] == term.arguments.begin()->first;
}

} // namespace

// Resistances over one velocity whose sizes have opposite signs are pieces of a curve, no laws.
bool ChannelSearch::has_opposites() const {
  std::map<std::string, double> sign;
  Index at = 0;
  for (const Member &m : out_.members) {
    const Index first = at;
    at += m.is_fixed ? 0 : m.h.cols();
    const auto v = m.term.arguments.find("v");
    if (!is_law(m) || v == m.term.arguments.end() || m.is_fixed || first >= out_.fit.beta.size())
      continue;
    double &before = sign[v->second];
    if (before * out_.fit.beta(first) < 0.0)
      return true;
    before = out_.fit.beta(first);
  }
  return false;
}

bool ChannelSearch::is_law(const Member &m) const {
  return !m.is_given && m.candidate >= 0 && m.term.gate.everywhere() &&
         library_.candidates[static_cast<std::size_t>(m.candidate)].is_physical;
}

bool ChannelSearch::are_laws() const {
  return !has_opposites() &&
         std::all_of(out_.members.begin(), out_.members.end(), [this](const Member &m) {
           return m.is_given || is_swing(m.term) || is_law(m);
         });
}

// Whether what was found may be the likeness of something else: it is no law of physics, or
// several, or what one law leaves is no noise.
bool ChannelSearch::asks_for_expression() const {
  if (!are_laws())
    return true;
  return out_.members.size() > 1 ||
         (!out_.members.empty() &&
          (out_.noise.spread_of_sizes > kSmooth || out_.noise.scatter > kWide));
}

// Formulas beside these members, by the noise that the best of them leaves.
std::vector<Expression> ChannelSearch::expressions_beside(const std::vector<Member> &base) {
  std::vector<Expression> found;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<Expression> now = find_expressions(measured_, channel_, y_, base, out_.noise);
    if (now.empty())
      break;
    found = std::move(now);
    out_.members = base;
    out_.members.push_back(found.front().member);
    out_.fit = fit_members(y_, out_.members, out_.noise);
    const double before = out_.noise.divisor();
    estimate_noise();
    if (std::abs(out_.noise.divisor() / before - 1.0) < kSettled)
      break;
  }
  return found;
}

// What anything more could take off: the share of the whole squares that is left, less what noise
// of the stated sd leaves.
double ChannelSearch::share_left() const {
  const double whole = y_.cwiseAbs2().dot(out_.noise.weight),
               left = out_.fit.residual.cwiseAbs2().dot(out_.noise.weight),
               noise = channel_.sd_estimated ? 0.0 : kOfStated * out_.noise.weight.sum();
  return (left - noise) / std::max(1e-300, whole);
}

// Beside nothing, and beside the laws that were found; taken where it says so much more than names
// that these are no longer worth having, and holds in parts that it was not fitted to.
void ChannelSearch::try_expressions(const std::vector<Member> &kept) {
  if (!asks_for_expression())
    return;
  const ChannelFindings named = out_;
  std::vector<std::vector<Member>> bases{kept, kept};
  for (const Member &m : named.members) {
    if (is_law(m) && m.term.cause != "bias" && !moves_prediction(m.term))
      bases[1].push_back(m);
  }
  if (bases[1].size() == kept.size())
    bases.pop_back();
  const bool has_law = !has_opposites() && std::any_of(out_.members.begin(), out_.members.end(),
                                                       [this](const Member &m) {
                                                         return is_law(m) && m.term.cause != "bias";
                                                       });
  const bool only_laws = are_laws();
  const double possible = share_left();
  const double margin = only_laws || named.members.size() < 2 ? kWithoutName : kThanPatches;
  ChannelFindings best = named;
  std::vector<double> seen_by(bases.size(), 1e300);
  for (std::size_t search = 0; search < 2 * bases.size(); ++search) {
    const std::size_t b = search % bases.size();
    const std::vector<Member> &base = bases[b];
    const bool is_beside = base.size() > kept.size();
    // What would not be taken whatever it said is not searched for.
    if ((has_law && !is_beside && possible <= kMuch * kMuch) ||
        (only_laws && is_beside && possible <= kRelevant * kRelevant))
      continue;
    // Again where what was found beside other laws leaves much less than what this one was judged
    // by.
    const Noise noise = search < bases.size() ? named.noise : best.noise;
    if (search >= bases.size() && noise.divisor() > kMuchLess * seen_by[b])
      continue;
    out_ = named;
    out_.noise = noise;
    const std::vector<Expression> found = expressions_beside(base);
    seen_by[b] = out_.noise.divisor();
    if (found.empty())
      continue;
    const double better = best.rival_expressions.empty() ? margin : 0.0;
    if (!is_better_formula(best, better) || (is_beside && formula_overlaps_law()) ||
        (has_law && !is_beside && !says_more(named, kMuch)) ||
        (only_laws && is_beside && !says_more(named, kRelevant)))
      continue;
    best = out_;
    best.rival_expressions.clear();
    for (const Expression &expression : found)
      best.rival_expressions.push_back(expression.member);
  }
  out_ = std::move(best);
  name_parts();
  join_laws_beside_formula();
}

// What is given and the formula, whole; and less each of its products that is of one feature.
std::vector<std::vector<Member>> ChannelSearch::formula_alone() const {
  std::vector<Member> all;
  std::size_t formula = out_.members.size();
  for (const Member &m : out_.members) {
    if (m.is_given || is_swing(m.term) || !m.term.gate.everywhere() || !m.part_penalty.empty())
      all.push_back(m);
    if (!m.is_given && !m.part_penalty.empty())
      formula = all.size() - 1;
  }
  if (formula == out_.members.size())
    return {};
  std::vector<std::vector<Member>> out{all};
  const Term &term = all[formula].term;
  for (std::size_t k = 0; k < term.basis.size() && term.basis.size() > 1; ++k) {
    if (features_of_product(term, k).size() > 1)
      continue;
    out.push_back(all);
    take_out(k, &out.back()[formula]);
  }
  return out;
}

// Whether a product of the formula is of one feature alone that a resistance is of too: they are
// one curve in two pieces.
bool ChannelSearch::formula_overlaps_law() const {
  std::set<std::string> resisted;
  for (const Member &m : out_.members) {
    const auto v = m.term.arguments.find("v");
    if (is_law(m) && v != m.term.arguments.end())
      resisted.insert(v->second);
  }
  for (const Member &m : out_.members) {
    for (std::size_t k = 0; !m.is_given && k < m.part_penalty.size(); ++k) {
      const std::set<std::string> features = features_of_product(m.term, k);
      if (features.size() == 1 && resisted.count(*features.begin()) > 0)
        return true;
    }
  }
  return false;
}

// A formula has few products, and its last may stand for several laws (a root of the speed for a
// friction of two kinds): these, searched jointly beside the others, take its place where they say
// more.
void ChannelSearch::join_laws_beside_formula() {
  ChannelFindings best = out_;
  const std::vector<std::vector<Member>> formulas = formula_alone();
  for (const std::vector<Member> &formula : formulas) {
    const std::size_t alone = formula.size();
    const bool is_whole = &formula == formulas.data();
    out_ = best;
    join_forms_beside(formula);
    out_.fit = fit_members(y_, out_.members, out_.noise);
    estimate_noise();
    const Noise noise = out_.noise.scale < best.noise.scale ? out_.noise : best.noise;
    if (out_.members.size() == alone || out_.members.size() > options_.most_terms ||
        has_opposites() || formula_overlaps_law() ||
        score_of(out_.members, noise) <
            score_of(best.members, noise) + (is_whole ? kWithoutName : kThanPatches) ||
        (is_whole && !says_more(best, kRelevant)))
      continue;
    out_.rival_expressions.clear();
    best = out_;
  }
  out_ = std::move(best);
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// Whether the members, the last of them a formula, say more than those of `other`, by so many nats,
// and hold in parts of the logs that they were not fitted to.
bool ChannelSearch::is_better_formula(const ChannelFindings &other, double by) {
  const Noise &noise = out_.noise.scale < other.noise.scale ? out_.noise : other.noise;
  if (score_of(out_.members, noise) < score_of(other.members, noise) + by)
    return false;
  Claim claim;
  hold_out(out_.members.size() - 1, &claim);
  return claim.is_confirmed &&
         (!has_held() || held_loss(out_.members) <= kHeldSlack * held_loss(other.members));
}

// Real machines depart from every law a little: laws stay alone where a formula takes less than
// this share of the whole error, as amplitude, more off.
bool ChannelSearch::says_more(const ChannelFindings &laws, double share) const {
  const double whole = 0.5 * y_.cwiseAbs2().dot(out_.noise.weight);
  const double fall =
      0.5 * (laws.fit.residual.cwiseAbs2() - out_.fit.residual.cwiseAbs2()).dot(out_.noise.weight);
  return fall > share * share * whole;
}

// Products of the formula, of which `part` is one, that the candidate says: it alone where the
// candidate has one size, all that are combinations of its columns where it has two (a sine and a
// cosine). None: it does not say `part`.
std::vector<std::size_t> ChannelSearch::parts_said(const Candidate &candidate, std::size_t formula,
                                                   std::size_t part) const {
  const Vector root = out_.noise.weight.cwiseSqrt();
  const bool resists = candidate.is_physical && candidate.term.arguments.count("v") > 0;
  const Term &term = out_.members[formula].term;
  if (candidate.is_fixed || (candidate.columns > 1 && resists))
    return {};
  const Eigen::MatrixXd said =
      root.asDiagonal() * library_.g.middleCols(candidate.column, candidate.columns);
  std::vector<std::size_t> parts;
  for (std::size_t k = 0; k < out_.members[formula].part_penalty.size(); ++k) {
    const Vector column = root.cwiseProduct(out_.members[formula].h.col(static_cast<Index>(k)));
    const bool is_wanted = k == part || candidate.columns > 1;
    const bool may_be = resists || candidate.columns > 1 || !shares_features(term, part);
    if (is_wanted && may_be && cosine(column, said) > (resists ? kAlike : kSame))
      parts.push_back(k);
  }
  return std::find(parts.begin(), parts.end(), part) != parts.end() ? parts
                                                                    : std::vector<std::size_t>{};
}

// The members with the form that says what a part of the formula says in that part's place, and in
// the place of another of its kind; none: there is no such name.
std::vector<Member> ChannelSearch::named_part(std::size_t formula, std::size_t part) const {
  double best = -1e300;
  std::vector<Member> named;
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const Candidate &candidate = library_.candidates[c];
    const std::vector<std::size_t> parts = parts_said(candidate, formula, part);
    if (parts.empty())
      continue;
    std::vector<Member> all;
    for (const Member &m : without(formula)) {
      const bool is_same =
          !m.is_given && m.candidate >= 0 && m.term.gate.everywhere() &&
          library_.candidates[static_cast<std::size_t>(m.candidate)].group == candidate.group;
      if (!is_same)
        all.push_back(m);
    }
    if (parts.size() < out_.members[formula].part_penalty.size()) {
      all.push_back(out_.members[formula]);
      for (std::size_t k = parts.size(); k-- > 0;)
        take_out(parts[k], &all.back());
    }
    Member member = form_member(static_cast<int>(c), false);
    if (!member.term.shape.empty())
      refine_shape(all, fit_members(y_, all, out_.noise).loss, &member);
    all.push_back(std::move(member));
    // A sine alone is a form of two sizes too, one of which is about none.
    const double sizes = 0.5 * library_.ln_rows *
                         std::max(0.0, candidate.columns - static_cast<double>(parts.size()));
    const double score = score_of(all, out_.noise) + sizes;
    if (score > std::max(best, score_of(out_.members, out_.noise) - kForName)) {
      best = score;
      named = std::move(all);
    }
  }
  return named;
}

// The members with a coupling and a constant in place of a formula of one feature, where that is a
// straight line in all but its looks; none: it is not.
std::vector<Member> ChannelSearch::as_straight_line(std::size_t formula) const {
  const Term &term = out_.members[formula].term;
  if (term.arguments.size() != 1)
    return {};
  std::vector<Member> all;
  for (const Member &m : without(formula)) {
    if (m.is_given || m.term.cause != "bias" || !m.term.gate.everywhere())
      all.push_back(m);
  }
  const std::size_t others = all.size();
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const Term &named = library_.candidates[c].term;
    const bool is_of_it = !named.arguments.empty() &&
                          named.arguments.begin()->second == term.arguments.begin()->second;
    if (named.form == "bias" ||
        (is_of_it && (named.form == "coupling" || named.form == "coupling_about")))
      all.push_back(form_member(static_cast<int>(c), false));
  }
  const bool is_line = all.size() == others + 2 &&
                       score_of(all, out_.noise) > score_of(out_.members, out_.noise) - kForName;
  return is_line ? all : std::vector<Member>{};
}

// Plain products of two features that no other part of a formula is of are findings of their own.
void ChannelSearch::split_products() {
  std::vector<Member> apart;
  for (Member &member : out_.members) {
    for (std::size_t k = member.is_given ? 0 : member.part_penalty.size(); k-- > 0;) {
      Member one = member;
      for (std::size_t other = member.part_penalty.size(); other-- > 0;) {
        if (other != k)
          take_out(other, &one);
      }
      if (member.part_penalty.size() == 1 || !is_plain_product(one.term) ||
          shares_features(member.term, k))
        continue;
      one.penalty = one.part_penalty.front();
      take_out(k, &member);
      apart.push_back(std::move(one));
    }
  }
  if (!apart.empty())
    out_.rival_expressions.clear(); // they are rivals of the whole formula
  out_.members.insert(out_.members.end(), apart.begin(), apart.end());
}

// Where a part of a formula has a name (it is about a friction or a drag, or exactly another form
// of features that no other part is of) it is claimed as that, and the formula is what remains.
void ChannelSearch::name_parts() {
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t j = 0; !changed && j < out_.members.size(); ++j) {
      const std::size_t parts = out_.members[j].is_given ? 0 : out_.members[j].part_penalty.size();
      std::vector<Member> line = parts > 0 ? as_straight_line(j) : std::vector<Member>{};
      if (!line.empty()) {
        out_.members = std::move(line);
        out_.rival_expressions.clear();
        changed = true;
        break;
      }
      for (std::size_t k = 0; !changed && k < parts; ++k) {
        std::vector<Member> named = named_part(j, k);
        changed = !named.empty();
        if (changed) {
          out_.members = std::move(named);
          out_.rival_expressions.clear(); // they are rivals of the whole formula
        }
      }
    }
  }
  split_products();
  for (Member &member : out_.members) {
    if (is_plain_product(member.term))
      member.term.cause = "product";
    if (is_plain_coupling(member.term))
      member.term.cause = "coupling";
  }
  out_.fit = fit_members(y_, out_.members, out_.noise);
}

// A curve of many values is no explanation where a formula says as much.
void ChannelSearch::formulas_for_tables() {
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    if (out_.members[j].term.form != "table" || out_.members[j].is_given)
      continue;
    const ChannelFindings curve = out_;
    const std::vector<Expression> found = expressions_beside(without(j));
    if (found.empty() || !is_better_formula(curve, 0.0)) {
      out_ = curve;
      continue;
    }
    out_.rival_expressions.clear();
    for (const Expression &expression : found)
      out_.rival_expressions.push_back(expression.member);
    return;
  }
}

// Other formulas in the place of the one that is claimed; the first of the list is that one.
void ChannelSearch::add_rival_expressions(const std::vector<Member> &others, const Fit &without,
                                          Claim *claim) const {
  for (std::size_t k = 1; k < out_.rival_expressions.size(); ++k) {
    std::vector<Member> all = others;
    all.push_back(out_.rival_expressions[k]);
    const Fit with = fit_members(y_, all, out_.noise);
    Member rival = all.back();
    const Index first = with.beta.size() - rival.h.cols();
    for (Index c = 0; c < rival.h.cols(); ++c)
      rival.term.sizes.push_back({"size", with.beta(first + c), 0.0, ""});
    Alternative alternative;
    alternative.cause = "unknown";
    alternative.expression = expression_text(rival.term);
    const double score = (without.loss - with.loss) / out_.noise.divisor() - rival.penalty;
    alternative.delta_bic = 2.0 * (claim->score - score);
    alternative.heldout_r2 = heldout_r2_of(all);
    claim->alternatives.push_back(alternative);
  }
}

} // namespace rim::diagnose
