// SPDX-License-Identifier: MIT
#include "train/rolled.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

#include <Eigen/Cholesky>

#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
#include "image/rolled.h"
}

namespace rim {

namespace {

constexpr std::size_t kMostProducts = 240;
constexpr std::size_t kMostRates = 12; // of one state
// Changes over these numbers of blocks: over short ones the sensor's noise hides them, over long
// ones few are independent.
constexpr std::size_t kWindows[] = {1, 3, 10, 30};
constexpr double kRateMustWin = 0.005; // of the squared error of the changes, held out
// A round's states may leave this part of the error of the best model without, alone: at first
// those that are much better, then what they help to roll; at last what may help in company, and
// what that helps to roll.
constexpr double kMayLeave[] = {0.8, 0.8, 1.5, 1.5};
// A quarter, a half and three quarters of the way through the range of healthy runs.
constexpr std::uint16_t kHinges[] = {BASIS_HINGE + 21, BASIS_HINGE + 32, BASIS_HINGE + 43};
constexpr double kRidge = 1e-6;     // of the mean square of the products
constexpr double kBeyond = 0.25;    // of the range in healthy runs, on either side
constexpr Eigen::Index kSmooth = 2; // blocks on either side of a reading within a product

struct Factors {
  std::uint16_t a, b, c;
};

// An input's filter with the first time constant: one row.
std::uint16_t filter_of(const Basis &basis, std::uint16_t input) {
  return static_cast<std::uint16_t>(input * basis.share.size());
}

// Where filter f stands among the terms: its mean over the block.
Eigen::Index column_of(const Basis &basis, std::uint16_t filter) {
  const auto is_it = [filter](const Basis::Term &t) { return t.op == BASIS_MEAN && t.a == filter; };
  const auto at = std::find_if(basis.terms.begin(), basis.terms.end(), is_it);
  return at == basis.terms.end() ? -1 : at - basis.terms.begin();
}

// Whether an image holds these weights: a product of what is small in its unit has a large one.
bool can_be_held(const Eigen::VectorXd &weights) { return weights.cast<float>().allFinite(); }

// One run, with one time constant: filter i is the mean of input i over the block.
struct Inputs {
  Matrix filter;                   // blocks x inputs of the basis
  Eigen::VectorXd elapsed;         // from the middle of the block before to that of this one, s
  Eigen::VectorXd share;           // of the time of both, that of this one
  const Matrix *outcome = nullptr; // blocks x outcomes
};

// A view of the states and rates alone, as the flight code reads them.
class FlightRates {
public:
  FlightRates(const Basis &basis, const std::vector<Basis::State> &states,
              const std::vector<Basis::Rate> &rates, std::size_t outcomes)
      : states_(states) {
    Basis small;
    small.inputs = basis.inputs;
    small.share = {1.0};
    small.states = states;
    small.rates = rates;
    small.first.assign(outcomes, 0.0);
    bytes_ = basis_section(small);
    std::uint32_t features = 1;
    for (const Basis::Input &i : basis.inputs)
      features = std::max<std::uint32_t>(features, i.a + 1U);
    for (const Basis::Input &i : basis.inputs) {
      if (rimi_basis_is_product(i.b))
        features = std::max<std::uint32_t>(features, (i.b & ~BASIS_OF_PRODUCT) + 1U);
    }
    if (rimi_basis_open(&view_, bytes_.data(), bytes_.size(), features,
                        static_cast<std::uint32_t>(outcomes)) != RIM_OK)
      throw std::logic_error("the rolled states are not as the library wants them");
  }

  // blocks x states
  Matrix roll(const Inputs &in, const Eigen::VectorXd &first, double block_s) const {
    Matrix values(in.filter.rows(), static_cast<Eigen::Index>(view_.states));
    std::vector<double> part(view_.rates + 1U);
    Eigen::VectorXd state(values.cols());
    for (Eigen::Index s = 0; s < state.size(); ++s)
      state[s] = first[outcome_of(s)];
    for (Eigen::Index n = 0; n < values.rows(); ++n) {
      if (n == 0)
        rimi_rolled_begin(&view_, in.filter.row(n).data(), block_s, state.data(), part.data());
      else if (in.elapsed[n] > ROLLED_LONGEST * block_s)
        rimi_rolled_resume(&view_, in.filter.row(n).data(), moved(in, n).data(), state.data(),
                           part.data());
      else
        rimi_rolled_step(&view_, in.filter.row(n).data(), in.share[n], in.elapsed[n], block_s,
                         state.data(), part.data());
      values.row(n) = state;
    }
    return values;
  }

private:
  // By how much the readings of the states moved since the block before.
  Eigen::VectorXd moved(const Inputs &in, Eigen::Index n) const {
    Eigen::VectorXd by(static_cast<Eigen::Index>(view_.states));
    for (Eigen::Index s = 0; s < by.size(); ++s)
      by[s] = (*in.outcome)(n, outcome_of(s)) - (*in.outcome)(n - 1, outcome_of(s));
    return by;
  }
  Eigen::Index outcome_of(Eigen::Index s) const {
    return states_[static_cast<std::size_t>(s)].outcome;
  }
  std::vector<Basis::State> states_;
  std::vector<std::uint8_t> bytes_;
  rim_basis view_{};
};

// What a state's changes are fitted to, for one length of windows.
struct Sums {
  Eigen::MatrixXd gram;
  Eigen::VectorXd cross;
  double squares = 0.0;
  Sums &operator+=(const Sums &o) {
    if (gram.size() == 0)
      return *this = o;
    gram += o.gram;
    cross += o.cross;
    squares += o.squares;
    return *this;
  }
};
using SumsOfWindows = std::vector<Sums>; // [window]

// The search for one state.
struct Fit {
  std::vector<Factors> factors;
  std::vector<Eigen::VectorXd> weight; // [fold], the last of all runs
  double error = 1e300;
  std::vector<Eigen::VectorXd> values; // per run
};

class Searcher {
public:
  Searcher(const Basis &basis, const RunStore &runs, const std::vector<std::uint16_t> &inputs,
           double block_s, double (*error_of)(const Eigen::VectorXd &));

  Rolled search(const std::vector<double> &asked);

private:
  Inputs inputs_of(std::size_t r) const;

  // The products that the change of outcome o may be a sum of.
  std::vector<Factors> products(std::size_t o) const;

  // Per step from block n - 1 to n: products times the time of the step.
  Matrix steps(std::size_t r, std::size_t o, const std::vector<Factors> &products) const;

  // The sums of a run over windows of every length in which no block is missing.
  SumsOfWindows sums(std::size_t r, std::size_t o, const std::vector<Factors> &products) const;

  Fit fit(std::size_t o) const;

  static Eigen::VectorXd solve(const Sums &sums, const std::vector<Eigen::Index> &some);

  // Squared error of the changes in the runs of every fold, by weights of the other runs.
  static double held_out(const std::vector<Sums> &without, const std::vector<Sums> &folds,
                         const std::vector<Eigen::Index> &some);

  // Takes products one after the other while the changes of runs left out are predicted better.
  static Fit fit_window(const std::vector<Factors> &all, std::vector<Sums> *folds);

  Basis::State state_of(std::size_t o) const;

  std::vector<Basis::Rate> rates_with(const Fit &fit, std::size_t fold) const;

  // Rolls every run by the rates that were learnt without it.
  void judge(std::size_t o, Fit *fit) const;

  void accept(std::size_t o, Fit fit);

  const Basis &basis_;
  const RunStore &runs_;
  double block_s_;
  double (*error_of_)(const Eigen::VectorXd &);
  std::vector<std::uint16_t> filters_;
  std::vector<Eigen::Index> columns_;
  std::vector<Inputs> inputs_;
  Rolled rolled_;
  std::size_t round_states_ = 0; // when this round's states were fitted
};

Searcher::Searcher(const Basis &basis, const RunStore &runs,
                   const std::vector<std::uint16_t> &inputs, double block_s,
                   double (*error_of)(const Eigen::VectorXd &))
    : basis_(basis), runs_(runs), block_s_(block_s), error_of_(error_of) {
  for (const std::uint16_t i : inputs) {
    const Eigen::Index column = column_of(basis, filter_of(basis, i));
    if (column < 0)
      continue;
    filters_.push_back(i);
    columns_.push_back(column);
  }
  inputs_.resize(runs.all());
  parallel_for(runs.all(), [&](std::size_t r) { inputs_[r] = inputs_of(r); });
  rolled_.rates.resize(kFolds + 1);
  for (std::size_t r = 0; r < runs.all(); ++r)
    rolled_.values.emplace_back(runs[r].blocks(), 0);
}

Rolled Searcher::search(const std::vector<double> &asked) {
  std::vector<double> bar = asked;
  if (filters_.empty()) // of what nothing drives, the start of a log is no start
    return std::move(rolled_);
  std::vector<Fit> fits;
  for (const double may_leave : kMayLeave) {
    if (rolled_.states.size() == BASIS_MAX_STATES)
      break;
    if (fits.empty() || rolled_.states.size() > round_states_) { // there is more to depend on
      round_states_ = rolled_.states.size();
      fits.assign(bar.size(), {});
      parallel_for(bar.size(), [&](std::size_t o) {
        if (bar[o] > 0.0)
          fits[o] = fit(o);
      });
    }
    std::vector<std::pair<double, std::size_t>> better;
    for (std::size_t o = 0; o < bar.size(); ++o) {
      if (bar[o] > 0.0 && fits[o].error < may_leave * bar[o])
        better.emplace_back(fits[o].error / bar[o], o);
    }
    std::sort(better.begin(), better.end());
    for (const auto &[ratio, o] : better) {
      if (rolled_.states.size() < BASIS_MAX_STATES)
        accept(o, std::move(fits[o]));
      bar[o] = 0.0;
    }
  }
  return std::move(rolled_);
}

Inputs Searcher::inputs_of(std::size_t r) const {
  const std::shared_ptr<const WideBlocks> wide = runs_.wide(r);
  const BlockRun &run = runs_[r];
  Inputs in;
  in.filter = Matrix::Zero(run.blocks(), static_cast<Eigen::Index>(basis_.inputs.size()));
  for (std::size_t k = 0; k < filters_.size(); ++k)
    in.filter.col(filters_[k]) = wide->terms.col(columns_[k]);
  in.outcome = &run.outcome;
  in.elapsed = Eigen::VectorXd::Zero(run.blocks());
  in.share = run.share;
  for (Eigen::Index n = 1; n < run.blocks(); ++n)
    in.elapsed[n] = run.time_s[n] - run.time_s[n - 1];
  return in;
}

std::vector<Factors> Searcher::products(std::size_t o) const {
  const auto own = static_cast<std::uint16_t>(BASIS_STATE + rolled_.states.size());
  const auto size = static_cast<std::uint16_t>(BASIS_STATE_MAGNITUDE + rolled_.states.size());
  bool negative = false, positive = false;
  for (const BlockRun &run : runs_) {
    const auto y = run.outcome.col(static_cast<Eigen::Index>(o));
    negative = negative || y.minCoeff() < 0.0;
    positive = positive || y.maxCoeff() > 0.0;
  }
  std::vector<std::uint16_t> single = filters_;
  for (std::size_t s = 0; s < rolled_.states.size(); ++s)
    single.push_back(static_cast<std::uint16_t>(BASIS_STATE + s));
  std::vector<Factors> all = {{BASIS_PLAIN, BASIS_PLAIN, BASIS_PLAIN},
                              {own, BASIS_PLAIN, BASIS_PLAIN},
                              {own, own, BASIS_PLAIN}};
  if (negative && positive)
    all.push_back({own, size, BASIS_PLAIN});
  for (const std::uint16_t f : single) {
    all.push_back({f, BASIS_PLAIN, BASIS_PLAIN});
    all.push_back({f, own, BASIS_PLAIN});
    all.push_back({f, own, own});
  }
  // All pairs or none: which would be left out would depend on the order of the columns.
  const bool pairs = all.size() + single.size() * (single.size() + 1) <= kMostProducts;
  for (std::size_t i = 0; i < single.size() && pairs; ++i) {
    for (std::size_t j = i; j < single.size(); ++j) {
      all.push_back({single[i], single[j], BASIS_PLAIN});
      all.push_back({single[i], single[j], own});
    }
  }
  return all;
}

Matrix Searcher::steps(std::size_t r, std::size_t o, const std::vector<Factors> &products) const {
  const Eigen::Index blocks = runs_[r].blocks();
  const Eigen::VectorXd y = runs_[r].outcome.col(static_cast<Eigen::Index>(o));
  Eigen::VectorXd middle(blocks); // of the steps, smoothed over its neighbours
  for (Eigen::Index n = 0; n < blocks; ++n) {
    const Eigen::Index from = std::max<Eigen::Index>(n - 1 - kSmooth, 0);
    const Eigen::Index to = std::min(n + kSmooth, blocks - 1);
    middle[n] = y.segment(from, to - from + 1).mean();
  }
  const Matrix &filter = inputs_[r].filter, &values = rolled_.values[r];
  const auto share = inputs_[r].share.tail(blocks - 1).array();
  Matrix steps(blocks, static_cast<Eigen::Index>(products.size()));
  for (Eigen::Index c = 0; c < steps.cols(); ++c) {
    const Factors &f = products[static_cast<std::size_t>(c)];
    Eigen::ArrayXd now = Eigen::ArrayXd::Ones(blocks), of_states = now;
    for (const std::uint16_t code : {f.a, f.b, f.c}) {
      if (code == BASIS_PLAIN)
        continue;
      const Eigen::Index s = code & (BASIS_MAX_STATES - 1U);
      if (code < BASIS_STATE)
        now *= filter.col(code).array();
      else if (s < values.cols())
        of_states.tail(blocks - 1) *=
            0.5 * (values.col(s).tail(blocks - 1) + values.col(s).head(blocks - 1)).array();
      else if ((code & BASIS_STATE_MAGNITUDE) == BASIS_STATE_MAGNITUDE)
        of_states *= middle.array().abs();
      else
        of_states *= middle.array();
    }
    Eigen::ArrayXd mean = now;
    mean.tail(blocks - 1) = share * now.tail(blocks - 1) + (1.0 - share) * now.head(blocks - 1);
    steps.col(c) = mean * of_states * inputs_[r].elapsed.array();
  }
  return steps;
}

SumsOfWindows Searcher::sums(std::size_t r, std::size_t o,
                             const std::vector<Factors> &products) const {
  const BlockRun &run = runs_[r];
  Matrix reached = steps(r, o, products); // from the first block on
  std::vector<Eigen::Index> since(static_cast<std::size_t>(run.blocks()), 0);
  for (Eigen::Index n = 1; n < run.blocks(); ++n) {
    const auto at = static_cast<std::size_t>(n);
    reached.row(n) += reached.row(n - 1);
    since[at] = run.follows[at] ? since[at - 1] + 1 : 0;
  }
  SumsOfWindows all;
  for (const std::size_t window : kWindows) {
    const auto w = static_cast<Eigen::Index>(window);
    std::vector<Eigen::Index> ends;
    for (Eigen::Index n = w; n < run.blocks(); n += std::max<Eigen::Index>(1, w / 2)) {
      if (since[static_cast<std::size_t>(n)] >= w)
        ends.push_back(n);
    }
    Eigen::MatrixXd x(static_cast<Eigen::Index>(ends.size()), reached.cols());
    Eigen::VectorXd y(x.rows());
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      const Eigen::Index n = ends[static_cast<std::size_t>(i)];
      x.row(i) = reached.row(n) - reached.row(n - w);
      y[i] = run.outcome(n, static_cast<Eigen::Index>(o)) -
             run.outcome(n - w, static_cast<Eigen::Index>(o));
    }
    all.push_back({x.transpose() * x, x.transpose() * y, y.squaredNorm()});
  }
  return all;
}

Fit Searcher::fit(std::size_t o) const {
  const std::vector<Factors> all = products(o);
  std::vector<std::vector<Sums>> of_fold(std::size(kWindows), std::vector<Sums>(kFolds));
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    const SumsOfWindows of_run = sums(r, o, all);
    for (std::size_t w = 0; w < of_run.size(); ++w)
      of_fold[w][r % kFolds] += of_run[w];
  }
  Fit best;
  for (std::vector<Sums> &folds : of_fold) {
    Fit one = fit_window(all, &folds);
    if (one.factors.empty() || !std::all_of(one.weight.begin(), one.weight.end(), can_be_held))
      continue;
    judge(o, &one);
    if (one.error < best.error)
      best = std::move(one);
  }
  return best;
}

Eigen::VectorXd Searcher::solve(const Sums &sums, const std::vector<Eigen::Index> &some) {
  const auto k = static_cast<Eigen::Index>(some.size());
  Eigen::MatrixXd g(k, k);
  Eigen::VectorXd c(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const Eigen::Index a = some[static_cast<std::size_t>(i)];
    c[i] = sums.cross[a];
    for (Eigen::Index j = 0; j < k; ++j)
      g(i, j) = sums.gram(a, some[static_cast<std::size_t>(j)]);
  }
  g.diagonal().array() += kRidge * g.trace() / static_cast<double>(k);
  return g.ldlt().solve(c);
}

double Searcher::held_out(const std::vector<Sums> &without, const std::vector<Sums> &folds,
                          const std::vector<Eigen::Index> &some) {
  double error = 0.0;
  for (std::size_t f = 0; f < kFolds; ++f) {
    if (folds[f].gram.size() == 0)
      continue;
    const Eigen::VectorXd w = solve(without[f], some);
    error += folds[f].squares;
    for (Eigen::Index i = 0; i < w.size(); ++i) {
      const Eigen::Index a = some[static_cast<std::size_t>(i)];
      error -= 2.0 * w[i] * folds[f].cross[a];
      for (Eigen::Index j = 0; j < w.size(); ++j)
        error += w[i] * w[j] * folds[f].gram(a, some[static_cast<std::size_t>(j)]);
    }
  }
  return error;
}

Fit Searcher::fit_window(const std::vector<Factors> &all, std::vector<Sums> *folds) {
  Fit fit;
  Sums total;
  for (const Sums &s : *folds) {
    if (s.gram.size() > 0)
      total += s;
  }
  const Eigen::VectorXd scale =
      (total.gram.diagonal().array() + 1e-300).rsqrt(); // every product counts alike
  const auto standardise = [&scale](Sums *s) {
    s->gram = scale.asDiagonal() * s->gram * scale.asDiagonal();
    s->cross = scale.asDiagonal() * s->cross;
  };
  standardise(&total);
  std::vector<Sums> without;
  for (Sums &s : *folds) {
    without.push_back(total);
    if (s.gram.size() == 0)
      continue;
    standardise(&s);
    without.back().gram -= s.gram;
    without.back().cross -= s.cross;
  }
  std::vector<Eigen::Index> chosen;
  double least = total.squares;
  while (chosen.size() < kMostRates) {
    Eigen::Index best = -1;
    double bar = (1.0 - kRateMustWin) * least;
    for (Eigen::Index c = 0; c < scale.size(); ++c) {
      if (std::find(chosen.begin(), chosen.end(), c) != chosen.end())
        continue;
      std::vector<Eigen::Index> tried = chosen;
      tried.push_back(c);
      const double error = held_out(without, *folds, tried);
      if (error < bar) {
        bar = error;
        best = c;
      }
    }
    if (best < 0)
      break;
    chosen.push_back(best);
    least = bar;
  }
  if (chosen.empty())
    return fit;
  for (const Eigen::Index c : chosen)
    fit.factors.push_back(all[static_cast<std::size_t>(c)]);
  without.push_back(total);
  for (const Sums &s : without) {
    fit.weight.push_back(solve(s, chosen));
    for (std::size_t i = 0; i < chosen.size(); ++i)
      fit.weight.back()[static_cast<Eigen::Index>(i)] *= scale[chosen[i]];
  }
  return fit;
}

Basis::State Searcher::state_of(std::size_t o) const {
  double low = 1e300, high = -1e300;
  for (const BlockRun &run : runs_) {
    low = std::min(low, run.outcome.col(static_cast<Eigen::Index>(o)).minCoeff());
    high = std::max(high, run.outcome.col(static_cast<Eigen::Index>(o)).maxCoeff());
  }
  const double margin = kBeyond * (high - low);
  return {static_cast<std::uint16_t>(o), low - margin, high + margin};
}

std::vector<Basis::Rate> Searcher::rates_with(const Fit &fit, std::size_t fold) const {
  std::vector<Basis::Rate> rates = rolled_.rates[fold];
  for (std::size_t i = 0; i < fit.factors.size(); ++i)
    rates.push_back({static_cast<std::uint16_t>(rolled_.states.size()), fit.factors[i].a,
                     fit.factors[i].b, fit.factors[i].c,
                     fit.weight[fold][static_cast<Eigen::Index>(i)]});
  return rates;
}

void Searcher::judge(std::size_t o, Fit *fit) const {
  std::vector<Basis::State> states = rolled_.states;
  states.push_back(state_of(o));
  double sum = 0.0;
  fit->values.resize(runs_.all());
  for (std::size_t f = 0; f <= kFolds; ++f) {
    const FlightRates rates(basis_, states, rates_with(*fit, f),
                            static_cast<std::size_t>(runs_.front().outcome.cols()));
    for (std::size_t r = 0; r < runs_.all(); ++r) {
      if (runs_.fold(r) != f)
        continue;
      fit->values[r] = rates.roll(inputs_[r], runs_[r].first, block_s_).rightCols<1>();
      if (r < runs_.size())
        sum += error_of_(runs_[r].outcome.col(static_cast<Eigen::Index>(o)) - fit->values[r]);
    }
  }
  fit->error = std::sqrt(sum / static_cast<double>(runs_.size()));
}

void Searcher::accept(std::size_t o, Fit fit) {
  // Its own place among the states: others may have been accepted since it was fitted.
  const auto own = static_cast<std::uint16_t>(rolled_.states.size());
  for (Factors &f : fit.factors) {
    for (std::uint16_t *code : {&f.a, &f.b, &f.c}) {
      if (*code != BASIS_PLAIN && *code >= BASIS_STATE &&
          (*code & (BASIS_MAX_STATES - 1U)) == round_states_)
        *code = static_cast<std::uint16_t>(*code - round_states_ + own);
    }
  }
  for (std::size_t f = 0; f <= kFolds; ++f)
    rolled_.rates[f] = rates_with(fit, f);
  rolled_.states.push_back(state_of(o));
  for (std::size_t r = 0; r < runs_.all(); ++r) {
    Matrix &values = rolled_.values[r];
    values.conservativeResize(values.rows(), values.cols() + 1);
    values.rightCols<1>() = fit.values[r];
  }
}

} // namespace

Rolled fit_rolled(const Basis &basis, const RunStore &runs, const std::vector<double> &asked,
                  const std::vector<std::uint16_t> &inputs, double block_s,
                  double (*error_of)(const Eigen::VectorXd &)) {
  return Searcher(basis, runs, inputs, block_s, error_of).search(asked);
}

bool add_rolled_terms(Basis *basis, const Rolled &rolled,
                      const std::vector<std::uint16_t> &inputs) {
  const std::size_t states = rolled.states.size(), room = BASIS_MAX_TERMS - basis->terms.size();
  if (states == 0 || states > room)
    return false;
  std::vector<Basis::Term> more[2]; // products; hinges
  const auto add = [](std::vector<Basis::Term> *to, std::size_t a, std::uint16_t filter,
                      std::size_t c) {
    to->push_back({BASIS_ROLLED, static_cast<std::uint16_t>(a), filter,
                   static_cast<std::uint16_t>(c), TermGroup::rolled});
  };
  for (std::size_t s = 0; s < states; ++s) {
    add(&basis->terms, s, BASIS_PLAIN, BASIS_PLAIN);
    for (std::size_t k = s; k < states; ++k)
      add(&more[0], s, BASIS_PLAIN, k);
    for (const std::uint16_t k : kHinges)
      add(&more[1], s, BASIS_PLAIN, k);
    for (const std::uint16_t i : inputs) {
      add(&more[0], s, filter_of(*basis, i), BASIS_PLAIN);
      add(&more[0], s, filter_of(*basis, i), s);
      for (const std::uint16_t k : kHinges)
        add(&more[1], s, filter_of(*basis, i), k);
    }
  }
  for (const std::vector<Basis::Term> &terms : more) {
    if (terms.size() > BASIS_MAX_TERMS - basis->terms.size())
      break;
    basis->terms.insert(basis->terms.end(), terms.begin(), terms.end());
  }
  basis->center.resize(basis->terms.size(), 0.0);
  basis->inverse_sd.resize(basis->terms.size(), 1.0);
  basis->states = rolled.states;
  basis->rates = rolled.rates.back();
  for (Basis::Rate &rate : basis->rates) {
    for (std::uint16_t *factor : {&rate.a, &rate.b, &rate.c}) {
      if (*factor < BASIS_STATE)
        *factor = filter_of(*basis, *factor);
    }
  }
  return true;
}

Matrix with_rolled(const Basis &basis, const Matrix &wide, const Matrix &values) {
  Matrix all(wide.rows(), static_cast<Eigen::Index>(basis.terms.size()));
  all.leftCols(wide.cols()) = wide;
  for (Eigen::Index c = wide.cols(); c < all.cols(); ++c) {
    const Basis::Term &t = basis.terms[static_cast<std::size_t>(c)];
    all.col(c) = values.col(t.a);
    if (t.c < basis.states.size()) {
      all.col(c).array() *= values.col(t.c).array();
    } else if (t.c != BASIS_PLAIN) {
      const Basis::State &s = basis.states[t.a];
      const auto low = static_cast<double>(static_cast<float>(s.low));
      const auto high = static_cast<double>(static_cast<float>(s.high));
      const double part = static_cast<double>(t.c - BASIS_HINGE) / BASIS_HINGES;
      all.col(c) = (all.col(c).array() - (low + part * (high - low))).max(0.0);
    }
    if (t.b != BASIS_PLAIN)
      all.col(c).array() *= wide.col(column_of(basis, t.b)).array();
  }
  return all;
}

} // namespace rim
