// Blocks of rows and the residual channels that librim makes of them (rim/channels.h), for
// training.
//
// The flight code predicts with a model of all training runs; calibration must judge every run by a
// model that has not seen it. So the channels are computed here a second time, from predictions of
// left-one-run-out models; a test holds both to the same values.
#ifndef RIM_TRAIN_BLOCKS_HPP
#define RIM_TRAIN_BLOCKS_HPP

#include <cstdint>
#include <vector>

#include "log/log.hpp"
#include "rim/alarm.h"
#include "train/fit.hpp"

namespace rim {

// What the columns of the logs are to the monitor.
struct Layout {
  std::vector<std::string> feature_names, feature_units; // context, command, sensor columns
  std::vector<std::string> outcome_names, outcome_units; // sensors, or z. columns
  std::vector<std::uint16_t> outcome_feature;            // trained: feature index of each outcome
  std::vector<std::uint8_t> command;                     // per feature
  bool external = false;                                 // z. m. sd. columns bring predictions
  std::size_t features() const { return feature_names.size(); }
  std::size_t outcomes() const { return outcome_names.size(); }
};

// The layout of a log; DataError when it has neither sensors nor outcomes.
Layout layout_of(const Log &log);
// DataError naming the file and column where a log's columns differ from the layout.
void check_layout(const Layout &layout, const Log &log);

struct Blocks {
  Matrix context;                       // blocks x features: means
  std::vector<double> start_s;          // time of the first row of the block
  std::vector<std::uint32_t> first_row; // index into the log's rows
  std::vector<bool> follows;            // the block before is its neighbour in time
};

// Groups rows as rim_channels_row() does: `block_rows` a block, begun anew after a gap of a quarter
// of a block; an unfinished last block is dropped.
Blocks make_blocks(const Log &log, const std::vector<int> &columns, std::uint32_t block_rows,
                   double period_s);

// Median time between rows of all logs.
double median_period_s(const std::vector<Log> &logs);

// Which features tell the phase of a run, 1 or 0: those that take the same course in every run (the
// mean over runs at the same share of a run's length explains nine tenths of the variance). All 1
// where none does: runs that are not alike. contexts: one matrix of blocks x features a run.
//   Gates of the models: on other features they would split runs from one another instead of
//   phases, and every map would see few runs. Regions: intervals of other features hold other parts
//   of a flight in every run, so that there is no nominal spread by which to judge them.
std::vector<double> phase_weights(const std::vector<const Matrix *> &contexts);

// Channel values of one run, before standardisation: one row a block that the flight code would
// give to the search.
struct ChannelSeries {
  Matrix raw;     // blocks x channels
  Matrix context; // blocks x features
  std::vector<double> start_s;
};

struct TrainedModels {
  FitResult step, level, increment;
  std::vector<ChannelSeries> series; // per run, by models without that run
};

struct ModelOptions {
  std::uint32_t kinds = 1u << RIM_KIND_SHIFT | 1u << RIM_KIND_VARIANCE | 1u << RIM_KIND_REPEAT;
  std::uint32_t block_rows = 20;
  double period_s = 0.05;
  FitOptions fit;
};

// Fits the three models on all runs and the channel values of every run by models without it.
TrainedModels train_models(const std::vector<Log> &logs, const Layout &layout,
                           const ModelOptions &options);

} // namespace rim
#endif
