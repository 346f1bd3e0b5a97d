// SPDX-License-Identifier: MIT
#include "diagnose/sets.hpp"
#include "stats/robust.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include <Eigen/Cholesky>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kMostForms = 6, kBeam = 8, kChildren = 14, kSingles = 30;
constexpr int kRounds = 4;
constexpr double kSettled = 0.03;  // rounds end when the noise moves by less
constexpr double kOpposed = 6.0;   // nats: what resistances that oppose each other must earn
constexpr double kLeastLoss = 3.0; // nats: what a form must lose by going to stay
constexpr double kCut = 4.0;       // of the median absolute deviation, as sd
// A simulation is never exactly right: noise below these shares of the stated sd and of the whole
// error is not believed, and rows beyond some 500 say less and less where the model's error shows.
constexpr double kLeastSd = 0.5, kLeastShare = 0.05, kMostEffective = 500.0;
constexpr double kLeastOwnSquares = 1e-4; // of a column beside those that are there
constexpr double kRidge = 1e-3;
constexpr Index kParts = 5;                   // of a single log
constexpr std::size_t kMostProportional = 40; // quantities
constexpr std::size_t kMostLag = 200;
constexpr Eigen::Index kLeastRows = 20; // of a log that laws are fitted to alone
// Sizes by log: of so many logs at most, and of sets that are not hopelessly behind.
constexpr std::size_t kMostLogs = 40;
constexpr double kMostBehind = 400.0;
constexpr std::size_t kMostSplit = 60, kFewSplit = 20;

Vector cut(const Vector &left, const Vector &weight) {
  std::vector<double> size;
  for (Index i = 0; i < left.size(); ++i) {
    if (weight(i) > 0.0)
      size.push_back(std::abs(left(i)) * std::sqrt(weight(i)));
  }
  const double corner = std::max(1e-12, kCut * 1.4826 * median(size));
  Vector out = left;
  for (Index i = 0; i < left.size(); ++i) {
    const double most = weight(i) > 0.0 ? corner / std::sqrt(weight(i)) : corner;
    out(i) = std::clamp(left(i), -most, most);
  }
  return out;
}

} // namespace

bool is_trifle(double fall, double left, double whole) {
  return fall < kRelevant * kRelevant * whole &&
         !(fall > kRelevantRest * left && fall > kTrifle * kTrifle * whole);
}

double least_noise(const Channel &channel) { return channel.sd_estimated ? 0.0 : kLeastSd; }

NoiseState noise_state(const Vector &left, const Vector &weight, const Measured &measured,
                       double y_rms, double sizes, double least_sd) {
  const Vector e = cut(left, weight).cwiseProduct(weight.cwiseSqrt());
  NoiseState noise;
  double squares = 0.0, fourth = 0.0;
  for (Index i = 0; i < e.size(); ++i) {
    if (weight(i) > 0.0) {
      noise.rows += 1.0;
      squares += e(i) * e(i);
      fourth += std::pow(e(i), 4.0);
    }
  }
  if (noise.rows < 20.0 || !(squares > 0.0))
    return noise;
  const double variance = squares / noise.rows;
  noise.kurtosis = fourth / noise.rows / (variance * variance);
  noise.variance = std::max({squares / std::max(1.0, noise.rows - sizes), least_sd * least_sd,
                             std::pow(kLeastShare * y_rms, 2.0)});
  noise.scatter = std::sqrt(variance);
  double sum = 0.0, sum_of_squares = 0.0;
  for (std::size_t lag = 1; lag <= kMostLag; ++lag) {
    double products = 0.0, both = 0.0;
    for (const LogSpan &log : measured.logs) {
      if (lag > log.rows / 3)
        continue;
      for (std::size_t i = log.first; i + lag < log.first + log.rows; ++i) {
        const auto a = static_cast<Index>(i), b = static_cast<Index>(i + lag);
        if (weight(a) > 0.0 && weight(b) > 0.0) {
          products += e(a) * e(b);
          both += 1.0;
        }
      }
    }
    const double rho = both > 0.0 ? products / both / variance : 0.0;
    if (lag == 1)
      noise.autocorrelation = rho;
    if (rho < 2.0 / std::sqrt(noise.rows))
      break;
    sum += rho;
    sum_of_squares += rho * rho;
  }
  noise.spread_of_sizes = 1.0 + 2.0 * sum;
  // What is added to reach the stated sd's floor is noise of the readings, and white.
  const double smooth = std::max(variance, std::pow(kLeastShare * y_rms, 2.0)) / noise.variance;
  noise.spread_of_squares =
      std::max(1.0, 0.5 * (noise.kurtosis - 1.0)) * (1.0 + 2.0 * sum_of_squares);
  const double known = 1.0 / (std::max(1.0, variance) * noise.spread_of_sizes);
  noise.spread = 1.0 + 2.0 * smooth * sum + (1.0 - known) * noise.rows / kMostEffective;
  return noise;
}

SetSearch::SetSearch(const Measured &measured, const Library &library, const Vector &y,
                     const Vector &weight, const std::vector<Member> &kept, double least_sd,
                     Products *known)
    : measured_(measured), library_(library), y_(y), weight_(weight), known_(*known),
      least_sd_(least_sd) {
  if (known_.weight.size() != weight.size() || known_.weight != weight)
    known_ = {weight, {}};
  Index free = 0;
  for (const Member &member : kept)
    free += member.is_fixed ? 0 : member.h.cols();
  kept_.resize(y.size(), free);
  fixed_ = Vector::Zero(y.size());
  Index at = 0;
  for (const Member &member : kept) {
    if (member.candidate >= 0 && member.term.gate.everywhere())
      kept_groups_.push_back(library.candidates[static_cast<std::size_t>(member.candidate)].group);
    if (member.is_fixed) {
      fixed_ += member.h.rowwise().sum();
      continue;
    }
    kept_.middleCols(at, member.h.cols()) = member.h;
    at += member.h.cols();
  }
  pair_.assign(library.candidates.size(), 0.0);
  for (std::size_t c = 0; c < pair_.size(); ++c) {
    const Candidate &candidate = library.candidates[c];
    if (candidate.columns == 2)
      pair_[c] = library.g.col(candidate.column)
                     .cwiseProduct(weight)
                     .dot(library.g.col(candidate.column + 1));
  }
  rms_ = std::sqrt(y.cwiseAbs2().cwiseProduct(weight).sum() / std::max(1.0, weight.sum()));
}

// Library columns first, then those that stay.
Vector SetSearch::column(int index) const {
  const auto k = static_cast<Index>(index);
  return k < library_.g.cols() ? Vector(library_.g.col(k))
                               : Vector(kept_.col(k - library_.g.cols()));
}

const Vector &SetSearch::gram(int index) {
  const auto found = gram_.find(index);
  if (found != gram_.end())
    return found->second;
  fetch_columns({index});
  return gram_.at(index);
}

// Products of the candidates' columns with all others.
void SetSearch::fetch(const std::vector<int> &atoms) {
  std::vector<int> missing;
  for (const int atom : atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    for (int k = candidate.column; k < candidate.column + candidate.columns; ++k) {
      if (gram_.count(k) == 0 && std::find(missing.begin(), missing.end(), k) == missing.end())
        missing.push_back(k);
    }
  }
  fetch_columns(missing);
}

// Many at once: that is several times faster.
void SetSearch::fetch_columns(const std::vector<int> &columns) {
  const Index p = library_.g.cols();
  std::vector<int> unknown;
  for (const int k : columns) {
    if (k < static_cast<int>(p) && known_.of.count(k) == 0)
      unknown.push_back(k);
  }
  if (!unknown.empty()) {
    const Eigen::MatrixXd weighted = weight_.asDiagonal() * library_.g(Eigen::all, unknown),
                          products = library_.g.transpose() * weighted;
    for (std::size_t j = 0; j < unknown.size(); ++j)
      known_.of.emplace(unknown[j], products.col(static_cast<Index>(j)));
  }
  for (const int k : columns) {
    Vector row(p + kept_.cols());
    const Vector weighted = column(k).cwiseProduct(weight_);
    row.head(p) =
        k < static_cast<int>(p) ? known_.of.at(k) : Vector(library_.g.transpose() * weighted);
    row.tail(kept_.cols()) = kept_.transpose() * weighted;
    gram_.emplace(k, std::move(row));
  }
}

// A delay's size is 1 in the end; here it is free, for a gain beside it acts on what is late.
bool SetSearch::is_free(const Candidate &candidate) const {
  return !candidate.is_fixed || moves_prediction(candidate.term);
}

bool SetSearch::may_join(const State &state, int atom) const {
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
  if (!allowed_(candidate.term))
    return false;
  if (std::find(kept_groups_.begin(), kept_groups_.end(), candidate.group) != kept_groups_.end())
    return false;
  return std::none_of(state.atoms.begin(), state.atoms.end(), [&](int other) {
    return library_.candidates[static_cast<std::size_t>(other)].group == candidate.group;
  });
}

SetSearch::State SetSearch::begin() const {
  State state;
  for (Index k = 0; k < kept_.cols(); ++k)
    state.columns.push_back(static_cast<int>(library_.g.cols() + k));
  return state;
}

SetSearch::State SetSearch::with(const State &state, int atom) const {
  State next = state;
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
  next.atoms.push_back(atom);
  next.penalty += candidate.penalty;
  for (int k = 0; k < candidate.columns && is_free(candidate); ++k)
    next.columns.push_back(candidate.column + k);
  return next;
}

SetSearch::State SetSearch::without(const State &state, std::size_t which) const {
  State next = begin();
  for (std::size_t j = 0; j < state.atoms.size(); ++j) {
    if (j != which)
      next = with(next, state.atoms[j]);
  }
  return next;
}

// Least squares; false where a size has the wrong sign.
bool SetSearch::solve(State *state) {
  const auto k = static_cast<Index>(state->columns.size());
  double yy = squares_;
  Eigen::MatrixXd a(k, k);
  Vector t(k);
  for (Index i = 0; i < k; ++i) {
    const Vector &row = gram(state->columns[static_cast<std::size_t>(i)]);
    t(i) = products_(state->columns[static_cast<std::size_t>(i)]);
    for (Index j = 0; j < k; ++j)
      a(i, j) = row(state->columns[static_cast<std::size_t>(j)]);
  }
  std::vector<int> fixed;
  for (const int atom : state->atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (is_free(candidate))
      continue;
    const Vector &row = gram(candidate.column);
    yy += row(candidate.column) - 2.0 * products_(candidate.column);
    for (const int other : fixed)
      yy += 2.0 * row(other);
    for (Index i = 0; i < k; ++i)
      t(i) -= row(state->columns[static_cast<std::size_t>(i)]);
    fixed.push_back(candidate.column);
  }
  a.diagonal().array() *= 1.0 + 1e-9;
  state->beta = k > 0 ? Vector(a.ldlt().solve(t)) : Vector();
  state->rss = std::max(0.0, yy - (k > 0 ? t.dot(state->beta) : 0.0));
  auto at = static_cast<std::size_t>(kept_.cols());
  for (const int atom : state->atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (!is_free(candidate))
      continue;
    const double size = state->beta(static_cast<Index>(at));
    if (candidate.is_positive && !(size > 0.0))
      return false;
    if (is_by_direction(candidate.term) &&
        std::abs(state->beta(static_cast<Index>(at) + 1)) > std::abs(size) &&
        acts_throughout(library_.g.col(candidate.column + 1)))
      return false;
    if (candidate.term.form == kSmoothStribeck &&
        size * state->beta(static_cast<Index>(at) + 1) < 0.0)
      return false;
    if (moves_prediction(candidate.term) && !(size > 0.3 && size < 2.0))
      return false;
    at += static_cast<std::size_t>(candidate.columns);
  }
  state->opposed = opposed(*state);
  return true;
}

// Of two resistances over one velocity one that helps is rather a piece of a curve than a law: a
// drag can be put together of a friction and the opposite of another.
double SetSearch::opposed(const State &state) const {
  std::map<std::string, double> first;
  auto at = static_cast<Index>(kept_.cols());
  for (const int atom : state.atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (!is_free(candidate))
      continue;
    const double size = state.beta(at);
    at += candidate.columns;
    const auto v = candidate.term.arguments.find("v");
    if (candidate.is_physical && v != candidate.term.arguments.end() &&
        size * first.emplace(v->second, size).first->second < 0.0)
      return kOpposed;
  }
  return 0.0;
}

double SetSearch::score(const State &state) const {
  return -state.rss / (2.0 * noise_.variance * noise_.spread) - state.penalty - state.opposed;
}

// By how much the squares fall when the candidate joins; s: products of the library's columns with
// what remains, cross: with the columns that are there, solved: the inverse of their products times
// that. Negative where it adds nothing of its own.
double SetSearch::fall_of(std::size_t which, const Vector &s, const Eigen::MatrixXd &cross,
                          const Eigen::MatrixXd &solved) const {
  const Candidate &candidate = library_.candidates[which];
  const Index j = candidate.column;
  const bool has_any = cross.rows() > 0;
  const auto own = [&](Index i) {
    return norm_(i) - (has_any ? cross.col(i).dot(solved.col(i)) : 0.0);
  };
  const double w = own(j);
  if (!is_free(candidate))
    return 2.0 * s(j) - w;
  if (w <= kLeastOwnSquares * norm_(j))
    return -1.0;
  if (candidate.columns == 1)
    return s(j) * s(j) / w;
  const double second = own(j + 1),
               both = pair_[which] - (has_any ? cross.col(j).dot(solved.col(j + 1)) : 0.0);
  const double determinant = w * second - both * both;
  if (determinant <= kLeastOwnSquares * norm_(j) * norm_(j + 1))
    return -1.0;
  return (second * s(j) * s(j) - 2.0 * both * s(j) * s(j + 1) + w * s(j + 1) * s(j + 1)) /
         determinant;
}

// The best sets with one form more, by the fall of the squares that each brings.
std::vector<SetSearch::State> SetSearch::children(const State &state) {
  const auto k = static_cast<Index>(state.columns.size());
  const Index p = library_.g.cols();
  Eigen::MatrixXd a(k, k), cross(k, p);
  for (Index i = 0; i < k; ++i) {
    const Vector &row = gram(state.columns[static_cast<std::size_t>(i)]);
    cross.row(i) = row.head(p).transpose();
    for (Index j = 0; j < k; ++j)
      a(i, j) = row(state.columns[static_cast<std::size_t>(j)]);
  }
  a.diagonal().array() *= 1.0 + 1e-9;
  Eigen::MatrixXd solved = k > 0 ? Eigen::MatrixXd(a.ldlt().solve(cross)) : cross;
  Vector s = products_.head(p);
  for (const int atom : state.atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (!is_free(candidate))
      s -= gram(candidate.column).head(p);
  }
  if (k > 0)
    s -= cross.transpose() * state.beta;
  std::vector<std::pair<double, int>> found;
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const double fall = may_join(state, static_cast<int>(c)) ? fall_of(c, s, cross, solved) : -1.0;
    if (fall > 0.0)
      found.emplace_back(fall / (2.0 * noise_.variance * noise_.spread) -
                             library_.candidates[c].penalty,
                         static_cast<int>(c));
  }
  std::sort(found.begin(), found.end(), [](const auto &x, const auto &y) {
    return x.first > y.first || (x.first == y.first && x.second < y.second);
  });
  // Of the variants of one thing the best two.
  std::map<std::string, int> taken;
  std::vector<int> best;
  for (const auto &[gain, atom] : found) {
    if (best.size() < (state.atoms.empty() ? kSingles : kChildren) &&
        ++taken[library_.candidates[static_cast<std::size_t>(atom)].group] <= 2)
      best.push_back(atom);
  }
  fetch(best);
  std::vector<State> out;
  for (const int atom : best) {
    State next = with(state, atom);
    if (solve(&next))
      out.push_back(std::move(next));
  }
  return out;
}

void SetSearch::keep_best(std::vector<State> *beam, std::size_t most) const {
  std::stable_sort(beam->begin(), beam->end(),
                   [this](const State &a, const State &b) { return score(a) > score(b); });
  std::set<std::vector<int>> seen;
  std::vector<State> kept;
  for (State &state : *beam) {
    std::vector<int> key = state.atoms;
    std::sort(key.begin(), key.end());
    if (kept.size() < most && seen.insert(key).second)
      kept.push_back(std::move(state));
  }
  *beam = std::move(kept);
}

std::vector<SetSearch::State> SetSearch::expand(std::vector<State> beam) {
  for (std::size_t depth = 0; depth < kMostForms; ++depth) {
    std::vector<State> all = beam;
    for (const State &state : beam) {
      if (state.atoms.size() == kMostForms)
        continue;
      for (State &next : children(state))
        all.push_back(std::move(next));
    }
    const double before = score(beam.front());
    keep_best(&all, kBeam);
    const bool is_same = score(all.front()) <= before && depth > 1;
    beam = std::move(all);
    if (is_same)
      break;
  }
  return beam;
}

// Forms that could as well go do; and one form may do what two did.
SetSearch::State SetSearch::prune(State state) {
  for (bool changed = true; changed;) {
    changed = false;
    const double factor = 1.0 / (2.0 * noise_.variance * noise_.spread);
    State best = state;
    for (std::size_t j = 0; j < state.atoms.size(); ++j) {
      State less = without(state, j);
      if (!solve(&less))
        continue;
      const double loss = less.rss - state.rss;
      if (score(less) > score(best) ||
          (best.atoms.size() == state.atoms.size() &&
           (loss * factor < kLeastLoss || is_trifle(loss, less.rss, whole_))))
        best = less;
    }
    changed = best.atoms.size() < state.atoms.size();
    for (std::size_t j = 0; !changed && j < state.atoms.size(); ++j) {
      const State less = without(state, j);
      State solved = less;
      if (!solve(&solved))
        continue;
      for (State &next : children(solved)) {
        if (score(next) > score(best) + 1e-6)
          best = std::move(next);
      }
    }
    changed = changed || score(best) > score(state) + 1e-6;
    if (changed)
      state = std::move(best);
  }
  return state;
}

// Free columns, where sizes differ one a log.
Eigen::MatrixXd SetSearch::columns_of(const State &state) const {
  const std::size_t logs = measured_.logs.size();
  const int own = state.differs < 0 ? -1
                                    : library_
                                          .candidates[static_cast<std::size_t>(
                                              state.atoms[static_cast<std::size_t>(state.differs)])]
                                          .column;
  const std::size_t k = state.columns.size() + (own < 0 ? 0 : logs - 1);
  Eigen::MatrixXd h = Eigen::MatrixXd::Zero(y_.size(), static_cast<Index>(k));
  Index at = 0;
  for (const int index : state.columns) {
    const Vector x = column(index);
    if (index != own) {
      h.col(at++) = x;
      continue;
    }
    for (const LogSpan &log : measured_.logs) {
      const auto first = static_cast<Index>(log.first), rows = static_cast<Index>(log.rows);
      h.col(at++).segment(first, rows) = x.segment(first, rows);
    }
  }
  return h;
}

Vector SetSearch::left_by(const State &state) const {
  Vector target = target_, left = y_ - fixed_;
  for (const int atom : state.atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (is_free(candidate))
      continue;
    target -= library_.g.col(candidate.column);
    left -= library_.g.col(candidate.column);
  }
  const Eigen::MatrixXd h = columns_of(state);
  if (h.cols() == 0)
    return left;
  Eigen::MatrixXd a = h.transpose() * weight_.asDiagonal() * h;
  add_ridge(1e-9, &a);
  return left - h * a.ldlt().solve(h.transpose() * weight_.cwiseProduct(target));
}

// The set with one form of a size of its own in every log.
SetSearch::State SetSearch::split(const State &state, std::size_t which) const {
  State out = state;
  out.differs = static_cast<int>(which);
  Vector target = target_;
  for (const int atom : state.atoms) {
    const Candidate &candidate = library_.candidates[static_cast<std::size_t>(atom)];
    if (!is_free(candidate))
      target -= library_.g.col(candidate.column);
  }
  const Eigen::MatrixXd h = columns_of(out);
  Eigen::MatrixXd a = h.transpose() * weight_.asDiagonal() * h;
  add_ridge(1e-9, &a);
  const Vector weighted = weight_.cwiseProduct(target), t = h.transpose() * weighted;
  out.rss = std::max(0.0, weighted.dot(target) - t.dot(a.ldlt().solve(t)));
  out.penalty +=
      kSizesDiffer + 0.5 * static_cast<double>(measured_.logs.size() - 1) * library_.ln_rows;
  return out;
}

// Of the sets, and of each with one law of physics of a size of its own in every log, the best.
SetSearch::State SetSearch::best_split(const std::vector<State> &states) {
  const auto is_worse = [this](const State &a, const State &b) { return score(a) < score(b); };
  State out = *std::max_element(states.begin(), states.end(), is_worse);
  const std::size_t logs = measured_.logs.size();
  if (logs < 2 || logs > kMostLogs)
    return out;
  // What stands in for sizes that differ (a place that each log has of its own) leads by far before
  // any may: the best few are looked at however far they are behind.
  std::vector<State> best = states;
  keep_best(&best, kMostSplit);
  const double least = score(out) - kMostBehind;
  for (std::size_t i = 0; i < best.size(); ++i) {
    const State &state = best[i];
    for (std::size_t j = 0; j < state.atoms.size() && (i < kFewSplit || score(state) > least);
         ++j) {
      const Candidate &candidate = library_.candidates[static_cast<std::size_t>(state.atoms[j])];
      if (candidate.columns != 1 || !is_free(candidate) || !candidate.is_physical ||
          moves_prediction(candidate.term))
        continue;
      State own = split(state, j);
      if (score(own) > score(out))
        out = std::move(own);
    }
  }
  return out;
}

// The target anew: the residual of the best set so far, cut, on top of what it explains.
void SetSearch::look_again(const State &state) {
  const Vector left = left_by(state);
  target_ = y_ - fixed_ - left + cut(left, weight_);
  const Vector weighted = target_.cwiseProduct(weight_);
  products_.resize(library_.g.cols() + kept_.cols());
  products_.head(library_.g.cols()) = library_.g.transpose() * weighted;
  products_.tail(kept_.cols()) = kept_.transpose() * weighted;
  squares_ = weighted.dot(target_);
  whole_ = std::max(whole_, squares_);
}

// What the columns leave of the target, by ridge regression over these rows.
Vector SetSearch::left_by_ridge(const Eigen::MatrixXd &h, Index first, Index rows) const {
  const auto part = h.middleRows(first, rows);
  const Vector y = target_.segment(first, rows), w = weight_.segment(first, rows);
  Eigen::MatrixXd a = part.transpose() * w.asDiagonal() * part;
  add_ridge(kRidge, &a);
  return y - part * a.ldlt().solve(part.transpose() * w.cwiseProduct(y));
}

// Of the columns those that alone explain most of these rows: as many as a quarter of the rows.
Eigen::MatrixXd SetSearch::best_columns(const Eigen::MatrixXd &h, Index first, Index rows) const {
  if (4 * h.cols() <= rows)
    return h;
  const auto part = h.middleRows(first, rows);
  const Vector w = weight_.segment(first, rows);
  const Vector products = part.transpose() * w.cwiseProduct(target_.segment(first, rows)),
               squares = part.cwiseAbs2().transpose() * w;
  std::vector<Index> order(static_cast<std::size_t>(h.cols()));
  std::iota(order.begin(), order.end(), Index{0});
  const Vector fall = products.cwiseAbs2().cwiseQuotient(squares.cwiseMax(1e-300));
  std::stable_sort(order.begin(), order.end(),
                   [&fall](Index a, Index b) { return fall(a) > fall(b); });
  order.resize(static_cast<std::size_t>(rows / 4));
  return h(Eigen::all, order);
}

// Noise as what the columns leave of rows that they were not fitted to: of each log by the others,
// of a single log by its parts. A slow error that other quantities explain is no autocorrelation of
// the noise; but columns that merely happen to be as slow as it do not say it elsewhere.
NoiseState SetSearch::noise_elsewhere(const Eigen::MatrixXd &h) const {
  std::vector<std::pair<Index, Index>> parts; // first row, rows
  for (const LogSpan &log : measured_.logs)
    parts.emplace_back(static_cast<Index>(log.first), static_cast<Index>(log.rows));
  if (parts.size() == 1) {
    const Index rows = y_.size();
    parts.clear();
    for (Index k = 0; k < kParts; ++k)
      parts.emplace_back(rows * k / kParts, rows * (k + 1) / kParts - rows * k / kParts);
  }
  const Eigen::MatrixXd weighted = weight_.asDiagonal() * h;
  const Eigen::MatrixXd a = h.transpose() * weighted;
  const Vector t = weighted.transpose() * target_;
  Vector left = target_;
  for (const auto &[first, rows] : parts) {
    const auto here = weighted.middleRows(first, rows);
    Eigen::MatrixXd others = a - h.middleRows(first, rows).transpose() * here;
    add_ridge(kRidge, &others);
    const Vector right = t - here.transpose() * target_.segment(first, rows);
    left.segment(first, rows) -= h.middleRows(first, rows) * others.ldlt().solve(right);
  }
  return noise_state(left, weight_, measured_, rms_, 0.0, least_sd_);
}

// Noise as it would be if every law of physics were at work, with a size of its own in every log
// where there are several; or if every other quantity acted in proportion, where that leaves less.
void SetSearch::begin_noise() {
  target_ = y_ - fixed_;
  std::vector<int> columns, proportional;
  std::set<std::string> groups;
  for (const Candidate &candidate : library_.candidates) {
    if (candidate.columns != 1 || !is_free(candidate))
      continue;
    if (candidate.is_physical && groups.insert(candidate.group).second)
      columns.push_back(candidate.column);
    else if ((candidate.term.form == "coupling" || candidate.term.form == "coupling_about") &&
             proportional.size() < kMostProportional)
      proportional.push_back(candidate.column);
  }
  const auto k = static_cast<Index>(columns.size());
  Eigen::MatrixXd h(y_.size(), k + kept_.cols());
  for (Index j = 0; j < k; ++j)
    h.col(j) = library_.g.col(columns[static_cast<std::size_t>(j)]);
  h.rightCols(kept_.cols()) = kept_;
  Vector left = left_by_ridge(h, 0, y_.size());
  noise_ = noise_state(left, weight_, measured_, rms_, static_cast<double>(k), least_sd_);
  least_effective_ = 0.5 * noise_.rows / noise_.spread;
  bool is_elsewhere = false;
  if (!proportional.empty()) {
    Eigen::MatrixXd all(y_.size(), h.cols() + static_cast<Index>(proportional.size()));
    all << h, library_.g(Eigen::all, proportional);
    const NoiseState elsewhere = noise_elsewhere(all);
    if (elsewhere.variance * elsewhere.spread < noise_.variance * noise_.spread) {
      noise_ = elsewhere;
      is_elsewhere = true;
      least_effective_ = std::max(least_effective_, 0.5 * noise_.rows / noise_.spread);
    }
  }
  const std::size_t logs = measured_.logs.size();
  if (logs < 2 || logs > kMostLogs)
    return;
  for (const LogSpan &log : measured_.logs) {
    const auto first = static_cast<Index>(log.first), rows = static_cast<Index>(log.rows);
    if (rows < kLeastRows)
      return;
    left.segment(first, rows) = left_by_ridge(best_columns(h, first, rows), first, rows);
  }
  const NoiseState by_log = noise_state(
      left, weight_, measured_, rms_, static_cast<double>(k * static_cast<Index>(logs)), least_sd_);
  if (!is_elsewhere || by_log.variance * by_log.spread < noise_.variance * noise_.spread)
    noise_ = by_log;
}

std::vector<SetSearch::State> SetSearch::starts() {
  State none = begin();
  solve(&none);
  std::vector<State> all = children(none);
  all.insert(all.begin(), none);
  std::vector<int> of_sets;
  for (const std::vector<int> &set : library_.sets)
    of_sets.insert(of_sets.end(), set.begin(), set.end());
  fetch(of_sets);
  for (const std::vector<int> &set : library_.sets) {
    State state = none;
    bool fits = true;
    for (const int atom : set) {
      fits = fits && may_join(state, atom);
      state = with(state, atom);
    }
    if (fits && solve(&state))
      all.push_back(state);
  }
  return all;
}

FormSet SetSearch::best(const Allowed &allowed, NoiseState *noise) {
  allowed_ = allowed;
  norm_ = library_.g.cwiseAbs2().transpose() * weight_;
  begin_noise();
  State found = begin();
  look_again(found);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<State> first = starts();
    std::vector<State> beam = first;
    keep_best(&beam, kBeam);
    beam = expand(std::move(beam));
    beam.insert(beam.end(), first.begin(), first.end());
    found = best_split(beam);
    if (found.differs < 0)
      found = prune(std::move(found));
    const NoiseState before = noise_;
    noise_ = noise_state(left_by(found), weight_, measured_, rms_,
                         static_cast<double>(found.columns.size()), least_sd_);
    noise_.spread = std::min(noise_.spread, noise_.rows / std::max(1.0, least_effective_));
    look_again(found);
    if (std::abs(noise_.spread / before.spread - 1.0) < kSettled &&
        std::abs(noise_.variance / before.variance - 1.0) < kSettled)
      break;
  }
  *noise = noise_;
  return {found.atoms, found.differs, score(found)};
}

} // namespace rim::diagnose
