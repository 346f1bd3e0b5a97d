// SPDX-License-Identifier: MIT
#include "train/leave_out.hpp"

#include <algorithm>
#include <utility>

#include "train/choose_models.hpp"

namespace rim {

namespace {

// A target, and a model of it that does without one feature more.
using Candidate = std::pair<std::size_t, TargetModel>;

double judged(const TargetModel &model) {
  return model.error * model.whole_error; // of both errors' geometric mean the square
}

std::vector<std::uint16_t> features_used(const Basis &basis, const Layout &layout,
                                         const TargetModel &model, std::size_t target) {
  std::vector<std::uint16_t> used;
  for (const Eigen::Index i : terms_of(basis, layout, model, target)) {
    for (const std::uint16_t f : features_of(basis, basis.terms[static_cast<std::size_t>(i)]))
      used.push_back(f);
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

// Of every target asked, its model without each of the features that it uses; not without all.
std::vector<Candidate> candidates_of(const Basis &basis, const Layout &layout,
                                     const std::vector<TargetModel> &targets,
                                     const std::vector<bool> &asked) {
  std::vector<Candidate> candidates;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    if (!asked[t])
      continue;
    for (const std::uint16_t f : features_used(basis, layout, targets[t], t)) {
      candidates.emplace_back(t, targets[t]);
      candidates.back().second.without.push_back(f);
      if (terms_of(basis, layout, candidates.back().second, t).empty())
        candidates.pop_back();
    }
  }
  return candidates;
}

// Every candidate's ridge, the best, and its errors.
void judge(const Fitter &fitter, const Basis &basis, const Layout &layout,
           std::vector<Candidate> *candidates) {
  std::vector<Question> questions;
  for (const auto &[target, model] : *candidates) {
    const std::size_t column = model.initial ? 2 * layout.outcomes() + target : target;
    questions.push_back(
        {terms_of(basis, layout, model, target), static_cast<Eigen::Index>(column), 1});
  }
  const auto answers = fitter.errors(questions);
  for (std::size_t i = 0; i < candidates->size(); ++i) {
    std::vector<TargetModel> models(std::size(kRidges), (*candidates)[i].second);
    std::vector<double> errors;
    for (std::size_t l = 0; l < models.size(); ++l) {
      models[l].ridge = kRidges[l];
      models[l].error = answers[i].front()[l];
      models[l].whole_error = whole_error(models[l].error, answers[i].back()[l]);
      errors.push_back(judged(models[l]));
    }
    (*candidates)[i].second = models[best_ridge(errors)];
  }
}

} // namespace

void leave_out(const Fitter &fitter, const Basis &basis, const Layout &layout,
               std::vector<TargetModel> *targets) {
  std::vector<bool> asked(targets->size(), true);
  for (;;) {
    std::vector<Candidate> candidates = candidates_of(basis, layout, *targets, asked);
    if (candidates.empty())
      return;
    judge(fitter, basis, layout, &candidates);
    asked.assign(targets->size(), false);
    for (const auto &[target, model] : candidates) {
      if (judged(model) > judged((*targets)[target]))
        continue;
      (*targets)[target] = model;
      asked[target] = true;
    }
  }
}

} // namespace rim
