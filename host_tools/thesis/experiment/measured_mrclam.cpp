// SPDX-License-Identifier: MIT
#include "thesis/experiment/measured_mrclam.hpp"

#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/table.hpp"

namespace rim::experiment {

using diagnose::Measured;

namespace {

// "d6_r4": 4; 0 where the name says none.
int robot_of(const std::string &name) {
  const std::size_t at = name.rfind("_r");
  if (at == std::string::npos || at + 3 != name.size() ||
      std::isdigit(static_cast<unsigned char>(name[at + 2])) == 0)
    return 0;
  return name[at + 2] - '0';
}

std::vector<std::uint8_t> rows_turning(const Measured &held, double least_radps, bool turning) {
  const int rate = held.find_feature("u.cmd_w_radps");
  std::vector<std::uint8_t> rows(held.rows(), turning ? 0 : 1);
  for (std::size_t i = 0; rate >= 0 && i < rows.size(); ++i) {
    const double w = held.x(static_cast<Eigen::Index>(i), rate);
    rows[i] = (std::fabs(w) > least_radps) == turning ? 1 : 0;
  }
  return rows;
}

std::string causes_of(const diagnose::Diagnosis &diagnosis, const std::string &channel) {
  std::string text;
  for (const diagnose::Finding &finding : diagnosis.findings) {
    if (finding.term.channel == channel)
      text += (text.empty() ? "" : "; ") + cause_text(finding);
  }
  return text.empty() ? "nothing claimed" : text;
}

} // namespace

std::vector<MrclamFold> run_measured_mrclam(const MeasuredOptions &options) {
  const std::string folder = measured_folder(options);
  const Schema schema = read_schema(data_path("diagnose_mrclam.toml"));
  const std::vector<std::string> names =
      measured_names(folder, options, [](const std::string &name) { return robot_of(name) > 0; });
  const auto world = world::make_world_predictor("unicycle");
  std::vector<Log> half[2];
  std::vector<std::string> half_names[2];
  for (const std::string &name : names) {
    const auto h = static_cast<std::size_t>(robot_of(name) % 2);
    half[h].push_back(predicted_log(folder + "/" + name + ".csv", schema, *world));
    half_names[h].push_back(name);
  }
  if (half[0].empty() || half[1].empty())
    throw DataError(folder + ": no logs of robots of both even and odd number (d6_r1.csv ...)");
  diagnose::Options diagnosis;
  diagnosis.catalogue = diagnose::read_catalogue(data_path("causes.toml"));
  diagnosis.predictor = world.get();
  diagnosis.null_runs = options.null_runs;
  diagnosis.seed = options.seed;
  diagnosis.gains = false; // judged here, on rows of choice
  diagnosis.model = "world unicycle";
  std::vector<MrclamFold> folds;
  for (std::size_t tested = 0; tested < 2; ++tested) {
    const auto found = diagnose::diagnose(half[1 - tested], diagnosis, nullptr);
    const auto terms = terms_of(found);
    const Measured held = diagnose::make_measured(half[tested], diagnose::Constants::keep);
    const auto on = [&](const char *channel, const std::vector<std::uint8_t> &rows) {
      return judge(terms, held, channel, rows, options.seed);
    };
    MrclamFold fold;
    fold.trained = half_names[1 - tested];
    fold.tested = half_names[tested];
    fold.turning = on("forward_mps", rows_turning(held, kTurning_radps, true));
    fold.straight = on("forward_mps", rows_turning(held, kTurning_radps, false));
    fold.all = on("forward_mps", std::vector<std::uint8_t>(held.rows(), 1));
    fold.turn_rate = on("turn_radps", std::vector<std::uint8_t>(held.rows(), 1));
    fold.forward_causes = causes_of(found, "forward_mps");
    fold.turn_causes = causes_of(found, "turn_radps");
    folds.push_back(fold);
  }
  return folds;
}

void print_measured_mrclam(const std::vector<MrclamFold> &folds, std::FILE *to) {
  fmt::print(to, "Robots: commands carried out at once, extended by what some robots show, on the "
                 "others.\nRMSE after over before (95 % by resampling blocks).\n\n");
  Table table({{"tested", ""},
               {"channel", ""},
               {"where", ""},
               {"rows", ""},
               {"before", ""},
               {"after", ""},
               {"ratio", ""}});
  for (const MrclamFold &fold : folds) {
    const std::string tested = fmt::format("{}", fmt::join(fold.tested, " "));
    const auto add = [&](const char *channel, const std::string &where, const Judgement &j) {
      table.add(
          {tested, channel, where, cell(j.rows), cell(j.before), cell(j.after), ratio_text(j)});
    };
    const std::string above = fmt::format("turn rate above {:g} rad/s", kTurning_radps);
    add("forward speed", above, fold.turning);
    add("forward speed", "otherwise", fold.straight);
    add("forward speed", "everywhere", fold.all);
    add("turn rate", "everywhere", fold.turn_rate);
  }
  table.print(to);
  fmt::print(to, "\n");
  for (const MrclamFold &fold : folds) {
    fmt::print(to, "From {}:\n  forward speed: {}\n  turn rate: {}\n", fmt::join(fold.trained, " "),
               fold.forward_causes, fold.turn_causes);
  }
}

} // namespace rim::experiment
