// SPDX-License-Identifier: MIT
// predict/predictor.hpp - simulations that predict measured logs: `rim diagnose --world, --model`.
#pragma once

#include <memory>
#include <string>

#include "log/log.hpp"

namespace rim::world {

class Predictor {
public:
  virtual ~Predictor() = default;
  // "world falcon"
  virtual std::string name() const = 0;
  // Seconds from a row to the outcome that is predicted for it.
  virtual double step_s() const = 0;
  // The log with z. m. sd. columns of every outcome beside its context; rows for which nothing can
  // be predicted are left out (row[] still counts the file's). DataError (file, column, reason)
  // when a column that the simulation needs is missing.
  virtual Log predict(const Log &log) const = 0;
  // The context one step later, when the outcomes had been `outcome` (rows x z. columns) instead of
  // the measured ones. `now` and `next` have the columns of predict(); what the simulation does not
  // carry forward (commands, attitude) is taken from `next`, the measured rows of that moment.
  // False when this simulation cannot be rolled out.
  virtual bool advance(const Log &now, const Matrix &outcome, Log *next) const = 0;
};

// "lander", "falcon", "unicycle"; UsageError otherwise.
std::unique_ptr<Predictor> make_world_predictor(const std::string &world);
// A trained image's nominal model, without its monitor.
std::unique_ptr<Predictor> make_image_predictor(const std::string &path);

} // namespace rim::world
