// SPDX-License-Identifier: MIT
#include "thesis/experiment/measured_falcon.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include <Eigen/QR>

#include <fmt/format.h>

#include "diagnose/rollout.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/progress.hpp"
#include "util/table.hpp"

namespace rim::experiment {

using diagnose::Measured;
using diagnose::Term;
using diagnose::Vector;

namespace {

const char *const kChannel = "speed_mps";

// Fields of one column, by data row; DataError where it is missing.
std::vector<std::string> text_column(const std::string &path, const std::string &name) {
  std::stringstream in(read_file(path));
  std::vector<std::string> values;
  std::size_t wanted = 0;
  bool is_header = true;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#')
      continue;
    std::stringstream fields(line);
    std::string field;
    for (std::size_t c = 0; std::getline(fields, field, ','); ++c) {
      if (is_header && field == name)
        wanted = c + 1;
      if (!is_header && c + 1 == wanted)
        values.push_back(field);
    }
    if (is_header && wanted == 0)
      throw DataError(path + ": column '" + name + "' is missing");
    is_header = false;
  }
  return values;
}

// Flights that go from ascent to landing.
std::vector<std::string> full_descents(const std::string &folder) {
  const std::string path = folder + "/missions.csv";
  const std::vector<std::string> mission = text_column(path, "mission");
  const std::vector<std::string> full = text_column(path, "descent_to_landing");
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(mission.size(), full.size()); ++i) {
    if (full[i] == "yes")
      names.push_back(mission[i]);
  }
  return names;
}

std::vector<std::uint8_t> rows_of_phase(const Measured &held, const std::string &path,
                                        const std::string &phase) {
  const std::vector<std::string> phases = text_column(path, "phase");
  std::vector<std::uint8_t> rows(held.rows());
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] = phase.empty() || phases.at(held.row[i] - 1) == phase ? 1 : 0;
  return rows;
}

// The term fitted alone: sizes by least squares, its shape parameter scanned. Weights allow for
// what the term leaves.
Term fitted_alone(Term term, const Measured &measured) {
  const diagnose::Channel &c =
      measured.channels.at(static_cast<std::size_t>(measured.find_channel(kChannel)));
  const Vector residual = c.z - c.m;
  const double shape = term.shape.empty() ? 0.0 : term.shape[0].value;
  double left = std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size()));
  for (int pass = 0; pass < 3; ++pass) {
    Term best = term;
    double least = std::numeric_limits<double>::infinity();
    double best_left = left;
    const Vector weight = (c.sd.array().square() + left * left).sqrt().inverse();
    for (int k = -20; k <= 20; ++k) {
      if (!term.shape.empty())
        term.shape[0].value = shape * std::exp(0.025 * k);
      const Eigen::MatrixXd gate = diagnose::gate_mask(term.gate, measured).asDiagonal() *
                                   diagnose::basis_columns(term, measured, c.m);
      const Eigen::MatrixXd weighted = weight.asDiagonal() * gate;
      const Vector size =
          weighted.colPivHouseholderQr().solve(weight.cwiseProduct(residual).eval());
      const Vector rest = residual - gate * size;
      const double cost = weight.cwiseProduct(rest).squaredNorm();
      if (cost < least) {
        least = cost;
        for (std::size_t s = 0; s < term.sizes.size(); ++s)
          term.sizes[s].value = size(static_cast<Eigen::Index>(s));
        best = term;
        best_left = std::sqrt(rest.squaredNorm() / static_cast<double>(rest.size()));
      }
      if (term.shape.empty())
        break;
    }
    term = best;
    left = best_left;
  }
  return term;
}

FalconLeftOut judge_flight(const std::string &flight, const std::string &path,
                           const std::vector<Log> &others, const Log &held_log,
                           diagnose::Options options) {
  options.gains = false; // judged here, on rows of choice
  options.model = "world falcon";
  Measured measured;
  const diagnose::Diagnosis diagnosis = diagnose::diagnose(others, options, &measured);
  const Measured held = diagnose::make_measured({held_log}, diagnose::Constants::keep);
  const std::vector<Term> terms = terms_of(diagnosis);
  FalconLeftOut result;
  result.flight = flight;
  const auto all = rows_of_phase(held, path, ""), aero = rows_of_phase(held, path, "aero");
  result.one_step = judge(terms, held, kChannel, all, options.seed);
  result.aero = judge(terms, held, kChannel, aero, options.seed);
  result.coast = judge(terms, held, kChannel, rows_of_phase(held, path, "coast"), options.seed);
  std::vector<diagnose::Judged> every(held.channels.size());
  diagnose::append_rolled(terms, held_log, options.horizon_s, *options.predictor, &every);
  const auto at = static_cast<std::size_t>(held.find_channel(kChannel));
  const diagnose::Judged &rolled = every.at(at);
  const diagnose::Channel &channel = held.channels.at(at);
  for (const diagnose::Gain &gain :
       diagnose::summarise(rolled, channel, options.horizon_s, "held-out logs", options.seed)) {
    if (gain.where == "all")
      result.horizon = gain;
  }
  for (const diagnose::Finding &finding : diagnosis.findings) {
    if (finding.term.kind != diagnose::TermKind::mean)
      continue;
    if (result.first.empty()) {
      result.first = cause_text(finding);
      result.second =
          judge({fitted_alone(finding.term, measured)}, terms, held, kChannel, aero, options.seed);
    } else {
      result.has_second = true;
      result.others += (result.others.empty() ? "" : "; ") + cause_text(finding);
    }
  }
  return result;
}

} // namespace

std::vector<FalconLeftOut> run_measured_falcon(const MeasuredOptions &options) {
  const std::string folder = measured_folder(options);
  const Schema schema = read_schema(data_path("diagnose_falcon9.toml"));
  const std::vector<std::string> missions = text_column(folder + "/missions.csv", "mission");
  const std::vector<std::string> names =
      measured_names(folder, options, [&missions](const std::string &name) {
        return std::find(missions.begin(), missions.end(), name) != missions.end();
      });
  if (names.size() < 3)
    throw DataError(folder + ": fewer than three flights");
  const auto world = world::make_world_predictor("falcon");
  std::vector<Log> logs;
  for (const std::string &name : names)
    logs.push_back(predicted_log(folder + "/" + name + ".csv", schema, *world));
  diagnose::Options diagnosis;
  diagnosis.catalogue = diagnose::read_catalogue(data_path("causes.toml"));
  diagnosis.horizon_s = options.horizon_s;
  diagnosis.predictor = world.get();
  diagnosis.null_runs = options.null_runs;
  diagnosis.seed = options.seed;
  const std::vector<std::string> full = full_descents(folder);
  std::vector<FalconLeftOut> flights;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (std::find(full.begin(), full.end(), names[i]) == full.end())
      continue;
    std::vector<Log> others = logs;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    flights.push_back(
        judge_flight(names[i], folder + "/" + names[i] + ".csv", others, logs[i], diagnosis));
  }
  return flights;
}

void print_measured_falcon(const std::vector<FalconLeftOut> &flights,
                           const MeasuredOptions &options, std::FILE *to) {
  fmt::print(to,
             "Falcon 9: a point mass under gravity, extended by what the other flights show, on "
             "the flight left out.\nRMSE of the speed after over before (95 % by resampling "
             "blocks); engine-on rows and rows near an event are in neither fit nor score.\n\n");
  Table table({{"flight", ""},
               {"rows", ""},
               {"1 s", ""},
               {"in air", "1 s"},
               {fmt::format("{:g} s", options.horizon_s), ""},
               {"coast", ""},
               {"second term", ""}});
  for (const FalconLeftOut &f : flights) {
    const bool judged = f.horizon.rows > 0;
    table.add({f.flight, cell(f.one_step.rows), ratio_text(f.one_step), ratio_text(f.aero),
               judged ? ratio_text(f.horizon.ratio, f.horizon.ratio_ci95) : "-",
               ratio_text(f.coast), f.has_second ? ratio_text(f.second) : "none found"});
  }
  table.print(to);
  fmt::print(to, "\nsecond term: RMSE in air with all terms over that with the first alone.\n\n");
  for (const FalconLeftOut &f : flights) {
    fmt::print(to, "{}: {}{}{}\n", f.flight, f.first.empty() ? "nothing claimed" : f.first,
               f.others.empty() ? "" : "; then ", f.others);
  }
}

} // namespace rim::experiment
