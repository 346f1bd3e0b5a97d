// SPDX-License-Identifier: MIT
#include "train/interference_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>

#include "image/flight_image.hpp"
#include "rim/monitor.h"
#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "rim/image.h"
#include "interference/detector.h"

namespace rim {
namespace {

constexpr std::uint32_t kModelId = 1;

// How many of the last names of two paths are the same: of "a/hold/1.csv" and "./hold/1.csv" two.
std::size_t common_names(const std::string &a, const std::string &b) {
  const std::filesystem::path one = std::filesystem::path(a).lexically_normal(),
                              other = std::filesystem::path(b).lexically_normal();
  const std::vector<std::filesystem::path> x(one.begin(), one.end()), y(other.begin(), other.end());
  std::size_t n = 0;
  while (n < std::min(x.size(), y.size()) && x[x.size() - 1 - n] == y[y.size() - 1 - n])
    ++n;
  return n;
}

// The run whose path is that of the label, or ends as it does in more names than any other's:
// several folders may hold a run_0001.csv.
InterferenceRun *labelled_run(const std::string &path, const std::string &log,
                              std::vector<InterferenceRun> *runs) {
  InterferenceRun *best = nullptr;
  const InterferenceRun *rival = nullptr;
  std::size_t most = 0;
  for (InterferenceRun &run : *runs) {
    if (run.name == log)
      return &run;
    const std::size_t names = common_names(run.name, log);
    if (names == 0 || names < most)
      continue;
    rival = names == most ? best : nullptr;
    most = names;
    best = &run;
  }
  if (best == nullptr)
    throw DataError(path + ": '" + log + "' is not among the logs given");
  if (rival != nullptr)
    throw DataError(path + ": '" + log + "' may be " + rival->name + " or " + best->name +
                    ": write the path into the labels by which the log is given");
  return best;
}

void add_labels(const std::string &path, std::vector<InterferenceRun> *runs) {
  std::map<const InterferenceRun *, std::string> named;
  for (const world::InterferenceLabels &labels : world::read_labels(path)) {
    InterferenceRun *run = labelled_run(path, labels.log, runs);
    const auto [by, is_new] = named.emplace(run, labels.log);
    if (!is_new)
      throw DataError(path + ": '" + by->second + "' and '" + labels.log + "' both seem to be " +
                      run->name + ": give all logs that the labels name");
    run->intervals = labels.intervals;
  }
}

void print_found(const std::vector<InterferenceRun> &runs, const InterferenceTrainer &trainer) {
  std::vector<InterferenceOutcome> outcomes(runs.size());
  parallel_for(runs.size(),
               [&](std::size_t r) { outcomes[r] = detect(trainer.train(r).model, runs[r]); });
  const char *const names[] = {"HMM alone", "all together"};
  for (std::size_t d = 0; d < 2; ++d) {
    std::size_t events = 0, hits = 0, wrong = 0;
    double delay_s = 0.0;
    for (const InterferenceOutcome &o : outcomes) {
      events += o.events;
      hits += o.detector[d].hits;
      wrong += o.detector[d].false_positives;
      for (const double s : o.detector[d].delays_s)
        delay_s += s;
    }
    std::printf("leave one out, %s: %zu of %zu found, %zu false positives, mean delay %.3g s\n",
                names[d], hits, events, wrong,
                hits > 0 ? delay_s / static_cast<double>(hits) : 0.0);
  }
}

std::vector<std::uint8_t> section_of(const rim_interference_model &model) {
  std::vector<std::uint8_t> section(RIM_INTERFERENCE_BYTES);
  if (rimi_interference_pack(&model, section.data(), section.size()) != RIM_OK)
    throw DataError("the logs teach no model of interference (velocity without any scatter?)");
  return section;
}

// Index of the first of these names that is there.
std::uint16_t index_of(const std::vector<std::string> &names,
                       const std::vector<std::string> &wanted, const std::string &name) {
  for (const std::string &column : wanted) {
    const auto at = std::find(names.begin(), names.end(), column);
    if (at != names.end())
      return static_cast<std::uint16_t>(at - names.begin());
  }
  throw DataError(name + ": the image's rows have no '" + wanted.back() +
                  "': interference cannot be watched for");
}

} // namespace

std::vector<std::uint8_t> with_interference(const LoadedImage &image,
                                            const rim_interference_model &model,
                                            const std::string &name) {
  const Layout layout = layout_of_image(image.view());
  SectionBytes inputs;
  inputs.u16(index_of(layout.feature_names, {"u.vx_mps"}, name));
  inputs.u16(index_of(layout.outcome_names, {"z.vx_mps", "s.vx_mps"}, name));
  return with_sections(image.view(),
                       {{RIM_SECTION_INTERFERENCE, section_of(model)},
                        {RIM_SECTION_INTERFERENCE_INPUTS, inputs.bytes()}},
                       ModelId::of_content);
}

void train_interference(const std::vector<Log> &logs, const std::string &labels,
                        const rim_wheels *wheels, const std::string &model,
                        const std::string &out) {
  std::optional<LoadedImage> flight; // found before the work
  if (!model.empty())
    flight.emplace(load_image(model));
  std::vector<InterferenceRun> runs;
  for (const Log &log : logs)
    runs.push_back(interference_run(log, wheels));
  add_labels(labels, &runs);
  const InterferenceTrainer trainer(runs, {});
  const InterferenceTraining t = trainer.train(runs.size());
  const rim_interference_model &m = t.model;
  std::printf("%zu runs; observations: stop %zu, accel %zu, constant %zu, decel %zu, mi %zu\n",
              runs.size(), t.state_rows[0], t.state_rows[1], t.state_rows[2], t.state_rows[3],
              t.state_rows[4]);
  std::size_t skipped = 0;
  for (const Log &log : logs)
    skipped += log.rows_skipped;
  if (skipped > 0)
    std::printf("%zu rows skipped for a missing or infinite value\n", skipped);
  for (const std::string &state : t.unseen)
    std::printf("state '%s' is never seen: it takes the emissions of all observations\n",
                state.c_str());
  std::printf(
      "p_mi %.3g, log odds %.3g; latency %.3g s, limits %.3g and %.3g m/s^2 within %.2g %%\n",
      t.p_mi, m.ln_odds, m.latency_s, m.accel_mps2, m.decel_mps2, 100.0 * m.limit_spread);
  std::printf("thresholds: one-step %.3g, open-loop %.3g\n", m.one_step.threshold,
              m.open_loop.threshold);
  if (runs.size() > 2)
    print_found(runs, trainer);
  if (flight) {
    const std::vector<std::uint8_t> image = with_interference(*flight, m, model);
    AtomicFile file(out);
    file.write(image.data(), image.size());
    file.commit();
  } else {
    ImageWriter image(kModelId);
    image.add_section(RIM_SECTION_INTERFERENCE, section_of(m));
    image.write(out);
  }
  std::printf("%s written\n", out.c_str());
}

} // namespace rim
