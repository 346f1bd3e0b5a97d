// SPDX-License-Identifier: MIT
// Noise models: what is known to be in the healthy residuals is found within stated tolerances,
// what is not there is not, and no fault hides in the effects of a run.
#include "check.hpp"
#include "made_noise.hpp"

extern "C" {
#include "image/noise.h"
}

namespace {

constexpr std::uint64_t kSeed = 5000; // of the first run everywhere here
constexpr std::size_t kRuns = 60;

bool near(double found, double truth, double share) {
  if (std::fabs(found - truth) <= share * std::fabs(truth))
    return true;
  print_message("%.4g where %.4g is true, beyond %.0f %%\n", found, truth, 100.0 * share);
  return false;
}

rim::ChannelNoise fit_one(const MadeNoise &made, std::size_t runs = kRuns) {
  return fit_made(made, made_noises(kSeed, runs, made)).channels.front();
}

// The section as flight reads it; it must outlive what is returned.
rim_noise opened(const rim::NoiseModel &noise, const std::vector<std::uint8_t> &section) {
  rim_noise view{};
  assert_int_equal(rimi_noise_open(&view, section.data(), section.size(),
                                   static_cast<std::uint32_t>(noise.channels.size()),
                                   static_cast<std::uint32_t>(noise.means)),
                   RIM_OK);
  return view;
}

void white_noise_is_white(void **) {
  MadeNoise made;
  made.s = 0.2;
  const rim::ChannelNoise c = fit_one(made);
  assert_true(near(c.s, 0.2, 0.03)); // 14400 blocks know it to 0.6 %
  assert_true(c.rho < 0.03);
  for (const double ln_sigma : c.ln_sigma)
    assert_true(std::fabs(ln_sigma) < 0.03);
  assert_true(c.limit == 0.0);
  assert_true(c.effect_sd < 0.15 * 0.2); // the mean of a run alone varies by 1 / sqrt(240)
}

void autocorrelation_is_found(void **) {
  for (const double rho : {0.3, 0.6, 0.9}) {
    MadeNoise made;
    made.rho = rho;
    made.s = 0.2;
    const rim::ChannelNoise c = fit_one(made);
    print_message("rho %.2f: found %.3f, s %.4f\n", rho, c.rho, c.s);
    assert_true(std::fabs(c.rho - rho) < 0.04);
    assert_true(near(c.s, 0.2, 0.04));
    assert_true(c.limit == 0.0);
  }
}

// An actuator saturates now and then: two blocks are a dozen standard deviations off. They hardly
// change the noise, and flight reads the limit.
void a_few_blocks_far_off_are_limited(void **) {
  for (const double rho : {0.0, 0.6}) {
    MadeNoise made;
    made.rho = rho;
    made.s = 0.2;
    std::vector<MadeRun> runs = made_noises(kSeed, kRuns, made);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      const Eigen::Index first = 10 + static_cast<Eigen::Index>(r) % 50;
      for (Eigen::Index b = first; b + 1 < made.blocks; b += 80) {
        runs[r].residual(b, 0) += 12.0 * made.s;
        runs[r].residual(b + 1, 0) += 8.0 * made.s;
      }
    }
    const rim::NoiseModel noise = fit_made(made, runs);
    const rim::ChannelNoise &c = noise.channels.front();
    print_message("rho %.2f: found %.3f, s %.4f, limit %.1f\n", rho, c.rho, c.s, c.limit);
    assert_true(c.limit >= NOISE_LEAST_LIMIT);
    assert_true(near(c.s, made.s, 0.35)); // that of all that was measured is 1.9 times as large
    assert_true(std::fabs(c.rho - rho) < 0.2);
    const std::vector<std::uint8_t> bytes = rim::noise_section(noise);
    const rim_noise view = opened(noise, bytes);
    const noise_channel flown = rimi_noise_channel(&view, 0);
    assert_true(static_cast<double>(flown.limit) == c.limit && flown.active > 0.5F);
  }
}

// Every other ten blocks are missing: noise that lasts is not what it was before, nor anything new.
void noise_with_gaps_is_found(void **) {
  MadeNoise made;
  made.blocks = 480;
  made.rho = 0.9;
  made.s = 0.2;
  std::vector<MadeRun> runs = made_noises(kSeed, kRuns, made);
  for (MadeRun &run : runs) {
    rim::BlockRun &blocks = run.blocks;
    Eigen::Index kept = 0;
    for (Eigen::Index b = 0; b < made.blocks; ++b) {
      if (b / 10 % 2 != 0)
        continue;
      blocks.follows[static_cast<std::size_t>(kept)] = b % 10 != 0;
      blocks.time_s[kept] = blocks.time_s[b];
      for (rim::Matrix *m :
           {&blocks.context, &blocks.outcome, &blocks.means, &run.predicted, &run.residual})
        m->row(kept) = m->row(b).eval();
      ++kept;
    }
    for (rim::Matrix *m :
         {&blocks.context, &blocks.outcome, &blocks.means, &run.predicted, &run.residual})
      m->conservativeResize(kept, Eigen::NoChange);
    blocks.time_s.conservativeResize(kept);
    blocks.follows.resize(static_cast<std::size_t>(kept));
    run.disturbance.conservativeResize(kept);
  }
  const rim::NoiseModel noise = fit_made(made, runs);
  assert_true(noise.with_gaps && rim::noise_section(noise).front() == NOISE_LAYOUT_GAPS);
  const std::size_t half = kRuns / 2; // of the runs suffices
  std::vector<MadeRun> some = made_noises(kSeed, half, MadeNoise{});
  some.insert(some.end(), runs.begin(), runs.begin() + static_cast<std::ptrdiff_t>(half));
  assert_true(fit_made(made, some).with_gaps);
  some.push_back(some.front());
  assert_false(fit_made(made, some).with_gaps);
  assert_true(rim::noise_section(fit_made(made, some)).front() == NOISE_LAYOUT);
  const rim::ChannelNoise &c = noise.channels.front();
  print_message("found rho %.3f, s %.4f\n", c.rho, c.s);
  assert_true(std::fabs(c.rho - made.rho) < 0.04);
  assert_true(near(c.s, made.s, 0.04));
}

// Standard deviation of the mean of n blocks of AR(1) noise, times sqrt(n).
double of_sums(double rho, double sd, double n) {
  const double all = sd * sd * (1.0 + rho) / (1.0 - rho);
  return std::sqrt(all -
                   2.0 * sd * sd * rho * (1.0 - std::pow(rho, n)) / (n * std::pow(1.0 - rho, 2)));
}

// Quick noise hides how slowly the rest wanders: what counts is how large sums of many blocks are.
void noise_of_two_speeds_is_as_large_as_its_sums(void **) {
  constexpr double kBlocks = 16.0;
  MadeNoise made;
  made.blocks = 512; // of which there are enough sums of 16 and of 32 in a run
  made.s = 0.2;
  made.slow_sd = 0.15;
  made.slow_rho = 0.9;
  const rim::ChannelNoise c = fit_one(made);
  const double found = of_sums(c.rho, c.s / std::sqrt(1.0 - c.rho * c.rho), kBlocks);
  const double truth = std::hypot(0.2, of_sums(0.9, 0.15, kBlocks));
  print_message("rho %.3f, s %.4f; sums as of sd %.3f, truly %.3f\n", c.rho, c.s, found, truth);
  assert_true(near(found, truth, 0.15));
}

// A model errs for as long as a manoeuvre lasts, and is right in between.
void noise_that_lasts_while_predictions_move_is_found(void **) {
  for (const double rho : {0.0, 0.85}) {
    MadeNoise made;
    made.blocks = 432;
    made.rests = true;
    made.s = 0.2;
    made.rho_moving = rho;
    const rim::ChannelNoise c = fit_one(made);
    print_message("rho %.2f while predictions move: found %.3f, %.3f elsewhere, s %.4f\n", rho,
                  c.rho_of(true), c.rho, c.s);
    if (rho > 0.0)
      assert_true(c.rho_of(true) > c.rho + 0.1 && std::fabs(c.rho_of(true) - rho) < 0.1);
    else
      assert_true(c.rho_of(true) < 0.03);
  }
}

// Raw fields of a run as training and flight make them.
Eigen::MatrixXd raw_fields(const rim::NoiseModel &noise, const rim::ChannelNoise &c,
                           const MadeRun &run) {
  Eigen::MatrixXd raw(run.residual.rows(), 4 + run.blocks.means.cols());
  raw.col(0).setOnes();
  raw.col(1) = ((run.predicted.col(0).array() - c.p_center) / c.p_scale).max(-4.0).min(4.0);
  raw.col(2) = (1.0 - (-(run.blocks.time_s.array() / noise.trend_s).min(40.0)).exp()) *
               noise.trend_s / noise.run_s;
  raw.col(3) = (-(run.blocks.time_s.array() / noise.decay_s)).exp();
  raw.rightCols(run.blocks.means.cols()) = run.blocks.means;
  return raw;
}

// The spread of 60 draws is known to 9 %; the model raises its square by 3 / 60 besides.
void effects_of_a_run_are_found(void **) {
  MadeNoise made;
  made.offset_sd = 0.5;
  made.rho = 0.5;
  made.s = 0.2;
  const std::vector<MadeRun> runs = made_noises(kSeed, kRuns, made);
  double squares = 0.0;
  for (const MadeRun &run : runs)
    squares += run.offset[0] * run.offset[0] / static_cast<double>(kRuns);
  const rim::NoiseModel noise = fit_made(made, runs);
  const rim::ChannelNoise &c = noise.channels.front();
  print_message("offsets: %.3f drawn, %.3f found\n", std::sqrt(squares), c.effect_sd);
  assert_true(near(c.effect_sd, std::sqrt(squares), 0.12));
  assert_true(near(c.s, 0.2, 0.05));
  assert_true(std::fabs(c.rho - 0.5) < 0.04);
  // The strongest field hardly changes in the run.
  const Eigen::VectorXd first = raw_fields(noise, c, runs[0]) * c.combination.row(0).transpose();
  assert_true((first.array() - first.mean()).abs().mean() < 0.15 * std::fabs(first.mean()));
  MadeNoise gains = made;
  gains.offset_sd = 0.0;
  gains.gain_sd = 0.3;
  const rim::ChannelNoise g = fit_one(gains);
  assert_true(near(g.effect_sd, 0.3, 0.3));
  assert_true(std::fabs(g.combination(0, 1)) > 4.0 * std::fabs(g.combination(0, 0)));
}

void a_scale_that_depends_on_the_context_is_found(void **) {
  MadeNoise made;
  made.s = 0.2;
  made.ln_sigma = 0.4;
  const rim::ChannelNoise c = fit_one(made);
  print_message("ln sigma per sd of the prediction: %.3f\n", c.ln_sigma[0]);
  assert_true(near(c.ln_sigma[0], 0.4, 0.12)); // a ridge draws it towards 0
  assert_true(std::fabs(c.ln_sigma[1]) < 0.04);
}

// It is the scale of what is new: what a manoeuvre did stays as it was when the manoeuvre is over.
void noise_that_lasts_has_the_scale_of_what_is_new(void **) {
  for (const double rho : {0.6, 0.95}) {
    MadeNoise made;
    made.s = 0.2;
    made.rho = rho;
    made.ln_sigma = 0.4;
    const rim::ChannelNoise c = fit_one(made);
    print_message("rho %.3f, s %.4f, ln sigma per sd of the prediction: %.3f\n", c.rho, c.s,
                  c.ln_sigma[0]);
    assert_true(std::fabs(c.rho - rho) < 0.04);
    assert_true(near(c.s, 0.2, 0.06) && near(c.ln_sigma[0], 0.4, 0.12));
  }
}

// What six runs say of a scale is what they happened to do: it is drawn to none.
void few_runs_teach_little_of_a_scale(void **) {
  MadeNoise made;
  made.s = 0.2;
  made.ln_sigma = 0.4;
  const double few = fit_one(made, 6).ln_sigma[0], many = fit_one(made, 30).ln_sigma[0];
  print_message("ln sigma per sd of the prediction: %.3f by 6 runs, %.3f by 30\n", few, many);
  assert_true(few < 0.2 && many > 0.33);
}

// Where the predictions move quickly, the errors of their timing are large.
void a_scale_that_depends_on_the_activity_is_found(void **) {
  MadeNoise made;
  made.s = 0.2;
  made.ln_active = 0.5;
  const rim::ChannelNoise c = fit_one(made);
  print_message("ln sigma per activity: %.3f\n", c.ln_sigma[2]);
  assert_true(near(c.ln_sigma[2], 0.5, 0.15));
  assert_true(std::fabs(c.ln_sigma[0]) < 0.04 && std::fabs(c.ln_sigma[3]) < 0.04);
}

// What part of a shape's evidence is left when the effects of a run are integrated out: of white
// noise, m'(I + BB')^-1 m / m'm.
double left_of(const Eigen::VectorXd &shape, const Eigen::MatrixXd &fields) {
  const Eigen::Index n = shape.size();
  const Eigen::MatrixXd v = Eigen::MatrixXd::Identity(n, n) + fields * fields.transpose();
  return shape.dot(v.llt().solve(shape)) / shape.squaredNorm();
}

// More raw fields than runs: what few runs happen to do must not become effects in which a fault
// of a fresh run disappears.
// Channels of behaviour and scatter go by what behaviour predicts, those of agreement by what the
// other sensors let expect.
void every_kind_goes_by_its_own_prediction(void **) {
  const MadeNoise made;
  const std::vector<MadeRun> runs = made_noises(kSeed, 10, made, true);
  std::vector<rim::Matrix> agreed;
  std::vector<rim::SearchRun> seen;
  std::vector<std::size_t> which;
  for (const MadeRun &run : runs)
    agreed.push_back((10.0 + 3.0 * run.predicted.array()).matrix());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    which.push_back(r);
    seen.push_back(runs[r].seen());
    seen.back().agreed = &agreed[r];
  }
  const rim::NoiseModel noise = rim::fit_noise(made_basis(made), seen, which, 1.0);
  const rim::ChannelNoise &behaviour = noise.channels[0], &agreement = noise.channels[1];
  assert_true(std::fabs(agreement.p_center - 10.0 - 3.0 * behaviour.p_center) < 1e-5);
  assert_true(std::fabs(agreement.p_scale - 3.0 * behaviour.p_scale) < 1e-5);
  assert_true(noise.channels[2].p_scale == behaviour.p_scale);
}

void more_effects_than_runs_do_not_swallow_a_fault(void **) {
  for (const std::size_t count : {4u, 6u, 10u}) {
    MadeNoise made;
    made.means = 8; // 12 raw fields
    const std::vector<MadeRun> runs = made_noises(kSeed + 300, count, made);
    const rim::NoiseModel noise = fit_made(made, runs);
    const rim::ChannelNoise &c = noise.channels.front();
    assert_true(c.combination.rows() <= static_cast<Eigen::Index>(NOISE_MAX_FIELDS));
    const MadeRun fresh = made_noise(kSeed + 400, made);
    const Eigen::MatrixXd fields = raw_fields(noise, c, fresh) * c.combination.transpose();
    Eigen::VectorXd late = Eigen::VectorXd::Zero(240), place = late;
    late.tail(80).setOnes();
    for (Eigen::Index b = 0; b < 240; ++b)
      place[b] = fresh.predicted(b, 0) > 0.8 ? 1.0 : 0.0;
    const double a = left_of(late, fields), b = left_of(place, fields);
    print_message("%zu runs: %.2f of a late shift is left, %.2f of one in a place\n", count, a, b);
    assert_true(a > 0.4 && b > 0.6);
    assert_true(near(c.s, 1.0, 0.1));
  }
}

// Runs that differ by hundreds of noise's standard deviations in one way, and by a few in another:
// the two have nothing to do with each other, though thirty runs may look as if they had. A run
// that is far off in the first way must not be expected to be so in the second.
void what_happens_together_by_chance_is_apart(void **) {
  for (std::uint64_t k = 0; k < 4; ++k) {
    MadeNoise made;
    made.offset_sd = 200.0;
    made.gain_sd = 4.0;
    made.means = 4;
    const std::vector<MadeRun> runs = made_noises(kSeed + 500 + 100 * k, 30, made);
    const rim::ChannelNoise c = fit_made(made, runs).channels.front();
    assert_true(std::fabs(c.combination(0, 0)) > 100.0); // the offset; what else is in that field
    const double rest = c.combination.row(0).tail(c.combination.cols() - 1).cwiseAbs().maxCoeff();
    print_message("beside an offset of %.0f a field has %.3f of anything else\n",
                  std::fabs(c.combination(0, 0)), rest);
    assert_true(rest < 0.05);
  }
}

// The step of a command scatters one block: that is no noise of all blocks.
void one_block_that_scatters_is_no_noise(void **) {
  std::vector<MadeRun> runs = made_noises(kSeed, kRuns, MadeNoise{}, true);
  for (MadeRun &run : runs) {
    for (Eigen::Index b = 20; b < run.residual.rows(); b += 40)
      run.residual.row(b).array() += 12.0;
  }
  const rim::NoiseModel noise = fit_made(MadeNoise{}, runs);
  // What is left of 12 in every fortieth block is 2: 1 + 4 / 40 of the variance.
  assert_true(near(noise.channels[RIM_CHANNEL_SCATTER].s, std::sqrt(1.1), 0.03));
  assert_true(noise.channels[RIM_CHANNEL_REPEAT].s > 1.5);
}

// A share of repeats that every run has is no effect of a run, in which a fault could hide.
void a_share_that_all_runs_have_is_no_effect(void **) {
  std::vector<MadeRun> runs = made_noises(kSeed, kRuns, MadeNoise{}, true);
  const rim::ChannelNoise before = fit_made(MadeNoise{}, runs).channels[RIM_CHANNEL_REPEAT];
  for (MadeRun &run : runs)
    run.residual.col(RIM_CHANNEL_REPEAT).array() += 5.0;
  const rim::NoiseModel noise = fit_made(MadeNoise{}, runs);
  const rim::ChannelNoise &c = noise.channels[RIM_CHANNEL_REPEAT];
  print_message("mean %.4f, s %.4f, effects %.4f\n", c.mean, c.s, c.effect_sd);
  assert_true(std::fabs(c.mean - before.mean - 5.0) < 1e-5);
  assert_true(near(c.s, before.s, 1e-3));
  assert_true(c.effect_sd < 0.15 * c.s); // 5, did the mean count as one
  for (const int kind : {RIM_CHANNEL_BEHAVIOUR, RIM_CHANNEL_AGREEMENT, RIM_CHANNEL_SCATTER})
    assert_true(noise.channels[static_cast<std::size_t>(kind)].mean == 0.0);
  const std::vector<std::uint8_t> section = rim::noise_section(noise);
  const rim_noise view = opened(noise, section);
  assert_true(static_cast<double>(rimi_noise_channel(&view, RIM_CHANNEL_REPEAT).mean) == c.mean);
}

// What training writes is what flight reads.
void the_section_says_the_same(void **) {
  MadeNoise made;
  made.outcomes = 2;
  made.means = 3;
  made.offset_sd = 0.4;
  made.rho = 0.3;
  const rim::NoiseModel noise = fit_made(made, made_noises(kSeed, 20, made));
  const std::vector<std::uint8_t> section = rim::noise_section(noise);
  rim_noise view;
  assert_int_equal(rimi_noise_open(&view, section.data(), section.size(), 2, 3), RIM_OK);
  assert_int_not_equal(rimi_noise_open(&view, section.data(), section.size(), 2, 4), RIM_OK);
  assert_int_equal(rimi_noise_open(&view, section.data(), section.size(), 2, 3), RIM_OK);
  assert_true(view.activity == noise.activity);
  assert_int_equal(view.runs, 20); // by which flight knows how well the effects are known
  for (std::uint32_t i = 0; i < 2; ++i) {
    const noise_channel c = rimi_noise_channel(&view, i);
    const rim::ChannelNoise &own = noise.channels[i];
    assert_int_equal(c.fields, own.combination.rows());
    assert_true(c.rho == static_cast<float>(own.rho) && c.s == static_cast<float>(own.s));
    assert_true(c.p_scale == static_cast<float>(own.p_scale));
    for (int k = 0; k < 5; ++k)
      assert_true(c.ln_sigma[k] == static_cast<float>(own.ln_sigma[k]));
    const double weight = rimi_noise_weight(&c, 1.5, -2.0, 0.7);
    const double ln = own.ln_sigma[0] * 1.5 + own.ln_sigma[1] * (1.5 * 1.5 - 1.0) -
                      own.ln_sigma[2] * 2.0 + own.ln_sigma[3] * 3.0 + own.ln_sigma[4] * 0.7;
    assert_true(std::fabs(weight - std::exp(-ln)) < 1e-6);
  }
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const CMUnitTest tests[] = {
      cmocka_unit_test(white_noise_is_white),
      cmocka_unit_test(autocorrelation_is_found),
      cmocka_unit_test(a_few_blocks_far_off_are_limited),
      cmocka_unit_test(noise_with_gaps_is_found),
      cmocka_unit_test(noise_of_two_speeds_is_as_large_as_its_sums),
      cmocka_unit_test(noise_that_lasts_while_predictions_move_is_found),
      cmocka_unit_test(effects_of_a_run_are_found),
      cmocka_unit_test(a_scale_that_depends_on_the_context_is_found),
      cmocka_unit_test(noise_that_lasts_has_the_scale_of_what_is_new),
      cmocka_unit_test(few_runs_teach_little_of_a_scale),
      cmocka_unit_test(a_scale_that_depends_on_the_activity_is_found),
      cmocka_unit_test(every_kind_goes_by_its_own_prediction),
      cmocka_unit_test(more_effects_than_runs_do_not_swallow_a_fault),
      cmocka_unit_test(one_block_that_scatters_is_no_noise),
      cmocka_unit_test(a_share_that_all_runs_have_is_no_effect),
      cmocka_unit_test(what_happens_together_by_chance_is_apart),
      cmocka_unit_test(the_section_says_the_same),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
