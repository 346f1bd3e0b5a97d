#include "train/train_report.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "bus/names.hpp"
#include "train/image_writer.hpp"
#include "util/table.hpp"

namespace rim {

namespace {

// Row t and the outcomes of row t + 1, where none is missing between them.
struct StepRows {
  Matrix x, y;
  std::vector<std::uint32_t> run;
};

bool is_step(const Log &log, std::size_t t, double period_s) {
  return t + 1 < log.t_s.size() && log.t_s[t + 1] - log.t_s[t] <= 1.5 * period_s;
}

StepRows step_rows(const std::vector<Log> &logs, const FlightPlan &plan) {
  StepRows s;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    for (std::size_t t = 0; t < logs[r].t_s.size(); ++t) {
      if (is_step(logs[r], t, plan.period_s))
        s.run.push_back(static_cast<std::uint32_t>(r));
    }
  }
  const Layout &layout = plan.layout;
  const auto rows = static_cast<Eigen::Index>(s.run.size());
  s.x.resize(rows, static_cast<Eigen::Index>(layout.features()));
  s.y.resize(rows, static_cast<Eigen::Index>(layout.outcomes()));
  Eigen::Index at = 0;
  for (const Log &log : logs) {
    const std::vector<int> columns = feature_columns(log);
    for (std::size_t t = 0; t < log.t_s.size(); ++t) {
      if (!is_step(log, t, plan.period_s))
        continue;
      const auto row = static_cast<Eigen::Index>(t);
      for (std::size_t f = 0; f < columns.size(); ++f)
        s.x(at, static_cast<Eigen::Index>(f)) = log.values(row, columns[f]);
      for (std::size_t o = 0; o < layout.outcomes(); ++o) {
        s.y(at, static_cast<Eigen::Index>(o)) =
            log.values(row + 1, columns[layout.outcome_feature[o]]);
      }
      ++at;
    }
  }
  return s;
}

// Geometric mean over outcomes of a / b.
double ratio(const std::vector<double> &a, const std::vector<double> &b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::log(std::max(a[i], 1e-300) / std::max(b[i], 1e-300));
  return std::exp(sum / static_cast<double>(std::max<std::size_t>(1, a.size())));
}

const char *section_name(std::uint32_t id) {
  switch (id) {
  case RIM_SECTION_CONFIG:
    return "configuration";
  case RIM_SECTION_STEP:
    return "model: one row ahead";
  case RIM_SECTION_LEVEL:
    return "model: same block";
  case RIM_SECTION_INCREMENT:
    return "model: next block";
  case RIM_SECTION_CHANNELS:
    return "channels' scales";
  case RIM_SECTION_THRESHOLD:
    return "thresholds";
  case RIM_SECTION_FEATURES:
    return "features' ranges";
  case RIM_SECTION_REGION:
    return "features of regions";
  case RIM_SECTION_OUTCOMES:
    return "outcomes";
  case RIM_SECTION_COMMANDS:
    return "commands";
  case RIM_SECTION_NAMES:
    return "names";
  case RIM_SECTION_ENVELOPE:
    return "nominal spread";
  default:
    return "other";
  }
}

} // namespace

KernelReport one_step_kernels(const std::vector<Log> &logs, const Training &training) {
  if (training.models.step.model.prototypes.size() == 0)
    return {};
  const StepRows rows = step_rows(logs, training.plan);
  FitResult
      local; // its own errors are known from the fit over all rows: only the model counts here
  local.model = training.models.step.model;
  local.mean = Matrix::Zero(rows.y.rows(), rows.y.cols());
  return compare_kernels(rows.x, rows.y, rows.run, local, KernelOptions{});
}

std::string error_report(const Training &training, const KernelReport &kernels) {
  const Layout &layout = training.plan.layout;
  const std::vector<double> &local = training.models.step.rmse;
  const std::vector<double> &same = training.models.level.rmse;
  const bool has_step = !kernels.kernel.empty();
  std::string text =
      "\nError of the nominal models, each run predicted without itself (root mean square)\n";
  std::vector<TableColumn> columns{{"outcome", ""}, {"unit", ""}};
  if (has_step) {
    columns.push_back({"white noise", "of a reading"});
    columns.push_back({"kernel average", "one row ahead"});
    columns.push_back({"its prototypes", "one row ahead"});
    columns.push_back({"local-linear", "one row ahead"});
  }
  if (!same.empty())
    columns.push_back({"local-linear", "from other sensors"});
  Table table(columns);
  for (std::size_t o = 0; o < layout.outcomes(); ++o) {
    std::vector<std::string> cells{quantity_of(layout.outcome_names[o]).words,
                                   layout.outcome_units[o].empty() ? "-" : layout.outcome_units[o]};
    if (has_step) {
      for (const double value :
           {kernels.white[o], kernels.kernel[o], kernels.prototypes[o], local[o]})
        cells.push_back(cell(value, 3));
    }
    if (!same.empty())
      cells.push_back(cell(same[o], 3));
    table.add(std::move(cells));
  }
  text += table.text();
  if (has_step) {
    text += fmt::format(
        "compressing the kernel average (thesis eq. 4.13) to {} prototypes multiplies its error by "
        "{:.3g};\nlocal-linear maps on {} prototypes, which fly, bring it to {:.3g} of the kernel "
        "average's (geometric mean)\n",
        kernels.compressed.prototypes.rows(), ratio(kernels.prototypes, kernels.kernel),
        training.models.step.model.prototypes.rows(), ratio(local, kernels.kernel));
    if (!kernels.rounding.empty()) {
      text += fmt::format(
          "single precision in the image adds at most {:.2g} of an outcome's error\n", [&] {
            double worst = 0.0;
            for (std::size_t o = 0; o < local.size(); ++o)
              worst = std::max(worst, kernels.rounding[o] / std::max(local[o], 1e-300));
            return worst;
          }());
    }
  }
  return text;
}

namespace {

std::string model_line(const char *name, const FitResult &fit) {
  if (fit.model.prototypes.size() == 0)
    return "";
  return fmt::format("  {:<20} {} prototypes, bandwidth {:g} of their radius; error {:.3g} of the "
                     "outcomes' spread; {} choices tried\n",
                     name, fit.chosen.prototypes, fit.chosen.bandwidth, fit.chosen.error,
                     fit.candidates.size());
}

std::string ordinal(std::size_t n) {
  const std::size_t last = n % 100 / 10 == 1 ? 0 : n % 10;
  return std::to_string(n) + (last == 1 ? "st" : last == 2 ? "nd" : last == 3 ? "rd" : "th");
}

std::string wrapped(const std::vector<std::string> &words, const std::string &indent) {
  std::string text = indent, line;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string word = words[i] + (i + 1 < words.size() ? ", " : "");
    if (line.size() + word.size() > 90) {
      text += line + "\n" + indent;
      line.clear();
    }
    line += word;
  }
  return text + line + "\n";
}

} // namespace

std::string choice_report(const Training &training) {
  const FlightPlan &plan = training.plan;
  std::string text = "\nChosen by leaving whole runs out\n";
  text += model_line("one row ahead", training.models.step);
  text += model_line("from other sensors", training.models.level);
  text += model_line("next block", training.models.increment);
  text += fmt::format("  a block is {} rows ({:.3g} s)\n", plan.block_rows,
                      plan.block_rows * plan.period_s);
  std::vector<std::string> features;
  for (const std::uint16_t f : plan.region)
    features.push_back(quantity_of(plan.layout.feature_names[f]).words);
  text += fmt::format("{} of {} features may describe a region (the others repeat one of them)\n",
                      plan.region.size(), plan.layout.features());
  return text + wrapped(features, "  ");
}

std::string promise_report(const Training &training, double false_alarm) {
  const Thresholds &t = training.plan.thresholds;
  const std::size_t runs = t.maxima.size();
  const double promised = static_cast<double>(t.promised_rate);
  std::string text = fmt::format("\nCalibration: {} healthy runs, each judged by what the others "
                                 "taught\n",
                                 runs);
  if (promised > false_alarm * (1.0 + 1e-6)) {
    text += fmt::format("  with {} runs no rate below {:.1f} % can be promised (wished: {:.3g} %); "
                        "using that.\n  {:.0f} runs are the least for {:.3g} %\n",
                        runs, 100.0 / static_cast<double>(runs + 1), 100.0 * false_alarm,
                        std::ceil(1.0 / false_alarm - 1e-9) - 1.0, 100.0 * false_alarm);
  }
  text += fmt::format(
      "  promised: at most {:.1f} % of healthy runs raise any alarm\n  alarm at score "
      "{:.3g}, the {} of the {} runs' largest scores ({:.3g} to {:.3g})\n",
      100.0 * promised, static_cast<double>(t.alarm_score),
      t.rank == runs ? std::string("highest") : ordinal(runs - t.rank + 1) + " highest", runs,
      static_cast<double>(t.maxima.front()), static_cast<double>(t.maxima.back()));
  return text;
}

std::string image_report(const std::vector<std::uint8_t> &image) {
  const LoadedImage loaded(
      std::string_view(reinterpret_cast<const char *>(image.data()), image.size()), "image");
  Table table({{"section", ""}, {"size", "bytes"}});
  for (std::uint32_t id = 1; id < 64; ++id) {
    const std::uint8_t *data = nullptr;
    std::size_t bytes = 0;
    if (rim_image_section(&loaded.view(), id, &data, &bytes) == RIM_OK)
      table.add({section_name(id), cell(bytes)});
  }
  table.add({"whole image", cell(image.size())});
  std::size_t monitor = 0;
  Monitor made(image, "image");
  monitor = made.bytes();
  table.add({"RAM of one monitor", cell(monitor)});
  return "\n" + table.text();
}

} // namespace rim
