#include "train/blocks.hpp"

#include <algorithm>
#include <cmath>

#include "rim/channels.h"
#include "util/error.hpp"

namespace rim {

Layout layout_of(const Log &log) {
  Layout layout;
  for (const int c : feature_columns(log)) {
    const Column &column = log.columns[static_cast<std::size_t>(c)];
    if (column.role == Role::sensor) {
      layout.outcome_feature.push_back(static_cast<std::uint16_t>(layout.features()));
      layout.outcome_names.push_back(column.name);
      layout.outcome_units.push_back(column.unit);
    }
    layout.feature_names.push_back(column.name);
    layout.feature_units.push_back(column.unit);
    layout.command.push_back(column.role == Role::command ? 1 : 0);
  }
  const std::vector<int> measured = role_columns(log, Role::outcome);
  if (!measured.empty()) {
    layout.external = true;
    layout.outcome_feature.clear();
    layout.outcome_names.clear();
    layout.outcome_units.clear();
    for (const int c : measured) {
      layout.outcome_names.push_back(log.columns[static_cast<std::size_t>(c)].name);
      layout.outcome_units.push_back(log.columns[static_cast<std::size_t>(c)].unit);
    }
  }
  if (layout.outcomes() == 0) {
    throw DataError(log.path + ": nothing to monitor: no column 's.NAME' and none 'z.NAME'");
  }
  if (layout.features() == 0) {
    throw DataError(log.path + ": no context: no column 'x.NAME', 'u.NAME' or 's.NAME'");
  }
  return layout;
}

void check_layout(const Layout &layout, const Log &log) {
  const Layout other = layout_of(log);
  const auto compare = [&log](const std::vector<std::string> &expected,
                              const std::vector<std::string> &found) {
    for (std::size_t i = 0; i < std::max(expected.size(), found.size()); ++i) {
      if (i >= found.size()) {
        throw DataError(log.path + ": column '" + expected[i] + "' is missing");
      }
      if (i >= expected.size()) {
        throw DataError(log.path + ": column '" + found[i] + "' is not in the model or first log");
      }
      if (expected[i] != found[i]) {
        throw DataError(log.path + ": column '" + found[i] + "' where '" + expected[i] +
                        "' is expected (same columns in the same order)");
      }
    }
  };
  compare(layout.feature_names, other.feature_names);
  compare(layout.outcome_names, other.outcome_names);
}

Blocks make_blocks(const Log &log, const std::vector<int> &columns, std::uint32_t block_rows,
                   double period_s) {
  const std::size_t rows = log.t_s.size();
  const auto features = static_cast<Eigen::Index>(columns.size());
  Blocks blocks;
  blocks.context.resize(static_cast<Eigen::Index>(rows / block_rows), features);
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(features);
  std::uint32_t in_block = 0;
  std::size_t first = 0;
  bool follows = false;
  const double break_s = std::max(1.5, 0.25 * block_rows) * period_s;
  for (std::size_t t = 0; t < rows; ++t) {
    if (t > 0 && period_s > 0 && log.t_s[t] - log.t_s[t - 1] > break_s) {
      in_block = 0;
      follows = false;
    }
    if (in_block == 0) {
      first = t;
      sum.setZero();
    }
    for (Eigen::Index f = 0; f < features; ++f) {
      sum[f] += log.values(static_cast<Eigen::Index>(t), columns[static_cast<std::size_t>(f)]);
    }
    if (++in_block == block_rows) {
      const auto n = static_cast<Eigen::Index>(blocks.start_s.size());
      blocks.context.row(n) = sum / static_cast<double>(block_rows);
      blocks.start_s.push_back(log.t_s[first]);
      blocks.first_row.push_back(static_cast<std::uint32_t>(first));
      blocks.follows.push_back(follows);
      follows = true;
      in_block = 0;
    }
  }
  blocks.context.conservativeResize(static_cast<Eigen::Index>(blocks.start_s.size()), features);
  return blocks;
}

double median_period_s(const std::vector<Log> &logs) {
  std::vector<double> periods;
  for (const Log &log : logs) {
    for (std::size_t t = 1; t < log.t_s.size(); ++t)
      periods.push_back(log.t_s[t] - log.t_s[t - 1]);
  }
  if (periods.empty())
    throw DataError("the logs have fewer than two rows");
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

namespace {

// Inputs, targets and run of one model, and for each of its rows which block (or row) of which run.
struct Samples {
  Matrix x, y;
  std::vector<std::uint32_t> run;
};

struct Runs {
  std::vector<Blocks> blocks;
  std::vector<int> columns; // of the features
};

Samples level_samples(const Runs &runs, const Layout &layout) {
  Eigen::Index n = 0;
  for (const Blocks &blocks : runs.blocks)
    n += blocks.context.rows();
  Samples s;
  s.x.resize(n, static_cast<Eigen::Index>(layout.features()));
  s.y.resize(n, static_cast<Eigen::Index>(layout.outcomes()));
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.blocks.size(); ++r) {
    const Matrix &context = runs.blocks[r].context;
    s.x.middleRows(at, context.rows()) = context;
    for (std::size_t o = 0; o < layout.outcomes(); ++o) {
      s.y.col(static_cast<Eigen::Index>(o)).segment(at, context.rows()) =
          context.col(layout.outcome_feature[o]);
    }
    s.run.insert(s.run.end(), static_cast<std::size_t>(context.rows()),
                 static_cast<std::uint32_t>(r));
    at += context.rows();
  }
  return s;
}

Samples increment_samples(const Runs &runs, const Layout &layout) {
  Eigen::Index n = 0;
  for (const Blocks &blocks : runs.blocks) {
    n += std::count(blocks.follows.begin(), blocks.follows.end(), true);
  }
  Samples s;
  s.x.resize(n, static_cast<Eigen::Index>(layout.features()));
  s.y.resize(n, static_cast<Eigen::Index>(layout.outcomes()));
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.blocks.size(); ++r) {
    const Blocks &blocks = runs.blocks[r];
    for (Eigen::Index b = 1; b < blocks.context.rows(); ++b) {
      if (!blocks.follows[static_cast<std::size_t>(b)])
        continue;
      s.x.row(at) = blocks.context.row(b - 1);
      for (std::size_t f = 0; f < layout.features(); ++f) {
        const auto i = static_cast<Eigen::Index>(f);
        if (layout.command[f] != 0) {
          s.x(at, i) = 0.5 * (blocks.context(b - 1, i) + blocks.context(b, i));
        }
      }
      for (std::size_t o = 0; o < layout.outcomes(); ++o) {
        const Eigen::Index f = layout.outcome_feature[o];
        s.y(at, static_cast<Eigen::Index>(o)) = blocks.context(b, f) - blocks.context(b - 1, f);
      }
      s.run.push_back(static_cast<std::uint32_t>(r));
      ++at;
    }
  }
  return s;
}

// Row t predicts row t + 1 wherever no row is missing between them.
bool is_step(const Log &log, std::size_t t, double period_s) {
  return t + 1 < log.t_s.size() && log.t_s[t + 1] - log.t_s[t] <= 1.5 * period_s;
}

Samples step_samples(const std::vector<Log> &logs, const Runs &runs, const Layout &layout,
                     double period_s) {
  Eigen::Index n = 0;
  for (const Log &log : logs) {
    for (std::size_t t = 0; t < log.t_s.size(); ++t)
      n += is_step(log, t, period_s) ? 1 : 0;
  }
  Samples s;
  s.x.resize(n, static_cast<Eigen::Index>(layout.features()));
  s.y.resize(n, static_cast<Eigen::Index>(layout.outcomes()));
  s.run.reserve(static_cast<std::size_t>(n));
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    const Log &log = logs[r];
    for (std::size_t t = 0; t < log.t_s.size(); ++t) {
      if (!is_step(log, t, period_s))
        continue;
      const auto row = static_cast<Eigen::Index>(t);
      for (std::size_t f = 0; f < layout.features(); ++f) {
        s.x(at, static_cast<Eigen::Index>(f)) = log.values(row, runs.columns[f]);
      }
      for (std::size_t o = 0; o < layout.outcomes(); ++o) {
        s.y(at, static_cast<Eigen::Index>(o)) =
            log.values(row + 1, runs.columns[layout.outcome_feature[o]]);
      }
      s.run.push_back(static_cast<std::uint32_t>(r));
      ++at;
    }
  }
  return s;
}

bool has_kind(std::uint32_t kinds, rim_kind kind) { return (kinds >> kind & 1u) != 0; }

// Block means of the standardised one-step residuals, and the logarithm of their variance about
// them.
void step_channels(const FitResult &fit, const Samples &samples, const std::vector<Log> &logs,
                   const Runs &runs, double period_s, std::uint32_t block_rows,
                   std::vector<Matrix> *mean, std::vector<Matrix> *variance) {
  const Eigen::Index outcomes = samples.y.cols();
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    const Blocks &blocks = runs.blocks[r];
    const Log &log = logs[r];
    Matrix sum = Matrix::Zero(blocks.context.rows(), outcomes);
    Matrix sum2 = sum;
    Eigen::VectorXd count = Eigen::VectorXd::Zero(blocks.context.rows());
    std::size_t block = 0;
    for (std::size_t t = 0; t < log.t_s.size(); ++t) {
      if (!is_step(log, t, period_s))
        continue;
      const auto z = (samples.y.row(at) - fit.mean.row(at)).array() / fit.sd.row(at).array();
      const Eigen::ArrayXd clipped = z.max(-RIM_CHANNELS_CLIP).min(RIM_CHANNELS_CLIP);
      ++at;
      const std::size_t target = t + 1; // the residual belongs to the row that was predicted
      while (block < blocks.first_row.size() && blocks.first_row[block] + block_rows <= target) {
        ++block;
      }
      if (block >= blocks.first_row.size() || target < blocks.first_row[block])
        continue;
      const auto b = static_cast<Eigen::Index>(block);
      sum.row(b).array() += clipped.transpose();
      sum2.row(b).array() += clipped.square().transpose();
      count[b] += 1.0;
    }
    for (Eigen::Index b = 0; b < sum.rows(); ++b) {
      const double n = std::max(2.0, count[b]);
      sum2.row(b).array() -= sum.row(b).array().square() / n;
      sum2.row(b) = (sum2.row(b).array() / (n - 1.0)).max(RIM_CHANNELS_LEAST_VARIANCE).log();
      sum.row(b) /= std::max(1.0, count[b]);
    }
    mean->push_back(std::move(sum));
    variance->push_back(std::move(sum2));
  }
}

// Share of the readings in each block that repeat the one before, or are exactly 0.
Matrix repeat_channels(const Log &log, const Blocks &blocks, const Runs &runs, const Layout &layout,
                       double period_s, std::uint32_t block_rows) {
  const auto outcomes = static_cast<Eigen::Index>(layout.outcomes());
  Matrix share = Matrix::Zero(blocks.context.rows(), outcomes);
  for (Eigen::Index b = 0; b < share.rows(); ++b) {
    const std::uint32_t first = blocks.first_row[static_cast<std::size_t>(b)];
    for (std::uint32_t t = first; t < first + block_rows; ++t) {
      const bool follows = t > 0 && is_step(log, t - 1, period_s);
      for (Eigen::Index o = 0; o < outcomes; ++o) {
        const int c = runs.columns[layout.outcome_feature[static_cast<std::size_t>(o)]];
        const double now = log.values(t, c);
        if (!(std::abs(now) > 0.0) || (follows && !(std::abs(now - log.values(t - 1, c)) > 0.0))) {
          share(b, o) += 1.0;
        }
      }
    }
  }
  return share / static_cast<double>(block_rows);
}

struct SeriesInput {
  const Samples *level_samples, *increment_samples;
  const FitResult *level, *increment;
  std::vector<Matrix> step_mean, step_variance;
  std::vector<Matrix> level_z, increment_z; // standardised residuals by run
  std::vector<Matrix> repeats;
};

std::vector<Matrix> residuals_by_run(const Samples &samples, const FitResult &fit,
                                     std::size_t runs) {
  std::vector<Matrix> out(runs);
  Eigen::Index at = 0;
  const auto n = static_cast<Eigen::Index>(samples.run.size());
  for (std::size_t r = 0; r < runs; ++r) {
    Eigen::Index end = at;
    while (end < n && samples.run[static_cast<std::size_t>(end)] == r)
      ++end;
    out[r] = (samples.y.middleRows(at, end - at) - fit.mean.middleRows(at, end - at)).array() /
             fit.sd.middleRows(at, end - at).array();
    at = end;
  }
  return out;
}

ChannelSeries series_of_run(const SeriesInput &in, const Blocks &blocks, std::size_t run,
                            std::uint32_t kinds, Eigen::Index outcomes) {
  std::vector<Eigen::Index> used; // blocks the flight code gives to the search
  for (Eigen::Index b = 0; b < blocks.context.rows(); ++b) {
    if (!has_kind(kinds, RIM_KIND_INCREMENT) || blocks.follows[static_cast<std::size_t>(b)]) {
      used.push_back(b);
    }
  }
  const auto n = static_cast<Eigen::Index>(used.size());
  ChannelSeries series;
  series.context.resize(n, blocks.context.cols());
  Eigen::Index present = 0;
  for (unsigned k = 0; k < RIM_CHANNELS_KINDS; ++k)
    present += kinds >> k & 1u;
  series.raw.resize(n, present * outcomes);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index b = used[static_cast<std::size_t>(i)];
    series.context.row(i) = blocks.context.row(b);
    series.start_s.push_back(blocks.start_s[static_cast<std::size_t>(b)]);
    Eigen::Index at = 0;
    const auto put = [&](rim_kind kind, const std::vector<Matrix> &from, Eigen::Index row) {
      if (!has_kind(kinds, kind))
        return;
      series.raw.block(i, at, 1, outcomes) = from[run].row(row);
      at += outcomes;
    };
    put(RIM_KIND_SHIFT, in.level_z, b);
    put(RIM_KIND_INCREMENT, in.increment_z, i);
    put(RIM_KIND_VARIANCE, in.step_variance, b);
    put(RIM_KIND_STEP, in.step_mean, b);
    put(RIM_KIND_REPEAT, in.repeats, b);
  }
  return series;
}

} // namespace

std::vector<double> phase_weights(const std::vector<const Matrix *> &contexts) {
  constexpr Eigen::Index points = 200;
  constexpr double follows = 0.9; // share of the variance that the common course explains
  const Eigen::Index features = contexts.front()->cols();
  Matrix course = Matrix::Zero(points, features);
  const auto row_at = [](const Matrix &run, Eigen::Index point) {
    return run.row(point * (run.rows() - 1) / (points - 1));
  };
  for (const Matrix *run : contexts) {
    for (Eigen::Index p = 0; p < points; ++p)
      course.row(p) += row_at(*run, p);
  }
  course /= static_cast<double>(contexts.size());
  const Eigen::RowVectorXd mean = course.colwise().mean();
  Eigen::RowVectorXd off = Eigen::RowVectorXd::Zero(features), all = off;
  for (const Matrix *run : contexts) {
    for (Eigen::Index p = 0; p < points; ++p) {
      off.array() += (row_at(*run, p) - course.row(p)).array().square();
      all.array() += (row_at(*run, p) - mean).array().square();
    }
  }
  std::vector<double> weight(static_cast<std::size_t>(features), 0.0);
  bool any = false;
  for (std::size_t f = 0; f < weight.size(); ++f) {
    const auto i = static_cast<Eigen::Index>(f);
    weight[f] = all[i] > 0.0 && off[i] < (1.0 - follows) * all[i] ? 1.0 : 0.0;
    any = any || weight[f] > 0.0;
  }
  if (!any)
    weight.assign(weight.size(), 1.0);
  return weight;
}

TrainedModels train_models(const std::vector<Log> &logs, const Layout &layout,
                           const ModelOptions &options) {
  Runs runs;
  runs.columns = feature_columns(logs.front());
  for (const Log &log : logs) {
    runs.blocks.push_back(make_blocks(log, runs.columns, options.block_rows, options.period_s));
    if (runs.blocks.back().context.rows() < 2) {
      throw DataError(log.path + ": fewer than two blocks of " +
                      std::to_string(options.block_rows) + " rows");
    }
  }
  TrainedModels models;
  SeriesInput in;
  std::vector<const Matrix *> contexts;
  for (const Blocks &blocks : runs.blocks)
    contexts.push_back(&blocks.context);
  FitOptions fit = options.fit;
  if (fit.gate_weight.empty())
    fit.gate_weight = phase_weights(contexts);
  const std::uint32_t kinds = options.kinds;
  if (has_kind(kinds, RIM_KIND_VARIANCE) || has_kind(kinds, RIM_KIND_STEP)) {
    const Samples samples = step_samples(logs, runs, layout, options.period_s);
    models.step = fit_nominal(samples.x, samples.y, samples.run, fit);
    step_channels(models.step, samples, logs, runs, options.period_s, options.block_rows,
                  &in.step_mean, &in.step_variance);
    models.step.mean.resize(0, 0); // 420k x 25 doubles are not needed any more
    models.step.sd.resize(0, 0);
  }
  if (has_kind(kinds, RIM_KIND_SHIFT)) {
    FitOptions others = fit;
    others.exclude.assign(layout.outcome_feature.begin(), layout.outcome_feature.end());
    const Samples samples = level_samples(runs, layout);
    models.level = fit_nominal(samples.x, samples.y, samples.run, others);
    in.level_z = residuals_by_run(samples, models.level, logs.size());
  }
  if (has_kind(kinds, RIM_KIND_INCREMENT)) {
    const Samples samples = increment_samples(runs, layout);
    models.increment = fit_nominal(samples.x, samples.y, samples.run, fit);
    in.increment_z = residuals_by_run(samples, models.increment, logs.size());
  }
  for (std::size_t r = 0; r < logs.size(); ++r) {
    if (has_kind(kinds, RIM_KIND_REPEAT)) {
      in.repeats.push_back(repeat_channels(logs[r], runs.blocks[r], runs, layout, options.period_s,
                                           options.block_rows));
    }
    models.series.push_back(
        series_of_run(in, runs.blocks[r], r, kinds, static_cast<Eigen::Index>(layout.outcomes())));
  }
  return models;
}

} // namespace rim
