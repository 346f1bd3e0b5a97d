// SPDX-License-Identifier: MIT
#include "train/behaviour.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include <Eigen/Cholesky>

#include "train/outside.hpp"
#include "train/rolled.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
// A slow term has only as many independent values as there are runs: most of what differs between
// runs is left out of the fit.
constexpr double kWithin = 0.95;
constexpr double kRunMeanWeight = 0.2; // of a run's own mean error, in the error that chooses
// First readings must lower the error of the best model without them by so much, and the error
// within runs alone as well: a sensor that is wrong from the start, or a place in which the run
// starts, shifts all that is predicted by them, and an offset that differs between runs is an
// effect of the run, by which an offset from the start is judged. Where the starts differ so much
// that the error falls to this part, hardly an offset could be seen, and nothing else either.
constexpr double kFirstMustWin = 0.1;
constexpr double kFirstAlone = 1.0 / 3.0;
const double kRidges[] = {0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5};

// A set of groups, and by how much it must lower the error to be preferred to the simpler ones.
struct Choice {
  bool shape, slow, initial, steep;
  double must_win;
};
const Choice kChoices[] = {{false, false, false, false, 0.0}, {true, false, false, false, 0.03},
                           {false, true, false, false, 0.03}, {true, true, false, false, 0.05},
                           {false, false, true, false, 0.10}, {true, false, true, false, 0.12},
                           {true, true, true, false, 0.15},   {true, false, false, true, 0.08},
                           {true, true, false, true, 0.10},   {true, true, true, true, 0.18}};
// Steep terms go far beyond what was learnt from: they must lower the error of the best model
// without them by so much.
constexpr double kSteepMustWin = 0.05;
// An outcome may come from outside where the commands leave more than this part of its deviation
// (a tenth of its variance). As an input it must lower another's error by so much, and all such
// outcomes together that of the best of them alone.
constexpr double kUnexplained = 0.3162;
constexpr double kOutsideMustWin = 0.1;
constexpr double kFurtherMustWin = 0.1;
// Rolled states must lower the error of the best model without them by so much, and all of them
// together that of the best of them alone by kFurtherMustWin. An outcome is rolled forward itself
// where a model leaves more than this part of its deviation.
constexpr double kRolledMustWin = 0.1;
constexpr double kRolledWorth = 0.05;

struct Moments {
  Eigen::MatrixXd gram;  // terms x terms, within runs
  Eigen::MatrixXd cross; // terms x targets: y, and y less its first reading
};

Matrix standard_terms(const Basis &basis, const Matrix &terms) {
  Matrix x = terms;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    x.col(i) = ((x.col(i).array() - basis.center[k]) * basis.inverse_sd[k])
                   .max(-BASIS_CLIP)
                   .min(BASIS_CLIP);
  }
  return x;
}

// Mean and 1 / standard deviation of a column, from its sums.
double center_of(double sum, double n) { return sum / std::max(n, 1.0); }

double inverse_of(double squares, double mean, double n) {
  const double sd = std::sqrt(squares / std::max(n, 1.0));
  return static_cast<double>(
      static_cast<float>(sd > 1e-9 * (1e-9 + std::abs(mean)) ? 1.0 / sd : 1e-6));
}

// Mean and 1 / standard deviation of every column of a matrix over all runs, which are gone through
// twice, in their order; matrix(r): that of run r.
template <class MatrixOf>
void learn(std::size_t runs, const MatrixOf &matrix, std::vector<double> *center,
           std::vector<double> *inverse) {
  std::vector<double> sum(center->size(), 0.0), squares = sum;
  double n = 0.0;
  for (std::size_t r = 0; r < runs; ++r) {
    const auto m = matrix(r);
    n += static_cast<double>(m->rows());
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] += m->col(static_cast<Eigen::Index>(i)).sum();
  }
  for (std::size_t r = 0; r < runs; ++r) {
    const auto m = matrix(r);
    for (std::size_t i = 0; i < sum.size(); ++i)
      squares[i] +=
          (m->col(static_cast<Eigen::Index>(i)).array() - center_of(sum[i], n)).square().sum();
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double mean = center_of(sum[i], n);
    (*center)[i] = static_cast<double>(static_cast<float>(mean));
    (*inverse)[i] = inverse_of(squares[i], mean, n);
  }
}

// A run's targets: outcomes, scatter; then outcomes less their first readings.
Matrix targets_of(const BlockRun &run) {
  const Eigen::Index o = run.outcome.cols();
  Matrix y(run.blocks(), 3 * o);
  y.leftCols(o) = run.outcome;
  y.middleCols(o, o) = run.scatter;
  y.rightCols(o) = run.outcome.rowwise() - run.first.transpose();
  return y;
}

// The mean of the runs is kept apart by 1 - kWithin only.
Moments moments_of(const Matrix &x, const Matrix &y) {
  const double n = static_cast<double>(x.rows());
  const double off = n * (1.0 - (1.0 - kWithin) * (1.0 - kWithin));
  const Eigen::RowVectorXd mx = x.colwise().mean(), my = y.colwise().mean();
  Moments m;
  m.gram.noalias() = x.transpose() * x;
  m.gram.noalias() -= off * mx.transpose() * mx;
  m.cross.noalias() = x.transpose() * y;
  m.cross.noalias() -= off * mx.transpose() * my;
  return m;
}

// Beside the commands.
struct Further {
  std::vector<std::uint16_t> outside; // features of the outcomes that are inputs
  std::vector<std::uint16_t> states;  // rolled ones
};

bool holds(const std::vector<std::uint16_t> &all, std::uint16_t one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// outcome: the one whose first reading may be used; those of others are noise more often than not.
std::vector<Eigen::Index> terms_of(const Basis &basis, const Choice &choice, std::size_t outcome,
                                   const Further &further) {
  std::vector<Eigen::Index> terms;
  const auto is_input = [&](const Basis::Term &t) {
    return holds(further.outside, basis.inputs[t.a / basis.share.size()].a);
  };
  const auto is_rolled = [&](const Basis::Term &t) {
    const bool alone = t.b == BASIS_PLAIN && t.c == BASIS_PLAIN;
    return holds(further.states, t.a) && (t.c == BASIS_PLAIN || holds(further.states, t.c)) &&
           (alone || choice.shape);
  };
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    const TermGroup g = basis.terms[i].group;
    if (g == TermGroup::mean || (g == TermGroup::shape && choice.shape) ||
        (g == TermGroup::slow && choice.slow) || (g == TermGroup::steep && choice.steep) ||
        (g == TermGroup::outside && is_input(basis.terms[i]) &&
         (basis.terms[i].op == BASIS_MEAN || choice.shape)) ||
        (g == TermGroup::rolled && is_rolled(basis.terms[i])) ||
        (g == TermGroup::initial && choice.initial && basis.terms[i].a == outcome))
      terms.push_back(static_cast<Eigen::Index>(i));
  }
  return terms;
}

struct Fold {
  Eigen::MatrixXd gram, cross;
  Eigen::RowVectorXd mean_y; // of the targets over the fold's training runs
};

// Which terms explain which targets, columns of Fitter::y().
struct Question {
  std::vector<Eigen::Index> terms;
  Eigen::Index first, targets;
};

// The runs' terms are made when they are needed, run by run: those of all are too many to hold.
class Fitter {
public:
  // rolled: the values of the states that are terms of the basis, of every run; nullptr: none.
  Fitter(const Basis &basis, const RunStore &runs, const std::vector<Matrix> *rolled)
      : basis_(basis), runs_(runs), rolled_(rolled) {
    const std::size_t n = runs.size();
    y_.resize(n);
    parallel_for(n, [&](std::size_t r) { y_[r] = targets_of(runs[r]); });
    mean_ = Eigen::RowVectorXd::Zero(y_.front().cols());
    for (const Matrix &y : y_)
      mean_ += y.colwise().mean() / static_cast<double>(n);
    for (Matrix &y : y_)
      y.rowwise() -= mean_; // numbers near zero: sums keep their digits
    const auto p = static_cast<Eigen::Index>(basis.terms.size());
    folds_.assign(kFolds + 1,
                  {Eigen::MatrixXd::Zero(p, p), Eigen::MatrixXd::Zero(p, mean_.cols()), {}});
    parallel_in_order(
        n, [&](std::size_t r) { return moments_of(x(r), y_[r]); },
        [&](std::size_t r, const Moments &m) {
          for (std::size_t f = 0; f <= kFolds; ++f) {
            if (r % kFolds == f)
              continue;
            folds_[f].gram += m.gram;
            folds_[f].cross += m.cross;
          }
        });
  }

  // errors[question][target - first][ridge], root mean square over runs left out; then, from
  // errors[question][targets] on, those within runs alone.
  std::vector<std::vector<std::vector<double>>>
  errors(const std::vector<Question> &questions) const;
  // Weights of all terms for a target; fold kFolds: all runs.
  Eigen::VectorXd weights(const std::vector<Eigen::Index> &terms, double ridge, std::size_t fold,
                          Eigen::Index target) const;
  Matrix x(std::size_t run) const {
    const std::shared_ptr<const WideBlocks> wide = runs_.wide(run);
    return standard_terms(basis_, rolled_ == nullptr
                                      ? wide->terms
                                      : with_rolled(basis_, wide->terms, (*rolled_)[run]));
  }
  const Matrix &y(std::size_t run) const { return y_[run]; } // less mean()
  const Eigen::RowVectorXd &mean() const { return mean_; }
  // What errors() says of a target that nothing explains.
  double spread(Eigen::Index target) const;
  std::size_t runs() const { return y_.size(); }

private:
  // weights[question][fold and ridge]: of runs without the fold.
  std::vector<std::vector<Eigen::MatrixXd>>
  all_weights(const std::vector<Question> &questions) const;

  const Basis &basis_;
  const RunStore &runs_;
  const std::vector<Matrix> *rolled_;
  std::vector<Matrix> y_;
  std::vector<Fold> folds_;
  Eigen::RowVectorXd mean_;
};

Eigen::MatrixXd sub_gram(const Eigen::MatrixXd &gram, const std::vector<Eigen::Index> &terms) {
  const auto k = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd g(k, k);
  for (Eigen::Index i = 0; i < k; ++i) {
    for (Eigen::Index j = 0; j < k; ++j)
      g(i, j) = gram(terms[static_cast<std::size_t>(i)], terms[static_cast<std::size_t>(j)]);
  }
  return g;
}

Matrix columns_of(const Matrix &m, const std::vector<Eigen::Index> &terms) {
  Matrix some(m.rows(), static_cast<Eigen::Index>(terms.size()));
  for (Eigen::Index i = 0; i < some.cols(); ++i)
    some.col(i) = m.col(terms[static_cast<std::size_t>(i)]);
  return some;
}

Eigen::MatrixXd sub_rows(const Eigen::MatrixXd &m, const std::vector<Eigen::Index> &terms) {
  Eigen::MatrixXd s(static_cast<Eigen::Index>(terms.size()), m.cols());
  for (std::size_t i = 0; i < terms.size(); ++i)
    s.row(static_cast<Eigen::Index>(i)) = m.row(terms[i]);
  return s;
}

// What chooses: squares within runs, and a part of the squared mean of each run, which the run's
// own effects can explain. *within: the former alone.
double run_error(const Eigen::VectorXd &e, double *within) {
  const double mean = e.mean();
  *within = (e.array() - mean).square().mean();
  return *within + kRunMeanWeight * mean * mean;
}

std::vector<std::vector<Eigen::MatrixXd>>
Fitter::all_weights(const std::vector<Question> &questions) const {
  const std::size_t ridges = std::size(kRidges), jobs = kFolds * ridges;
  std::vector<std::vector<Eigen::MatrixXd>> weights(questions.size(),
                                                    std::vector<Eigen::MatrixXd>(jobs));
  parallel_for(questions.size() * jobs, [&](std::size_t i) {
    const Question &q = questions[i / jobs];
    const std::size_t job = i % jobs;
    const Fold &fold = folds_[job / ridges];
    Eigen::MatrixXd g = sub_gram(fold.gram, q.terms);
    g.diagonal().array() += kRidges[job % ridges];
    weights[i / jobs][job] =
        g.ldlt().solve(sub_rows(fold.cross, q.terms).middleCols(q.first, q.targets));
  });
  return weights;
}

std::vector<std::vector<std::vector<double>>>
Fitter::errors(const std::vector<Question> &questions) const {
  const std::size_t ridges = std::size(kRidges);
  const auto weights = all_weights(questions);
  // Of one run: [question](target, ridge).
  using OfRun = std::vector<Eigen::MatrixXd>;
  const auto of_run = [&](std::size_t r) {
    const std::size_t f = r % kFolds;
    const Matrix all = x(r);
    OfRun of(questions.size());
    for (std::size_t k = 0; k < questions.size(); ++k) {
      const Question &q = questions[k];
      const Matrix some = columns_of(all, q.terms);
      of[k].resize(2 * q.targets, static_cast<Eigen::Index>(ridges));
      for (std::size_t l = 0; l < ridges; ++l) {
        const Eigen::MatrixXd &w = weights[k][f * ridges + l];
        const Matrix e = y_[r].middleCols(q.first, q.targets) - some * w;
        const auto at = static_cast<Eigen::Index>(l);
        for (Eigen::Index t = 0; t < q.targets; ++t)
          of[k](t, at) = run_error(e.col(t), &of[k](q.targets + t, at));
      }
    }
    return of;
  };
  // part[question][fold]: summed over the fold's runs; the folds are put together afterwards.
  std::vector<OfRun> part(questions.size(), OfRun(kFolds));
  for (std::size_t k = 0; k < questions.size(); ++k) {
    for (Eigen::MatrixXd &p : part[k])
      p = Eigen::MatrixXd::Zero(2 * questions[k].targets, static_cast<Eigen::Index>(ridges));
  }
  parallel_in_order(y_.size(), of_run, [&](std::size_t r, const OfRun &of) {
    for (std::size_t k = 0; k < of.size(); ++k)
      part[k][r % kFolds] += of[k];
  });
  std::vector<std::vector<std::vector<double>>> errors(questions.size());
  for (std::size_t k = 0; k < questions.size(); ++k) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(part[k][0].rows(), part[k][0].cols());
    for (const Eigen::MatrixXd &p : part[k])
      sum += p;
    for (Eigen::Index t = 0; t < sum.rows(); ++t) {
      errors[k].emplace_back();
      for (Eigen::Index l = 0; l < sum.cols(); ++l)
        errors[k].back().push_back(std::sqrt(sum(t, l) / static_cast<double>(y_.size())));
    }
  }
  return errors;
}

double Fitter::spread(Eigen::Index target) const {
  double sum = 0.0, within = 0.0;
  for (const Matrix &y : y_)
    sum += run_error(y.col(target), &within);
  return std::sqrt(sum / static_cast<double>(y_.size()));
}

Eigen::VectorXd Fitter::weights(const std::vector<Eigen::Index> &terms, double ridge,
                                std::size_t fold, Eigen::Index target) const {
  Eigen::MatrixXd g = sub_gram(folds_[fold].gram, terms);
  g.diagonal().array() += ridge;
  const Eigen::VectorXd w = g.ldlt().solve(sub_rows(folds_[fold].cross.col(target), terms));
  Eigen::VectorXd all = Eigen::VectorXd::Zero(folds_[fold].gram.rows());
  for (std::size_t i = 0; i < terms.size(); ++i)
    all[terms[i]] = static_cast<double>(static_cast<float>(w[static_cast<Eigen::Index>(i)]));
  return all;
}

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
    for (std::size_t l = 0; l < std::size(kRidges); ++l) {
      const double e = errors[c][(is_within ? errors[c].size() / 2 : 0) + target][l];
      const double first = kChoices[c].initial && !best.initial ? kFirstMustWin : 0.0;
      const double steep = kChoices[c].steep && !best.steep ? kSteepMustWin : 0.0;
      if (e < (1.0 - kChoices[c].must_win) * bar && e < (1.0 - first - steep) * least) {
        least = e;
        best.shape = kChoices[c].shape;
        best.slow = kChoices[c].slow;
        best.initial = kChoices[c].initial;
        best.steep = kChoices[c].steep;
        best.ridge = kRidges[l];
      }
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

} // namespace

Matrix standard_means(const Basis &basis, const BlockRun &run) {
  Matrix m = run.means;
  for (Eigen::Index i = 0; i < m.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    m.col(i) = ((m.col(i).array() - basis.mean_center[k]) * basis.mean_inverse_sd[k])
                   .max(-BASIS_MEAN_CLIP)
                   .min(BASIS_MEAN_CLIP);
  }
  return m;
}

void learn_means(Basis *basis, const RunStore &runs) {
  learn(
      runs.size(), [&](std::size_t r) { return &runs[r].means; }, &basis->mean_center,
      &basis->mean_inverse_sd);
}

namespace {

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

// The outcomes that the commands do not explain well and that are not the integral of others.
std::vector<std::size_t> unexplained(const Fitter &fitter, const Errors &errors,
                                     const std::vector<bool> &integrated) {
  std::vector<std::size_t> found;
  for (std::size_t o = 0; o < integrated.size(); ++o) {
    const double error = choose_among(errors, o, false, false).error;
    if (!integrated[o] && error > kUnexplained * fitter.spread(static_cast<Eigen::Index>(o)))
      found.push_back(o);
  }
  return found;
}

std::vector<std::uint16_t> features_of(const Layout &layout, const std::vector<std::size_t> &set) {
  std::vector<std::uint16_t> features;
  for (const std::size_t o : set)
    features.push_back(layout.outcome_feature[o]);
  return features;
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

// What every target is predicted from, and the outcomes that come from outside.
struct Chosen {
  std::vector<TargetModel> targets;
  std::vector<std::size_t> outside;
};

// Which groups of terms, and which outcomes, every target is predicted from. Where the commands
// move less than half of the outcomes, what moves the others was not logged: they are no
// disturbances.
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
  std::vector<Eigen::Index> commands;
  for (std::size_t i = 0; i < basis.terms.size(); ++i) {
    if (basis.terms[i].op == BASIS_MEAN && basis.terms[i].group == TermGroup::mean)
      commands.push_back(static_cast<Eigen::Index>(i));
  }
  chosen.outside = not_moved(unexplained(fitter, errors, integrated), runs,
                             [&](std::size_t r) { return columns_of(fitter.x(r), commands); });
  if (2 * chosen.outside.size() > outcomes)
    chosen.outside.clear();
  if (!chosen.outside.empty())
    choose_outside(fitter, basis, layout, errors, chosen.outside, &chosen.targets);
  return chosen;
}

double error_of_run(const Eigen::VectorXd &e) {
  double within = 0.0;
  return run_error(e, &within);
}

// Places among the inputs of what may drive a rolled state: commands and context, their magnitudes,
// cosines and sines, and disturbances.
std::vector<std::uint16_t> drivers(const Basis &basis, const Layout &layout,
                                   const std::vector<std::size_t> &outside) {
  const std::vector<std::uint16_t> disturbances = features_of(layout, outside);
  std::vector<std::uint16_t> found;
  for (std::size_t i = 0; i < basis.inputs.size(); ++i) {
    const Basis::Input &in = basis.inputs[i];
    const bool is_sensor = std::find(layout.outcome_feature.begin(), layout.outcome_feature.end(),
                                     in.a) != layout.outcome_feature.end();
    if (is_sensor ? holds(disturbances, in.a) : in.b >= BASIS_SINE)
      found.push_back(static_cast<std::uint16_t>(i));
  }
  return found;
}

// The outcomes that are worth to be rolled forward, with what a state must win against.
std::vector<double> worth_rolling(const Fitter &fitter, const Chosen &chosen,
                                  const Layout &layout) {
  std::vector<double> asked(layout.outcomes(), 0.0);
  for (std::size_t o = 0; o < asked.size(); ++o) {
    const bool is_angle =
        (layout.command[layout.outcome_feature[o]] & (BLOCKS_ANGLE_RAD | BLOCKS_ANGLE_DEG)) != 0;
    const bool from_outside =
        std::find(chosen.outside.begin(), chosen.outside.end(), o) != chosen.outside.end();
    const double error = chosen.targets[o].error;
    if (!is_angle && !from_outside &&
        error > kRolledWorth * fitter.spread(static_cast<Eigen::Index>(o)))
      asked[o] = error;
  }
  return asked;
}

// Takes for every outcome one rolled state or all of them as inputs, beside the disturbances that
// it has already, where that lowers the error enough.
void choose_states(const Fitter &fitter, const Basis &basis, const Layout &layout, Chosen *chosen) {
  const std::size_t outcomes = layout.outcomes();
  std::vector<std::vector<std::uint16_t>> sets;
  for (std::size_t s = 0; s < basis.states.size(); ++s)
    sets.push_back({static_cast<std::uint16_t>(s)});
  if (sets.size() > 1) {
    sets.emplace_back(sets.size());
    std::iota(sets.back().begin(), sets.back().end(), std::uint16_t{0});
  }
  std::vector<std::size_t> left;
  for (std::size_t o = 0; o < outcomes; ++o) {
    if (std::find(chosen->outside.begin(), chosen->outside.end(), o) == chosen->outside.end())
      left.push_back(o);
  }
  while (!left.empty()) { // all that have the same disturbances as inputs, at once
    const std::vector<std::size_t> outside = chosen->targets[left.front()].outside;
    std::vector<std::size_t> same, others;
    for (const std::size_t o : left)
      (chosen->targets[o].outside == outside ? same : others).push_back(o);
    left = others;
    const std::vector<TargetModel> before = chosen->targets;
    for (const std::vector<std::uint16_t> &set : sets) {
      const Errors errors =
          errors_of_choices(fitter, basis, outcomes, {features_of(layout, outside), set}, same);
      for (const std::size_t o : same) {
        TargetModel model = choose(errors, o, outcomes), &best = chosen->targets[o];
        const double further = set.size() > 1 && !best.states.empty() ? kFurtherMustWin : 0.0;
        if (model.error >= (1.0 - kRolledMustWin) * before[o].error ||
            model.error >= (1.0 - further) * best.error)
          continue;
        model.outside = outside;
        model.states = set;
        best = model;
      }
    }
  }
}

// One target's model: weights[fold], the last of all runs, and its column of Fitter::y().
struct FoldModels {
  std::vector<Eigen::VectorXd> weight;
  std::vector<double> intercept;
  Eigen::Index column = 0;
};

// What the weights of one run's fold say of it, and the mean that is left of it by every other's.
struct RunPrediction {
  Matrix by_weights; // blocks x targets
  Matrix rest;       // targets x (kFolds + 1)
};

RunPrediction predict_run(const Fitter &fitter, const std::vector<FoldModels> &models,
                          std::size_t r) {
  const Matrix x = fitter.x(r);
  const auto targets = static_cast<Eigen::Index>(models.size());
  RunPrediction p{Matrix(x.rows(), targets), Matrix::Zero(targets, kFolds + 1)};
  for (Eigen::Index t = 0; t < targets; ++t) {
    const FoldModels &m = models[static_cast<std::size_t>(t)];
    for (std::size_t f = 0; f <= kFolds; ++f) {
      if (r % kFolds == f)
        p.by_weights.col(t) = x * m.weight[f];
      else
        p.rest(t, static_cast<Eigen::Index>(f)) =
            fitter.y(r).col(m.column).mean() - (x * m.weight[f]).mean();
    }
  }
  return p;
}

// Predictions without the intercepts, per run; fills the intercepts: so that the mean error of the
// runs is zero, since terms have mean zero over all runs, not over a fold.
std::vector<Matrix> predict_runs(const Fitter &fitter, std::vector<FoldModels> *models) {
  std::vector<Matrix> by_weights(fitter.runs());
  Matrix sum = Matrix::Zero(static_cast<Eigen::Index>(models->size()), kFolds + 1);
  double n[kFolds + 1] = {};
  parallel_in_order(
      fitter.runs(), [&](std::size_t r) { return predict_run(fitter, *models, r); },
      [&](std::size_t r, RunPrediction p) {
        by_weights[r] = std::move(p.by_weights);
        for (std::size_t f = 0; f <= kFolds; ++f) {
          if (r % kFolds == f)
            continue;
          sum.col(static_cast<Eigen::Index>(f)) += p.rest.col(static_cast<Eigen::Index>(f));
          n[f] += 1.0;
        }
      });
  for (std::size_t t = 0; t < models->size(); ++t) {
    FoldModels &m = (*models)[t];
    for (std::size_t f = 0; f <= kFolds; ++f)
      m.intercept.push_back(fitter.mean()[m.column] +
                            sum(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(f)) / n[f]);
  }
  return by_weights;
}

// What a target's models say of every run that they have not seen.
void judge_target(const Fitter &fitter, const RunStore &runs, const std::vector<Matrix> &by_weights,
                  const FoldModels &of_folds, std::size_t t, Behaviour *b) {
  TargetModel &model = b->targets[t];
  const std::size_t outcomes = b->targets.size() / 2;
  const auto i = static_cast<Eigen::Index>(t % outcomes);
  double squares = 0.0, spread = 0.0, n = 0.0;
  for (std::size_t f = 0; f < kFolds; ++f) {
    for (std::size_t r = f; r < runs.size(); r += kFolds) {
      Eigen::VectorXd p =
          by_weights[r].col(static_cast<Eigen::Index>(t)).array() + of_folds.intercept[f];
      if (model.initial)
        p.array() += runs[r].first[i];
      const Eigen::VectorXd y = t < outcomes ? runs[r].outcome.col(i) : runs[r].scatter.col(i);
      const Eigen::VectorXd e = y - p;
      squares += e.squaredNorm();
      spread += (y.array() - fitter.mean()[static_cast<Eigen::Index>(t)]).square().sum();
      n += static_cast<double>(y.size());
      if (t < outcomes) {
        b->predicted[r].col(i) = p;
        b->residual[r].col(i) = e;
      } else {
        b->scatter[r].col(i) = e;
      }
    }
  }
  model.weight = of_folds.weight[kFolds];
  model.intercept = static_cast<double>(static_cast<float>(of_folds.intercept[kFolds]));
  model.error = std::sqrt(squares / n);
  model.r2 = spread > 0.0 ? 1.0 - squares / spread : 0.0;
}

// The models of all targets as they were chosen.
Behaviour fit_targets(const Fitter &fitter, const Basis &basis, const Layout &layout,
                      const RunStore &runs, const std::vector<TargetModel> &targets) {
  const std::size_t outcomes = layout.outcomes();
  Behaviour b;
  b.targets = targets;
  std::vector<FoldModels> models(2 * outcomes);
  parallel_for(2 * outcomes, [&](std::size_t t) {
    const TargetModel &model = b.targets[t];
    models[t].column = static_cast<Eigen::Index>(model.initial ? 2 * outcomes + t : t);
    const auto used = terms_of(basis, {model.shape, model.slow, model.initial, model.steep, 0.0}, t,
                               {features_of(layout, model.outside), model.states});
    for (std::size_t f = 0; f <= kFolds; ++f)
      models[t].weight.push_back(fitter.weights(used, model.ridge, f, models[t].column));
  });
  const std::vector<Matrix> by_weights = predict_runs(fitter, &models);
  for (const BlockRun &run : runs) {
    for (auto *matrices : {&b.predicted, &b.residual, &b.scatter})
      matrices->emplace_back(run.blocks(), static_cast<Eigen::Index>(outcomes));
  }
  parallel_for(2 * outcomes,
               [&](std::size_t t) { judge_target(fitter, runs, by_weights, models[t], t, &b); });
  return b;
}

} // namespace

Behaviour fit_behaviour(Basis *basis, const Layout &layout,
                        const std::vector<Integrand> &integrands, const RunStore &runs,
                        double block_s) {
  if (runs.size() < 3)
    throw DataError("training needs at least 3 runs");
  // The wide matrices stay alive while their terms are looked at.
  const auto terms = [&](std::size_t r) {
    const std::shared_ptr<const WideBlocks> wide = runs.wide(r);
    return std::shared_ptr<const Matrix>(wide, &wide->terms);
  };
  learn(runs.size(), terms, &basis->center, &basis->inverse_sd);
  learn_means(basis, runs);
  auto fitter = std::make_unique<Fitter>(*basis, runs, nullptr);
  const std::vector<bool> integrated = integrated_outcomes(layout, integrands, runs);
  Chosen chosen = choose_targets(*fitter, *basis, layout, integrated, runs);
  const std::vector<std::uint16_t> inputs = drivers(*basis, layout, chosen.outside);
  const Rolled rolled = fit_rolled(*basis, runs, worth_rolling(*fitter, chosen, layout),
                                   inputs, block_s, error_of_run);
  if (add_rolled_terms(basis, rolled, inputs)) {
    const auto all = [&](std::size_t r) {
      return std::make_shared<const Matrix>(
          with_rolled(*basis, runs.wide(r)->terms, rolled.values[r]));
    };
    learn(runs.size(), all, &basis->center, &basis->inverse_sd);
    fitter = std::make_unique<Fitter>(*basis, runs, &rolled.values);
    choose_states(*fitter, *basis, layout, &chosen);
  }
  return fit_targets(*fitter, *basis, layout, runs, chosen.targets);
}

} // namespace rim
