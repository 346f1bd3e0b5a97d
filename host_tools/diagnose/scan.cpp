// SPDX-License-Identifier: MIT
#include "diagnose/scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include <Eigen/LU>

#include "batch/interval.h"
#include "search/cem.h"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr int kRefineBins = 200;
// What a bound may be off by.
constexpr double kRounding = 1.0 - 1e-9;

std::size_t idx(Index i) { return static_cast<std::size_t>(i); }

// out[b] = the sum of x over the rows whose bin is b, for b < bins. Rows beside each other are
// often in one bin: each of four in turn has sums of its own, or every addition would wait for the
// last.
void add_up(const std::vector<std::uint8_t> &bin, const Vector &x, std::size_t bins, double *out) {
  constexpr std::size_t kTurns = 4;
  std::array<Cells, kTurns> sums{};
  std::size_t i = 0;
  for (; i + kTurns <= bin.size(); i += kTurns) {
    for (std::size_t turn = 0; turn < kTurns; ++turn)
      sums[turn][bin[i + turn]] += x(static_cast<Index>(i + turn));
  }
  for (; i < bin.size(); ++i)
    sums[0][bin[i]] += x(static_cast<Index>(i));
  for (std::size_t b = 0; b < bins; ++b)
    out[b] = (sums[0][b] + sums[1][b]) + (sums[2][b] + sums[3][b]);
}

struct BoxBest {
  double value = 0.0;
  int first[2] = {0, 0}, last[2] = {0, 0};
};

// Twice the most that any box of these columns can reach: by Cauchy and Schwarz the sum of s^2 / w.
double most_of(const double *s, const double *w, int columns) {
  double sum = 0.0;
  for (int k = 0; k < columns; ++k)
    sum += s[k] * s[k] / std::max(w[k], 1e-300);
  return sum;
}

// Largest s^2 / 2 w over the boxes of a grid, by sums of columns, where it is above `known`; w and
// n likewise. Rows that cannot reach what was found already are passed over.
BoxBest best_box(const Cells &s, const Cells &w, const Cells &n, int rows, int columns,
                 double least, double known) {
  BoxBest best;
  best.value = known;
  double cs[kCoarseBins], cw[kCoarseBins], cn[kCoarseBins];
  for (int top = 0; top < rows; ++top) {
    std::fill_n(cs, kCoarseBins, 0.0);
    std::fill_n(cw, kCoarseBins, 0.0);
    std::fill_n(cn, kCoarseBins, 0.0);
    for (int bottom = top; bottom < rows; ++bottom) {
      for (int k = 0; k < columns; ++k) {
        const auto at = static_cast<std::size_t>(bottom * kCoarseBins + k);
        cs[k] += s[at];
        cw[k] += w[at];
        cn[k] += n[at];
      }
      if (most_of(cs, cw, columns) < 2.0 * best.value * kRounding)
        continue;
      for (int left = 0; left < columns; ++left) {
        double sum = 0.0, weight = 0.0, count = 0.0;
        for (int right = left; right < columns; ++right) {
          sum += cs[right];
          weight += cw[right];
          count += cn[right];
          if (count >= least && sum * sum > 2.0 * best.value * weight) {
            best.value = 0.5 * sum * sum / weight;
            best.first[0] = top;
            best.last[0] = bottom;
            best.first[1] = left;
            best.last[1] = right;
          }
        }
      }
    }
  }
  return best;
}

double variance_gain(double n, double q, double all_n, double all_q) {
  const double out_n = all_n - n, out_q = all_q - q;
  if (n <= 0.0 || out_n <= 0.0 || q <= 0.0 || out_q <= 0.0)
    return 0.0;
  return 0.5 *
         (all_n * std::log(all_q / all_n) - n * std::log(q / n) - out_n * std::log(out_q / out_n));
}

} // namespace

Scanner::Scanner(const Library &library, const Vector &weight)
    : library_(library), weight_(weight), root_(weight.cwiseSqrt()) {
  norm_ = (library.g.cwiseAbs2().transpose() * weight_);
  const int gates = static_cast<int>(library.gates.size());
  for (int a = 0; a < gates; ++a) {
    for (int b = a + 1; b < gates; ++b) {
      if (library.gates[static_cast<std::size_t>(a)].name !=
          library.gates[static_cast<std::size_t>(b)].name)
        pairs_.emplace_back(a, b);
    }
  }
  const Vector used = (weight_.array() > 0.0).cast<double>();
  for (const auto &[fa, fb] : pairs_) {
    const auto &a = library.gates[static_cast<std::size_t>(fa)].coarse;
    const auto &b = library.gates[static_cast<std::size_t>(fb)].coarse;
    std::vector<std::uint8_t> cell(a.size());
    for (std::size_t i = 0; i < cell.size(); ++i)
      cell[i] = static_cast<std::uint8_t>(a[i] * kCoarseBins + b[i]);
    cells_.push_back(std::move(cell));
    rows_in_.push_back(sums(cells_.size() - 1, used));
  }
  fine_rows_ = Eigen::MatrixXd::Zero(kFineBins, gates);
  for (int f = 0; f < gates; ++f) {
    const auto &bin = library.gates[static_cast<std::size_t>(f)].fine;
    for (Index i = 0; i < used.size(); ++i)
      fine_rows_(bin[idx(i)], f) += used(i);
  }
  least_rows_ = std::max(15.0, 0.008 * weight_.sum());
  for (int c = 0; c < static_cast<int>(library.candidates.size()); ++c) {
    const Candidate &candidate = library.candidates[static_cast<std::size_t>(c)];
    if (candidate.gate == GateKind::none || candidate.is_fixed)
      continue;
    if (candidate.columns == 2) {
      gated_pairs_.push_back(c);
      continue;
    }
    Gated gated;
    gated.candidate = c;
    gated.is_pair = candidate.gate == GateKind::pair;
    const Vector g2 = library.g.col(candidate.column).cwiseAbs2().cwiseProduct(weight_);
    gated.w = Eigen::MatrixXd::Zero(kFineBins, gates);
    for (int f = 0; f < gates; ++f) {
      const auto &bin = library.gates[static_cast<std::size_t>(f)].fine;
      for (Index i = 0; i < g2.size(); ++i)
        gated.w(bin[idx(i)], f) += g2(i);
    }
    for (std::size_t p = 0; gated.is_pair && p < pairs_.size(); ++p)
      gated.w_grid.push_back(sums(p, g2));
    gated_.push_back(std::move(gated));
  }
}

Cells Scanner::sums(std::size_t pair, const Vector &x) const {
  Cells out;
  add_up(cells_[pair], x, out.size(), out.data());
  return out;
}

void Scanner::propose_gated(const Gated &gated, const Vector &e, const Noise &noise,
                            std::vector<Proposal> *out) const {
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(gated.candidate)];
  const Vector ge = library_.g.col(candidate.column).cwiseProduct(root_).cwiseProduct(e);
  const double g2 = norm_(candidate.column) / std::max(1.0, weight_.sum());
  rim_stats bins[kFineBins];
  double sum[kFineBins];
  Proposal best;
  best.candidate = gated.candidate;
  best.penalty = candidate.penalty + library_.gate_penalty(1);
  for (int f = 0; f < static_cast<int>(library_.gates.size()); ++f) {
    const GateFeature &feature = library_.gates[static_cast<std::size_t>(f)];
    const int count = feature.fine_bins();
    add_up(feature.fine, ge, kFineBins, sum);
    for (int b = 0; b < count; ++b)
      bins[b] = {fine_rows_(b, f), sum[b], gated.w(b, f)};
    rim_interval found;
    if (rimi_interval_find(bins, static_cast<std::size_t>(count), least_rows_, &found) != RIM_OK ||
        found.bins == 0 || static_cast<int>(found.bins) == count || found.w < 1e-12 * g2)
      continue;
    if (candidate.is_positive && found.s <= 0.0)
      continue;
    const double gain =
        found.ln_anom / noise.divisor() * (feature.name == kTime ? library_.time_share : 1.0);
    if (gain > best.gain) {
      best.gain = gain;
      best.bounds = {
          {f, feature.fine_edge[found.first], feature.fine_edge[found.first + found.bins]}};
    }
  }
  if (best.gain > 0.0)
    out->push_back(best);
}

namespace {

// Sums of two columns' products with the residual and with each other.
struct PairSums {
  double s1 = 0, s2 = 0, w11 = 0, w12 = 0, w22 = 0, n = 0;
  void add(double g1, double g2, double e, double weight) {
    s1 += g1 * e;
    s2 += g2 * e;
    w11 += g1 * g1 * weight;
    w12 += g1 * g2 * weight;
    w22 += g2 * g2 * weight;
    n += weight > 0.0 ? 1.0 : 0.0;
  }
  PairSums less(const PairSums &o) const {
    return {s1 - o.s1, s2 - o.s2, w11 - o.w11, w12 - o.w12, w22 - o.w22, n - o.n};
  }
  // By how much half the squares fall with both.
  double gain() const {
    const double determinant = w11 * w22 - w12 * w12;
    return determinant > 1e-6 * w11 * w22
               ? 0.5 * (w22 * s1 * s1 - 2.0 * w12 * s1 * s2 + w11 * s2 * s2) / determinant
               : 0.0;
  }
};

struct PairBest {
  double gain = 0.0;
  std::size_t first = 0, last = 0; // bins: first <= bin < last
};

// sums[k]: of the bins below k.
PairBest best_pair(const std::vector<PairSums> &sums, double least) {
  PairBest best;
  for (std::size_t a = 0; a + 1 < sums.size(); ++a) {
    for (std::size_t b = a + 1; b < sums.size(); ++b) {
      const PairSums inside = sums[b].less(sums[a]);
      if (inside.n < least || (a == 0 && b + 1 == sums.size()))
        continue;
      const double gain = inside.gain();
      if (gain > best.gain)
        best = {gain, a, b};
    }
  }
  return best;
}

} // namespace

void Scanner::propose_pairs(int candidate, const Vector &e, const Noise &noise,
                            std::vector<Proposal> *out) const {
  const Candidate &c = library_.candidates[static_cast<std::size_t>(candidate)];
  Proposal best;
  best.candidate = candidate;
  best.penalty = c.penalty + library_.gate_penalty(1);
  for (int f = 0; f < static_cast<int>(library_.gates.size()); ++f) {
    const GateFeature &feature = library_.gates[static_cast<std::size_t>(f)];
    std::vector<PairSums> sums(static_cast<std::size_t>(feature.fine_bins()) + 1);
    for (Index i = 0; i < e.size(); ++i)
      sums[feature.fine[idx(i)] + 1U].add(library_.g(i, c.column), library_.g(i, c.column + 1),
                                          root_(i) * e(i), weight_(i));
    for (std::size_t b = 1; b < sums.size(); ++b)
      sums[b] = sums[b].less({-sums[b - 1].s1, -sums[b - 1].s2, -sums[b - 1].w11, -sums[b - 1].w12,
                              -sums[b - 1].w22, -sums[b - 1].n});
    const PairBest found = best_pair(sums, 2.0 * least_rows_);
    const double gain =
        found.gain / noise.divisor() * (feature.name == kTime ? library_.time_share : 1.0);
    if (gain > best.gain) {
      best.gain = gain;
      best.bounds = {{f, feature.fine_edge[found.first], feature.fine_edge[found.last]}};
    }
  }
  if (best.gain > 0.0)
    out->push_back(best);
}

// The interval of two columns at fine resolution.
void Scanner::refine_pair(const Vector &residual, Proposal *proposal) const {
  const Candidate &c = library_.candidates[static_cast<std::size_t>(proposal->candidate)];
  const Vector &x = library_.gates[static_cast<std::size_t>(proposal->bounds[0].feature)].x;
  std::vector<Index> order(static_cast<std::size_t>(x.size()));
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = static_cast<Index>(i);
  std::sort(order.begin(), order.end(), [&x](Index a, Index b) { return x(a) < x(b); });
  const std::size_t each = std::max<std::size_t>(1, order.size() / kRefineBins);
  std::vector<PairSums> sums(1);
  std::vector<double> edges{x(order.front())};
  PairSums sum;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Index k = order[i];
    sum.add(library_.g(k, c.column), library_.g(k, c.column + 1), weight_(k) * residual(k),
            weight_(k));
    const bool is_last = i + 1 == order.size();
    if (is_last || ((i + 1) % each == 0 && x(order[i + 1]) > x(k))) {
      sums.push_back(sum);
      edges.push_back(is_last ? x(k) : 0.5 * (x(k) + x(order[i + 1])));
    }
  }
  const PairBest found = best_pair(sums, 2.0 * least_rows_);
  if (found.gain > 0.0) {
    proposal->bounds[0].lower = edges[found.first];
    proposal->bounds[0].upper = edges[found.last];
  }
}

void Scanner::propose_boxes(const Gated &gated, const Vector &e, const Noise &noise,
                            std::vector<Proposal> *out) const {
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(gated.candidate)];
  const Vector ge = library_.g.col(candidate.column).cwiseProduct(root_).cwiseProduct(e);
  Proposal best;
  best.candidate = gated.candidate;
  best.penalty = candidate.penalty + library_.gate_penalty(2);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const GateFeature &a = library_.gates[static_cast<std::size_t>(pairs_[p].first)];
    const GateFeature &b = library_.gates[static_cast<std::size_t>(pairs_[p].second)];
    // Only bins that are: a feature of few values has fewer, and rounding could choose one more.
    const double factor =
        (a.name == kTime || b.name == kTime ? library_.time_share : 1.0) / noise.divisor();
    const double known = best.gain / factor * kRounding;
    const BoxBest box = best_box(sums(p, ge), gated.w_grid[p], rows_in_[p], a.coarse_bins(),
                                 b.coarse_bins(), least_rows_, known);
    const double gain = box.value * factor;
    if (box.value > known && gain > best.gain) {
      best.gain = gain;
      best.bounds = {{pairs_[p].first, a.coarse_edge[static_cast<std::size_t>(box.first[0])],
                      a.coarse_edge[static_cast<std::size_t>(box.last[0] + 1)]},
                     {pairs_[p].second, b.coarse_edge[static_cast<std::size_t>(box.first[1])],
                      b.coarse_edge[static_cast<std::size_t>(box.last[1] + 1)]}};
    }
  }
  if (best.gain > 0.0)
    out->push_back(best);
}

// By how much Huber's loss falls when the column is added as it is: where it is large it meets
// residuals that are, and neither may be cut alone. `now`: the loss without it.
double Scanner::fixed_gain(const Vector &weighted, double now, double corner, Index column) const {
  const auto size = (weighted - root_.cwiseProduct(library_.g.col(column))).array().abs();
  const auto inner = size.min(corner);
  return now - (inner * (size - 0.5 * inner)).sum();
}

std::vector<Proposal> Scanner::mean(const Fit &fit, const Noise &noise, std::size_t most) const {
  std::vector<Proposal> out;
  const Vector e = fit.clipped, we = root_.cwiseProduct(e);
  const Vector weighted = root_.cwiseProduct(fit.residual);
  const double corner = noise.clip * noise.scale;
  const auto cut = weighted.array().abs().min(corner).eval();
  const double now = (cut * (weighted.array().abs() - 0.5 * cut)).sum();
  const Vector s = library_.g.transpose() * we;
  Vector w = norm_;
  Eigen::MatrixXd along; // columns of g in the span of the members
  if (fit.orthonormal.cols() > 0) {
    along = library_.g.transpose() * (root_.asDiagonal() * fit.orthonormal);
    w -= along.rowwise().squaredNorm();
  }
  for (std::size_t c = 0; c < library_.candidates.size(); ++c) {
    const Candidate &candidate = library_.candidates[c];
    const Index k = candidate.column;
    Proposal p;
    p.candidate = static_cast<int>(c);
    p.penalty = candidate.penalty;
    if (candidate.columns == 1) {
      if (candidate.is_fixed)
        p.gain = fixed_gain(weighted, now, corner, k);
      else if (w(k) > 1e-6 * norm_(k) && !(candidate.is_positive && s(k) <= 0.0))
        p.gain = 0.5 * s(k) * s(k) / w(k);
    } else {
      Eigen::Matrix2d gram;
      const Vector first = library_.g.col(k), second = library_.g.col(k + 1);
      double cross = first.cwiseProduct(weight_).dot(second);
      if (along.cols() > 0)
        cross -= along.row(k).dot(along.row(k + 1));
      gram << w(k), cross, cross, w(k + 1);
      const Eigen::Vector2d right(s(k), s(k + 1));
      if (gram.determinant() > 1e-9 * norm_(k) * norm_(k + 1))
        p.gain = 0.5 * right.dot(gram.inverse() * right);
    }
    p.gain /= noise.divisor();
    if (p.gain > 0.0)
      out.push_back(p);
  }
  for (const int candidate : gated_pairs_)
    propose_pairs(candidate, e, noise, &out);
  for (const Gated &gated : gated_) {
    propose_gated(gated, e, noise, &out);
    if (gated.is_pair)
      propose_boxes(gated, e, noise, &out);
  }
  const auto is_better = [](const Proposal &a, const Proposal &b) { return a.score() > b.score(); };
  std::stable_sort(out.begin(), out.end(), is_better);
  if (out.size() > most)
    out.resize(most);
  return out;
}

namespace {

// Squares of the standardised residual: how many rows, and their sum.
struct Squares {
  double n = 0.0, q = 0.0;
};

// Whether the scatter inside tells more than what was best so far; then it is the best. least: rows
// that there must be, inside and outside.
bool is_best(const Squares &inside, const Squares &all, double least, double spread,
             Proposal *best) {
  if (inside.n < least || all.n - inside.n < least)
    return false;
  // With the mean as unit a side of n rows and squares q adds (q - n - n ln(q / n)) / 2, which is
  // at most (q - n)^2 / (4 min(n, q)): skip what cannot win.
  const double q = inside.q * all.n / all.q, excess = q - inside.n;
  const double in = std::min(q, inside.n), out = all.n - std::max(q, inside.n);
  if (0.25 * excess * excess * (in + out) < best->gain * spread * in * out * kRounding)
    return false;
  const double gain = variance_gain(inside.n, inside.q, all.n, all.q) / spread;
  if (gain <= best->gain)
    return false;
  best->gain = gain;
  best->ratio = (inside.q / inside.n) / ((all.q - inside.q) / (all.n - inside.n));
  return true;
}

} // namespace

Proposal Scanner::variance_interval(const Vector &q, const Vector &used, double spread) const {
  const Squares all{used.sum(), q.sum()};
  Proposal best;
  best.penalty = 0.5 * library_.ln_rows + library_.gate_penalty(1);
  double squares[kFineBins];
  for (int f = 0; f < static_cast<int>(library_.gates.size()); ++f) {
    const GateFeature &feature = library_.gates[static_cast<std::size_t>(f)];
    add_up(feature.fine, q, kFineBins, squares);
    for (int a = 0; a < feature.fine_bins(); ++a) {
      Squares inside;
      for (int b = a; b < feature.fine_bins(); ++b) {
        inside.n += fine_rows_(b, f);
        inside.q += squares[b];
        if (is_best(inside, all, 2.0 * least_rows_, spread, &best))
          best.bounds = {{f, feature.fine_edge[idx(a)], feature.fine_edge[idx(b + 1)]}};
      }
    }
  }
  return best;
}

// Boxes of at least two bins a side.
Proposal Scanner::variance_box(const Vector &q, const Vector &used, double spread) const {
  const Squares all{used.sum(), q.sum()};
  Proposal best;
  best.penalty = 0.5 * library_.ln_rows + library_.gate_penalty(2);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const int fa = pairs_[p].first, fb = pairs_[p].second;
    const GateFeature &a = library_.gates[static_cast<std::size_t>(fa)];
    const GateFeature &b = library_.gates[static_cast<std::size_t>(fb)];
    const Cells squares = sums(p, q);
    for (int i0 = 0; i0 < a.coarse_bins(); ++i0) {
      std::array<Squares, kCoarseBins> column{}; // of the rows i0 to i1
      for (int i1 = i0; i1 < a.coarse_bins(); ++i1) {
        for (int j = 0; j < b.coarse_bins(); ++j) {
          const std::size_t at = idx(i1 * kCoarseBins + j);
          column[idx(j)].n += rows_in_[p][at];
          column[idx(j)].q += squares[at];
        }
        for (int j0 = 0; i1 > i0 && j0 + 1 < b.coarse_bins(); ++j0) {
          Squares inside = column[idx(j0)];
          for (int j1 = j0 + 1; j1 < b.coarse_bins(); ++j1) {
            inside.n += column[idx(j1)].n;
            inside.q += column[idx(j1)].q;
            if (is_best(inside, all, 2.0 * least_rows_, spread, &best))
              best.bounds = {{fa, a.coarse_edge[idx(i0)], a.coarse_edge[idx(i1 + 1)]},
                             {fb, b.coarse_edge[idx(j0)], b.coarse_edge[idx(j1 + 1)]}};
          }
        }
      }
    }
  }
  return best;
}

std::vector<Proposal> Scanner::variance(const Fit &fit, const Noise &noise) const {
  const Vector used = (weight_.array() > 0.0).cast<double>();
  const Vector q = fit.clipped.cwiseAbs2().cwiseProduct(used);
  std::vector<Proposal> out;
  for (const Proposal &p : {variance_interval(q, used, noise.spread_of_squares),
                            variance_box(q, used, noise.spread_of_squares)}) {
    if (p.gain > 0.0)
      out.push_back(p);
  }
  const auto merit = [](const Proposal &p) {
    return p.score() - (p.bounds.size() > 1 ? kOfFeature : 0.0);
  };
  std::stable_sort(out.begin(), out.end(),
                   [merit](const Proposal &a, const Proposal &b) { return merit(a) > merit(b); });
  return out;
}

namespace {

// Bins of rows in order: `each` rows a bin, but single ones where `fine` says so; equal values are
// never apart.
struct RowBins {
  std::vector<rim_stats> stats;
  std::vector<std::size_t> first; // row of each, and the end
};

RowBins row_bins(const std::vector<std::pair<double, Index>> &order, const Vector &products,
                 const Vector &squares, std::size_t each,
                 const std::function<bool(std::size_t)> &fine) {
  RowBins bins;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_new = i > 0 && order[i].first > order[i - 1].first;
    if (bins.stats.empty() ||
        (is_new && (fine(i) || bins.stats.back().n >= static_cast<double>(each)))) {
      bins.stats.push_back({0.0, 0.0, 0.0});
      bins.first.push_back(i);
    }
    bins.stats.back().n += 1.0;
    bins.stats.back().s += products(order[i].second);
    bins.stats.back().w += squares(order[i].second);
  }
  bins.first.push_back(order.size());
  return bins;
}

} // namespace

// First over bins, and then over single rows about the edges found.
void Scanner::refine_bound(const Vector &products, const Vector &squares, std::size_t which,
                           Proposal *proposal) const {
  Proposal others = *proposal;
  others.bounds.erase(others.bounds.begin() + static_cast<std::ptrdiff_t>(which));
  others.is_ellipse = false;
  const Vector mask = inside(others);
  const GateFeature &feature =
      library_.gates[static_cast<std::size_t>(proposal->bounds[which].feature)];
  std::vector<std::pair<double, Index>> order;
  for (Index i = 0; i < mask.size(); ++i) {
    if (mask(i) > 0.0)
      order.emplace_back(feature.x(i), i);
  }
  if (order.size() < 20)
    return;
  std::sort(order.begin(), order.end());
  const std::size_t each = std::max<std::size_t>(1, order.size() / kRefineBins);
  std::size_t low = 0, high = order.size();
  const auto edge = [&order](std::size_t at) {
    return at == 0              ? order.front().first
           : at == order.size() ? order.back().first
                                : 0.5 * (order[at - 1].first + order[at].first);
  };
  for (const bool is_fine : {false, true}) {
    const auto fine = [&](std::size_t i) {
      return is_fine && (std::max(i, low) - std::min(i, low) <= 2 * each ||
                         std::max(i, high) - std::min(i, high) <= 2 * each);
    };
    const RowBins bins = row_bins(order, products, squares, each, fine);
    rim_interval found;
    if (rimi_interval_find(bins.stats.data(), bins.stats.size(),
                           std::min(least_rows_, 0.5 * static_cast<double>(order.size())),
                           &found) != RIM_OK ||
        found.bins == 0)
      return;
    low = bins.first[found.first];
    high = bins.first[found.first + found.bins];
    proposal->bounds[which].lower = edge(low);
    proposal->bounds[which].upper = edge(high);
    if (each == 1)
      return;
  }
}

namespace {

struct EllipseValue {
  std::vector<double> x; // [n][2], within the unit square
  std::vector<double> s, w;
  double least = 0.0;
};

double ellipse_value(const rim_ellipsoid *ellipsoid, void *context) {
  const auto &data = *static_cast<const EllipseValue *>(context);
  const ellipsoid_test test = rimi_ellipsoid_test(ellipsoid, false);
  double s = 0.0, w = 0.0, n = 0.0;
  for (std::size_t i = 0; i < data.s.size(); ++i) {
    if (rimi_ellipsoid_holds(&test, &data.x[2 * i])) {
      s += data.s[i];
      w += data.w[i];
      n += 1.0;
    }
  }
  return n >= data.least && w > 0.0 ? 0.5 * s * s / w : 0.0;
}

} // namespace

void Scanner::try_ellipse(const Vector &products, const Vector &squares, Proposal *proposal) const {
  const Vector mask = inside(*proposal);
  double s = products.dot(mask), w = squares.dot(mask);
  const double of_box = w > 0.0 ? 0.5 * s * s / w : 0.0;
  EllipseValue data;
  data.least = least_rows_;
  double low[2], span[2];
  rim_ellipsoid ellipsoid{};
  ellipsoid.dims = 2;
  const std::size_t diagonal[2] = {0, 2};
  for (std::size_t k = 0; k < 2; ++k) {
    const Bound &bound = proposal->bounds[k];
    const Vector &x = library_.gates[static_cast<std::size_t>(bound.feature)].x;
    low[k] = x.minCoeff();
    span[k] = std::max(1e-300, x.maxCoeff() - low[k]);
    ellipsoid.center[k] = (0.5 * (bound.lower + bound.upper) - low[k]) / span[k];
    // Same area as the box: half axes 2 / sqrt(pi) of its half widths.
    ellipsoid.factor[diagonal[k]] =
        std::clamp(1.128 * 0.5 * (bound.upper - bound.lower) / span[k], 0.02, 1.0);
  }
  for (Index i = 0; i < products.size(); ++i) {
    if (squares(i) <= 0.0)
      continue;
    for (std::size_t k = 0; k < 2; ++k)
      data.x.push_back(
          (library_.gates[static_cast<std::size_t>(proposal->bounds[k].feature)].x(i) - low[k]) /
          span[k]);
    data.s.push_back(products(i));
    data.w.push_back(squares(i));
  }
  rim_cem_config config{};
  config.samples = 40;
  config.elites = 6;
  config.iterations = 8;
  double value = 0.0;
  if (rimi_cem_optimise(&config, ellipse_value, &data, 1, 1, &ellipsoid, &value) != RIM_OK ||
      value <= of_box)
    return;
  // A = L L' in the features' own units.
  Eigen::Matrix2d factor;
  factor << ellipsoid.factor[0], 0.0, ellipsoid.factor[1], ellipsoid.factor[2];
  const Eigen::Vector2d scale(span[0], span[1]);
  const Eigen::Matrix2d shape =
      scale.asDiagonal() * (factor * factor.transpose()) * scale.asDiagonal();
  const Eigen::Matrix2d inverse = shape.inverse();
  proposal->is_ellipse = true;
  proposal->center.clear();
  proposal->inverse_shape.clear();
  for (int k = 0; k < 2; ++k) {
    const double center = low[k] + ellipsoid.center[k] * span[k], half = std::sqrt(shape(k, k));
    proposal->center.push_back(center);
    proposal->bounds[static_cast<std::size_t>(k)].lower = center - half;
    proposal->bounds[static_cast<std::size_t>(k)].upper = center + half;
    for (int l = 0; l < 2; ++l)
      proposal->inverse_shape.push_back(inverse(k, l));
  }
}

void Scanner::refine(const Vector &residual, const Noise &noise, Proposal *proposal,
                     bool ellipses) const {
  if (proposal->bounds.empty() || proposal->candidate < 0)
    return;
  const Candidate &candidate = library_.candidates[static_cast<std::size_t>(proposal->candidate)];
  if (candidate.columns == 2) {
    refine_pair(residual, proposal);
    return;
  }
  const double corner = noise.clip * noise.scale;
  const Vector clipped =
      residual.cwiseProduct(root_).cwiseMax(-corner).cwiseMin(corner).cwiseProduct(root_);
  const Vector g = library_.g.col(candidate.column);
  const Vector products = g.cwiseProduct(clipped), squares = g.cwiseAbs2().cwiseProduct(weight_);
  proposal->is_ellipse = false;
  const int passes = proposal->bounds.size() > 1 ? 2 : 1;
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t k = 0; k < proposal->bounds.size(); ++k)
      refine_bound(products, squares, k, proposal);
  }
  const bool turned =
      std::any_of(proposal->bounds.begin(), proposal->bounds.end(), [this](const Bound &b) {
        return library_.gates[static_cast<std::size_t>(b.feature)].is_turned;
      });
  if (ellipses && proposal->bounds.size() == 2 && !turned)
    try_ellipse(products, squares, proposal);
}

Vector Scanner::inside(const Proposal &proposal) const {
  Vector mask = Vector::Ones(weight_.size());
  if (proposal.is_ellipse) {
    const Vector &a = library_.gates[static_cast<std::size_t>(proposal.bounds[0].feature)].x;
    const Vector &b = library_.gates[static_cast<std::size_t>(proposal.bounds[1].feature)].x;
    const std::vector<double> &m = proposal.inverse_shape;
    for (Index i = 0; i < mask.size(); ++i) {
      const double da = a(i) - proposal.center[0], db = b(i) - proposal.center[1];
      mask(i) = da * (m[0] * da + m[1] * db) + db * (m[2] * da + m[3] * db) < 1.0 ? 1.0 : 0.0;
    }
    return mask;
  }
  for (const Bound &bound : proposal.bounds) {
    const Vector &x = library_.gates[static_cast<std::size_t>(bound.feature)].x;
    mask.array() *= ((x.array() >= bound.lower) && (x.array() <= bound.upper)).cast<double>();
  }
  return mask;
}

Gate Scanner::gate(const Proposal &proposal) const {
  Gate gate;
  for (const Bound &bound : proposal.bounds)
    add_bounds(library_.gates[static_cast<std::size_t>(bound.feature)], bound.lower, bound.upper,
               &gate);
  gate.is_ellipse = proposal.is_ellipse;
  const std::size_t d = gate.features.size();
  if (gate.is_ellipse) {
    gate.center = proposal.center;
    gate.inverse_shape = proposal.inverse_shape;
    return gate;
  }
  gate.inverse_shape.assign(d * d, 0.0);
  for (std::size_t k = 0; k < d; ++k) {
    const double half = 0.5 * (proposal.bounds[k].upper - proposal.bounds[k].lower);
    gate.center.push_back(0.5 * (proposal.bounds[k].lower + proposal.bounds[k].upper));
    gate.inverse_shape[k * d + k] = 1.0 / std::max(1e-300, half * half);
  }
  return gate;
}

} // namespace rim::diagnose
