// SPDX-License-Identifier: MIT
#include "thesis/experiment/falcon.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <unistd.h>

#include <fmt/format.h>

#include "log/schema.hpp"
#include "replay/replay.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/table.hpp"

namespace rim::experiment {

namespace {

namespace fs = std::filesystem;
using Kind = FalconFault::Kind;

constexpr double kSpeedStep_mps = 1.0 / 3.6; // the webcast shows whole km/h

std::vector<std::string> split(const std::string &line) {
  std::vector<std::string> fields;
  std::stringstream in(line);
  for (std::string field; std::getline(in, field, ',');)
    fields.push_back(field);
  return fields;
}

// A mission's file as text fields.
struct Sheet {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;

  std::size_t column(const std::string &name) const {
    const auto at = std::find(header.begin(), header.end(), name);
    if (at == header.end())
      throw DataError("falcon9: column '" + name + "' is missing");
    return static_cast<std::size_t>(at - header.begin());
  }
  double number(std::size_t row, std::size_t c) const {
    return std::strtod(rows[row].at(c).c_str(), nullptr);
  }
};

Sheet read_sheet(const std::string &path) {
  std::stringstream in(read_file(path));
  Sheet sheet;
  for (std::string line; std::getline(in, line);) {
    if (sheet.header.empty())
      sheet.header = split(line);
    else if (!line.empty())
      sheet.rows.push_back(split(line));
  }
  return sheet;
}

bool is_kept(const std::string &phase) {
  return phase == "entry_burn" || phase == "aero" || phase == "landing_burn";
}

void put_bias(Sheet *sheet, const FalconFault &fault) {
  const std::size_t c = sheet->column("altitude_m"), step = sheet->column("alt_res_m");
  for (std::size_t r = 0; r < sheet->rows.size(); ++r) {
    const double quantum = std::max(1.0, sheet->number(r, step));
    const double value = sheet->number(r, c) + fault.size;
    sheet->rows[r][c] = fmt::format("{:g}", std::floor(value / quantum) * quantum);
  }
}

void put_gain(Sheet *sheet, const FalconFault &fault) {
  const std::size_t c = sheet->column("speed_mps");
  for (std::size_t r = 0; r < sheet->rows.size(); ++r) {
    const double speed = sheet->number(r, c);
    if (speed < fault.from_mps || speed > fault.to_mps)
      continue;
    const double steps = std::round((1.0 + fault.size) * speed / kSpeedStep_mps);
    sheet->rows[r][c] = fmt::format("{:.4f}", steps * kSpeedStep_mps);
  }
}

void put_stuck(Sheet *sheet, const FalconFault &fault) {
  const std::size_t c = sheet->column("altitude_m"), t = sheet->column("t_s");
  const std::size_t phase = sheet->column("phase");
  double first = 1e300, last = -1e300;
  for (std::size_t r = 0; r < sheet->rows.size(); ++r) {
    if (is_kept(sheet->rows[r].at(phase))) {
      first = std::min(first, sheet->number(r, t));
      last = std::max(last, sheet->number(r, t));
    }
  }
  const double from = first + fault.at_share * (last - first);
  std::string held;
  for (std::size_t r = 0; r < sheet->rows.size(); ++r) {
    const double now = sheet->number(r, t);
    if (now < from || now > from + fault.size)
      continue;
    if (held.empty())
      held = sheet->rows[r][c];
    sheet->rows[r][c] = held;
  }
}

// A folder that goes when the work ends.
struct Scratch {
  fs::path path;
  Scratch() : path(fs::temp_directory_path() / ("rim_falcon_" + std::to_string(::getpid()))) {
    make_folder(path.string());
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  Scratch(const Scratch &) = delete;
  Scratch &operator=(const Scratch &) = delete;
};

Log faulty_log(const std::string &path, const FalconFault &fault, const Schema &schema,
               const std::string &scratch) {
  if (fault.kind == Kind::none)
    return read_log(path, &schema);
  Sheet sheet = read_sheet(path);
  if (fault.kind == Kind::altitude_bias)
    put_bias(&sheet, fault);
  else if (fault.kind == Kind::speed_gain)
    put_gain(&sheet, fault);
  else
    put_stuck(&sheet, fault);
  AtomicFile file(scratch);
  file.write(fmt::format("{}\n", fmt::join(sheet.header, ",")));
  for (const auto &row : sheet.rows)
    file.write(fmt::format("{}\n", fmt::join(row, ",")));
  file.commit();
  return read_log(scratch, &schema);
}

std::vector<std::string> missions(const std::string &folder,
                                  const std::vector<std::string> &exclude) {
  std::vector<std::string> names;
  const Sheet sheet = read_sheet(folder + "/missions.csv");
  for (const auto &row : sheet.rows) {
    const std::string &name = row.at(0);
    if (std::find(exclude.begin(), exclude.end(), name) == exclude.end())
      names.push_back(name);
  }
  return names;
}

} // namespace

std::vector<FalconFault> falcon_faults() {
  std::vector<FalconFault> faults(1);
  faults[0].name = "as flown";
  const auto add = [&faults](Kind kind, double size, const std::string &name) {
    FalconFault fault;
    fault.kind = kind;
    fault.size = size;
    fault.name = name;
    if (kind == Kind::speed_gain) {
      fault.from_mps = 300.0;
      fault.to_mps = 700.0;
    }
    faults.push_back(fault);
  };
  // Three steps of the display; then of the order in which flights differ at one speed.
  add(Kind::altitude_bias, 300.0, "altitude +0.3 km");
  add(Kind::altitude_bias, 3000.0, "altitude +3 km");
  add(Kind::altitude_bias, 10000.0, "altitude +10 km");
  add(Kind::speed_gain, 0.02, "speed +2 % at 300-700 m/s");
  add(Kind::speed_gain, 0.20, "speed +20 % at 300-700 m/s");
  add(Kind::altitude_stuck, 3.0, "altitude stuck 3 s");
  add(Kind::altitude_stuck, 10.0, "altitude stuck 10 s");
  return faults;
}

std::string falcon_folder(const FalconOptions &options) {
  const std::string folder =
      options.data.empty() ? source_path("../shared/measured/falcon9") : options.data;
  return fs::is_directory(folder) ? folder : std::string();
}

FalconCampaign run_falcon(const FalconOptions &options) {
  const std::string folder = falcon_folder(options);
  const Schema schema = read_schema(data_path("falcon9.toml"));
  const std::vector<std::string> names = missions(folder, options.exclude);
  std::vector<Log> logs(names.size());
  parallel_for(names.size(), [&](std::size_t i) {
    logs[i] = read_log(folder + "/" + names[i] + ".csv", &schema);
  });
  FalconCampaign campaign;
  campaign.faults = falcon_faults();
  campaign.flights.resize(names.size());
  const Scratch scratch;
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::vector<Log> others;
    for (std::size_t k = 0; k < logs.size(); ++k) {
      if (k != i)
        others.push_back(logs[k]);
    }
    const Training training = train(others, options.train);
    FalconFlight &flight = campaign.flights[i];
    flight.mission = names[i];
    flight.rows = logs[i].t_s.size();
    flight.promised = static_cast<double>(training.plan.thresholds.promised_rate);
    for (const OutcomeReport &outcome : training.outcomes)
      flight.rmse.push_back(outcome.error);
    campaign.outcomes = training.plan.layout.outcome_names;
    campaign.units = training.plan.layout.outcome_units;
    Replayer replayer(make_image(training.plan), "image without " + names[i]);
    for (const FalconFault &fault : campaign.faults) {
      const Log log = faulty_log(folder + "/" + names[i] + ".csv", fault, schema,
                                 (scratch.path / "flight.csv").string());
      const ReplayedLog result = replayer.replay(log, ReplayOptions{});
      FalconCell cell;
      cell.alarmed = result.raised > 0;
      cell.t_s = result.first.t_s;
      cell.share = result.score / result.alarm_score;
      if (cell.alarmed && result.first.channels > 0)
        cell.outcome = replayer.names().outcome(result.first.channel[0]).words;
      flight.cells.push_back(cell);
    }
  }
  return campaign;
}

namespace {

// Median over the flights of the error that the model of the other flights makes.
double typical_error(const FalconCampaign &campaign, std::size_t outcome) {
  std::vector<double> errors;
  for (const FalconFlight &flight : campaign.flights) {
    if (outcome < flight.rmse.size())
      errors.push_back(flight.rmse[outcome]);
  }
  std::sort(errors.begin(), errors.end());
  return errors.empty() ? 0.0 : errors[errors.size() / 2];
}

double error_of(const FalconCampaign &campaign, const std::string &name) {
  for (std::size_t o = 0; o < campaign.outcomes.size(); ++o) {
    if (campaign.outcomes[o] == name)
      return typical_error(campaign, o);
  }
  return 0.0;
}

// A fault's size over what flights differ by; "-" where it has no such size.
std::string relative_size(const FalconCampaign &campaign, const FalconFault &fault) {
  double size = 0.0, error = 0.0;
  if (fault.kind == Kind::altitude_bias) {
    size = fault.size;
    error = error_of(campaign, "s.altitude_m");
  } else if (fault.kind == Kind::speed_gain) {
    size = 0.5 * (fault.from_mps + fault.to_mps) * fault.size;
    error = error_of(campaign, "s.speed_mps");
  }
  return error > 0.0 ? fmt::format("{:.2f}", size / error) : "-";
}

Table score_table(const FalconCampaign &campaign) {
  std::vector<TableColumn> columns{{"fault", ""}, {"size", "of dispersion"}};
  for (const FalconFlight &flight : campaign.flights)
    columns.push_back({flight.mission, std::to_string(flight.rows) + " rows"});
  columns.push_back({"alarms", "flights"});
  Table table(columns);
  for (std::size_t f = 0; f < campaign.faults.size(); ++f) {
    std::vector<std::string> cells{campaign.faults[f].name,
                                   relative_size(campaign, campaign.faults[f])};
    std::size_t alarms = 0;
    for (const FalconFlight &flight : campaign.flights) {
      const FalconCell &cell = flight.cells[f];
      alarms += cell.alarmed ? 1 : 0;
      cells.push_back(fmt::format("{:.0f}{}", 100.0 * std::max(0.0, cell.share),
                                  cell.alarmed ? " " + cell.outcome : ""));
    }
    cells.push_back(fmt::format("{} of {}", alarms, campaign.flights.size()));
    table.add(std::move(cells));
  }
  return table;
}

} // namespace

void print_falcon(const FalconCampaign &campaign, std::FILE *to) {
  fmt::print(to,
             "Falcon 9: {} measured landings, each replayed by a monitor trained on the others.\n"
             "Cells: largest score over the alarm's, in percent; the sensor named first where an "
             "alarm was raised.\n\n",
             campaign.flights.size());
  score_table(campaign).print(to);
  double promised = 0.0;
  std::size_t false_alarms = 0;
  for (const FalconFlight &flight : campaign.flights) {
    promised = std::max(promised, flight.promised);
    false_alarms += flight.cells.front().alarmed ? 1 : 0;
  }
  fmt::print(to,
             "\nFalse alarms: {} of {} flights as flown; promised: at most {:.1f} % ({} training "
             "flights: no lower rate can be promised).\n"
             "Dispersion: an unseen flight differs by {:.3g} km of altitude or {:.3g} m/s of speed "
             "from what the other flights lead\nto expect. A fault much smaller than that is not "
             "seen unless it also moves or repeats as no flight does; and one odd\nflight among so "
             "few sets the threshold for all. When altitude and speed disagree, either may be "
             "named.\n",
             false_alarms, campaign.flights.size(), 100.0 * promised, campaign.flights.size() - 1,
             1e-3 * error_of(campaign, "s.altitude_m"), error_of(campaign, "s.speed_mps"));
}

} // namespace rim::experiment
