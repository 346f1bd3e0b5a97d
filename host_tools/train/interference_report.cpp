#include "train/interference_report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "train/image_writer.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "world/cobot.hpp"

namespace rim {
namespace {

constexpr std::uint32_t kModelId = 1;

void add_labels(const std::string &path, std::vector<InterferenceRun> *runs) {
  for (const world::InterferenceLabels &labels : world::read_labels(path)) {
    const auto name_of = [](const std::string &p) {
      return std::filesystem::path(p).filename().string();
    };
    auto run = std::find_if(runs->begin(), runs->end(),
                            [&](const auto &r) { return r.name == labels.log; });
    if (run == runs->end())
      run = std::find_if(runs->begin(), runs->end(),
                         [&](const auto &r) { return name_of(r.name) == name_of(labels.log); });
    if (run == runs->end())
      throw DataError(path + ": '" + labels.log + "' is not among the logs given");
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

} // namespace

void train_interference(const std::vector<Log> &logs, const std::string &labels,
                        const std::string &out) {
  world::CobotParams params;
  world::CobotMap map;
  world::read_cobot(data_path("cobot.toml"), "", &params, &map);
  const world::Cobot cobot(params, map, {}, 1, 1);
  std::vector<InterferenceRun> runs;
  for (const Log &log : logs)
    runs.push_back(interference_run(log, &cobot.wheels()));
  add_labels(labels, &runs);
  const InterferenceTrainer trainer(runs, {});
  const InterferenceTraining t = trainer.train(runs.size());
  const rim_interference_model &m = t.model;
  std::printf("%zu runs; observations: stop %zu, accel %zu, constant %zu, decel %zu, mi %zu\n",
              runs.size(), t.state_rows[0], t.state_rows[1], t.state_rows[2], t.state_rows[3],
              t.state_rows[4]);
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
  std::vector<std::uint8_t> section(RIM_INTERFERENCE_BYTES);
  if (rim_interference_pack(&m, section.data(), section.size()) != RIM_OK)
    throw DataError(labels + ": the logs teach no model (velocity without any scatter?)");
  ImageWriter image(kModelId);
  image.add_section(RIM_INTERFERENCE_SECTION, section);
  image.write(out);
  std::printf("%s written\n", out.c_str());
}

} // namespace rim
