// SPDX-License-Identifier: MIT
#include "train/choose_models.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "train/outside.hpp"

extern "C" {
#include "image/basis.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

// First readings must lower the error of the best model without them by so much, and the error
// within runs alone as well: a sensor that is wrong from the start, or a place in which the run
// starts, shifts all that is predicted by them, and an offset that differs between runs is an
// effect of the run, by which an offset from the start is judged. Where the starts differ so much
// that the error falls to this part, hardly an offset could be seen, and nothing else either.
constexpr double kFirstMustWin = 0.1;
constexpr double kFirstAlone = 1.0 / 3.0;
const Choice kChoices[] = {{false, false, false, false, 0.0}, {true, false, false, false, 0.03},
                           {false, true, false, false, 0.03}, {true, true, false, false, 0.05},
                           {false, false, true, false, 0.10}, {true, false, true, false, 0.12},
                           {true, true, true, false, 0.15},   {true, false, false, true, 0.08},
                           {true, true, false, true, 0.10},   {true, true, true, true, 0.18}};
// Steep terms go far beyond what was learnt from: they must lower the error of the best model
// without them by so much.
constexpr double kSteepMustWin = 0.05;
// The commands explain an outcome where they leave less than this part of its deviation (a tenth of
// its variance).
constexpr double kExplained = 0.3162;
// An outcome from outside must lower another's error by so much as its input, and all such outcomes
// together that of the best of them alone.
constexpr double kOutsideMustWin = 0.1;
// The others together leave less than this part of the error of what they bring about.
constexpr double kDriven = 1.0 / 3.0;
constexpr double kFurtherMustWin = 0.1;
// Rolled states must lower the error of the best model without them by so much: first that of the
// simplest models, by kRolledMayWin; at last the mean of both errors, with whole runs and without.
// All of them together must lower that of the best of them alone by kFurtherMustWin. An outcome is
// rolled forward itself where a model leaves more than kRolledWorth of its deviation, whole runs
// counted: a state begins where its own sensor is, which hides an offset from the start, and leaves
// nothing to tell by which of two sensors that read the same is wrong.
constexpr double kRolledMustWin = 0.1, kRolledMayWin = 0.05;
constexpr double kRolledWorth = 0.05;

// Filters of commands that are slower than this part of the slowest one are told apart from the
// others by how the runs began, and by little else: a run that begins as few others do (at speed)
// would be predicted by weights that these few runs have set. A target does without them, and
// without how commands move, where its error becomes larger by no more than this.
constexpr double kQuick = 0.05;
constexpr double kLessMayLose = 0.03;

bool holds(const std::vector<std::uint16_t> &all, std::uint16_t one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// Whether a term is made of a slow filter.
bool is_slow(const Basis &basis, const Basis::Term &t) {
  const std::uint16_t places[] = {t.a, t.b, t.c};
  return std::any_of(places, places + filters_of(t), [&basis](std::uint16_t filter) {
    return basis.share[filter % basis.share.size()] < basis.share.back() / kQuick;
  });
}

// The inputs of a term.
std::vector<std::size_t> inputs_of(const Basis &basis, const Basis::Term &t) {
  const std::size_t times = basis.share.size();
  const std::uint16_t places[] = {t.a, t.b, t.c};
  std::vector<std::size_t> inputs;
  for (std::size_t k = 0; k < filters_of(t); ++k)
    inputs.push_back(places[k] / times);
  if (t.op == BASIS_ROLLED && t.b != BASIS_PLAIN)
    inputs.push_back(t.b / times);
  if (t.op == BASIS_INTEGRAL)
    inputs.push_back(t.a);
  return inputs;
}

} // namespace

std::vector<std::uint16_t> features_of(const Basis &basis, const Basis::Term &term) {
  std::vector<std::uint16_t> features;
  for (const std::size_t i : inputs_of(basis, term)) {
    const Basis::Input &in = basis.inputs[i];
    features.push_back(in.a);
    if (rimi_basis_is_product(in.b))
      features.push_back(static_cast<std::uint16_t>(in.b & ~BASIS_OF_PRODUCT));
  }
  return features;
}

std::vector<std::uint16_t> features_of(const Layout &layout, const std::vector<std::size_t> &set) {
  std::vector<std::uint16_t> features;
  for (const std::size_t o : set)
    features.push_back(layout.outcome_feature[o]);
  return features;
}

std::vector<Eigen::Index> terms_of(const Basis &basis, const Choice &choice, std::size_t outcome,
                                   const Further &further) {
  std::vector<Eigen::Index> terms;
  const auto is_input = [&](const Basis::Term &t) {
    return holds(further.outside, basis.inputs[t.a / basis.share.size()].a);
  };
  const auto is_rolled = [&](const Basis::Term &t) {
    const bool alone = t.b == BASIS_PLAIN && t.c == BASIS_PLAIN;
    const bool is_hinge = t.c != BASIS_PLAIN && t.c >= BASIS_HINGE;
    return holds(further.states, t.a) &&
           (t.c == BASIS_PLAIN || is_hinge || holds(further.states, t.c)) &&
           (alone || choice.shape) && (!is_hinge || choice.steep);
  };
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    const TermGroup g = basis.terms[i].group;
    if (g == TermGroup::mean || g == TermGroup::movement ||
        (g == TermGroup::shape && choice.shape) || (g == TermGroup::slow && choice.slow) ||
        (g == TermGroup::steep && choice.steep) ||
        (g == TermGroup::outside && is_input(basis.terms[i]) &&
         (basis.terms[i].op == BASIS_MEAN || choice.shape)) ||
        (g == TermGroup::rolled && is_rolled(basis.terms[i])) ||
        (g == TermGroup::initial && choice.initial && basis.terms[i].a == outcome))
      terms.push_back(static_cast<Eigen::Index>(i));
  }
  return terms;
}

std::vector<Eigen::Index> terms_of(const Basis &basis, const Layout &layout,
                                   const TargetModel &model, std::size_t outcome) {
  std::vector<Eigen::Index> terms =
      terms_of(basis, {model.shape, model.slow, model.initial, model.steep, 0.0}, outcome,
               {features_of(layout, model.outside), model.states});
  const auto is_left_out = [&](Eigen::Index i) {
    const Basis::Term &term = basis.terms[static_cast<std::size_t>(i)];
    const std::vector<std::uint16_t> of_it = features_of(basis, term);
    return (model.quick && is_slow(basis, term)) ||
           (model.still && term.group == TermGroup::movement) ||
           std::any_of(of_it.begin(), of_it.end(),
                       [&model](std::uint16_t f) { return holds(model.without, f); });
  };
  terms.erase(std::remove_if(terms.begin(), terms.end(), is_left_out), terms.end());
  return terms;
}

namespace {

// The simplest choice that no richer one beats by enough. errors[choice][target]: of all targets,
// then those within runs alone, which compare them where `is_within`.
TargetModel choose_among(const std::vector<std::vector<std::vector<double>>> &errors,
                         std::size_t target, bool is_within, bool with_initial) {
  TargetModel best;
  double least = 1e300, bar = 1e300;
  for (std::size_t c = 0; c < std::size(kChoices); ++c) {
    if (kChoices[c].initial && !with_initial)
      continue;
    if (kChoices[c].steep && kChoices[c].initial != best.initial)
      continue; // steep terms can stand for how the runs began, but only for these runs
    const std::vector<double> &by_ridge =
        errors[c][(is_within ? errors[c].size() / 2 : 0) + target];
    const std::size_t l = best_ridge(by_ridge);
    const double first = kChoices[c].initial && !best.initial ? kFirstMustWin : 0.0;
    const double steep = kChoices[c].steep && !best.steep ? kSteepMustWin : 0.0;
    if (by_ridge[l] < (1.0 - kChoices[c].must_win) * bar &&
        by_ridge[l] < (1.0 - first - steep) * least) {
      least = by_ridge[l];
      best.shape = kChoices[c].shape;
      best.slow = kChoices[c].slow;
      best.initial = kChoices[c].initial;
      best.steep = kChoices[c].steep;
      best.ridge = kRidges[l];
      best.whole_error =
          whole_error(errors[c][target][l], errors[c][errors[c].size() / 2 + target][l]);
    }
    if (c == 0)
      bar = least; // of the simplest
  }
  best.error = least;
  return best;
}

TargetModel choose(const std::vector<std::vector<std::vector<double>>> &errors, std::size_t target,
                   std::size_t outcomes) {
  const TargetModel best = choose_among(errors, target, false, target < outcomes);
  if (!best.initial)
    return best;
  if (choose_among(errors, target, true, true).initial ||
      best.error < kFirstAlone * choose_among(errors, target, false, false).error)
    return best;
  return choose_among(errors, target, true, false);
}

// errors[choice][target]: of outcomes and scatter, or of outcomes less their first readings; then
// those within runs alone.
using Errors = std::vector<std::vector<std::vector<double>>>;

// Choices with first readings are answered for the outcomes `with_initial`.
Errors errors_of_choices(const Fitter &fitter, const Basis &basis, std::size_t outcomes,
                         const Further &further, const std::vector<std::size_t> &with_initial) {
  const auto o = static_cast<Eigen::Index>(outcomes);
  std::vector<Question> questions;
  for (const Choice &choice : kChoices) {
    if (!choice.initial)
      questions.push_back({terms_of(basis, choice, 0, further), 0, 2 * o});
    for (std::size_t i = 0; choice.initial && i < with_initial.size(); ++i)
      questions.push_back({terms_of(basis, choice, with_initial[i], further),
                           2 * o + static_cast<Eigen::Index>(with_initial[i]), 1});
  }
  const auto answers = fitter.errors(questions);
  Errors errors;
  std::size_t at = 0;
  for (const Choice &choice : kChoices) {
    errors.emplace_back();
    if (!choice.initial) {
      errors.back() = answers[at++];
      continue;
    }
    errors.back().resize(2 * outcomes);
    for (const std::size_t t : with_initial) {
      errors.back()[t] = answers[at].front();
      errors.back()[outcomes + t] = answers[at++].back();
    }
  }
  return errors;
}

// The filters of the inputs that are these features (of all of them where none is named), as terms.
std::vector<Eigen::Index> means_of(const Basis &basis, TermGroup group,
                                   const std::vector<std::uint16_t> &features) {
  std::vector<Eigen::Index> found;
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    const Basis::Term &t = basis.terms[i];
    if (t.op == BASIS_MEAN && t.group == group &&
        (features.empty() || holds(features, basis.inputs[t.a / basis.share.size()].a)))
      found.push_back(static_cast<Eigen::Index>(i));
  }
  return found;
}

} // namespace

std::vector<double> screened(const Fitter &fitter, const Basis &basis, std::size_t outcomes,
                             const Further &further) {
  std::vector<Question> questions;
  for (const Choice &choice : {kChoices[0], kChoices[1]})
    questions.push_back(
        {terms_of(basis, choice, 0, further), 0, static_cast<Eigen::Index>(outcomes)});
  const auto answers = fitter.errors(questions);
  std::vector<double> least(outcomes, 1e300);
  for (const auto &errors : answers) {
    for (std::size_t o = 0; o < outcomes; ++o)
      least[o] = std::min(least[o], *std::min_element(errors[o].begin(), errors[o].end()));
  }
  return least;
}

namespace {

// Of outcomes that no command moves, those that others of them bring about are no disturbances: a
// gas that air and sun warm. What is warmed comes later: the air before tells of the gas, but the
// gas before does not tell of the air. What is most moved goes first.
std::vector<std::size_t> not_driven(const Fitter &fitter, const Basis &basis, const Layout &layout,
                                    const RunStore &runs, std::vector<std::size_t> candidates) {
  const std::vector<double> alone = screened(fitter, basis, layout.outcomes(), {});
  while (candidates.size() > 1) {
    std::size_t most = candidates.size();
    double least = kNotMoved;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const std::size_t o = candidates[i];
      std::vector<std::size_t> others = candidates;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
      const Further further{features_of(layout, others), {}};
      if (screened(fitter, basis, layout.outcomes(), further)[o] > kDriven * alone[o])
        continue;
      const auto terms = [&, means = means_of(basis, TermGroup::outside, further.outside)](
                             std::size_t r) { return columns_of(fitter.x(r), means); };
      const double part = moved_by(runs, o, terms).before;
      if (part < least) {
        least = part;
        most = i;
      }
    }
    if (most == candidates.size())
      break;
    candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(most));
  }
  return candidates;
}

// Takes for every outcome, but the candidates themselves, one candidate or all of them as inputs
// where that lowers the error enough.
void choose_outside(const Fitter &fitter, const Basis &basis, const Layout &layout,
                    const Errors &without, const std::vector<std::size_t> &candidates,
                    std::vector<TargetModel> *targets) {
  const std::size_t outcomes = layout.outcomes();
  std::vector<std::vector<std::size_t>> sets;
  for (const std::size_t c : candidates)
    sets.push_back({c});
  if (candidates.size() > 1)
    sets.push_back(candidates);
  std::vector<std::size_t> chosen(outcomes, sets.size());
  std::vector<double> least(outcomes, 0.0);
  for (std::size_t o = 0; o < outcomes; ++o)
    least[o] = (1.0 - kOutsideMustWin) * choose_among(without, o, false, false).error;
  for (std::size_t s = 0; s < sets.size(); ++s) {
    const Errors errors =
        errors_of_choices(fitter, basis, outcomes, {features_of(layout, sets[s]), {}}, {});
    for (std::size_t o = 0; o < outcomes; ++o) {
      const bool is_candidate =
          std::find(candidates.begin(), candidates.end(), o) != candidates.end();
      const double error = choose_among(errors, o, false, false).error;
      const double further = sets[s].size() > 1 && chosen[o] < sets.size() ? kFurtherMustWin : 0.0;
      if (is_candidate || error >= (1.0 - further) * least[o])
        continue;
      least[o] = error;
      chosen[o] = s;
    }
  }
  for (std::size_t s = 0; s < sets.size(); ++s) {
    std::vector<std::size_t> of_set;
    for (std::size_t o = 0; o < outcomes; ++o) {
      if (chosen[o] == s)
        of_set.push_back(o);
    }
    if (of_set.empty())
      continue;
    const Errors errors =
        errors_of_choices(fitter, basis, outcomes, {features_of(layout, sets[s]), {}}, of_set);
    for (const std::size_t o : of_set) {
      TargetModel model = choose(errors, o, outcomes);
      model.outside = sets[s];
      if (model.error < (1.0 - kOutsideMustWin) * (*targets)[o].error)
        (*targets)[o] = model;
    }
  }
}

} // namespace

Chosen choose_targets(const Fitter &fitter, const Basis &basis, const Layout &layout,
                      const std::vector<bool> &integrated, const RunStore &runs) {
  const std::size_t outcomes = layout.outcomes();
  std::vector<std::size_t> all(outcomes);
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Errors errors = errors_of_choices(fitter, basis, outcomes, {}, all);
  Chosen chosen;
  for (std::size_t t = 0; t < 2 * outcomes; ++t)
    chosen.targets.push_back(choose(errors, t, outcomes));
  const bool may = std::any_of(basis.terms.begin(), basis.terms.end(),
                               [](const Basis::Term &t) { return t.group == TermGroup::outside; });
  if (!may)
    return chosen;
  const std::vector<Eigen::Index> commands = means_of(basis, TermGroup::mean, {});
  std::vector<std::size_t> asked;
  std::vector<bool> explained;
  for (std::size_t o = 0; o < outcomes; ++o) {
    if (!integrated[o])
      asked.push_back(o);
    explained.push_back(choose_among(errors, o, false, false).error <=
                        kExplained * fitter.spread(static_cast<Eigen::Index>(o)));
  }
  const auto terms = [&](std::size_t r) { return columns_of(fitter.x(r), commands); };
  chosen.outside =
      not_driven(fitter, basis, layout, runs, not_moved(asked, explained, runs, terms));
  if (2 * chosen.outside.size() > outcomes)
    chosen.outside.clear();
  if (!chosen.outside.empty())
    choose_outside(fitter, basis, layout, errors, chosen.outside, &chosen.targets);
  return chosen;
}

std::vector<std::uint16_t> drivers(const Basis &basis, const Layout &layout,
                                   const std::vector<std::size_t> &outside) {
  const std::vector<std::uint16_t> disturbances = features_of(layout, outside);
  std::vector<std::uint16_t> found;
  for (std::size_t i = 0; i < basis.inputs.size(); ++i) {
    const Basis::Input &in = basis.inputs[i];
    if (is_outcome(layout, in.a) ? holds(disturbances, in.a) : in.b >= BASIS_LEAST_HARMONIC)
      found.push_back(static_cast<std::uint16_t>(i));
  }
  return found;
}

std::vector<double> worth_rolling(const Fitter &fitter, const Chosen &chosen,
                                  const Layout &layout) {
  std::vector<double> asked(layout.outcomes(), 0.0);
  for (std::size_t o = 0; o < asked.size(); ++o) {
    const bool from_outside =
        std::find(chosen.outside.begin(), chosen.outside.end(), o) != chosen.outside.end();
    const TargetModel &model = chosen.targets[o];
    if (!is_angle(layout, layout.outcome_feature[o]) && !from_outside &&
        model.whole_error > kRolledWorth * fitter.spread(static_cast<Eigen::Index>(o)))
      asked[o] = std::sqrt(model.error * model.whole_error);
  }
  return asked;
}

namespace {

// The states that outcomes with the same disturbances as inputs may take: one, or all of them.
// Empty where they do not help.
std::vector<std::vector<std::uint16_t>>
promising_states(const Fitter &fitter, const Basis &basis, std::size_t outcomes,
                 const std::vector<std::uint16_t> &outside) {
  std::vector<std::vector<std::uint16_t>> sets;
  for (std::size_t s = 0; s < basis.states.size(); ++s)
    sets.push_back({static_cast<std::uint16_t>(s)});
  if (sets.size() > 1) {
    sets.emplace_back(sets.size());
    std::iota(sets.back().begin(), sets.back().end(), std::uint16_t{0});
  }
  std::vector<std::vector<std::uint16_t>> best(outcomes);
  std::vector<double> least = screened(fitter, basis, outcomes, {outside, {}});
  for (double &bar : least)
    bar *= 1.0 - kRolledMayWin;
  for (const std::vector<std::uint16_t> &set : sets) {
    const std::vector<double> errors = screened(fitter, basis, outcomes, {outside, set});
    for (std::size_t o = 0; o < outcomes; ++o) {
      const double further = set.size() > 1 && !best[o].empty() ? kFurtherMustWin : 0.0;
      if (errors[o] >= (1.0 - further) * least[o])
        continue;
      least[o] = errors[o];
      best[o] = set;
    }
  }
  return best;
}

} // namespace

void choose_states(const Fitter &fitter, const Basis &basis, const Layout &layout, Chosen *chosen) {
  const std::size_t outcomes = layout.outcomes();
  using Inputs = std::pair<std::vector<std::size_t>, std::vector<std::uint16_t>>;
  std::map<std::vector<std::size_t>, std::vector<std::vector<std::uint16_t>>> promising;
  std::map<Inputs, std::vector<std::size_t>> of_inputs;
  for (std::size_t o = 0; o < outcomes; ++o) {
    if (std::find(chosen->outside.begin(), chosen->outside.end(), o) != chosen->outside.end())
      continue;
    const std::vector<std::size_t> &outside = chosen->targets[o].outside;
    const auto [known, is_new] = promising.try_emplace(outside);
    if (is_new)
      known->second = promising_states(fitter, basis, outcomes, features_of(layout, outside));
    const std::vector<std::uint16_t> &states = known->second[o];
    if (!states.empty())
      of_inputs[{outside, states}].push_back(o);
  }
  for (const auto &[inputs, of_them] : of_inputs) {
    const Errors errors = errors_of_choices(
        fitter, basis, outcomes, {features_of(layout, inputs.first), inputs.second}, of_them);
    for (const std::size_t o : of_them) {
      TargetModel model = choose(errors, o, outcomes);
      TargetModel &before = chosen->targets[o];
      const double left = model.error * model.whole_error / (before.error * before.whole_error);
      if (model.error >= before.error || model.whole_error >= before.whole_error ||
          left >= (1.0 - kRolledMustWin) * (1.0 - kRolledMustWin))
        continue;
      model.outside = inputs.first;
      model.states = inputs.second;
      before = model;
    }
  }
}

void choose_less(const Fitter &fitter, const Basis &basis, const Layout &layout,
                 bool TargetModel::*less, Chosen *chosen) {
  std::vector<std::size_t> asked;
  std::vector<Question> questions;
  for (std::size_t t = 0; t < chosen->targets.size(); ++t) {
    TargetModel model = chosen->targets[t];
    if (less == &TargetModel::quick && (model.slow || model.initial))
      continue;
    model.*less = true;
    const std::vector<Eigen::Index> terms = terms_of(basis, layout, model, t);
    if (terms.empty())
      continue;
    const std::size_t column = model.initial ? 2 * layout.outcomes() + t : t;
    asked.push_back(t);
    questions.push_back({terms, static_cast<Eigen::Index>(column), 1});
  }
  const auto answers = fitter.errors(questions);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    TargetModel &model = chosen->targets[asked[i]];
    const std::vector<double> &errors = answers[i].front();
    const std::size_t l = best_ridge(errors);
    if (errors[l] > (1.0 + kLessMayLose) * model.error)
      continue;
    model.*less = true;
    model.ridge = kRidges[l];
    model.error = errors[l];
    model.whole_error = whole_error(errors[l], answers[i].back()[l]);
  }
}

} // namespace rim
