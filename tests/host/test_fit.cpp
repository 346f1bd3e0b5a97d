// SPDX-License-Identifier: MIT
// The fit is held to least squares solved in the plainest way, to data whose truth is known, and to
// what the flight code makes of its section.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <random>

#include <Eigen/QR>

#include "check.hpp"
#include "image/nominal.h"
#include "train/fit.hpp"
#include "train/fit_gate.hpp"
#include "train/fit_gram.hpp"
#include "train/kernel.hpp"
#include "util/error.hpp"

namespace {

using rim::Matrix;

constexpr unsigned seed = 414;
constexpr Eigen::Index inputs = 5;
constexpr Eigen::Index outputs = 4;
constexpr double noise = 0.01;

struct Data {
  Matrix x, y;
  std::vector<std::uint32_t> run;
};

// Two hidden smooth states, read by five noisy sensors of very different scales, two of them of the
// same quantity with a bias per run; one outcome is curved.
Data make_data(std::uint32_t runs, Eigen::Index rows, unsigned more_seed) {
  std::mt19937_64 random(seed + more_seed);
  std::normal_distribution<double> normal;
  Data d;
  d.x.resize(runs * rows, inputs);
  d.y.resize(runs * rows, outputs);
  for (std::uint32_t r = 0; r < runs; ++r) {
    const double phase = normal(random);
    const double bias = 0.02 * normal(random);
    for (Eigen::Index i = 0; i < rows; ++i) {
      const double t = static_cast<double>(i) / static_cast<double>(rows);
      const double a = std::sin(6.0 * t + phase);
      const double b = t + 0.3 * std::cos(3.0 * t);
      const Eigen::Index at = r * rows + i;
      const double clean[inputs] = {1e4 + 1e3 * a, a + bias, a - bias, 1e-3 * b, a * b};
      const double scale[inputs] = {1e3, 1.0, 1.0, 1e-3, 1.0};
      for (Eigen::Index k = 0; k < inputs; ++k) {
        d.x(at, k) = clean[k] + noise * scale[k] * normal(random);
      }
      const double truth[outputs] = {a + 2.0 * b, a * a + b, 100.0 * b, a + bias};
      const double unit[outputs] = {1.0, 1.0, 100.0, 1.0};
      for (Eigen::Index k = 0; k < outputs; ++k) {
        d.y(at, k) = truth[k] + noise * unit[k] * normal(random);
      }
      d.run.push_back(10u * r);
    }
  }
  return d;
}

rim::FitOptions small_options() {
  rim::FitOptions options;
  options.prototypes = {6};
  options.bandwidth = {0.75};
  return options;
}

double largest_difference(const Matrix &a, const Matrix &b) {
  return (a - b).cwiseAbs().maxCoeff();
}

// Rows of pseudo-data appended to the weighted rows, solved by QR.
Matrix plain_ridge(const Matrix &x, const Matrix &y, const rim::RidgeShape &shape,
                   const Matrix &prior, double ridge) {
  const Eigen::Index n = x.rows();
  const Eigen::Index d = x.cols();
  const Eigen::RowVectorXd mean = x.colwise().mean();
  Matrix maps(y.cols(), 1 + d);
  for (Eigen::Index j = 0; j < y.cols(); ++j) {
    const int e = shape.exclude.empty() ? -1 : shape.exclude[static_cast<std::size_t>(j)];
    Eigen::MatrixXd left = Eigen::MatrixXd::Zero(n + d, d);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n + d);
    left.topRows(n) = x.rowwise() - mean;
    right.head(n) = y.col(j).array() - y.col(j).mean();
    left.bottomRows(d).diagonal() = (ridge * shape.input_error).cwiseSqrt();
    right.tail(d) = left.bottomRows(d) * prior.row(j).tail(d).transpose();
    if (e >= 0) {
      left.col(e).setZero();
    }
    const Eigen::VectorXd a = left.completeOrthogonalDecomposition().solve(right);
    const double at_mean = prior(j, 0) + prior.row(j).tail(d).dot(mean);
    const auto rows = static_cast<double>(n);
    maps.row(j).tail(d) = a.transpose();
    maps(j, 0) = (rows * y.col(j).mean() + at_mean) / (rows + 1.0) - a.dot(mean.transpose());
  }
  return maps;
}

rim::Gates one_gate(std::size_t rows) {
  rim::Gates gates;
  gates.top = 1;
  gates.index.assign(rows, 0);
  gates.weight.assign(rows, 1.0);
  return gates;
}

void maps_solve_the_ridge_problem(void **) {
  print_message("seed %u\n", seed);
  const Data d = make_data(1, 300, 1);
  rim::NominalModel scale;
  rim::standardise_inputs(d.x, scale);
  const Matrix xs = rim::standardised(scale, d.x);
  const auto grams = rim::run_grams(xs, d.y, {0, 300}, one_gate(300), 1);
  for (const bool exclude : {false, true}) {
    rim::RidgeShape shape{inputs, outputs, {}, Eigen::VectorXd::LinSpaced(inputs, 0.1, 2.0)};
    Matrix prior = Matrix::Constant(outputs, 1 + inputs, 0.25);
    if (exclude) {
      shape.exclude = {1, -1, 3, 0};
      for (Eigen::Index j : {0, 2, 3}) {
        prior(j, 1 + shape.exclude[static_cast<std::size_t>(j)]) = 0.0;
      }
    }
    for (const double ridge : {1e-2, 1.0, 1e3}) {
      const Matrix fast = rim::ridge_maps(grams[0], shape, prior, ridge);
      const Matrix plain = plain_ridge(xs, d.y, shape, prior, ridge);
      assert_true(largest_difference(fast, plain) < 1e-7 * (1.0 + plain.cwiseAbs().maxCoeff()));
      const Matrix residual =
          (d.y - xs * fast.rightCols(inputs).transpose()).rowwise() - fast.col(0).transpose();
      const Eigen::VectorXd squares = rim::squared_error(grams[0], shape, fast);
      for (Eigen::Index j = 0; j < outputs; ++j) {
        const double direct = residual.col(j).squaredNorm();
        assert_true(std::abs(squares[j] - direct) <
                    1e-6 * (direct + 1e-3 * d.y.col(j).squaredNorm()));
      }
    }
  }
}

void an_empty_prototype_is_its_prior(void **) {
  const rim::RidgeShape shape{inputs, outputs, {}, Eigen::VectorXd::Ones(inputs)};
  const Matrix prior = Matrix::Random(outputs, 1 + inputs);
  const rim::Gram none = rim::Gram::Zero(1 + inputs + outputs, 1 + inputs + outputs);
  assert_true(largest_difference(rim::ridge_maps(none, shape, prior, 1.0), prior) == 0.0);
}

// The predictions of a left-out run must be those of a model that never saw it. With one prototype
// nothing but the maps depends on the rows, so that the other runs alone must give the same model.
void leaving_a_run_out_equals_never_having_seen_it(void **) {
  const Data d = make_data(4, 200, 2);
  rim::FitOptions options = small_options();
  options.prototypes = {1};
  options.ridge = {1.0};
  options.input_error = {10.0, 0.01, 0.01, 1e-5, 0.01};
  const rim::FitResult all = rim::fit_nominal(d.x, d.y, d.run, options);
  for (std::uint32_t r = 0; r < 4; ++r) {
    Matrix x(600, inputs);
    Matrix y(600, outputs);
    std::vector<std::uint32_t> run;
    for (Eigen::Index i = 0; i < 800; ++i) {
      if (d.run[static_cast<std::size_t>(i)] != 10u * r) {
        x.row(static_cast<Eigen::Index>(run.size())) = d.x.row(i);
        y.row(static_cast<Eigen::Index>(run.size())) = d.y.row(i);
        run.push_back(d.run[static_cast<std::size_t>(i)]);
      }
    }
    const rim::FitResult rest = rim::fit_nominal(x, y, run, options);
    Eigen::RowVectorXd mean(outputs);
    Eigen::RowVectorXd sd(outputs);
    for (Eigen::Index i = 200 * r; i < 200 * (r + 1); i += 17) {
      rim::predict(rest.model, d.x.row(i).data(), mean.data(), sd.data(), nullptr);
      for (Eigen::Index j = 0; j < outputs; ++j) {
        // The offset's pseudo-row stands at the mean of the rows seen: a difference of order 1 / n.
        assert_true(std::abs(mean[j] - all.mean(i, j)) < 3e-3 * all.sd(i, j) + 1e-3 * noise);
      }
    }
  }
}

// Limits: the reading noise of the outcome and that of the inputs it follows from, for outcome 0
// sqrt(1 + 2^2 + 1/3) = 2.3 at most; and for outcome 1 what its curve costs the maps.
void local_linear_maps_reach_the_noise_and_know_it(void **) {
  const Data d = make_data(20, 400, 3);
  rim::FitOptions options = small_options();
  options.prototypes = {32};
  const rim::FitResult fit = rim::fit_nominal(d.x, d.y, d.run, options);
  const double unit[outputs] = {1.0, 1.0, 100.0, 1.0};
  const double most[outputs] = {2.3, 2.5, 1.5, 1.5};
  for (Eigen::Index j = 0; j < outputs; ++j) {
    const double ratio = fit.rmse[static_cast<std::size_t>(j)] / (noise * unit[j]);
    print_message("outcome %d: rmse %.2f of the noise\n", static_cast<int>(j), ratio);
    assert_true(ratio > 1.0 && ratio < most[j]);
    const double z = std::sqrt(((d.y - fit.mean).array() / fit.sd.array()).square().col(j).mean());
    assert_true(z > 0.9 && z < 1.1);
  }
  const rim::KernelReport kernel = rim::compare_kernels(d.x, d.y, d.run, fit, {});
  for (std::size_t j = 0; j < outputs; ++j) {
    assert_true(kernel.local[j] < kernel.kernel[j]);
    assert_true(kernel.rounding[j] > 0.0 && kernel.rounding[j] < 1e-4 * kernel.local[j]);
    assert_true(kernel.kernel[j] < kernel.prototypes[j]);
  }
}

// An offset that only the run's identity tells must stay in the residual, in full.
void a_runs_own_offset_is_not_learnt(void **) {
  Data d = make_data(12, 200, 4);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  double offset = 0.0;
  double squares = 0.0;
  for (Eigen::Index i = 0; i < d.y.rows(); ++i) {
    offset = i % 200 == 0 ? normal(random) : offset;
    d.y(i, 0) += offset;
    squares += offset * offset;
  }
  rim::FitOptions options = small_options();
  options.prototypes = {8, 32};
  const rim::FitResult fit = rim::fit_nominal(d.x, d.y, d.run, options);
  assert_true(fit.rmse[0] > 0.9 * std::sqrt(squares / static_cast<double>(d.y.rows())));
  assert_true((fit.sd.col(0).array() > 0.5).all());
}

void excluded_inputs_do_not_speak(void **) {
  const Data d = make_data(5, 200, 5);
  rim::FitOptions options = small_options();
  options.exclude = {0, -1, 3, 4};
  const rim::FitResult fit = rim::fit_nominal(d.x, d.y, d.run, options);
  for (const Matrix &map : fit.model.maps) {
    for (Eigen::Index j : {0, 2, 3}) {
      assert_true(map(j, options.exclude[static_cast<std::size_t>(j)]) == 0.0);
    }
    assert_true(map.row(1).cwiseAbs().minCoeff() > 0.0);
  }
}

void flight_predicts_what_was_fitted(void **) {
  const Data d = make_data(6, 300, 6);
  const rim::FitResult fit = rim::fit_nominal(d.x, d.y, d.run, small_options());
  const auto compressed =
      rim::compare_kernels(d.x, d.y, d.run, fit, rim::KernelOptions{}).compressed;
  for (const rim::NominalModel *model : {&fit.model, &compressed}) {
    const auto section = rim::nominal_section(*model);
    const auto prototypes = static_cast<unsigned>(model->prototypes.rows());
    assert_int_equal(section.size(), RIM_NOMINAL_BYTES(inputs, outputs, prototypes, model->order));
    const rim::Prediction flight = rim::predict_flight(section, d.x);
    Eigen::RowVectorXd mean(outputs);
    Eigen::RowVectorXd sd(outputs);
    for (Eigen::Index i = 0; i < d.x.rows(); ++i) {
      double far = 0.0;
      rim::predict(*model, d.x.row(i).data(), mean.data(), sd.data(), &far);
      for (Eigen::Index j = 0; j < outputs; ++j) {
        assert_true(std::abs(mean[j] - flight.mean(i, j)) < 1e-5 * (std::abs(mean[j]) + sd[j]));
        assert_true(std::abs(sd[j] - flight.sd(i, j)) < 1e-5 * sd[j]);
      }
      assert_true(std::abs(far - flight.extrapolation[static_cast<std::size_t>(i)]) <
                  1e-5 * (1 + far));
      assert_true(far <= 1.0 + 1e-6);
    }
    Matrix elsewhere = d.x.topRows(1);
    elsewhere.array() *= 10.0;
    assert_true(rim::predict_flight(section, elsewhere).extrapolation[0] > 3.0);
  }
}

void threads_do_not_change_a_bit(void **) {
  const Data d = make_data(7, 200, 7);
  rim::FitOptions options;
  options.prototypes = {2, 5};
  const char *before = std::getenv("RIM_THREADS");
  const std::string restore = before != nullptr ? before : "2";
  setenv("RIM_THREADS", "1", 1);
  const rim::FitResult one = rim::fit_nominal(d.x, d.y, d.run, options);
  setenv("RIM_THREADS", "3", 1);
  const rim::FitResult three = rim::fit_nominal(d.x, d.y, d.run, options);
  setenv("RIM_THREADS", restore.c_str(), 1);
  assert_true(rim::nominal_section(one.model) == rim::nominal_section(three.model));
  assert_true(one.mean == three.mean && one.sd == three.sd);
}

void the_plain_kernel_is_the_weighted_average(void **) {
  const Data d = make_data(3, 60, 8);
  const rim::PlainKernel kernel(d.x, d.y, d.run, 1000, 180);
  rim::NominalModel scale;
  rim::standardise_inputs(d.x, scale);
  const Matrix xs = rim::standardised(scale, d.x);
  const double h = 0.7;
  for (Eigen::Index q = 0; q < d.x.rows(); q += 13) {
    Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(outputs);
    Eigen::RowVectorXd square = mean;
    double sum = 0.0;
    for (Eigen::Index i = 0; i < d.x.rows(); ++i) {
      if (d.run[static_cast<std::size_t>(i)] == d.run[static_cast<std::size_t>(q)]) {
        continue;
      }
      const double w = std::exp(-0.5 * (xs.row(i) - xs.row(q)).squaredNorm() / (h * h));
      sum += w;
      mean += w * d.y.row(i);
      square += w * d.y.row(i).cwiseAbs2();
    }
    Matrix got;
    Matrix variance;
    kernel.predict(d.x.row(q).data(), d.run[static_cast<std::size_t>(q)], {h}, got, variance);
    mean /= sum;
    square = square / sum - mean.cwiseAbs2();
    assert_true((got.row(0) - mean).cwiseAbs().maxCoeff() <
                1e-9 * (1.0 + mean.cwiseAbs().maxCoeff()));
    assert_true((variance.row(0) - square).cwiseAbs().maxCoeff() < 1e-8 * square.maxCoeff());
  }
}

void white_noise_is_told_from_the_signal(void **) {
  const Data d = make_data(10, 1000, 9);
  const std::vector<double> sd = rim::white_noise(d.x, d.run);
  const double truth[inputs] = {10.0, noise, noise, 1e-5, noise};
  for (std::size_t i = 0; i < inputs; ++i) {
    assert_true(sd[i] > 0.95 * truth[i] && sd[i] < 1.05 * truth[i]);
  }
}

template <typename Call> bool is_data_error(const Call &call) {
  try {
    call();
  } catch (const rim::DataError &) {
    return true;
  }
  return false;
}

void rows_are_sampled_as_often_as_they_weigh(void **) {
  Matrix rows(100, 1);
  Eigen::VectorXd weight(100);
  for (Eigen::Index i = 0; i < 100; ++i) {
    rows(i, 0) = static_cast<double>(i);
    weight[i] = i < 80 ? 1.0 : 6.0; // the last fifth weighs 120 of 200
  }
  const Matrix even = rim::sample_rows(rows, {}, 50);
  const Matrix focused = rim::sample_rows(rows, weight, 50);
  assert_int_equal(even.rows(), 50);
  assert_int_equal(focused.rows(), 50);
  assert_int_equal((even.array() >= 80.0).count(), 10);
  assert_int_equal((focused.array() >= 80.0).count(), 30);
  assert_true(rim::sample_rows(rows, {}, 1000) == rows);
}

void bad_data_is_refused(void **) {
  const Data good = make_data(3, 50, 10);
  const auto refused = [&](const auto &change) {
    Data d = good;
    change(d);
    return is_data_error([&] { rim::fit_nominal(d.x, d.y, d.run, small_options()); });
  };
  assert_false(refused([](Data &) {}));
  assert_true(refused([](Data &d) { d.x(3, 2) = std::nan(""); }));
  assert_true(refused([](Data &d) { d.y(3, 2) = std::numeric_limits<double>::infinity(); }));
  assert_true(refused([](Data &d) { d.run.assign(d.run.size(), 1); }));
  assert_true(refused([](Data &d) { d.run.back() = d.run.front(); }));
  assert_true(refused([](Data &d) { d.y.conservativeResize(d.y.rows() - 1, outputs); }));
  assert_true(refused([](Data &d) { d.run.pop_back(); }));
}

void constant_columns_are_harmless(void **) {
  Data d = make_data(4, 100, 11);
  d.x.col(2).setConstant(7.0);
  d.y.col(1).setConstant(-3.0);
  const rim::FitResult fit = rim::fit_nominal(d.x, d.y, d.run, small_options());
  assert_true(fit.mean.allFinite() && fit.sd.allFinite());
  assert_true((fit.mean.col(1).array() + 3.0).abs().maxCoeff() < 1e-6);
  assert_true(rim::predict_flight(rim::nominal_section(fit.model), d.x).mean.allFinite());
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(maps_solve_the_ridge_problem),
      cmocka_unit_test(an_empty_prototype_is_its_prior),
      cmocka_unit_test(leaving_a_run_out_equals_never_having_seen_it),
      cmocka_unit_test(local_linear_maps_reach_the_noise_and_know_it),
      cmocka_unit_test(a_runs_own_offset_is_not_learnt),
      cmocka_unit_test(excluded_inputs_do_not_speak),
      cmocka_unit_test(flight_predicts_what_was_fitted),
      cmocka_unit_test(threads_do_not_change_a_bit),
      cmocka_unit_test(the_plain_kernel_is_the_weighted_average),
      cmocka_unit_test(white_noise_is_told_from_the_signal),
      cmocka_unit_test(rows_are_sampled_as_often_as_they_weigh),
      cmocka_unit_test(bad_data_is_refused),
      cmocka_unit_test(constant_columns_are_harmless),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
