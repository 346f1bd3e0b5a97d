// SPDX-License-Identifier: MIT
// Forms searched as sets: several ordinary causes beat one contrived one; which velocity a friction
// acts on; sizes that differ between logs; what a late command would have done, through limits too.
// Seeds are fixed.
#include "diagnose/sets.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>

#include "diagnose/diagnose.hpp"
#include "diagnose/mixed.hpp"
#include "diagnose/response.hpp"
#include "diagnose/roles.hpp"
#include "diagnose_case.hpp"
#include "util/data_path.hpp"

namespace {

using namespace diagnose_case;
using rim::Role;
using rim::diagnose::Diagnosis;
using rim::diagnose::Finding;

// What acts beside inertia on an axis: of velocity, position, log.
using Force = std::function<double(double v, double x, int log)>;

struct Axis {
  std::string velocity = "x.velocity_mps", velocity_unit = "m/s";
  std::string outcome = "force_N", unit = "N";
  double noise = 1.0;
  // Of 300 rows two of the cases below say too little. `make test-long`: more.
  int logs = 3, rows = std::getenv("RIM_LONG") ? 700 : 450;
};

// An axis that follows sums of sines; its force by inverse dynamics of 20 kg without friction.
std::vector<rim::Log> axes(std::uint64_t seed, const Axis &axis, const Force &force) {
  std::vector<rim::Log> out;
  for (int n = 0; n < axis.logs; ++n) {
    Random random(10 * seed + static_cast<std::uint64_t>(n));
    const double p = 6.28 * random.uniform(), q = 6.28 * random.uniform();
    rim::Log log;
    log.path = "axis" + std::to_string(n);
    log.columns = {{"x.position_m", "m", Role::context},
                   {axis.velocity, axis.velocity_unit, Role::context},
                   {"x.warmth_degC", "degC", Role::context},
                   {"z." + axis.outcome, axis.unit, Role::outcome},
                   {"m." + axis.outcome, axis.unit, Role::mean},
                   {"sd." + axis.outcome, axis.unit, Role::sd}};
    log.values.resize(axis.rows, 6);
    for (int i = 0; i < axis.rows; ++i) {
      const double t = 0.05 * i;
      const double x = 0.3 * std::sin(1.1 * t + p) + 0.15 * std::sin(2.3 * t + q);
      const double v = 0.33 * std::cos(1.1 * t + p) + 0.345 * std::cos(2.3 * t + q);
      const double a = -0.363 * std::sin(1.1 * t + p) - 0.7935 * std::sin(2.3 * t + q);
      const double m = 20.0 * a;
      log.values.row(i) << x, v, 20.0 + 3.0 * std::sin(t / 7.0 - p),
          m + force(v, x, n) + axis.noise * random.normal(), m, axis.noise;
      log.t_s.push_back(t);
      log.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
    log.rows_in_file = static_cast<std::uint32_t>(axis.rows);
    out.push_back(log);
  }
  return out;
}

Diagnosis diagnosis(const std::vector<rim::Log> &logs, bool gains = false) {
  rim::diagnose::Options options;
  options.catalogue = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  options.null_runs = 16;
  options.gains = gains;
  return rim::diagnose::diagnose(logs, options, nullptr);
}

const Finding &finding(const Diagnosis &d, const std::string &cause) {
  for (const Finding &f : d.findings) {
    if (f.term.cause == cause)
      return f;
  }
  fail_msg("no finding '%s' among %zu: %s", cause.c_str(), d.findings.size(), d.sentence.c_str());
  std::abort();
}

double sign(double v) { return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0; }

// A force adds to what is measured; the size is positive all the same, and the sentence says so.
void friction_on_a_force(void **) {
  const auto force = [](double v, double, int) { return 6.0 * sign(v) + 9.0 * v + 1.5; };
  const Diagnosis d = diagnosis(axes(1, {}, force));
  const auto &coulomb = finding(d, "coulomb_friction").term;
  assert_near(coulomb.sizes[0].value, 6.0, 4.0 * coulomb.sizes[0].stderror);
  assert_true(coulomb.sizes[0].stderror < 0.3);
  const auto &viscous = finding(d, "viscous_friction").term;
  assert_near(viscous.sizes[0].value, 9.0, 4.0 * viscous.sizes[0].stderror);
  assert_string_equal(coulomb.arguments.at("v").c_str(), "x.velocity_mps");
  assert_non_null(
      std::strstr(finding(d, "coulomb_friction").sentence.c_str(), "opposes the motion with"));
  for (const Finding &f : d.findings)
    assert_true(f.term.cause != "unknown" && f.term.cause != "hinge" && f.p_value < 0.05);
}

// Two quantities each explain less than 3 % of the whole error beside a large law, but most of what
// it leaves.
void trifles_that_together_are_none(void **) {
  Axis axis;
  axis.noise = 0.4;
  const auto force = [](double v, double x, double warmth) {
    return 60.0 * v + 2.5 * x + 0.28 * (warmth - 20.0);
  };
  std::vector<rim::Log> logs = axes(3, axis, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    for (Eigen::Index i = 0; i < log.values.rows(); ++i)
      log.values(i, 3) += force(log.values(i, 1), log.values(i, 0), log.values(i, 2));
  }
  const Diagnosis d = diagnosis(logs);
  std::vector<std::string> arguments;
  for (const Finding &f : d.findings) {
    if (f.term.cause == "coupling")
      arguments.push_back(f.term.arguments.at("f"));
  }
  std::sort(arguments.begin(), arguments.end());
  assert_int_equal(arguments.size(), 2);
  assert_string_equal(arguments[0].c_str(), "x.position_m");
  assert_string_equal(arguments[1].c_str(), "x.warmth_degC");
}

// A friction that would push in one direction is a constant force beside a friction.
void a_load_is_no_friction(void **) {
  const auto force = [](double v, double x, int) {
    return 2.0 * sign(v) + 40.0 + 5.0 * x + 10.0 * v;
  };
  const Diagnosis d = diagnosis(axes(7, {}, force));
  assert_near(finding(d, "bias").term.sizes[0].value, 40.0, 0.5);
  assert_near(finding(d, "coulomb_friction").term.sizes[0].value, 2.0, 0.4);
}

// A temperature that varies little beside its mean makes a product with a speed all the same.
void friction_that_falls_with_warmth(void **) {
  std::vector<rim::Log> logs =
      axes(7, {}, [](double v, double, int) { return 6.0 * sign(v) + 90.0 * v; });
  for (rim::Log &log : logs)
    log.values.col(3) -= 3.0 * log.values.col(1).cwiseProduct(log.values.col(2));
  const Diagnosis d = diagnosis(logs);
  assert_near(finding(d, "product").term.sizes[0].value, -3.0, 0.2);
  for (const Finding &f : d.findings)
    assert_true(f.term.cause != "unknown");
}

// Laws of physics stay alone where a formula beside them takes 2 % of the whole error more off.
void laws_stay_alone(void **) {
  Axis axis;
  axis.noise = 0.7;
  std::vector<rim::Log> logs =
      axes(7, axis, [](double v, double, int) { return 6.0 * sign(v) + 60.0 * v; });
  Random random(11);
  for (rim::Log &log : logs) {
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      const double v = log.values(i, 1), w = random.normal();
      log.values(i, 2) = w;
      log.values(i, 3) += 0.5 * w * std::exp(-v * v / 0.1);
    }
  }
  const Diagnosis d = diagnosis(logs);
  finding(d, "coulomb_friction");
  for (const Finding &f : d.findings)
    assert_true(f.term.form != "expression");
}

// What one temperature exceeds another by is one cause, not two couplings and a constant; and so is
// the square of a quantity.
void differences_and_squares(void **) {
  std::vector<rim::Log> heat = axes(5, {}, [](double, double, int) { return 0.0; }), square = heat;
  for (std::size_t n = 0; n < heat.size(); ++n) {
    heat[n].columns[0] = {"x.room_degC", "degC", Role::context};
    for (Eigen::Index i = 0; i < heat[n].values.rows(); ++i) {
      const double x = heat[n].values(i, 0), room = 18.0 + 9.0 * x;
      heat[n].values(i, 0) = room;
      heat[n].values(i, 3) += 2.0 * (room - heat[n].values(i, 2));
      square[n].values(i, 3) += 70.0 * x * x;
    }
  }
  const Diagnosis of_heat = diagnosis(heat), of_square = diagnosis(square);
  assert_int_equal(of_heat.findings.size(), 1);
  assert_string_equal(of_heat.findings[0].term.form.c_str(), "coupling_difference");
  assert_near(std::abs(of_heat.findings[0].term.sizes[0].value), 2.0, 0.1);
  assert_int_equal(of_square.findings.size(), 1);
  assert_string_equal(of_square.findings[0].term.form.c_str(), "square");
  assert_string_equal(of_square.findings[0].term.cause.c_str(), "product");
  assert_near(of_square.findings[0].term.sizes[0].value, 70.0, 2.0);
}

// What rises, is largest somewhere and falls again is one formula, no sum of curves.
void a_peak_is_one_formula(void **) {
  const Diagnosis d = diagnosis(
      axes(6, {}, [](double, double x, int) { return 40.0 * x * 0.12 / (x * x + 0.0144); }));
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_int_equal(term.basis.size(), 1);
  assert_string_equal(term.basis[0].c_str(), "f*width1/(f^2+width1^2)");
  assert_near(term.shape[0].value, 0.12, 0.01);
}

// Wires that slip: Bouc and Wen's equation, which is not what the engine tries.
void what_slips_is_hysteresis(void **) {
  std::vector<rim::Log> logs = axes(6, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    double s = 0.0;
    for (Eigen::Index i = 1; i < log.values.rows(); ++i) {
      const double by = (log.values(i, 0) - log.values(i - 1, 0)) / 0.08;
      for (int part = 0; part < 8; ++part)
        s += by / 8.0 * (1.0 - 0.5 * s * (by > 0.0 ? 1.0 : -1.0) - 0.5 * std::abs(s));
      log.values(i, 3) += 9.0 * s;
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_string_equal(term.cause.c_str(), "hysteresis");
  assert_true(term.arguments.at("f").rfind("x.position_m%", 0) == 0);
  assert_non_null(std::strstr(d.findings[0].sentence.c_str(), "on the way it came"));
}

// How many forms of hysteresis are tried of each feature.
std::map<std::string, int> held(const std::vector<rim::Log> &logs) {
  const Measured t = rim::diagnose::make_measured(logs);
  const auto causes = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  std::map<std::string, int> out;
  for (const auto &candidate : rim::diagnose::make_library(t, t.channels[0], causes).candidates) {
    if (candidate.term.form == rim::diagnose::kHysteresis)
      out[rim::diagnose::base_feature(candidate.term.arguments.at("f"))] += 1;
  }
  return out;
}

// A velocity has no way that it came; nor has a reading of whose noise the prediction is made, and
// within that noise none has.
void what_has_no_hysteresis(void **) {
  std::vector<rim::Log> logs = axes(9, {}, [](double, double, int) { return 0.0; });
  std::map<std::string, int> count = held(logs);
  const int most = count["x.position_m"];
  assert_true(most > 4);
  assert_int_equal(count["x.velocity_mps"], 0);
  Random random(9);
  std::vector<double> noise;
  for (rim::Log &log : logs) {
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      noise.push_back(0.02 * random.normal());
      log.values(i, 0) += noise.back();
    }
  }
  count = held(logs);
  assert_true(count["x.position_m"] > 0 && count["x.position_m"] <= most);
  const Measured t = rim::diagnose::make_measured(logs);
  const auto causes = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  for (const auto &candidate : rim::diagnose::make_library(t, t.channels[0], causes).candidates) {
    if (candidate.term.form == rim::diagnose::kHysteresis &&
        rim::diagnose::base_feature(candidate.term.arguments.at("f")) == "x.position_m") {
      const std::string &name = candidate.term.arguments.at("f");
      assert_true(std::stod(name.substr(name.find('%') + 1)) > 5.0 * 0.02);
    }
  }
  std::size_t row = 0;
  for (rim::Log &log : logs) {
    for (Eigen::Index i = 0; i < log.values.rows(); ++i)
      log.values(i, 4) += 100.0 * noise[row++];
  }
  assert_int_equal(held(logs)["x.position_m"], 0);
}

// What the links of an arm do to each other says nothing in pairs of features; the friction beside
// it keeps its names.
void three_factors_beside_friction(void **) {
  std::vector<rim::Log> logs =
      axes(9, {}, [](double v, double, int) { return 5.0 * sign(v) + 6.0 * v; });
  for (rim::Log &log : logs) {
    log.columns[0] = {"x.elbow_rad", "rad", Role::context};
    log.columns[2] = {"x.elbow_radps", "rad/s", Role::context};
    const double first = log.values(0, 0);
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      const double t = 0.05 * static_cast<double>(i), q = 1.4 * std::sin(0.83 * t + 9.0 * first),
                   w = 1.162 * std::cos(0.83 * t + 9.0 * first);
      log.values(i, 0) = q;
      log.values(i, 2) = w;
      log.values(i, 3) += 50.0 * log.values(i, 1) * w * std::sin(q);
    }
  }
  const Diagnosis d = diagnosis(logs);
  const auto &formula = finding(d, "unknown").term;
  assert_int_equal(formula.basis.size(), 1);
  assert_int_equal(formula.arguments.size(), 3);
  assert_near(formula.sizes[0].value, 50.0, 1.0);
  assert_near(finding(d, "coulomb_friction").term.sizes[0].value, 5.0, 0.5);
  assert_near(finding(d, "viscous_friction").term.sizes[0].value, 6.0, 1.0);
}

// Two laws that one formula found are two: a product of two features, of which one varies little
// for the form of that name, is claimed as what it is.
void a_product_beside_a_formula(void **) {
  std::vector<rim::Log> logs = axes(9, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    log.columns[1] = {"x.load_kg", "kg", Role::context};
    log.columns[2] = {"x.air_kPa", "kPa", Role::context};
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      const double air = 20.0 + 4.6 * std::sin(0.023 * static_cast<double>(i) + log.values(0, 0)),
                   x = log.values(i, 0);
      log.values(i, 2) = air;
      log.values(i, 3) += 2.0 * air * log.values(i, 1) + 0.6 * air * air * x;
    }
  }
  const Diagnosis d = diagnosis(logs);
  const auto &product = finding(d, "product").term;
  assert_near(product.sizes[0].value, 2.0, 0.1);
  assert_near(finding(d, "unknown").term.sizes[0].value, 0.6, 0.02);
}

// A sine of twice an angle alone is what repeats, of which the cosine is about none.
void a_sine_alone_repeats(void **) {
  std::vector<rim::Log> logs = axes(9, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    log.columns[2] = {"x.tilt_rad", "rad", Role::context};
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      log.values(i, 2) = 1.3 * std::sin(0.031 * static_cast<double>(i) + log.values(0, 0));
      log.values(i, 3) += 8.0 * std::sin(2.0 * log.values(i, 2));
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_string_equal(term.cause.c_str(), "periodic");
  assert_near(term.shape.at(0).value, 2.0, 0.0);
  assert_near(term.sizes[0].value, 8.0, 0.3);
}

// A drive whose voltage its own motion opposes gives less the faster it runs.
void a_limit_that_a_speed_takes_from(void **) {
  std::vector<rim::Log> logs = axes(9, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
      const auto row = static_cast<double>(i);
      const double wanted = 30.0 * std::sin(row / 9.0) + 8.0 * std::sin(row / 31.0),
                   opposed = 12.0 * log.values(i, 1);
      const double noise = log.values(i, 3) - log.values(i, 4);
      log.values(i, 4) = wanted;
      log.values(i, 3) = std::clamp(wanted + opposed, -24.0, 24.0) - opposed + noise;
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_string_equal(term.cause.c_str(), "saturation");
  assert_near(term.shape.at(0).value, 24.0, 0.5);
  assert_near(term.shape.at(1).value, 12.0, 1.0);
  assert_non_null(std::strstr(d.findings[0].sentence.c_str(), "of velocity"));
}

// A bearing that is never near rest has one narrow width of rest: in a wide one, a curve over its
// speed might be called friction.
void what_never_rests_has_one_narrow_width_of_rest(void **) {
  std::vector<rim::Log> logs = axes(7, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs)
    log.values.col(1).array() += 3.0;
  const Measured t = rim::diagnose::make_measured(logs);
  const auto causes = rim::diagnose::read_catalogue(rim::data_path("causes.toml"));
  std::size_t widths = 0;
  for (const auto &candidate : rim::diagnose::make_library(t, t.channels[0], causes).candidates) {
    if (candidate.term.form != "coulomb_smooth")
      continue;
    ++widths;
    assert_near(candidate.term.shape.at(0).value, 0.2 * 3.0, 0.05);
  }
  assert_int_equal(widths, 1);
}

// Neither a missing nor an unknown unit silences a cause.
void friction_without_a_unit(void **) {
  Axis axis;
  axis.velocity = "x.velocity";
  axis.velocity_unit = "";
  axis.outcome = "pull";
  axis.unit = "";
  const Diagnosis d =
      diagnosis(axes(2, axis, [](double v, double, int) { return 5.0 * sign(v) + 6.0 * v; }));
  assert_near(std::abs(finding(d, "coulomb_friction").term.sizes[0].value), 5.0, 0.5);
  assert_near(std::abs(finding(d, "viscous_friction").term.sizes[0].value), 6.0, 2.0);
}

void a_dead_band_is_coulomb_friction(void **) {
  const Diagnosis d = diagnosis(
      axes(3, {}, [](double v, double, int) { return std::abs(v) > 0.1 ? 4.0 * sign(v) : 0.0; }));
  assert_string_equal(d.findings[0].term.cause.c_str(), "coulomb_friction");
  assert_int_equal(d.findings.size(), 1);
}

void sizes_that_differ_between_logs(void **) {
  const double k[] = {4.0, 11.0, 25.0};
  const Diagnosis d =
      diagnosis(axes(4, {}, [&](double v, double, int log) { return k[log] * v * std::abs(v); }));
  const auto &drag = finding(d, "quadratic_drag");
  const auto &size = drag.term.sizes[0];
  assert_int_equal(size.per_log.size(), 3);
  for (std::size_t l = 0; l < 3; ++l)
    assert_near(size.per_log[l], k[l], 1.0);
  assert_near(size.value, 40.0 / 3.0, 1.5);
  assert_near(size.between_logs_sd, 10.7, 6.0);
  assert_non_null(std::strstr(drag.sentence.c_str(), "differs between the logs"));
}

// Two logs of three would promise the third the opposite of what it has: the extension gives
// another log nothing, and that is how it is judged.
void what_makes_another_log_worse_is_kept_from_it(void **) {
  const double k[] = {8.0, 13.0, -11.0};
  const auto logs =
      axes(41, {}, [&](double v, double, int log) { return k[log] * v * std::abs(v); });
  const Diagnosis d = diagnosis(logs, true);
  const auto &drag = finding(d, "quadratic_drag");
  assert_int_equal(drag.term.sizes[0].per_log.size(), 3);
  assert_true(drag.term.sizes[0].new_log == 0.0);
  assert_string_equal(d.gains.at(0).where.c_str(), "all");
  print_message("ratio %.4f: %s\n", d.gains[0].ratio, d.sentence.c_str());
  assert_false(d.gains[0].worse);
  assert_non_null(std::strstr(d.sentence.c_str(), "differs so much between logs"));
}

// A law without a name is a formula, not a table: its sizes and its rivals are there.
void a_formula_where_no_form_explains(void **) {
  const Diagnosis d =
      diagnosis(axes(6, {}, [](double, double x, int) { return 40.0 * x + 900.0 * x * x * x; }));
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_string_equal(term.form.c_str(), "expression");
  assert_string_equal(term.cause.c_str(), "unknown");
  assert_true(!d.findings[0].alternatives.empty());
  double error = 0.0, size = 0.0;
  const auto fresh = rim::diagnose::make_measured(
      axes(7, {}, [](double, double x, int) { return 40.0 * x + 900.0 * x * x * x; }));
  const Vector said = mean_effect(term, fresh, fresh.channels[0].m);
  for (Eigen::Index i = 0; i < said.size(); ++i) {
    const double x = fresh.x(i, fresh.find_feature("x.position_m"));
    const double truth = 40.0 * x + 900.0 * x * x * x;
    error += std::pow(said(i) - truth, 2.0);
    size += truth * truth;
  }
  assert_true(error < 0.002 * size);
}

// More friction in one direction than in the other is one form of two sizes, not two causes.
void friction_by_direction(void **) {
  const Diagnosis d = diagnosis(axes(8, {}, [](double v, double, int) {
    return std::abs(v) < 0.05 ? 0.0 : v > 0.0 ? 9.0 : -5.0;
  }));
  assert_int_equal(d.findings.size(), 1);
  const auto &term = d.findings[0].term;
  assert_string_equal(term.form.c_str(), "coulomb_by_direction");
  assert_near(term.sizes[0].value, 7.0, 0.3);
  assert_near(std::abs(term.sizes[1].value), 2.0, 0.3);
  assert_non_null(std::strstr(d.findings[0].sentence.c_str(), "forwards"));
}

// A new log has a size of its own: the prediction is as wide as the sizes differ.
void a_differing_size_widens_the_prediction(void **) {
  rim::diagnose::Measured t = table(1, 3, 1.0, {{"x.v_mps", "m/s", false, false, false}});
  t.x.col(0) << 0.0, 1.0, 2.0;
  rim::diagnose::Term term;
  term.channel = t.channels[0].name;
  term.cause = term.form = "viscous_friction";
  term.basis = {"-v"};
  term.arguments["v"] = "x.v_mps";
  term.sizes = {{"size", 2.0, 0.3, "", 0.4, {1.6, 2.4}, 2.0}};
  const auto after = extended_prediction({term}, t.channels[0], t);
  assert_near(after.m(2), -4.0, 1e-12);
  assert_near(after.sd(0), 1.0, 1e-12);
  assert_near(after.sd(2), std::sqrt(1.0 + 0.25 * 4.0), 1e-12);
  term.sizes[0].new_log = 0.5; // by so little: and wider by what is left out
  const auto less = extended_prediction({term}, t.channels[0], t);
  assert_near(less.m(2), -1.0, 1e-12);
  assert_near(less.sd(2), std::sqrt(1.0 + 4.0 * (0.25 + 2.25)), 1e-12);
}

// One log with a drag far off: none of the logs would be worse off with what another is predicted
// with than without; with the mean two of them would.
void a_far_off_log_does_not_mislead(void **) {
  const double k[] = {2.0, 2.5, 30.0};
  const Diagnosis d =
      diagnosis(axes(8, {}, [&](double v, double, int log) { return k[log] * v * std::abs(v); }));
  const auto &size = finding(d, "quadratic_drag").term.sizes[0];
  assert_near(size.value, 34.5 / 3.0, 2.0);
  assert_true(size.new_log > 1.0 && size.new_log <= 2.0 * 2.5);
}

// A pump whose current at rest, where its prediction does not vary, is off: no gain of that.
void what_rests_has_no_gain(void **) {
  std::vector<rim::Log> logs = axes(9, {}, [](double, double, int) { return 0.0; });
  for (rim::Log &log : logs) {
    for (int i = 0; i < log.values.rows(); ++i) {
      const bool rests = log.values(i, 0) < -0.15;
      const double noise = log.values(i, 3) - log.values(i, 4);
      log.values(i, 4) = rests ? 8.0 + 0.01 * log.values(i, 0) : 20.0 + log.values(i, 4);
      log.values(i, 3) = log.values(i, 4) + noise - (rests ? 5.0 : 0.0);
    }
  }
  const Diagnosis d = diagnosis(logs);
  assert_false(d.adequate());
  assert_string_equal(d.findings[0].term.cause.c_str(), "bias");
}

void noise_claims_nothing(void **) {
  for (std::uint64_t seed = 21; seed < 25; ++seed) {
    const Diagnosis d = diagnosis(axes(seed, {}, [](double, double, int) { return 0.0; }));
    if (!d.adequate())
      fail_msg("seed %d: %s", static_cast<int>(seed), d.sentence.c_str());
  }
}

void the_own_velocity(void **) {
  const auto logs = axes(5, {}, [](double, double, int) { return 0.0; });
  const Measured t = rim::diagnose::make_measured(logs);
  const std::vector<int> own = rim::diagnose::own_velocity(t, t.channels[0]);
  assert_int_equal(own.size(), 1);
  assert_string_equal(t.features[static_cast<std::size_t>(own[0])].name.c_str(), "x.velocity_mps");
  Channel heat = t.channels[0];
  heat.unit = "degC";
  assert_true(rim::diagnose::own_velocity(t, heat).empty());
}

// Sizes 1 and 3 that are known well: mean 2, spread about sqrt(2); known badly: no spread.
void mixed_sizes(void **) {
  const auto apart = rim::diagnose::mixed_size({1.0, 3.0}, {0.01, 0.01});
  assert_near(apart.mean, 2.0, 1e-3);
  assert_near(apart.between_sd, std::sqrt(2.0), 0.1);
  assert_near(apart.stderror, 1.0, 0.1);
  const auto same = rim::diagnose::mixed_size({1.0, 3.0}, {4.0, 4.0});
  assert_near(same.between_sd, 0.0, 1e-12);
  assert_near(apart.new_log, 2.0, 1e-3);
  assert_near(rim::diagnose::mixed_size({-1.0, -9.0}, {0.01, 0.01}).new_log, -2.0, 0.01);
  assert_near(rim::diagnose::mixed_size({-1.0, 9.0}, {0.01, 0.01}).new_log, 0.0, 1e-12);
  assert_near(same.stderror, 4.0 / std::sqrt(2.0), 1e-9);
  const auto weighted = rim::diagnose::mixed_size({1.0, 2.0}, {1.0, 1000.0});
  assert_near(weighted.mean, 1.0, 0.01);
}

// A response through an acceleration limit is learnt: of command less state, cut.
void a_response_through_a_limit(void **) {
  Measured t =
      table(1, 2000, 0.1, {{"u.v_mps", "m/s", true, false}, {"x.v_mps", "m/s", false, false}});
  const auto limited = [](double u, double v) { return std::clamp(0.2 * (u - v), -0.05, 0.05); };
  double v = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double u = std::sin(i / 15.0) + 0.6 * std::sin(i / 37.0);
    t.x.row(i) << u, v;
    t.channels[0].m(i) = limited(u, v);
    v += t.channels[0].m(i);
  }
  const auto response = rim::diagnose::fit_response(t, t.channels[0]);
  assert_true(response.is_known);
  assert_true(!response.ridges.empty());
  rim::diagnose::Term term;
  term.channel = t.channels[0].name;
  term.cause = term.form = "delay";
  term.response = response.products;
  term.ridges = response.ridges;
  term.shape = {{"delay", 0.3, 0.0, "s"}};
  const Vector column = basis_columns(term, t, t.channels[0].m).col(0);
  double error = 0.0, size = 0.0;
  for (int i = 3; i < 2000; ++i) {
    const double truth = limited(t.x(i - 3, 0), t.x(i, 1)) - t.channels[0].m(i);
    error += std::pow(column(i) - truth, 2.0);
    size += truth * truth;
  }
  assert_true(size > 0.01);
  assert_true(error < 0.02 * size);
}

} // namespace

int main() {
  std::printf("seeds 1 to 9, 21 to 24\n");
  const CMUnitTest tests[] = {
      cmocka_unit_test(friction_on_a_force),
      cmocka_unit_test(trifles_that_together_are_none),
      cmocka_unit_test(a_load_is_no_friction),
      cmocka_unit_test(friction_that_falls_with_warmth),
      cmocka_unit_test(laws_stay_alone),
      cmocka_unit_test(differences_and_squares),
      cmocka_unit_test(a_peak_is_one_formula),
      cmocka_unit_test(a_limit_that_a_speed_takes_from),
      cmocka_unit_test(what_slips_is_hysteresis),
      cmocka_unit_test(what_has_no_hysteresis),
      cmocka_unit_test(three_factors_beside_friction),
      cmocka_unit_test(a_product_beside_a_formula),
      cmocka_unit_test(a_sine_alone_repeats),
      cmocka_unit_test(what_never_rests_has_one_narrow_width_of_rest),
      cmocka_unit_test(friction_without_a_unit),
      cmocka_unit_test(a_dead_band_is_coulomb_friction),
      cmocka_unit_test(sizes_that_differ_between_logs),
      cmocka_unit_test(what_makes_another_log_worse_is_kept_from_it),
      cmocka_unit_test(a_formula_where_no_form_explains),
      cmocka_unit_test(friction_by_direction),
      cmocka_unit_test(a_differing_size_widens_the_prediction),
      cmocka_unit_test(a_far_off_log_does_not_mislead),
      cmocka_unit_test(what_rests_has_no_gain),
      cmocka_unit_test(noise_claims_nothing),
      cmocka_unit_test(the_own_velocity),
      cmocka_unit_test(mixed_sizes),
      cmocka_unit_test(a_response_through_a_limit),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
