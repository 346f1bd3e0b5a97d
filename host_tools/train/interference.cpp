// SPDX-License-Identifier: MIT
#include "train/interference.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "util/error.hpp"

namespace rim {

namespace {

constexpr std::size_t kStates = RIM_INTERFERENCE_STATES;
constexpr std::size_t kGaussians = RIM_INTERFERENCE_GAUSSIANS;
constexpr double kSmoothing = 0.01; // counts added to every transition
constexpr double kLeastSd = 1e-3;
constexpr std::size_t kLatencies = 31, kLimits = 36;
constexpr double kBand_sd = 3.0;   // of the limits from run to run: half the band
constexpr double kMostError = 0.1; // of a run's own limit: else it says nothing
const char *const kNames[] = {"stop", "accel", "constant", "decel", "mi"};

double latency_at(std::size_t i) { return 0.01 * static_cast<double>(i); }
double limit_at(std::size_t i) { return 0.3 * std::pow(1.08, static_cast<double>(i)); }

// The limit at the least sum of squares, on the parabola through the grid's three lowest points in
// the logarithm, and its standard error there.
struct LimitFit {
  double ln_limit, stderr_ln;
};

LimitFit fit_limit(const double *squares, double noise_mps) {
  const auto at =
      static_cast<std::size_t>(std::min_element(squares + 1, squares + kLimits - 1) - squares);
  const double left = squares[at - 1], mid = squares[at], right = squares[at + 1];
  const double bend = left - 2.0 * mid + right, step = std::log(limit_at(1) / limit_at(0));
  if (!(bend > 0.0))
    return {std::log(limit_at(at)), INFINITY};
  const double shift = std::clamp(0.5 * (left - right) / bend, -1.0, 1.0);
  return {std::log(limit_at(at)) + shift * step, noise_mps * std::sqrt(2.0 / bend) * step};
}

// sd between runs by moments: the square of the deviation less that of its own error.
double spread_of(const std::vector<LimitFit> &deviations) {
  double sum = 0.0, weight = 0.0;
  for (const LimitFit &d : deviations) {
    if (!(d.stderr_ln < kMostError))
      continue;
    sum += d.ln_limit * d.ln_limit - d.stderr_ln * d.stderr_ln;
    weight += 1.0;
  }
  return weight > 0.0 ? std::clamp(std::sqrt(std::max(0.0, sum / weight)), 0.0, 0.3) : 0.0;
}

struct Moments {
  double n = 0.0;
  std::array<double, kGaussians> sum{}, square{};
  void add(const Moments &o, double sign) {
    n += sign * o.n;
    for (std::size_t k = 0; k < kGaussians; ++k) {
      sum[k] += sign * o.sum[k];
      square[k] += sign * o.square[k];
    }
  }
};

bool in_interference(const InterferenceRun &run, double t_s) {
  return std::any_of(run.intervals.begin(), run.intervals.end(),
                     [&](const auto &i) { return t_s >= i.start_s && t_s <= i.end_s; });
}

// Rows before the first interference: what follows one may not be nominal yet.
std::size_t nominal_rows(const InterferenceRun &run) {
  double first = INFINITY;
  for (const auto &interval : run.intervals)
    first = std::min(first, interval.start_s);
  return static_cast<std::size_t>(std::lower_bound(run.t_s.begin(), run.t_s.end(), first) -
                                  run.t_s.begin());
}

} // namespace

struct InterferenceEvidence {
  std::array<double, kStates * kStates> counts{};
  std::array<Moments, kStates> moments;
  // Squared open-loop residuals over latency and limit, rows that rise and that fall.
  std::vector<double> rising, falling;
};

namespace {

// Open-loop residuals of the nominal rows for one latency and limit (eq. 4.10).
void add_squares(const InterferenceRun &run, std::size_t rows, double latency_s, double limit,
                 double *rising, double *falling) {
  double p = run.speed_mps[0], in_force = run.command_mps[0];
  std::size_t next = 1;
  bool is_rising = true;
  for (std::size_t i = 1; i < rows; ++i) {
    double now_s = run.t_s[i - 1];
    for (;;) {
      const bool changes = next < i && run.t_s[next] + latency_s <= run.t_s[i];
      const double until_s = changes ? std::max(now_s, run.t_s[next] + latency_s) : run.t_s[i];
      const double most = limit * (until_s - now_s);
      if (std::fabs(in_force - p) > 1e-9)
        is_rising = std::fabs(in_force) > std::fabs(p);
      p += std::clamp(in_force - p, -most, most);
      now_s = until_s;
      if (!changes)
        break;
      in_force = run.command_mps[next++];
    }
    const double r = run.speed_mps[i] - p;
    *(is_rising ? rising : falling) += r * r;
  }
}

rim_interference_model neutral_model() {
  rim_interference_model m{};
  for (std::size_t i = 0; i < kStates; ++i) {
    std::fill(m.transition[i], m.transition[i] + kStates, 1.0 / kStates);
    std::fill(m.sd[i], m.sd[i] + kGaussians, 1.0);
  }
  m.latency_s = 0.1;
  m.accel_mps2 = m.decel_mps2 = 1.0;
  m.settle_s = 0.3;
  m.gap_s = 1.0;
  m.one_step = m.open_loop = {1.0, 1.0, 1.0, 1e6};
  return m;
}

rim_interference started(const rim_interference_model &model) {
  rim_interference state;
  if (rimi_interference_init(&state, &model) != RIM_OK)
    throw std::logic_error("interference: the model was refused");
  return state;
}

InterferenceEvidence evidence_of(const InterferenceRun &run, double noise_mps) {
  InterferenceEvidence e;
  const std::vector<int> label = label_motion(run, noise_mps);
  rim_interference state = started(neutral_model());
  rim_interference_verdict verdict;
  int before = -1;
  for (std::size_t i = 0; i < run.t_s.size(); ++i) {
    rimi_interference_step(&state, run.t_s[i], run.command_mps[i], run.speed_mps[i], &verdict);
    const auto now = static_cast<std::size_t>(label[i]);
    if (before >= 0)
      e.counts[static_cast<std::size_t>(before) * kStates + now] += 1.0;
    before = label[i];
    double o[kGaussians];
    if (!rimi_interference_observation(&state, o))
      continue;
    Moments &m = e.moments[now];
    m.n += 1.0;
    for (std::size_t k = 0; k < kGaussians; ++k) {
      m.sum[k] += o[k];
      m.square[k] += o[k] * o[k];
    }
  }
  e.rising.assign(kLatencies * kLimits, 0.0);
  e.falling.assign(kLatencies * kLimits, 0.0);
  const std::size_t rows = nominal_rows(run);
  for (std::size_t l = 0; rows > 1 && l < kLatencies; ++l) {
    for (std::size_t a = 0; a < kLimits; ++a)
      add_squares(run, rows, latency_at(l), limit_at(a), &e.rising[l * kLimits + a],
                  &e.falling[l * kLimits + a]);
  }
  return e;
}

void check(const InterferenceRun &run) {
  const std::size_t least = RIM_INTERFERENCE_J_ROWS + 1;
  if (run.t_s.size() < least)
    throw DataError(fmt::format("{}: {} rows; the regression windows need {}", run.name,
                                run.t_s.size(), least));
  auto sorted = run.intervals;
  std::sort(sorted.begin(), sorted.end(),
            [](const auto &a, const auto &b) { return a.start_s < b.start_s; });
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const auto &now = sorted[i];
    if (now.start_s < run.t_s.front() || now.end_s > run.t_s.back())
      throw DataError(fmt::format("{}: label {:g}-{:g} s leaves the log ({:g}-{:g} s)", run.name,
                                  now.start_s, now.end_s, run.t_s.front(), run.t_s.back()));
    if (i > 0 && now.start_s <= sorted[i - 1].end_s)
      throw DataError(fmt::format("{}: labels {:g}-{:g} s and {:g}-{:g} s overlap", run.name,
                                  sorted[i - 1].start_s, sorted[i - 1].end_s, now.start_s,
                                  now.end_s));
  }
}

void set_emissions(const std::array<Moments, kStates> &moments, rim_interference_model *model,
                   std::vector<std::string> *unseen) {
  Moments all;
  for (const Moments &m : moments)
    all.add(m, 1.0);
  for (std::size_t i = 0; i < kStates; ++i) {
    const bool is_seen = moments[i].n > 1.5;
    if (!is_seen && unseen != nullptr)
      unseen->push_back(kNames[i]);
    const Moments &m = is_seen ? moments[i] : all;
    for (std::size_t k = 0; k < kGaussians; ++k) {
      const double mean = m.sum[k] / m.n;
      model->mean[i][k] = mean;
      model->sd[i][k] =
          std::max(kLeastSd, std::sqrt(std::max(0.0, m.square[k] / m.n - mean * mean)));
    }
  }
}

void set_p_mi(double p_mi, rim_interference_model *model) {
  for (std::size_t i = 0; i + 1 < kStates; ++i) {
    double others = 0.0;
    for (std::size_t j = 0; j + 1 < kStates; ++j)
      others += model->transition[i][j];
    for (std::size_t j = 0; j + 1 < kStates; ++j)
      model->transition[i][j] *= (1.0 - p_mi) / others;
    model->transition[i][RIM_MOTION_MI] = p_mi;
  }
}

// The highest of the excursions above 0 between two rows at 0, and the time watched.
struct Excursions {
  std::vector<double> peaks;
  double watched_s = 0.0;
  void threshold(const InterferenceOptions &o, double least, double *h) const;
};

// Upper confidence limit of an exponential's scale over its mean of n: 2 n mean / scale is chi^2 of
// 2 n degrees, whose quantile is Wilson and Hilferty's.
double scale_limit(double n, double z) {
  const double root = 1.0 - 1.0 / (9.0 * n) - z * std::sqrt(1.0 / (9.0 * n));
  return 1.0 / std::pow(std::max(0.3, root), 3.0);
}

// Peaks above their quantile o.tail are taken as exponential: rate(h) = rate(q) exp(-(h - q) / b).
void Excursions::threshold(const InterferenceOptions &o, double least, double *h) const {
  *h = least;
  if (peaks.empty())
    return;
  std::vector<double> sorted = peaks;
  std::sort(sorted.begin(), sorted.end());
  const auto from = static_cast<std::size_t>(o.tail * static_cast<double>(sorted.size()));
  const double q = sorted[from];
  const auto n = static_cast<double>(sorted.size() - from);
  double excess = 0.0;
  for (std::size_t i = from; i < sorted.size(); ++i)
    excess += (sorted[i] - q) / n;
  const double expected = n * o.quiet_h * 3600.0 / watched_s;
  const double scale = o.tail_z > 0.0 ? excess * scale_limit(n, o.tail_z) : excess;
  *h = std::max({least, q + scale * std::log(expected), o.margin * sorted.back()});
}

} // namespace

const std::vector<double> &p_mi_grid() {
  static const std::vector<double> grid = [] {
    std::vector<double> g;
    for (double e = -1.0; e >= -30.0; e -= e > -12.0 ? 0.5 : 1.0)
      g.push_back(std::pow(10.0, e));
    return g;
  }();
  return grid;
}

std::vector<int> label_motion(const InterferenceRun &run, double noise_mps) {
  std::vector<int> label(run.t_s.size());
  int changing = RIM_MOTION_CONSTANT; // after a rise or fall of the command until it is reached
  for (std::size_t i = 0; i < label.size(); ++i) {
    const double u = run.command_mps[i], before = i > 0 ? run.command_mps[i - 1] : u;
    const bool is_reached = std::fabs(run.speed_mps[i] - u) <= noise_mps;
    if (u != before)
      changing = u > before ? RIM_MOTION_ACCEL : RIM_MOTION_DECEL;
    else if (is_reached)
      changing = RIM_MOTION_CONSTANT;
    if (in_interference(run, run.t_s[i]))
      label[i] = RIM_MOTION_MI;
    else if (is_reached)
      label[i] = u == 0.0 ? RIM_MOTION_STOP : RIM_MOTION_CONSTANT;
    else // noise at rest: stop, the state that C.5 allows there
      label[i] = changing == RIM_MOTION_CONSTANT && u == 0.0 ? RIM_MOTION_STOP : changing;
  }
  return label;
}

InterferenceTrainer::InterferenceTrainer(const std::vector<InterferenceRun> &runs,
                                         InterferenceOptions options)
    : runs_(runs), options_(options) {
  if (runs.empty())
    throw DataError("interference: no run");
  std::size_t nominal = 0;
  for (const InterferenceRun &run : runs) {
    check(run);
    nominal += nominal_rows(run);
    evidence_.push_back(evidence_of(run, options.noise_mps));
  }
  if (nominal <= RIM_INTERFERENCE_J_ROWS)
    throw DataError("interference: every run begins with it, and latency, limits and thresholds "
                    "are learnt from the rows before it: add a run without interference");
}

InterferenceTrainer::~InterferenceTrainer() = default;

rim_interference_model InterferenceTrainer::with_p_mi(std::size_t left_out, double p_mi) const {
  std::array<double, kStates * kStates> counts{};
  std::array<Moments, kStates> moments;
  std::vector<double> rising(kLatencies * kLimits), falling(kLatencies * kLimits);
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (r == left_out)
      continue;
    const InterferenceEvidence &e = evidence_[r];
    for (std::size_t i = 0; i < counts.size(); ++i)
      counts[i] += e.counts[i];
    for (std::size_t i = 0; i < kStates; ++i)
      moments[i].add(e.moments[i], 1.0);
    for (std::size_t i = 0; i < rising.size(); ++i) {
      rising[i] += e.rising[i];
      falling[i] += e.falling[i];
    }
  }
  rim_interference_model model = neutral_model();
  rim_hmm_model hmm;
  rimi_hmm_from_counts(&hmm, kStates, counts.data(), kSmoothing, nullptr);
  for (std::size_t i = 0; i < kStates; ++i)
    std::copy(hmm.transition[i], hmm.transition[i] + kStates, model.transition[i]);
  set_p_mi(p_mi, &model);
  set_emissions(moments, &model, nullptr);
  double best = INFINITY;
  std::size_t latency = 0;
  for (std::size_t l = 0; l < kLatencies; ++l) {
    const auto at = static_cast<std::ptrdiff_t>(l * kLimits);
    const auto up = std::min_element(rising.begin() + at, rising.begin() + at + kLimits);
    const auto down = std::min_element(falling.begin() + at, falling.begin() + at + kLimits);
    if (*up + *down < best) {
      best = *up + *down;
      latency = l;
    }
  }
  model.latency_s = latency_at(latency);
  const LimitFit up = fit_limit(&rising[latency * kLimits], options_.noise_mps);
  const LimitFit down = fit_limit(&falling[latency * kLimits], options_.noise_mps);
  model.accel_mps2 = std::exp(up.ln_limit);
  model.decel_mps2 = std::exp(down.ln_limit);
  std::vector<LimitFit> deviations; // of each run from all of them
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (r == left_out)
      continue;
    for (const bool is_up : {true, false}) {
      const InterferenceEvidence &e = evidence_[r];
      LimitFit fit =
          fit_limit(&(is_up ? e.rising : e.falling)[latency * kLimits], options_.noise_mps);
      fit.ln_limit -= is_up ? up.ln_limit : down.ln_limit;
      deviations.push_back(fit);
    }
  }
  model.limit_spread = kBand_sd * spread_of(deviations);
  model.settle_s = options_.settle_s;
  return model;
}

namespace {

// Standard deviations of both residuals, at constant speed and while it changes.
void set_sd(const std::vector<const InterferenceRun *> &runs, double caution,
            rim_interference_model *model) {
  double square[2][2] = {{0}}, n[2] = {0};
  for (const InterferenceRun *run : runs) {
    rim_interference state = started(*model);
    rim_interference_verdict v;
    const std::size_t rows = nominal_rows(*run);
    for (std::size_t i = 0; i < rows; ++i) {
      rimi_interference_step(&state, run->t_s[i], run->command_mps[i], run->speed_mps[i], &v);
      if (i == 0)
        continue;
      const std::size_t phase = run->t_s[i] <= state.ramp_until_s;
      n[phase] += 1.0;
      square[0][phase] += v.one_step_mps * v.one_step_mps;
      square[1][phase] += v.residual_mps * v.residual_mps;
    }
  }
  rim_interference_cusum *const cusum[2] = {&model->one_step, &model->open_loop};
  for (std::size_t k = 0; k < 2; ++k) {
    cusum[k]->sd_steady = std::max(kLeastSd, std::sqrt(square[k][0] / std::max(1.0, n[0])));
    const double ramp = n[1] > 0.0 ? std::sqrt(square[k][1] / n[1]) : 0.0;
    cusum[k]->sd_ramp = caution * std::max(cusum[k]->sd_steady, ramp);
  }
}

void set_thresholds(const std::vector<const InterferenceRun *> &runs,
                    const InterferenceOptions &options, rim_interference_model *model) {
  model->one_step.slack = options.slack_one_step;
  model->open_loop.slack = options.slack_open_loop;
  model->one_step.threshold = model->open_loop.threshold = 1e6;
  std::array<Excursions, 3> all;
  constexpr double kBase = -30.0; // log odds of MI that count as an excursion's ground
  for (const InterferenceRun *run : runs) {
    rim_interference state = started(*model);
    rim_interference_verdict v;
    const std::size_t rows = nominal_rows(*run);
    std::array<double, 3> peak{};
    for (std::size_t i = 0; i < rows; ++i) {
      rimi_interference_step(&state, run->t_s[i], run->command_mps[i], run->speed_mps[i], &v);
      const double now[3] = {1e6 * v.score[1], 1e6 * v.score[2], v.ln_odds - kBase};
      for (std::size_t k = 0; k < 3; ++k) {
        if (now[k] <= 0.0 && peak[k] > 0.0) {
          all[k].peaks.push_back(peak[k]);
          peak[k] = 0.0;
        }
        peak[k] = std::max(peak[k], now[k]);
      }
    }
    for (std::size_t k = 0; k < 3; ++k) {
      if (peak[k] > 0.0)
        all[k].peaks.push_back(peak[k]);
      all[k].watched_s += rows > 0 ? run->t_s[rows - 1] - run->t_s[0] : 0.0;
    }
  }
  all[0].threshold(options, 3.0, &model->one_step.threshold);
  all[1].threshold(options, 3.0, &model->open_loop.threshold);
  double odds = 0.0;
  InterferenceOptions wider = options; // few excursions come near: the tail says little
  wider.margin = 2.0 * options.margin - 1.0;
  all[2].threshold(wider, -kBase, &odds);
  model->ln_odds = odds + kBase;
}

} // namespace

InterferenceTraining InterferenceTrainer::train(std::size_t left_out) const {
  InterferenceTraining out;
  std::vector<const InterferenceRun *> runs;
  std::array<Moments, kStates> moments;
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    if (r == left_out)
      continue;
    runs.push_back(&runs_[r]);
    out.rows += runs_[r].t_s.size();
    for (std::size_t i = 0; i < kStates; ++i) {
      moments[i].add(evidence_[r].moments[i], 1.0);
      out.state_rows[i] += static_cast<std::size_t>(evidence_[r].moments[i].n);
    }
  }
  std::size_t best_hits = 0, events = 0;
  for (const InterferenceRun *run : runs)
    events += run->intervals.size();
  out.p_mi = p_mi_grid().back();
  for (const double p_mi : p_mi_grid()) {
    const rim_interference_model model = with_p_mi(left_out, p_mi);
    std::size_t hits = 0, wrong = 0;
    for (std::size_t r = 0; r < runs.size() && wrong == 0; ++r) {
      const InterferenceOutcome o = detect(model, *runs[r]);
      hits += o.detector[0].hits;
      wrong += o.detector[0].false_positives;
    }
    if (wrong == 0 && hits > best_hits) {
      best_hits = hits;
      out.p_mi = p_mi;
    }
    if (best_hits == events)
      break;
  }
  out.model = with_p_mi(left_out, out.p_mi);
  set_emissions(moments, &out.model, &out.unseen);
  set_sd(runs, options_.ramp_caution, &out.model);
  set_thresholds(runs, options_, &out.model);
  return out;
}

InterferenceOutcome detect(const rim_interference_model &model, const InterferenceRun &run) {
  InterferenceOutcome out;
  out.events = run.intervals.size();
  rim_interference state = started(model);
  std::array<std::vector<char>, 2> hit;
  std::array<bool, 2> before{}, excused{};
  hit.fill(std::vector<char>(run.intervals.size(), 0));
  for (std::size_t i = 0; i < run.t_s.size(); ++i) {
    rim_interference_verdict v;
    rimi_interference_step(&state, run.t_s[i], run.command_mps[i], run.speed_mps[i], &v);
    std::size_t event = 0;
    while (event < run.intervals.size() && !(run.t_s[i] >= run.intervals[event].start_s &&
                                             run.t_s[i] <= run.intervals[event].end_s))
      ++event;
    const bool found[2] = {v.ln_odds > 0.0, v.alarmed};
    for (std::size_t d = 0; d < 2; ++d) {
      InterferenceOutcome::Detector &to = out.detector[d];
      if (found[d] && event < run.intervals.size()) {
        excused[d] = true; // what goes on from here is no false positive (C.3.1)
        if (!hit[d][event])
          to.delays_s.push_back(run.t_s[i] - run.intervals[event].start_s);
        hit[d][event] = 1;
      } else if (found[d] && !before[d] && !excused[d]) {
        ++to.false_positives;
      }
      if (!found[d])
        excused[d] = false;
      before[d] = found[d];
    }
  }
  for (std::size_t d = 0; d < 2; ++d)
    out.detector[d].hits =
        static_cast<std::size_t>(std::count(hit[d].begin(), hit[d].end(), char{1}));
  return out;
}

InterferenceRun interference_run(const Log &log, const rim_wheels *wheels) {
  InterferenceRun run;
  run.name = log.path;
  const int command = find_column(log, "u.vx_mps");
  if (command < 0)
    throw DataError(log.path + ": no command: column 'u.vx_mps'");
  int speed = find_column(log, "s.vx_mps");
  if (speed < 0)
    speed = find_column(log, "z.vx_mps");
  int encoder[4] = {0};
  bool has_encoders = true;
  for (int w = 0; w < 4; ++w) {
    encoder[w] = find_column(log, fmt::format("s.enc{}_ticks", w + 1));
    has_encoders = has_encoders && encoder[w] >= 0;
  }
  if (speed < 0 && !has_encoders)
    throw DataError(log.path + ": no speed: column 's.vx_mps', 'z.vx_mps' or 's.enc1_ticks' to "
                               "'s.enc4_ticks'");
  if (speed < 0 && wheels == nullptr)
    throw DataError(log.path + ": the speed is given as encoder counters: whose wheels they count "
                               "is not known (--robot)");
  std::uint32_t before[4] = {0}, now[4] = {0};
  for (std::size_t i = 0; i < log.t_s.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    double velocity[3] = {0.0, 0.0, 0.0};
    for (int w = 0; speed < 0 && w < 4; ++w) {
      const double ticks = log.values(row, encoder[w]);
      if (!(ticks >= 0.0 && ticks < 4294967296.0))
        throw DataError(fmt::format("{}:row {}: column 's.enc{}_ticks': {:g} is no counter",
                                    log.path, log.row[i], w + 1, ticks));
      now[w] = static_cast<std::uint32_t>(ticks);
    }
    if (speed < 0 && i > 0 &&
        rimi_wheels_velocity(wheels, before, now, log.t_s[i] - log.t_s[i - 1], velocity) != RIM_OK)
      throw DataError(fmt::format("{}:row {}: counters do not fit the wheels' {} bits", log.path,
                                  log.row[i], wheels->bits));
    std::copy(now, now + 4, before);
    if (speed < 0 && i == 0)
      continue;
    run.t_s.push_back(log.t_s[i]);
    run.command_mps.push_back(log.values(row, command));
    run.speed_mps.push_back(speed >= 0 ? log.values(row, speed) : velocity[0]);
  }
  return run;
}

} // namespace rim
