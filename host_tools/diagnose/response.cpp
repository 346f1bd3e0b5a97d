// SPDX-License-Identifier: MIT
#include "diagnose/response.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kLeastR2 = 0.98;    // less is no response
constexpr double kEnoughR2 = 0.9999; // more needs no curve
constexpr Index kKnots = 18, kMostRows = 3000;
constexpr int kMostRidges = 4, kSteps = 20, kFollowed = 4;
constexpr double kLeastFall = 0.1; // of the squares: what a curve must take off

// Commands and features that are no angles and no predictions, each of sd 1, as thinned rows.
struct Inputs {
  std::vector<int> features;
  std::vector<bool> is_command;
  Eigen::MatrixXd x;
  Vector sd;
};

struct Product {
  std::string name;
  bool has_command = false;
};

double sd_of(const Vector &x) {
  return std::sqrt(std::max(1e-300, (x.array() - x.mean()).square().mean()));
}

class Fitter {
public:
  Fitter(const Measured &measured, const Channel &channel);
  Response fit();

private:
  double left_share() const { return left_.squaredNorm() / std::max(1e-300, total_); }
  void fit_products();
  Ridge curve_over(const Vector &weights, Vector *fitted) const;
  std::vector<Vector> directions() const;
  double improve(Vector *weights) const;
  bool add_ridge();

  const Measured &measured_;
  std::vector<Index> rows_;
  Vector m_, left_;
  double total_ = 0.0;
  Inputs in_;
  Response out_;
};

Fitter::Fitter(const Measured &measured, const Channel &channel) : measured_(measured) {
  const Index stride = std::max<Index>(1, (channel.m.size() + kMostRows - 1) / kMostRows);
  for (Index i = 0; i < channel.m.size(); i += stride)
    rows_.push_back(i);
  m_ = channel.m(rows_);
  left_ = m_;
  total_ = (m_.array() - m_.mean()).square().sum();
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    const Feature &feature = measured.features[static_cast<std::size_t>(f)];
    if (feature.is_prediction)
      continue;
    in_.features.push_back(f);
    in_.is_command.push_back(feature.is_command);
  }
  in_.x.resize(m_.size(), static_cast<Index>(in_.features.size()));
  in_.sd.resize(in_.x.cols());
  for (Index k = 0; k < in_.x.cols(); ++k) {
    const Vector x = measured.x.col(in_.features[static_cast<std::size_t>(k)])(rows_);
    in_.sd(k) = sd_of(x);
    in_.x.col(k) = x;
  }
}

void Fitter::fit_products() {
  std::vector<Product> products{{"", false}};
  std::vector<Vector> columns{Vector::Ones(m_.size())};
  const auto name = [this](Index k) {
    return measured_.features[static_cast<std::size_t>(in_.features[static_cast<std::size_t>(k)])]
        .name;
  };
  for (Index f = 0; f < in_.x.cols(); ++f) {
    const bool is_command = in_.is_command[static_cast<std::size_t>(f)];
    products.push_back({name(f), is_command});
    columns.push_back(in_.x.col(f));
    for (Index g = 0; is_command && g < in_.x.cols(); ++g) {
      if (in_.is_command[static_cast<std::size_t>(g)] && g < f)
        continue;
      products.push_back({name(f) + "*" + name(g), true});
      columns.push_back(in_.x.col(f).cwiseProduct(in_.x.col(g)));
    }
  }
  const auto p = static_cast<Index>(columns.size());
  if (m_.size() < 3 * p)
    return;
  Eigen::MatrixXd h(m_.size(), p);
  Vector scale(p);
  for (Index k = 0; k < p; ++k) {
    scale(k) = std::max(1e-300, columns[static_cast<std::size_t>(k)].norm());
    h.col(k) = columns[static_cast<std::size_t>(k)] / scale(k);
  }
  Eigen::MatrixXd gram = h.transpose() * h;
  gram.diagonal().array() += 1e-9;
  const Vector beta = gram.ldlt().solve(h.transpose() * m_);
  left_ = m_ - h * beta;
  for (Index k = 0; k < p; ++k) {
    const Product &product = products[static_cast<std::size_t>(k)];
    if (product.has_command)
      out_.products[product.name] = beta(k) / scale(k);
  }
}

// The best curve for what is left over the sum with these weights, by least squares.
Ridge Fitter::curve_over(const Vector &weights, Vector *fitted) const {
  const Vector s = in_.x * weights;
  Ridge ridge;
  const double low = s.minCoeff(), high = s.maxCoeff();
  for (Index k = 0; k < kKnots; ++k)
    ridge.knots.push_back(low + (high - low + 1e-12) * static_cast<double>(k) / (kKnots - 1));
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(kKnots, kKnots);
  Vector right = Vector::Zero(kKnots);
  const double step = (ridge.knots.back() - ridge.knots.front()) / (kKnots - 1);
  for (Index i = 0; i < s.size(); ++i) {
    const double at = (s(i) - low) / step;
    const auto k = std::clamp<Index>(static_cast<Index>(at), 0, kKnots - 2);
    const double b = at - static_cast<double>(k), a = 1.0 - b;
    gram(k, k) += a * a;
    gram(k, k + 1) += a * b;
    gram(k + 1, k) += a * b;
    gram(k + 1, k + 1) += b * b;
    right(k) += a * left_(i);
    right(k + 1) += b * left_(i);
  }
  // Where there are no rows the curve goes on as it comes: second differences are held small.
  for (Index k = 1; k + 1 < kKnots; ++k) {
    const double w = 1e-4 * static_cast<double>(s.size()) / kKnots;
    const Index at[3] = {k - 1, k, k + 1};
    const double d[3] = {1.0, -2.0, 1.0};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        gram(at[i], at[j]) += w * d[i] * d[j];
  }
  gram.diagonal().array() += 1e-9;
  const Vector values = gram.ldlt().solve(right);
  ridge.values.assign(values.data(), values.data() + values.size());
  *fitted = ridge_values(ridge, s);
  return ridge;
}

// Where to look first: along each command, and along the difference of each command and each
// feature, in their own units and in units of their scatter; and along the products' linear part.
std::vector<Vector> Fitter::directions() const {
  std::vector<Vector> out;
  for (Index f = 0; f < in_.x.cols(); ++f) {
    if (!in_.is_command[static_cast<std::size_t>(f)])
      continue;
    Vector w = Vector::Zero(in_.x.cols());
    w(f) = 1.0 / in_.sd(f);
    out.push_back(w);
    for (Index g = 0; g < in_.x.cols(); ++g) {
      for (const double sign : {-1.0, 1.0}) {
        if (g == f)
          continue;
        Vector both = w;
        both(g) = sign / in_.sd(g);
        out.push_back(both);
        both(g) = sign / in_.sd(f);
        out.push_back(both);
      }
    }
  }
  return out;
}

// Gauss and Newton's steps of the weights; the squares left in the end.
double Fitter::improve(Vector *weights) const {
  Vector fitted;
  Ridge ridge = curve_over(*weights, &fitted);
  double best = (left_ - fitted).squaredNorm(), damping = 1e-3;
  for (int step = 0; step < kSteps; ++step) {
    const Vector s = in_.x * *weights;
    Eigen::MatrixXd jacobian(s.size(), in_.x.cols());
    const double width = ridge.knots[1] - ridge.knots[0];
    for (Index i = 0; i < s.size(); ++i) {
      const auto k =
          std::clamp<Index>(static_cast<Index>((s(i) - ridge.knots[0]) / width), 0, kKnots - 2);
      const double slope = (ridge.values[static_cast<std::size_t>(k) + 1] -
                            ridge.values[static_cast<std::size_t>(k)]) /
                           width;
      jacobian.row(i) = slope * in_.x.row(i).cwiseProduct(in_.sd.transpose());
    }
    Eigen::MatrixXd gram = jacobian.transpose() * jacobian;
    gram.diagonal().array() *= 1.0 + damping;
    gram.diagonal().array() += 1e-12 * gram.trace() + 1e-300;
    const Vector move = gram.ldlt().solve(jacobian.transpose() * (left_ - fitted));
    Vector next = *weights + move.cwiseProduct(in_.sd);
    next /= std::max(1e-300, next.cwiseProduct(in_.sd).norm());
    Vector then;
    const Ridge curve = curve_over(next, &then);
    const double now = (left_ - then).squaredNorm();
    if (now < best) {
      const bool is_done = now > best * (1.0 - 1e-4);
      best = now;
      *weights = next;
      ridge = curve;
      fitted = then;
      damping *= 0.3;
      if (is_done)
        break;
    } else {
      damping *= 10.0;
      if (damping > 1e3)
        break;
    }
  }
  return best;
}

bool Fitter::add_ridge() {
  std::vector<std::pair<double, Vector>> found;
  for (Vector &w : directions()) {
    Vector fitted;
    curve_over(w, &fitted);
    found.emplace_back((left_ - fitted).squaredNorm(), std::move(w));
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto &a, const auto &b) { return a.first < b.first; });
  if (found.size() > kFollowed)
    found.resize(kFollowed);
  double best = left_.squaredNorm() * (1.0 - kLeastFall);
  Vector weights;
  for (auto &[squares, w] : found) {
    const double now = improve(&w);
    if (now < best) {
      best = now;
      weights = w;
    }
  }
  if (weights.size() == 0)
    return false;
  Vector fitted;
  Ridge ridge = curve_over(weights, &fitted);
  for (Index k = 0; k < weights.size(); ++k)
    ridge.weights[measured_
                      .features[static_cast<std::size_t>(in_.features[static_cast<std::size_t>(k)])]
                      .name] = weights(k);
  left_ -= fitted;
  out_.ridges.push_back(std::move(ridge));
  return true;
}

Response Fitter::fit() {
  out_.is_tried = true;
  if (std::find(in_.is_command.begin(), in_.is_command.end(), true) == in_.is_command.end() ||
      !(total_ > 0.0))
    return out_;
  fit_products();
  for (int k = 0; k < kMostRidges && left_share() > 1.0 - kEnoughR2; ++k) {
    if (!add_ridge())
      break;
  }
  out_.is_known = left_share() < 1.0 - kLeastR2;
  return out_;
}

} // namespace

Response fit_response(const Measured &measured, const Channel &channel) {
  return Fitter(measured, channel).fit();
}

} // namespace rim::diagnose
