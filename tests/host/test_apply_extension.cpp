// SPDX-License-Identifier: MIT
// An extension in use: mended predictions no longer alarm, in the log and through the image.
#include "check.hpp"
#include "diagnose/apply_extension.hpp"

#include <cmath>
#include <cstring>

#include "image/correct.h"
#include "image/image_writer.hpp"
#include "replay/replay.hpp"
#include "toy_log.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"

namespace {

using rim::diagnose::Correction;
using rim::diagnose::Extension;
using rim::diagnose::Gate;
using rim::diagnose::Term;
using rim::diagnose::TermKind;

constexpr double kShift = 1.5; // sd of 0.5 N, where x.place is above 0.5

Gate above_half() {
  Gate gate;
  gate.features = {"x.place"};
  gate.units = {""};
  gate.lower = {0.5};
  gate.upper = {1.0};
  return gate;
}

Term bias(const std::string &channel, double size, const std::string &unit) {
  Term term;
  term.channel = channel;
  term.cause = term.form = "bias";
  term.basis = {"1"};
  term.sizes = {{"size", size, 0.0, unit}};
  return term;
}

std::vector<Extension> mending() {
  Term term = bias("force_N", kShift * 0.5, "N");
  term.gate = above_half();
  return {{"mending.toml", {term}}};
}

std::uint32_t raised(const std::vector<std::uint8_t> &image, const rim::Log &log) {
  return rim::Replayer(image, "toy").replay(log, {}).raised;
}

const std::vector<std::uint8_t> &external_image() {
  static const std::vector<std::uint8_t> image =
      rim::external_image({toy_external(1, 600, 0.0)}, 59, rim::CalibrationOptions{}).image;
  return image;
}

void a_mended_log_no_longer_alarms(void **) {
  for (std::uint64_t seed = 10; seed < 13; ++seed) {
    rim::Log log = toy_external(seed, 600, kShift);
    assert_int_equal(raised(external_image(), log), 1);
    rim::diagnose::apply_extension(mending(), &log);
    assert_int_equal(raised(external_image(), log), 0);
  }
}

void a_mended_image_no_longer_alarms(void **) {
  const rim::Layout layout = rim::layout_of(toy_external(1, 10, 0.0));
  const Correction correction =
      rim::diagnose::correction_section(mending(), layout, 1u << RIM_KIND_SHIFT);
  assert_int_equal(correction.terms, 1);
  assert_true(correction.left_out.empty());
  const auto image = rim::diagnose::with_correction(external_image(), correction.section, "toy");
  for (std::uint64_t seed = 10; seed < 13; ++seed) {
    assert_int_equal(raised(image, toy_external(seed, 600, kShift)), 0);
    assert_int_equal(raised(image, toy_external(seed, 600, 0.0)), 1); // the fault has gone
  }
  // Another content, another id; the same again, the same bytes.
  const rim::LoadedImage before(
      {reinterpret_cast<const char *>(external_image().data()), external_image().size()}, "before");
  const rim::LoadedImage after({reinterpret_cast<const char *>(image.data()), image.size()},
                               "after");
  assert_int_not_equal(before.view().model_id, after.view().model_id);
  assert_int_equal(before.view().sections + 1, after.view().sections);
  assert_true(rim::diagnose::with_correction(image, correction.section, "toy") == image);
}

void predictions_are_mended_row_by_row(void **) {
  rim::Log log = toy_external(3, 200, 0.0);
  const rim::Log before = log;
  Term scatter;
  scatter.channel = "force_N";
  scatter.cause = scatter.form = "noise";
  scatter.kind = TermKind::variance;
  scatter.sizes = {{"ratio", 4.0, 0.0, ""}};
  scatter.gate = above_half();
  Term gain = bias("force_N", 0.1, "");
  gain.basis = {"m + p"};
  gain.arguments = {{"p", "x.place"}};
  Term stuck;
  stuck.channel = "force_N";
  stuck.cause = stuck.form = "stuck";
  stuck.kind = TermKind::stuck;
  rim::diagnose::apply_extension({{"a.toml", {scatter, stuck}}, {"b.toml", {gain}}}, &log);
  for (Eigen::Index i = 0; i < log.values.rows(); ++i) {
    const double place = before.values(i, 0), m = before.values(i, 2);
    assert_true(std::abs(log.values(i, 2) - (m + 0.1 * (m + place))) < 1e-12);
    assert_true(std::abs(log.values(i, 3) - (place >= 0.5 ? 1.0 : 0.5)) < 1e-12);
    assert_true(log.values(i, 0) == place && log.values(i, 1) == before.values(i, 1));
  }
}

void a_log_without_sd_and_a_feature_that_never_changes(void **) {
  rim::Log log = toy_external(3, 50, 0.0);
  log.columns.pop_back();
  log.values.conservativeResize(Eigen::NoChange, 3);
  log.values.col(0).setConstant(0.75);
  const rim::Log before = log;
  rim::diagnose::apply_extension(mending(), &log);
  for (Eigen::Index i = 0; i < log.values.rows(); ++i)
    assert_true(std::abs(log.values(i, 2) - before.values(i, 2) - kShift * 0.5) < 1e-12);
}

template <class Body> void assert_refused(Body body, const char *part) {
  try {
    body();
  } catch (const rim::DataError &error) {
    if (std::strstr(error.what(), part) == nullptr)
      fail_msg("'%s' does not contain '%s'", error.what(), part);
    return;
  }
  fail_msg("nothing was thrown; expected '%s'", part);
}

void what_cannot_ride_is_said(void **) {
  const rim::Layout layout = rim::layout_of(toy_log(1, 10));
  std::vector<Extension> all = {{"x.toml", {}}};
  std::vector<Term> &terms = all[0].terms;
  terms.push_back(bias("position_a_m", 0.25, "m"));
  terms.push_back(bias("speed_mps", -0.5, "m/s")); // the same region: everywhere
  terms.push_back(bias("position_a_m", 1.0, "m"));
  terms.back().gate.features = {"s.speed_mps", "u.push"};
  terms.back().gate.units = {"m/s", ""};
  terms.back().gate.is_ellipse = true;
  terms.back().gate.lower = {-1.0, -1.0};
  terms.back().gate.upper = {1.0, 1.0};
  terms.back().gate.center = {0.0, 0.0};
  terms.back().gate.inverse_shape = {1.0, 0.0, 0.0, 1.0};
  terms.push_back(bias("force_N", 1.0, "N"));
  terms.push_back(bias("speed_mps", 1.0, "m/s"));
  terms.back().basis = {"m"};
  terms.push_back(bias("speed_mps", 1.0, "m/s"));
  terms.back().gate.features = {"t_s"};
  terms.back().gate.units = {"s"};
  terms.back().gate.lower = {0.0};
  terms.back().gate.upper = {1.0};
  const Correction made = rim::diagnose::correction_section(all, layout, 1u << RIM_KIND_SHIFT);
  assert_int_equal(made.terms, 3);
  assert_int_equal(made.left_out.size(), 3);
  assert_non_null(std::strstr(made.left_out[0].c_str(), "x.toml: force_N: bias: the image has no "
                                                        "such outcome"));
  assert_non_null(std::strstr(made.left_out[1].c_str(), "only constant shifts"));
  assert_non_null(std::strstr(made.left_out[2].c_str(), "no feature 't_s'"));
  rim_correct view;
  std::vector<std::uint64_t> aligned((made.section.size() + 7) / 8);
  std::memcpy(aligned.data(), made.section.data(), made.section.size());
  const auto *bytes = reinterpret_cast<const std::uint8_t *>(aligned.data());
  assert_int_equal(rimi_correct_open(&view, bytes, made.section.size()), RIM_OK);
  assert_int_equal(view.regions, 2);
  assert_int_equal(view.kinds, 1u << RIM_KIND_SHIFT);
  const double inside[4] = {0.5, 0.0, 0.0, 0.5}, outside[4] = {0.9, 0.0, 0.0, 0.9};
  const double zero[3] = {0.0, 0.0, 0.0};
  double mean[3];
  assert_int_equal(rimi_correct_mean(&view, inside, zero, mean), RIM_OK);
  assert_true(mean[0] == 1.25 && mean[1] == 0.0 && mean[2] == -0.5);
  assert_int_equal(rimi_correct_mean(&view, outside, zero, mean), RIM_OK);
  assert_true(mean[0] == 0.25 && mean[1] == 0.0 && mean[2] == -0.5);
}

void more_regions_than_fit(void **) {
  const rim::Layout layout = rim::layout_of(toy_log(1, 10));
  std::vector<Extension> all = {{"x.toml", {}}};
  for (int i = 0; i < 10; ++i) {
    Term term = bias("speed_mps", 1.0, "m/s");
    term.gate.features = {"u.push"};
    term.gate.units = {""};
    term.gate.lower = {0.1 * i};
    term.gate.upper = {0.1 * i + 0.05};
    all[0].terms.push_back(term);
  }
  const Correction made = rim::diagnose::correction_section(all, layout, 1u << RIM_KIND_SHIFT);
  assert_int_equal(made.terms, 8);
  assert_int_equal(made.left_out.size(), 2);
  assert_true(rim::diagnose::correction_section({}, layout, 1u).section.empty());
}

// A trained image with a correction of what the commands let it expect: what the run's own effects
// allow is not said, what they do not is a wrong model.
void a_trained_image_takes_it(void **) {
  std::vector<rim::Log> logs;
  for (std::uint64_t seed = 1; seed <= 24; ++seed)
    logs.push_back(toy_log(seed));
  const auto image = rim::make_image(rim::train(logs, rim::TrainOptions{}).plan);
  const rim::Layout layout = rim::layout_of(logs[0]);
  const auto corrected = [&](const char *channel, double size, const char *unit) {
    const std::vector<Extension> all = {{"x.toml", {bias(channel, size, unit)}}};
    return rim::diagnose::with_correction(
        image, rim::diagnose::correction_section(all, layout, 1u << RIM_KIND_SHIFT).section, "toy");
  };
  const rim::Log healthy = toy_log(55);
  assert_int_equal(raised(image, healthy), 0);
  assert_int_equal(raised(corrected("speed_mps", 1e-4, "m/s"), healthy), 0);
  rim::Replayer replayer(corrected("speed_mps", 1.0, "m/s"), "toy");
  const rim::ReplayedLog result = replayer.replay(healthy, {});
  assert_int_equal(result.raised, 1);
  assert_int_equal(result.first.channel[0], 2);
  assert_true(std::abs(result.last.shift[0] + 1.0) < 0.4); // its own error comes on top
}

void what_does_not_fit_is_refused(void **) {
  rim::Log log = toy_external(3, 50, 0.0);
  std::vector<Extension> other = mending();
  other[0].path = "/nonexistent/other.toml";
  other[0].terms[0].channel = "torque_Nm";
  assert_refused([&] { rim::diagnose::apply_extension(other, &log); }, "other.toml");
  assert_refused(
      [&] {
        (void)rim::diagnose::with_correction({1, 2, 3}, {}, "short.rim");
      },
      "short.rim");
  assert_refused([] { (void)rim::diagnose::read_extensions({"/nonexistent/e.toml"}); }, "e.toml");
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_mended_log_no_longer_alarms),
      cmocka_unit_test(a_mended_image_no_longer_alarms),
      cmocka_unit_test(predictions_are_mended_row_by_row),
      cmocka_unit_test(a_log_without_sd_and_a_feature_that_never_changes),
      cmocka_unit_test(what_cannot_ride_is_said),
      cmocka_unit_test(more_regions_than_fit),
      cmocka_unit_test(a_trained_image_takes_it),
      cmocka_unit_test(what_does_not_fit_is_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
