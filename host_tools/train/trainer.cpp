#include "train/trainer.hpp"

#include <algorithm>
#include <cmath>

#include "util/error.hpp"

namespace rim {

Training train(const std::vector<Log> &logs, const TrainOptions &options) {
  if (logs.size() < 3) {
    throw DataError("training needs at least 3 logs, each a run of its own; got " +
                    std::to_string(logs.size()));
  }
  Training training;
  FlightPlan &plan = training.plan;
  plan.layout = layout_of(logs.front());
  if (plan.layout.external) {
    throw DataError(logs.front().path +
                    ": has its own predictions (z. m. columns): nothing to train; "
                    "replay and diagnose take it as it is");
  }
  for (const Log &log : logs)
    check_layout(plan.layout, log);

  ModelOptions models;
  models.kinds = options.kinds;
  models.period_s = median_period_s(logs);
  models.block_rows =
      static_cast<std::uint32_t>(std::max(1L, std::lround(options.block_s / models.period_s)));
  models.fit = options.fit;
  training.models = train_models(logs, plan.layout, models);

  plan.kinds = options.kinds;
  use_profile(&plan, options.calibration.flight, false);
  plan.block_rows = models.block_rows;
  plan.period_s = models.period_s;
  plan.stale_s = options.stale_s;
  if (training.models.step.model.prototypes.size() > 0) {
    plan.step = nominal_section(training.models.step.model);
  }
  if (training.models.level.model.prototypes.size() > 0) {
    plan.level = nominal_section(training.models.level.model);
  }
  if (training.models.increment.model.prototypes.size() > 0) {
    plan.increment = nominal_section(training.models.increment.model);
  }
  calibrate_trained(&plan, training.models.series, options.calibration);
  training.promise = promise_for(logs.size(), options.calibration.false_alarm);
  return training;
}

} // namespace rim
