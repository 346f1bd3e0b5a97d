// SPDX-License-Identifier: MIT
#include "world/recording.hpp"

#include "util/atomic_file.hpp"

#include <algorithm>
#include <cstdio>
#include <fmt/format.h>
#include <stdexcept>

namespace rim::world {
namespace {

std::size_t limited(std::size_t rows, std::size_t max_rows) {
  return max_rows == 0 ? rows : std::min(rows, max_rows);
}

} // namespace

Column column_of(const std::string &name) {
  Column column;
  column.name = name;
  column.unit = unit_of_name(name);
  if (!role_of_name(name, column.role))
    throw std::logic_error("column of no role: " + name);
  return column;
}

void number_rows(Log &log) {
  log.rows_in_file = static_cast<std::uint32_t>(log.t_s.size());
  for (std::uint32_t row = 1; row <= log.rows_in_file; ++row)
    log.row.push_back(row);
}

Recording record_lander(const LanderRun &run, std::size_t max_rows) {
  Recording recording;
  Log &log = recording.log;
  for (const std::string &name : lander_columns())
    log.columns.push_back(column_of(name));
  const std::size_t rows = limited(run.rows.size(), max_rows);
  log.values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(log.columns.size()));
  for (std::size_t k = 0; k < rows; ++k) {
    const auto r = static_cast<Eigen::Index>(k);
    log.t_s.push_back(run.rows[k].t_s);
    for (std::size_t i = 0; i < kEngines; ++i)
      log.values(r, static_cast<Eigen::Index>(i)) = run.rows[k].throttle[i];
    log.values.row(r).tail(run.readings.cols()) = run.readings.row(r);
  }
  recording.finding.assign(run.acts.begin(), run.acts.begin() + static_cast<std::ptrdiff_t>(rows));
  number_rows(log);
  return recording;
}

Log lander_log(const LanderParams &params, const std::vector<Effect> &effects, std::uint64_t seed,
               std::uint64_t run) {
  Log log = record_lander(simulate_lander(params, effects, seed, run), 0).log;
  log.path = fmt::format("seed {} run {}", seed, run);
  return log;
}

Recording record_golf(Golf &golf, std::size_t dims, std::size_t max_rows) {
  Recording recording;
  Log &log = recording.log;
  for (std::size_t i = 1; i <= dims; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "x.f%03zu", i);
    log.columns.push_back(column_of(name));
  }
  for (const char *name : {"z.reward", "m.reward", "sd.reward"})
    log.columns.push_back(column_of(name));
  const std::vector<GolfShot> shots = golf.all();
  const std::size_t rows = limited(shots.size(), max_rows);
  log.values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(dims + 3));
  for (std::size_t k = 0; k < rows; ++k) {
    const auto r = static_cast<Eigen::Index>(k);
    const GolfShot &shot = shots[k];
    log.t_s.push_back(static_cast<double>(k));
    for (std::size_t i = 0; i < dims; ++i)
      log.values(r, static_cast<Eigen::Index>(i)) = shot.x[i];
    log.values.row(r).tail(3) << shot.z, shot.m, shot.sd;
    recording.finding.push_back(shot.anomalous ? 1 : 0);
  }
  number_rows(log);
  return recording;
}

std::string run_path(const std::string &folder, std::uint64_t run) {
  char name[40];
  std::snprintf(name, sizeof name, "run_%04llu.csv", static_cast<unsigned long long>(run));
  return folder + (folder.empty() || folder.back() == '/' ? "" : "/") + name;
}

void write_truth(const std::vector<Truth> &truths, const std::string &path) {
  AtomicFile out(path);
  out.write("log,row,finding\n");
  for (const Truth &truth : truths) {
    for (std::size_t k = 0; k < truth.finding.size(); ++k) {
      out.write(truth.log + "," + std::to_string(k + 1) +
                (truth.finding[k] != 0 ? ",1\n" : ",0\n"));
    }
  }
  out.commit();
}

} // namespace rim::world
