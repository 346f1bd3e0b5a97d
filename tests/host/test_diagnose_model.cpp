// SPDX-License-Identifier: MIT
// The joint robust fit: plain least squares where there are no outliers, weights, outliers that are
// cut, sizes that must be positive, members whose size is given.
#include "diagnose/model.hpp"

#include <cmath>

#include <Eigen/Dense>

#include "diagnose_case.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::Fit;
using rim::diagnose::fit_members;
using rim::diagnose::Member;
using rim::diagnose::Noise;

constexpr Eigen::Index kRows = 400;
constexpr double kCorner = 3.5; // scales, beyond which a residual is cut

Noise noise_of(Eigen::Index rows, double scale = 1.0) {
  Noise noise;
  noise.weight = Vector::Ones(rows);
  noise.scale = scale;
  return noise;
}

Member member(const Eigen::MatrixXd &h) {
  Member out;
  out.h = h;
  return out;
}

struct Data {
  Eigen::MatrixXd h; // 1, a slope, a wave
  Vector y;
};

Data data(double noise_sd) {
  Random random(11);
  Data d;
  d.h.resize(kRows, 3);
  d.y.resize(kRows);
  for (Eigen::Index i = 0; i < kRows; ++i) {
    const double x = static_cast<double>(i) / kRows;
    d.h.row(i) << 1.0, x, std::sin(20.0 * x);
    const double r = std::max(-2.0, std::min(2.0, random.normal()));
    d.y(i) = 0.5 - 2.0 * x + 0.7 * std::sin(20.0 * x) + noise_sd * r;
  }
  return d;
}

void nothing_fitted(void **) {
  const Vector y = (Vector(3) << 1.0, -2.0, 10.0).finished();
  const Fit fit = fit_members(y, {}, noise_of(3));
  assert_values(fit.residual, {1, -2, 10});
  assert_values(fit.clipped, {1, -2, kCorner});
  assert_near(fit.loss, 0.5 + 2.0 + kCorner * 10.0 - 0.5 * kCorner * kCorner, 1e-12);
  assert_true(fit.is_allowed);
  assert_int_equal(fit.beta.size(), 0);
}

void plain_least_squares_without_outliers(void **) {
  const Data d = data(1.0);
  const Fit fit = fit_members(d.y, {member(d.h.leftCols(2)), member(d.h.col(2))}, noise_of(kRows));
  const Vector plain = d.h.colPivHouseholderQr().solve(d.y);
  assert_values(fit.beta, {plain(0), plain(1), plain(2)}, 1e-6);
  assert_true((fit.residual - (d.y - d.h * plain)).cwiseAbs().maxCoeff() < 1e-5);
  assert_near(fit.loss, 0.5 * (d.y - d.h * plain).squaredNorm(), 1e-4);
  const Eigen::MatrixXd covariance = (d.h.transpose() * d.h).inverse();
  assert_true((fit.covariance - covariance).cwiseAbs().maxCoeff() <
              1e-6 * covariance.cwiseAbs().maxCoeff());
  const Eigen::MatrixXd &q = fit.orthonormal;
  assert_int_equal(q.cols(), 3);
  assert_true((q.transpose() * q - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-10);
  assert_true((d.h - q * (q.transpose() * d.h)).cwiseAbs().maxCoeff() < 1e-9);
}

void rows_weigh_what_they_are_worth(void **) {
  Data d = data(1.0);
  Noise noise = noise_of(kRows);
  for (Eigen::Index i = 0; i < kRows; ++i)
    noise.weight(i) = i % 3 == 0 ? 0.0 : i % 3 == 1 ? 0.25 : 1.0;
  for (Eigen::Index i = 0; i < kRows; i += 3)
    d.y(i) = 1e6; // no measurements: they say nothing
  const Vector root = noise.weight.cwiseSqrt();
  const Vector plain =
      (root.asDiagonal() * d.h).colPivHouseholderQr().solve(root.cwiseProduct(d.y));
  const Fit fit = fit_members(d.y, {member(d.h)}, noise);
  assert_values(fit.beta, {plain(0), plain(1), plain(2)}, 1e-6);
}

void outliers_are_cut(void **) {
  Data d = data(0.5);
  const Fit clean = fit_members(d.y, {member(d.h)}, noise_of(kRows, 0.5));
  for (Eigen::Index i = 0; i < kRows; i += 20)
    d.y(i) += 30.0; // one row in twenty, sixty sd off
  const Fit fit = fit_members(d.y, {member(d.h)}, noise_of(kRows, 0.5));
  const Vector plain = d.h.colPivHouseholderQr().solve(d.y);
  assert_true(std::abs(plain(0) - 0.5) > 1.0); // least squares is lost
  assert_true((fit.beta - clean.beta).cwiseAbs().maxCoeff() < 0.35);
  assert_near(fit.clipped.maxCoeff(), 0.5 * kCorner, 1e-12);
}

void sizes_must_be_positive_where_the_form_says_so(void **) {
  const Data d = data(0.1);
  Member slope = member(d.h.col(1));
  slope.is_positive = true;
  const Member rest = member(d.h.col(0));
  assert_false(fit_members(d.y, {rest, slope}, noise_of(kRows)).is_allowed);
  slope.h *= -1.0;
  assert_true(fit_members(d.y, {rest, slope}, noise_of(kRows)).is_allowed);
}

void a_given_member_is_not_fitted(void **) {
  const Data d = data(0.1);
  Member given = member(-2.0 * d.h.col(1) + 0.7 * d.h.col(2));
  given.is_fixed = true;
  const Fit fit = fit_members(d.y, {given, member(d.h.col(0))}, noise_of(kRows));
  assert_int_equal(fit.beta.size(), 1);
  assert_near(fit.beta(0), 0.5, 0.02);
  assert_near(fit.fitted(10), given.h(10, 0) + fit.beta(0), 1e-12);
}

// The same column twice: no explosion, their sum is what one had been.
void members_that_say_the_same(void **) {
  const Data d = data(0.1);
  const Fit one = fit_members(d.y, {member(d.h)}, noise_of(kRows));
  const Fit fit = fit_members(d.y, {member(d.h), member(d.h.col(0))}, noise_of(kRows));
  assert_true(fit.beta.allFinite());
  assert_near(fit.beta(0) + fit.beta(3), one.beta(0), 1e-3);
  assert_near(fit.loss, one.loss, 1e-3);
}

// The unit of a column says nothing about its size: the cube of a place in metres, over a force.
void a_column_of_tiny_numbers_is_fitted(void **) {
  Data d = data(0.0);
  const double tiny = 1e-11;
  d.h.col(2) *= tiny;
  const Fit fit = fit_members(d.y, {member(d.h)}, noise_of(kRows));
  assert_near(fit.beta(2) * tiny, 0.7, 1e-6);
  d.h.col(2).setZero(); // one of nothing gets nothing
  assert_near(fit_members(d.y, {member(d.h)}, noise_of(kRows)).beta(2), 0.0, 0.0);
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(nothing_fitted),
      cmocka_unit_test(plain_least_squares_without_outliers),
      cmocka_unit_test(rows_weigh_what_they_are_worth),
      cmocka_unit_test(outliers_are_cut),
      cmocka_unit_test(a_column_of_tiny_numbers_is_fitted),
      cmocka_unit_test(sizes_must_be_positive_where_the_form_says_so),
      cmocka_unit_test(a_given_member_is_not_fitted),
      cmocka_unit_test(members_that_say_the_same),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
