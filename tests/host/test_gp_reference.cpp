// SPDX-License-Identifier: MIT
// gp against two references on 50 random problems: a dense solution in long double with Eigen, and,
// scikit-learn's GaussianProcessRegressor, where `make test` could fetch it or python3 has it.
// Relative 1e-9.
#include "check.hpp"
#include "confidence.hpp"
#include "gp_fit.hpp"

#include "base/rng.h"
#include "rim/plan/gp.h"

#include <Eigen/Dense>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

constexpr unsigned kSeed = 650;
constexpr int kProblems = 50;
constexpr int kQueries = 20;

using Real = long double;
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;

struct Problem {
  rim_gp_config config{};
  int n = 0;
  std::vector<double> x, y, queries; // [n][dims], [n], [kQueries][dims]
  std::vector<double> mean, var;     // ours
  double log_likelihood = 0.0;
  std::vector<std::uint64_t> memory;
  rim_gp *gp = nullptr;
};

// 1 to 5 dimensions, 5 to 120 points, every kernel; noise so that K stays well conditioned.
Problem draw(int index) {
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, static_cast<std::uint64_t>(index));
  Problem p;
  p.config.kernel = static_cast<std::uint8_t>(index % 3);
  p.config.dims = static_cast<std::uint8_t>(1 + rimi_rng_below(&rng, 5));
  p.n = 5 + static_cast<int>(rimi_rng_below(&rng, 116));
  p.config.points = 128;
  p.config.signal_var = std::exp(2.0 * rimi_rng_normal(&rng));
  p.config.noise_var = p.config.signal_var * std::exp(-5.0 + 3.0 * rimi_rng_uniform(&rng));
  const std::size_t dims = p.config.dims;
  for (std::size_t d = 0; d < dims; ++d)
    p.config.length[d] = 0.15 + 0.85 * rimi_rng_uniform(&rng);
  for (std::size_t i = 0; i < static_cast<std::size_t>(p.n) * dims; ++i)
    p.x.push_back(2.0 * rimi_rng_uniform(&rng) - 1.0);
  for (int i = 0; i < p.n; ++i)
    p.y.push_back(std::sqrt(p.config.signal_var) * rimi_rng_normal(&rng));
  for (std::size_t i = 0; i < kQueries * dims; ++i)
    p.queries.push_back(2.4 * rimi_rng_uniform(&rng) - 1.2);
  p.memory.resize(RIM_GP_SIZE(dims, p.config.points) / 8 + 1);
  assert_int_equal(rim_gp_init(&p.gp, p.memory.data(), p.memory.size() * 8, &p.config), RIM_OK);
  for (int i = 0; i < p.n; ++i) {
    const double *at = p.x.data() + static_cast<std::size_t>(i) * dims;
    assert_int_equal(rim_gp_add(p.gp, at, p.y[static_cast<std::size_t>(i)], 0.0, 0.0), RIM_OK);
  }
  p.mean.resize(kQueries);
  p.var.resize(kQueries);
  assert_int_equal(
      rim_gp_predict_many(p.gp, p.queries.data(), kQueries, p.mean.data(), p.var.data()), RIM_OK);
  p.log_likelihood = rim_gp_log_likelihood(p.gp);
  return p;
}

Real kernel(const rim_gp_config &c, const double *a, const double *b) {
  Real r2 = 0;
  for (std::size_t d = 0; d < c.dims; ++d) {
    const Real step = (Real(a[d]) - Real(b[d])) / Real(c.length[d]);
    r2 += step * step;
  }
  const Real s = c.signal_var, r = std::sqrt(r2);
  if (c.kernel == RIM_GP_SQUARED_EXPONENTIAL)
    return s * std::exp(-r2 / 2);
  const Real q = std::sqrt(Real(c.kernel == RIM_GP_MATERN_3_2 ? 3 : 5)) * r;
  return s * (1 + q + (c.kernel == RIM_GP_MATERN_5_2 ? q * q / 3 : Real(0))) * std::exp(-q);
}

void near(double ours, double reference, double scale, double &worst) {
  const double error = std::fabs(ours - reference) / std::max(std::fabs(reference), scale);
  worst = std::max(worst, error);
  if (!(error <= 1e-9)) {
    fail_msg("%.17g is not %.17g", ours, reference);
  }
}

// The mean's scale is the prior's sd: where it crosses 0 it has no relative accuracy of its own.
void equals_dense_long_double(void **) {
  double worst = 0.0;
  for (int index = 0; index < kProblems; ++index) {
    const Problem p = draw(index);
    const std::size_t dims = p.config.dims;
    Matrix k(p.n, p.n);
    Vector y(p.n);
    for (int i = 0; i < p.n; ++i) {
      y[i] = p.y[static_cast<std::size_t>(i)];
      for (int j = 0; j < p.n; ++j)
        k(i, j) = kernel(p.config, &p.x[static_cast<std::size_t>(i) * dims],
                         &p.x[static_cast<std::size_t>(j) * dims]);
      k(i, i) += Real(p.config.noise_var);
    }
    const Eigen::FullPivLU<Matrix> lu(k); // not by Cholesky: another way
    const Vector alpha = lu.solve(y);
    Vector at(p.n);
    for (std::size_t q = 0; q < kQueries; ++q) {
      for (int i = 0; i < p.n; ++i)
        at[i] = kernel(p.config, &p.x[static_cast<std::size_t>(i) * dims], &p.queries[q * dims]);
      const Real var = Real(p.config.signal_var) - at.dot(lu.solve(at).eval());
      near(p.mean[q], static_cast<double>(at.dot(alpha)), std::sqrt(p.config.signal_var), worst);
      near(p.var[q], static_cast<double>(var), 0.0, worst);
    }
    Real log_determinant = 0;
    for (int i = 0; i < p.n; ++i)
      log_determinant += std::log(std::fabs(lu.matrixLU()(i, i)));
    const Real pi = std::acos(Real(-1));
    const Real expected = -(y.dot(alpha) + log_determinant + Real(p.n) * std::log(2 * pi)) / 2;
    near(p.log_likelihood, static_cast<double>(expected), 1.0, worst);
  }
  print_message("%d problems, %d contexts each: largest relative error %.1e\n", kProblems, kQueries,
                worst);
}

const char *const kScript = R"(
import sys, json, warnings
import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor as G
from sklearn.gaussian_process.kernels import RBF, Matern, ConstantKernel as C
warnings.filterwarnings('ignore')
for line in open(sys.argv[1]):
    p = json.loads(line)
    k = RBF(p['length']) if p['kernel'] == 0 else Matern(p['length'], nu=p['kernel'] + 0.5)
    g = G(C(p['signal_var']) * k, alpha=p['noise_var'], optimizer=None)
    g.fit(np.array(p['x']), p['y'])
    m, c = g.predict(np.array(p['q']), return_cov=True)
    values = list(m) + list(np.diag(c)) + [g.log_marginal_likelihood_value_]
    print(*[repr(float(v)) for v in values])
)";

void write_rows(std::FILE *to, const char *name, const std::vector<double> &v, std::size_t width) {
  std::fprintf(to, "\"%s\":[", name);
  for (std::size_t i = 0; i < v.size(); ++i) {
    std::fprintf(to, "%s%s%.17g%s", i == 0 ? "" : ",", width > 0 && i % width == 0 ? "[" : "", v[i],
                 width > 0 && i % width == width - 1 ? "]" : "");
  }
  std::fputs("]", to);
}

// The tests' own, else the machine's.
std::string python() {
  const char *build = std::getenv("BUILD");
  const std::string own = std::string(build != nullptr ? build : "build") + "/venv/bin/python3";
  return access(own.c_str(), X_OK) == 0 ? own : "python3";
}

void equals_scikit_learn(void **) {
  if (std::system((python() + " -c 'import sklearn' >/dev/null 2>&1").c_str()) != 0) {
    print_message("scikit-learn is not installed: comparison skipped\n");
    skip();
  }
  char folder[] = "/tmp/rim_gp_XXXXXX";
  assert_non_null(mkdtemp(folder));
  const std::string script = std::string(folder) + "/reference.py";
  const std::string data = std::string(folder) + "/problems.jsonl";
  std::FILE *file = std::fopen(script.c_str(), "w");
  assert_non_null(file);
  std::fputs(kScript, file);
  std::fclose(file);
  file = std::fopen(data.c_str(), "w");
  assert_non_null(file);
  std::vector<Problem> problems;
  for (int index = 0; index < kProblems; ++index) {
    problems.push_back(draw(index));
    const Problem &p = problems.back();
    const std::vector<double> length(p.config.length, p.config.length + p.config.dims);
    std::fprintf(file, "{\"kernel\":%d,\"signal_var\":%.17g,\"noise_var\":%.17g,", p.config.kernel,
                 p.config.signal_var, p.config.noise_var);
    write_rows(file, "length", length, 0);
    std::fputs(",", file);
    write_rows(file, "x", p.x, p.config.dims);
    std::fputs(",", file);
    write_rows(file, "y", p.y, 0);
    std::fputs(",", file);
    write_rows(file, "q", p.queries, p.config.dims);
    std::fputs("}\n", file);
  }
  std::fclose(file);
  std::FILE *pipe = popen((python() + " " + script + " " + data).c_str(), "r");
  assert_non_null(pipe);
  double worst = 0.0;
  for (const Problem &p : problems) {
    double value = 0.0;
    for (std::size_t q = 0; q < 2 * kQueries; ++q) {
      assert_int_equal(std::fscanf(pipe, "%lf", &value), 1);
      near(q < kQueries ? p.mean[q] : p.var[q - kQueries], value,
           q < kQueries ? std::sqrt(p.config.signal_var) : 0.0, worst);
    }
    assert_int_equal(std::fscanf(pipe, "%lf", &value), 1);
    near(p.log_likelihood, value, 1.0, worst);
  }
  assert_int_equal(pclose(pipe), 0);
  (void)std::remove(script.c_str());
  (void)std::remove(data.c_str());
  (void)std::remove(folder);
  print_message("scikit-learn: largest relative error %.1e\n", worst);
}

// Data drawn from a process: the fit is at least as likely as the truth and near it.
void fit_finds_the_hyperparameters(void **) {
  rim_gp_config truth{};
  truth.kernel = RIM_GP_MATERN_5_2;
  truth.dims = 2;
  truth.points = 150;
  truth.signal_var = 2.0;
  truth.noise_var = 0.05;
  truth.length[0] = 0.3;
  truth.length[1] = 1.5;
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 1000);
  const int n = truth.points;
  std::vector<double> x(static_cast<std::size_t>(2 * n));
  for (double &v : x)
    v = 2.0 * rimi_rng_uniform(&rng);
  Eigen::MatrixXd k(n, n);
  Eigen::VectorXd white(n);
  for (int i = 0; i < n; ++i) {
    white[i] = rimi_rng_normal(&rng);
    for (int j = 0; j < n; ++j)
      k(i, j) = static_cast<double>(kernel(truth, &x[static_cast<std::size_t>(2 * i)],
                                           &x[static_cast<std::size_t>(2 * j)])) +
                (i == j ? truth.noise_var : 0.0);
  }
  const Eigen::VectorXd y = k.llt().matrixL() * white;
  std::vector<std::uint64_t> memory(RIM_GP_SIZE(2, n) / 8 + 1);
  rim_gp *gp = nullptr;
  assert_int_equal(rim_gp_init(&gp, memory.data(), memory.size() * 8, &truth), RIM_OK);
  for (int i = 0; i < n; ++i)
    assert_int_equal(rim_gp_add(gp, &x[static_cast<std::size_t>(2 * i)], y[i], 0.0, 0.0), RIM_OK);
  const double of_truth = rim_gp_log_likelihood(gp);
  rim_gp_config start = truth;
  start.signal_var = 1.0;
  start.noise_var = 0.5;
  start.length[0] = start.length[1] = 1.0;
  assert_int_equal(rim_gp_set_config(gp, &start), RIM_OK);
  const rim::GpFit fit = rim::fit_gp(gp);
  const rim_gp_config found = rim_gp_get_config(gp);
  print_message("likelihood %.2f -> %.2f (truth %.2f) in %u steps: signal %.2f noise %.3f length "
                "%.2f %.2f\n",
                fit.before, fit.after, of_truth, fit.iterations, found.signal_var, found.noise_var,
                found.length[0], found.length[1]);
  assert_true(fit.converged);
  assert_true(fit.after >= of_truth);
  assert_true(std::fabs(std::log(found.length[0] / truth.length[0])) < 0.5);
  assert_true(std::fabs(std::log(found.noise_var / truth.noise_var)) < 0.5);
  const rim::GpFit again = rim::fit_gp(gp);
  assert_true(again.after >= fit.after);
}

void fit_survives_too_little_data(void **) {
  rim_gp_config c{};
  c.dims = 1;
  c.points = 8;
  c.noise_var = 0.1;
  std::vector<std::uint64_t> memory(RIM_GP_SIZE(1, 8) / 8 + 1);
  for (int n = 0; n < 3; ++n) {
    rim_gp *gp = nullptr;
    assert_int_equal(rim_gp_init(&gp, memory.data(), memory.size() * 8, &c), RIM_OK);
    const double x = 1.0;
    for (int i = 0; i < n; ++i)
      assert_int_equal(rim_gp_add(gp, &x, 1.0, 0.0, 0.0), RIM_OK);
    const rim::GpFit fit = rim::fit_gp(gp);
    assert_true(std::isfinite(fit.after) && fit.after >= fit.before);
  }
}

// New nominal runs exceed confidence 0.9 about one time in ten.
void confidence_is_calibrated(void **) {
  rim_extent_config c{};
  c.dims = 2;
  c.points = 40;
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 2000);
  std::vector<double> contexts(80), var(40, 0.01);
  for (double &v : contexts)
    v = rimi_rng_uniform(&rng);
  rim::set_confidence(c, rim::nominal_maxima(c, contexts, var, 200, 12, 1));
  std::vector<std::uint64_t> memory(RIM_EXTENT_SIZE(2, 40, 9, 1) / 8 + 1);
  rim_extent *extent = nullptr;
  assert_int_equal(rim_extent_init(&extent, memory.data(), memory.size() * 8, &c), RIM_OK);
  int sure = 0;
  for (const double ln_anom : rim::nominal_maxima(c, contexts, var, 200, 12, 9001))
    sure += rim_extent_confidence(extent, ln_anom) > 0.9;
  print_message("confidence above 0.9 in %d of 200 nominal runs; %d knots to ln anom %.1f\n", sure,
                c.knots, c.ln_anom[c.knots - 1]);
  assert_in_range(sure, 4, 42);
}

} // namespace

int main() {
  std::printf("seed %u\n", kSeed);
  const CMUnitTest tests[] = {
      cmocka_unit_test(equals_dense_long_double),
      cmocka_unit_test(equals_scikit_learn),
      cmocka_unit_test(fit_finds_the_hyperparameters),
      cmocka_unit_test(fit_survives_too_little_data),
      cmocka_unit_test(confidence_is_calibrated),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
