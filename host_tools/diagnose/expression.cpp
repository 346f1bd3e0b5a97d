// SPDX-License-Identifier: MIT
#include "diagnose/expression.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "diagnose/function.hpp"
#include "diagnose/roles.hpp"
#include "diagnose/sets.hpp"
#include "stats/orthogonal.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// Rows that are scanned; fewer of more features than so many.
constexpr Index kMostRows = 1200, kLeastRows = 600, kManyFeatures = 30;
constexpr std::size_t kMostAtoms = 260, kMostProducts = 3, kMostFactors = 3;
constexpr std::size_t kBeam = 3, kFollowed = 24, kLengthened = 12, kRivals = 4, kMostFound = 400;
// Of three factors all products of plain functions are seen, in so many rows.
constexpr std::size_t kMostPlain = 30;
constexpr Index kPlainRows = 400;
constexpr int kWidthSteps = 7, kSwaps = 2;
constexpr double kOfProduct = 2.0; // nats of a product, beside those of its factors and its size
// Nats more for what hardly varies, a temperature of a few degrees, and how much that is of its
// mean: as a factor it would come in for nothing.
constexpr double kConstant = 8.0, kLeastVaried = 0.05;
constexpr double kLeastGain = 3.0; // nats that a product must add
constexpr double kLeastOwn = 1e-4; // of a column's squares beside the columns that are there
constexpr double kWidths[] = {0.25, 0.45, 0.8, 1.4, 2.5}; // of a feature's scale

struct Atom {
  std::size_t input = 0;
  Fn fn = Fn::one;
  double width = 0.0, cost = 0.0;
  int harmonic = 0; // so many times a turn, which is not fitted; 0: the width is
  bool has_free_width() const { return has_width(fn) && harmonic == 0; }
};
using Product = std::vector<Atom>; // empty: a constant

struct State {
  std::vector<Product> products;
  Eigen::MatrixXd columns; // weighted; those that are kept first
  double rss = 0.0, penalty = 0.0, score = -1e300;
};

// Products seen beside columns, with their scores.
struct Scan {
  Eigen::MatrixXf basis; // of the columns
  Eigen::VectorXf left;  // what they leave
  std::vector<std::pair<double, Product>> found;

  void keep(std::size_t most);
};

void Scan::keep(std::size_t most) {
  const auto better = [](const auto &a, const auto &b) { return a.first > b.first; };
  if (found.size() > most) {
    std::nth_element(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(most), found.end(),
                     better);
    found.resize(most);
  }
  std::stable_sort(found.begin(), found.end(), better);
}

class Finder {
public:
  Finder(const Measured &measured, const Channel &channel, const Vector &y,
         const std::vector<Member> &kept, const Noise &noise);
  std::vector<Expression> find();

private:
  struct Beside {
    Vector left;
    Eigen::MatrixXd basis;
  };
  Beside beside(const Eigen::MatrixXd &columns, const std::vector<Index> &rows) const;
  void add_inputs();
  void add_atoms();
  Vector values(const Atom &atom, const Vector &argument) const;
  Vector column(const Product &product) const;
  double penalty_of(const Product &product) const;
  void solve(State *state) const;
  State with(const State &state, const Product &product) const;
  std::vector<Product> promising(const State &state) const;
  std::vector<State> sums_of_two(const State &none) const;
  State swapped(State state) const;
  void see(const Eigen::MatrixXf &block, const std::vector<Product> &of, Scan *scan) const;
  void see_pairs(const Eigen::VectorXf &root, Scan *scan) const;
  void add_plain();
  const Atom &plain(Index k) const {
    return atoms_[static_cast<std::size_t>(plain_[static_cast<std::size_t>(k)])];
  }
  void see_triples(const State &state, Scan *scan) const;
  void lengthen(const Product &product, const Eigen::VectorXf &values, Scan *scan) const;
  State refined(const State &from, State state) const;
  State pruned(State state) const;
  Expression expression(const State &state) const;

  const Measured &measured_;
  const Channel &channel_;
  const Noise &noise_;
  std::vector<Index> rows_; // that are scanned; all are fitted
  double thinning_ = 1.0, ln_rows_ = 0.0;
  Vector root_; // of the weight over the stated sd
  Vector y_;
  Eigen::MatrixXd kept_, x_;
  std::vector<FormulaInput> inputs_;
  std::vector<Atom> atoms_;
  Eigen::MatrixXf values_;        // of the atoms, in the rows of the scan, without weight
  Eigen::MatrixXf pairs_;         // of every two atoms: weighted squares of their product
  std::vector<Index> plain_;      // atoms, by input
  std::vector<Index> plain_rows_; // in which products of three of them are seen
  Eigen::MatrixXf plain_values_;
  double whole_ = 0.0; // squares that what is kept leaves
};

Finder::Finder(const Measured &measured, const Channel &channel, const Vector &y,
               const std::vector<Member> &kept, const Noise &noise)
    : measured_(measured), channel_(channel), noise_(noise) {
  const Index features = std::max<Index>(kManyFeatures, measured.x.cols()),
              most = std::max(kLeastRows, kMostRows * kManyFeatures / features),
              stride = std::max<Index>(1, (y.size() + most - 1) / most);
  for (Index i = 0; i < y.size(); i += stride)
    rows_.push_back(i);
  thinning_ = static_cast<double>(y.size()) / static_cast<double>(rows_.size());
  ln_rows_ = std::log(static_cast<double>(y.size()));
  const Fit fit = fit_members(y, kept, noise);
  const Vector left = fit.residual;
  const Vector weight = noise.weight.cwiseSqrt();
  root_ = weight.cwiseQuotient(channel.sd);
  y_ = left.cwiseProduct(weight);
  Index free = 0;
  for (const Member &member : kept)
    free += member.is_fixed ? 0 : member.h.cols();
  kept_.resize(y_.size(), free);
  Index at = 0;
  for (const Member &member : kept) {
    for (Index k = 0; k < member.h.cols() && !member.is_fixed; ++k)
      kept_.col(at++) = member.h.col(k).cwiseProduct(weight);
  }
  add_inputs();
  add_atoms();
  add_plain();
}

void Finder::add_inputs() {
  for (std::size_t f = 0; f < measured_.features.size(); ++f) {
    const bool is_own = measured_.features[f].name == "m." + channel_.name;
    const Vector x = is_own ? channel_.m : Vector(measured_.x.col(static_cast<Index>(f)));
    const double low = x.minCoeff(), high = x.maxCoeff();
    if (!(high > low))
      continue;
    FormulaInput in;
    in.feature = static_cast<int>(f);
    in.is_own = is_own;
    in.is_signed = low < 0.0;
    in.is_angle = measured_.features[f].is_angle;
    in.turns = !is_own && turns(measured_.features[f], x);
    in.in_degrees = in.turns && turn_in(measured_.features[f].unit) > turn_in("rad");
    in.least = low > 0.0 ? 0.5 * low : 0.0;
    const double mean = x.mean();
    in.hardly_varies = (x.array() - mean).square().mean() < std::pow(kLeastVaried * mean, 2.0);
    in.scale = in.is_signed ? std::sqrt(x.squaredNorm() / static_cast<double>(x.size()))
                            : 0.5 * (high - low);
    inputs_.push_back(in);
  }
  x_.resize(y_.size(), static_cast<Index>(inputs_.size()));
  for (std::size_t k = 0; k < inputs_.size(); ++k)
    x_.col(static_cast<Index>(k)) =
        inputs_[k].is_own ? channel_.m : Vector(measured_.x.col(inputs_[k].feature));
}

// The plainest functions of every feature first, until there are enough.
void Finder::add_atoms() {
  const double ln_features =
      std::log(static_cast<double>(std::max<std::size_t>(1, inputs_.size())));
  for (const Fn fn : kFunctions) {
    for (std::size_t k = 0; k < inputs_.size(); ++k) {
      if (!fits(fn, inputs_[k]))
        continue;
      const double of_constant = inputs_[k].hardly_varies ? kConstant : 0.0;
      Atom atom{k, fn, 0.0, ln_features + cost_of(fn) + of_constant};
      if (!has_width(fn)) {
        atoms_.push_back(atom);
        continue;
      }
      atom.cost += std::log(static_cast<double>(std::size(kWidths))) + 0.5 * ln_rows_;
      for (const double share : kWidths) {
        atom.width = share * inputs_[k].scale;
        if (!inputs_[k].is_angle)
          atoms_.push_back(atom);
      }
      const double radian = inputs_[k].in_degrees ? turn_in("deg") / turn_in("rad") : 1.0;
      if (inputs_[k].turns && (fn == Fn::sine || fn == Fn::cosine)) {
        for (const int harmonic : {1, 2, 3})
          atoms_.push_back({k, fn, radian / harmonic, ln_features + std::log(3.0), harmonic});
      }
    }
    if (atoms_.size() > kMostAtoms)
      break;
  }
  values_.resize(static_cast<Index>(rows_.size()), static_cast<Index>(atoms_.size()));
  for (std::size_t k = 0; k < atoms_.size(); ++k) {
    const Vector v = values(atoms_[k], x_(rows_, static_cast<Index>(atoms_[k].input)));
    const double size = std::max(1e-300, v.cwiseAbs().maxCoeff());
    values_.col(static_cast<Index>(k)) = (v / size).cast<float>();
  }
  const Vector thin_root = root_(rows_);
  const Eigen::MatrixXf squares = values_.cwiseAbs2();
  pairs_ = squares.transpose() * (thin_root.cwiseAbs2().cast<float>().asDiagonal() * squares);
}

// Functions that are factors of three: first what is plain of every feature.
void Finder::add_plain() {
  const auto rank = [](const Atom &atom) {
    return atom.fn == Fn::one                                    ? 0
           : atom.harmonic == 1                                  ? 1
           : atom.fn == Fn::square                               ? 2
           : atom.fn == Fn::signed_square || atom.fn == Fn::sign ? 3
                                                                 : 4;
  };
  for (int wanted = 0; wanted < 4; ++wanted) {
    for (std::size_t k = 0; k < atoms_.size() && plain_.size() < kMostPlain; ++k) {
      if (rank(atoms_[k]) == wanted)
        plain_.push_back(static_cast<Index>(k));
    }
  }
  const Index stride = 1 + (static_cast<Index>(rows_.size()) - 1) / kPlainRows;
  std::vector<Index> of_scan;
  for (Index i = 0; i < static_cast<Index>(rows_.size()); i += stride) {
    of_scan.push_back(i);
    plain_rows_.push_back(rows_[static_cast<std::size_t>(i)]);
  }
  plain_values_ = values_(of_scan, plain_);
}

Vector Finder::values(const Atom &atom, const Vector &argument) const {
  const FormulaInput &in = inputs_[atom.input];
  return argument.unaryExpr([&](double x) { return value_of(atom.fn, in, x, atom.width); });
}

Vector Finder::column(const Product &product) const {
  Vector out = root_;
  for (const Atom &atom : product)
    out = out.cwiseProduct(values(atom, x_.col(static_cast<Index>(atom.input))));
  return out / std::max(1e-300, out.cwiseAbs().maxCoeff());
}

double Finder::penalty_of(const Product &product) const {
  double sum = kOfProduct + 0.5 * ln_rows_;
  for (const Atom &atom : product)
    sum += atom.cost;
  return sum;
}

void Finder::solve(State *state) const {
  state->rss = y_.squaredNorm();
  if (state->columns.cols() > 0) {
    const Vector turned = in_orthonormal_basis(state->columns, y_);
    state->rss = turned.tail(turned.size() - state->columns.cols()).squaredNorm();
  }
  state->penalty = 0.0;
  for (const Product &product : state->products)
    state->penalty += penalty_of(product);
  state->score = -0.5 * state->rss / noise_.divisor() - state->penalty;
}

State Finder::with(const State &state, const Product &product) const {
  State next = state;
  next.products.push_back(product);
  next.columns.conservativeResize(y_.size(), state.columns.cols() + 1);
  next.columns.col(state.columns.cols()) = column(product);
  solve(&next);
  return next;
}

// Products by the fall of the squares that each brings beside the state's columns.
void Finder::see(const Eigen::MatrixXf &block, const std::vector<Product> &of, Scan *scan) const {
  const Eigen::VectorXf s = block.transpose() * scan->left,
                        w = block.colwise().squaredNorm().transpose();
  Eigen::VectorXf own = w;
  if (scan->basis.cols() > 0)
    own -= (scan->basis.transpose() * block).colwise().squaredNorm().transpose();
  for (Index k = 0; k < block.cols(); ++k) {
    if (!(own(k) > static_cast<float>(kLeastOwn) * w(k)))
      continue;
    const double gain = 0.5 * s(k) * s(k) / own(k) * thinning_ / noise_.divisor();
    const double score = gain - penalty_of(of[static_cast<std::size_t>(k)]);
    scan->found.emplace_back(score, of[static_cast<std::size_t>(k)]);
  }
}

// These rows beside columns: what the columns leave of y, and a basis of them.
Finder::Beside Finder::beside(const Eigen::MatrixXd &columns,
                              const std::vector<Index> &rows) const {
  Beside out;
  out.left = y_(rows);
  out.basis.resize(out.left.size(), columns.cols());
  if (columns.cols() > 0) {
    const Eigen::MatrixXd thin = columns(rows, Eigen::all);
    out.basis = orthonormal_basis(thin);
    out.left -= out.basis * (out.basis.transpose() * out.left);
  }
  return out;
}

std::vector<Product> Finder::promising(const State &state) const {
  const Beside state_of = beside(state.columns, rows_);
  Scan scan{state_of.basis.cast<float>(), state_of.left.cast<float>(), {}};
  const Vector thin_root = root_(rows_);
  const Eigen::VectorXf root = thin_root.cast<float>();
  see(root, {Product{}}, &scan);
  std::vector<Product> of;
  for (const Atom &atom : atoms_)
    of.push_back({atom});
  see(root.asDiagonal() * values_, of, &scan);
  see_pairs(root, &scan);
  scan.keep(kFollowed);
  std::vector<Product> shorter;
  for (const auto &[score, product] : scan.found) {
    if (product.size() == kMostFactors - 1 && shorter.size() < kLengthened)
      shorter.push_back(product);
  }
  for (const Product &product : shorter) {
    const Vector thin = column(product)(rows_);
    lengthen(product, thin.cast<float>(), &scan);
  }
  see_triples(state, &scan);
  scan.keep(kFollowed);
  std::vector<Product> out;
  for (auto &[score, product] : scan.found)
    out.push_back(std::move(product));
  return out;
}

// Products of two atoms of two features: all of them by products of matrices, which is several
// times faster than one after the other. O(rows x atoms^2 x columns of the basis).
void Finder::see_pairs(const Eigen::VectorXf &root, Scan *scan) const {
  // Weighted products of every two atoms; above the diagonal alone, for they are symmetric.
  const auto products = [this](const Eigen::VectorXf &weight) -> Eigen::MatrixXf {
    const Eigen::MatrixXf weighted = weight.asDiagonal() * values_;
    Eigen::MatrixXf out(values_.cols(), values_.cols());
    out.triangularView<Eigen::Upper>() = values_.transpose() * weighted;
    return out;
  };
  const Eigen::MatrixXf s = products(root.cwiseProduct(scan->left));
  Eigen::MatrixXf own = pairs_;
  for (Index k = 0; k < scan->basis.cols(); ++k)
    own.triangularView<Eigen::Upper>() -=
        products(root.cwiseProduct(scan->basis.col(k))).cwiseAbs2();
  const double factor = 0.5 * thinning_ / noise_.divisor();
  double least = -1e300;
  for (std::size_t a = 0; a < atoms_.size(); ++a) {
    for (std::size_t b = a + 1; b < atoms_.size(); ++b) {
      const auto i = static_cast<Index>(a), j = static_cast<Index>(b);
      if (atoms_[a].input == atoms_[b].input ||
          !(own(i, j) > static_cast<float>(kLeastOwn) * pairs_(i, j)))
        continue;
      const double score = factor * s(i, j) * s(i, j) / own(i, j) - kOfProduct - 0.5 * ln_rows_ -
                           atoms_[a].cost - atoms_[b].cost;
      if (score > least)
        scan->found.emplace_back(score, Product{atoms_[a], atoms_[b]});
    }
    if (scan->found.size() > kMostFound) {
      scan->keep(kFollowed);
      least = scan->found.back().first;
    }
  }
}

// Products of three plain functions of three features: two speeds and the sine of the angle between
// them say nothing in pairs. O(plain rows x plain atoms^3 x columns of the basis).
void Finder::see_triples(const State &state, Scan *scan) const {
  if (inputs_.size() < kMostFactors)
    return;
  const Vector root = root_(plain_rows_);
  const Beside of = beside(state.columns, plain_rows_);
  const Eigen::MatrixXf squares = plain_values_.cwiseAbs2();
  const double factor =
      0.5 * static_cast<double>(y_.size()) / static_cast<double>(root.size()) / noise_.divisor();
  double least = -1e300;
  const auto products = [](const Vector &weight, const Eigen::MatrixXf &v, Index a) {
    const Eigen::VectorXf w = weight.cast<float>().cwiseProduct(v.col(a));
    Eigen::MatrixXf out(v.cols(), v.cols());
    out.triangularView<Eigen::Upper>() = v.transpose() * (w.asDiagonal() * v);
    return out;
  };
  for (Index a = 0; a < plain_values_.cols(); ++a) {
    const Eigen::MatrixXf s = products(root.cwiseProduct(of.left), plain_values_, a),
                          all = products(root.cwiseAbs2(), squares, a);
    Eigen::MatrixXf own = all;
    for (Index k = 0; k < of.basis.cols(); ++k)
      own -= products(root.cwiseProduct(of.basis.col(k)), plain_values_, a).cwiseAbs2();
    for (Index b = a + 1; b < s.cols(); ++b) {
      for (Index c = b + 1; c < s.cols(); ++c) {
        const Atom &f = plain(a), &g = plain(b), &h = plain(c);
        if (f.input == g.input || g.input == h.input || f.input == h.input ||
            !(own(b, c) > static_cast<float>(kLeastOwn) * all(b, c)))
          continue;
        const double score = factor * s(b, c) * s(b, c) / own(b, c) - kOfProduct - 0.5 * ln_rows_ -
                             f.cost - g.cost - h.cost;
        if (score > least)
          scan->found.emplace_back(score, Product{f, g, h});
      }
    }
    if (scan->found.size() > kMostFound) {
      scan->keep(kFollowed);
      least = scan->found.back().first;
    }
  }
}

// The product, whose values these are, with one atom more of another feature.
void Finder::lengthen(const Product &product, const Eigen::VectorXf &values, Scan *scan) const {
  std::vector<Index> partners;
  std::vector<Product> longer;
  for (std::size_t b = 0; b < atoms_.size(); ++b) {
    const Atom &more = atoms_[b];
    if (std::any_of(product.begin(), product.end(),
                    [&more](const Atom &atom) { return atom.input == more.input; }))
      continue;
    partners.push_back(static_cast<Index>(b));
    longer.push_back(product);
    longer.back().push_back(more);
  }
  if (!partners.empty())
    see(values.asDiagonal() * values_(Eigen::all, partners), longer, scan);
}

// The widths of the last product, each by bisection in the rows of the scan: its size is then
// fitted in all. What the other columns and factors do is the same for every width.
State Finder::refined(const State &from, State state) const {
  Product product = state.products.back();
  const auto may_move = [](const Atom &atom) { return atom.has_free_width(); };
  if (std::none_of(product.begin(), product.end(), may_move))
    return state;
  const Beside of = beside(from.columns, rows_);
  double most = -1.0; // squares that the product takes off
  for (std::size_t k = 0; k < product.size(); ++k) {
    if (!may_move(product[k]))
      continue;
    Product others = product;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
    const Vector factors = column(others)(rows_);
    const Vector argument = x_(rows_, static_cast<Index>(product[k].input));
    const auto fall_of = [&](double width) {
      Atom atom = product[k];
      atom.width = width;
      const Vector x = factors.cwiseProduct(values(atom, argument));
      const double own = x.squaredNorm() - (of.basis.transpose() * x).squaredNorm(),
                   s = x.dot(of.left);
      return own > kLeastOwn * x.squaredNorm() ? s * s / own : 0.0;
    };
    most = std::max(most, fall_of(product[k].width));
    double factor = 1.35;
    for (int step = 0; step < kWidthSteps; ++step) {
      bool moved = false;
      for (const double by : {factor, 1.0 / factor}) {
        const double fall = fall_of(product[k].width * by);
        if (fall > most) {
          most = fall;
          product[k].width *= by;
          moved = true;
          break;
        }
      }
      if (!moved)
        factor = std::sqrt(factor);
    }
  }
  return with(from, product);
}

// Of all sums of two functions the best, exactly: what is best together need not be alone.
std::vector<State> Finder::sums_of_two(const State &none) const {
  const Vector root = root_(rows_);
  Eigen::MatrixXd a = root.asDiagonal() * values_.cast<double>();
  const Beside state_of = beside(none.columns, rows_);
  const Vector &e = state_of.left;
  a -= state_of.basis * (state_of.basis.transpose() * a);
  const Vector s = a.transpose() * e;
  const Eigen::MatrixXd gram = a.transpose() * a;
  std::vector<std::pair<double, std::pair<Index, Index>>> found;
  for (Index i = 0; i < gram.rows(); ++i) {
    for (Index j = i + 1; j < gram.rows(); ++j) {
      const double w = gram(i, i) * gram(j, j) - gram(i, j) * gram(i, j);
      if (!(w > kLeastOwn * gram(i, i) * gram(j, j)))
        continue;
      const double fall =
          (gram(j, j) * s(i) * s(i) - 2.0 * gram(i, j) * s(i) * s(j) + gram(i, i) * s(j) * s(j)) /
          w;
      found.emplace_back(0.5 * fall * thinning_ / noise_.divisor() -
                             penalty_of({atoms_[static_cast<std::size_t>(i)]}) -
                             penalty_of({atoms_[static_cast<std::size_t>(j)]}),
                         std::make_pair(i, j));
    }
  }
  if (found.empty())
    return {};
  const std::size_t most = std::min<std::size_t>(found.size(), kFollowed);
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(most), found.end(),
                    [](const auto &x, const auto &y) { return x.first > y.first; });
  std::vector<State> out;
  for (std::size_t n = 0; n < most; ++n) {
    const State one = with(none, {atoms_[static_cast<std::size_t>(found[n].second.first)]});
    out.push_back(
        refined(one, with(one, {atoms_[static_cast<std::size_t>(found[n].second.second)]})));
  }
  return out;
}

// Every product against the best that could take its place.
State Finder::swapped(State state) const {
  for (int round = 0; round < kSwaps; ++round) {
    const double before = state.score;
    for (std::size_t j = 0; j < state.products.size(); ++j) {
      State less;
      less.columns = state.columns.leftCols(kept_.cols());
      solve(&less);
      for (std::size_t k = 0; k < state.products.size(); ++k) {
        if (k != j)
          less = with(less, state.products[k]);
      }
      for (const Product &product : promising(less)) {
        State other = refined(less, with(less, product));
        if (other.score > state.score + 1e-6)
          state = std::move(other);
      }
    }
    if (state.score < before + kLeastGain)
      break;
  }
  return state;
}

// Products that could as well go do.
State Finder::pruned(State state) const {
  const Index first = kept_.cols();
  for (bool changed = true; changed && state.products.size() > 1;) {
    changed = false;
    for (std::size_t j = 0; j < state.products.size(); ++j) {
      State less;
      less.columns = state.columns.leftCols(first);
      solve(&less);
      for (std::size_t k = 0; k < state.products.size(); ++k) {
        if (k != j)
          less = with(less, state.products[k]);
      }
      if (less.score > state.score - kLeastGain ||
          is_trifle(less.rss - state.rss, less.rss, whole_)) {
        state = std::move(less);
        changed = true;
        break;
      }
    }
  }
  return state;
}

Expression Finder::expression(const State &state) const {
  Expression out;
  out.score = state.score;
  Term &term = out.member.term;
  term.channel = channel_.name;
  term.cause = "unknown";
  term.form = "expression";
  std::vector<std::size_t> named; // inputs by placeholder
  static const char *const kNames[] = {"f", "g", "h", "i", "j", "k", "l", "n", "o"};
  for (const Product &product : state.products) {
    std::string basis;
    for (const Atom &atom : product) {
      auto at = std::find(named.begin(), named.end(), atom.input);
      if (at == named.end())
        at = named.insert(named.end(), atom.input);
      const bool is_own = inputs_[atom.input].is_own;
      const std::string f = is_own ? "m" : kNames[at - named.begin()];
      const Feature &feature =
          measured_.features[static_cast<std::size_t>(inputs_[atom.input].feature)];
      if (!is_own)
        term.arguments[f] = feature.name;
      const std::string w = fmt::format("width{}", term.shape.size() + 1);
      if (atom.has_free_width())
        term.shape.push_back({w, atom.width, 0.0, feature.unit});
      basis +=
          (basis.empty() ? "" : "*") + text_of(atom.fn, inputs_[atom.input], f, w, atom.harmonic);
    }
    term.basis.push_back(basis.empty() ? "1" : basis);
    out.member.part_penalty.push_back(penalty_of(product));
  }
  out.member.penalty = state.penalty;
  const Vector m = channel_.m;
  out.member.h = channel_.sd.cwiseInverse().asDiagonal() * basis_columns(term, measured_, m);
  return out;
}

// What the largest product is made of: formulas that differ in it are rivals.
std::string kind_of(const State &state) {
  std::string kind;
  if (!state.products.empty()) {
    for (const Atom &atom : state.products.front())
      kind += fmt::format("{}:{} ", atom.input, static_cast<int>(atom.fn));
  }
  return kind;
}

std::vector<Expression> Finder::find() {
  if (atoms_.empty())
    return {};
  State none;
  none.columns = kept_;
  solve(&none);
  whole_ = none.rss;
  std::vector<State> beam{none}, all;
  for (std::size_t depth = 0; depth < kMostProducts; ++depth) {
    std::vector<State> next;
    for (const State &state : beam) {
      for (const Product &product : promising(state)) {
        State longer = refined(state, with(state, product));
        if (longer.score > state.score + kLeastGain)
          next.push_back(std::move(longer));
      }
    }
    if (depth == 1) {
      for (State &state : sums_of_two(none))
        next.push_back(std::move(state));
    }
    if (next.empty())
      break;
    std::stable_sort(next.begin(), next.end(),
                     [](const State &a, const State &b) { return a.score > b.score; });
    if (next.size() > kFollowed)
      next.resize(kFollowed);
    all.insert(all.end(), next.begin(), next.end());
    if (next.size() > kBeam)
      next.resize(kBeam);
    beam = std::move(next);
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const State &a, const State &b) { return a.score > b.score; });
  if (!all.empty())
    all.insert(all.begin(), pruned(swapped(all.front())));
  std::vector<Expression> out;
  std::vector<std::string> kinds;
  for (const State &state : all) {
    const std::string kind = kind_of(state);
    if (out.size() == kRivals || std::find(kinds.begin(), kinds.end(), kind) != kinds.end())
      continue;
    kinds.push_back(kind);
    out.push_back(expression(state));
  }
  return out;
}

} // namespace

std::vector<Expression> find_expressions(const Measured &measured, const Channel &channel,
                                         const Vector &y, const std::vector<Member> &kept,
                                         const Noise &noise) {
  return Finder(measured, channel, y, kept, noise).find();
}

} // namespace rim::diagnose
