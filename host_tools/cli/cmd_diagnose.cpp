// SPDX-License-Identifier: MIT
// rim diagnose: given measured data, what a simulation gets wrong, why, and how much correcting it
// improves the prediction.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "diagnose/diagnose.hpp"
#include "diagnose/extension.hpp"
#include "log/schema.hpp"
#include "report/output_folder.hpp"
#include "report/outputs.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/table.hpp"

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <optional>

namespace {

namespace fs = std::filesystem;
using namespace rim::diagnose;

struct DiagnoseArguments {
  std::vector<std::string> logs, holdout, extensions;
  std::string model, world, out, schema, causes;
  double horizon_s = 0.0, false_alarm = 0.05;
  std::size_t null_runs = 0;
  std::uint64_t seed = 1;
};

const char *const kFooter =
    "Each log has its own predictions (columns z.NAME measured, m.NAME predicted, sd.NAME the\n"
    "standard deviation of m.NAME), or --world or --model predicts it. The command writes\n"
    "diagnosis.json, labels.csv, report.html and extension.toml into DIR; extension.toml is the\n"
    "input of --extension in simulate, replay and the next diagnose.\n"
    "Exit status 1: the simulation is inadequate; 0: nothing in the logs contradicts it.\n\n"
    "Example: a fall that a point mass under gravity does not explain\n"
    "  rim diagnose --world falcon --schema data/diagnose_falcon9.toml flight1.csv flight2.csv \\\n"
    "      --holdout flight3.csv --horizon 10 --out diagnosis\n"
    "  xdg-open diagnosis/report.html";

void declare(rim::cli::Arguments &app, DiagnoseArguments &o) {
  app.add_option("LOG", o.logs, "measured logs")->required();
  app.add_option("--out", o.out, "folder for the results; earlier results in it are replaced")
      ->required()
      ->type_name("DIR");
  app.add_option("--holdout", o.holdout,
                 "measured log to judge the findings on; nothing is fitted to it. May be "
                 "repeated\n(default: cross-validation)")
      ->type_name("LOG")
      ->repeated();
  const rim::cli::Option world =
      app.add_option("--world", o.world,
                     "built-in simulation to diagnose: lander, falcon or unicycle")
          ->check(rim::cli::is_member({"lander", "falcon", "unicycle"}));
  app.add_option("--model", o.model, "diagnose the trained model of this flight image")
      ->type_name("MODEL.rim")
      ->excludes(world);
  app.add_option("--schema", o.schema, "maps the columns of logs with other names or units")
      ->type_name("FILE.toml");
  app.add_option("--extension", o.extensions,
                 "start from the extended model of an earlier diagnosis; may be repeated")
      ->type_name("FILE.toml")
      ->repeated();
  app.add_option("--causes", o.causes,
                 "further causes; a form of the same name replaces the one in data/causes.toml")
      ->type_name("FILE.toml");
  app.add_option("--horizon", o.horizon_s, "also report the prediction error this far ahead")
      ->type_name("SECONDS")
      ->check(rim::cli::positive_number());
  app.add_option("--false-alarm", o.false_alarm,
                 "largest acceptable chance of any claim when nothing is wrong (default 0.05)")
      ->check(rim::cli::range(1e-4, 0.5));
  app.add_option("--null-runs", o.null_runs,
                 "searches of simulated noise per channel, which set the threshold\n(default: 64 "
                 "over all channels)")
      ->check(rim::cli::range(8, 100000));
  app.add_option("--seed", o.seed, "seed of all random numbers (default 1)")
      ->check(rim::cli::non_negative_number());
  app.footer(kFooter);
}

bool is_same_file(const std::string &a, const std::string &b) {
  std::error_code ignored;
  if (a == b || fs::equivalent(a, b, ignored))
    return true;
  const auto size_a = fs::file_size(a, ignored), size_b = fs::file_size(b, ignored);
  return !ignored && size_a == size_b && rim::read_file(a) == rim::read_file(b);
}

// A hold-out that was trained on would be a lie, a log that counts twice is evidence that is none:
// by any path, also as a copy.
void check_logs(const DiagnoseArguments &o) {
  for (const std::string &held : o.holdout) {
    for (const std::string &log : o.logs) {
      if (is_same_file(held, log))
        throw rim::DataError(held + ": is a training log too" +
                             (held == log ? "" : " (" + log + ")") +
                             "; a hold-out must be another");
    }
  }
  for (const auto *logs : {&o.logs, &o.holdout}) {
    for (std::size_t i = 0; i < logs->size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (is_same_file((*logs)[i], (*logs)[j]))
          throw rim::DataError((*logs)[i] + ": is given twice" +
                               ((*logs)[i] == (*logs)[j] ? "" : " (" + (*logs)[j] + ")"));
      }
    }
  }
}

std::vector<rim::Log> read_all(const std::vector<std::string> &paths, const rim::Schema *schema,
                               const rim::world::Predictor *predictor) {
  std::vector<rim::Log> logs;
  for (const std::string &path : paths) {
    rim::Log log = rim::read_log(path, schema);
    logs.push_back(predictor != nullptr ? predictor->predict(log) : std::move(log));
  }
  return logs;
}

void print_findings(const Diagnosis &diagnosis) {
  std::printf("%s\n", diagnosis.sentence.c_str());
  for (const Finding &f : diagnosis.findings) {
    std::printf("\n%d. %s\n", f.number, f.sentence.c_str());
    std::printf("   ln anom %.1f, p %.2g%s\n", f.ln_anom, f.p_value,
                f.given ? " (from the extension given)" : "");
    for (const Alternative &a : f.alternatives) {
      if (a.delta_bic < 20.0)
        std::printf("   instead: %s, %s: BIC %+.1f\n", a.cause.c_str(), a.expression.c_str(),
                    a.delta_bic);
    }
  }
}

void print_unconfirmed(const Diagnosis &diagnosis) {
  if (!diagnosis.unconfirmed.empty())
    std::printf("\n");
  for (const Finding &f : diagnosis.unconfirmed)
    std::printf("%s\n", f.sentence.c_str());
}

void print_gains(const Diagnosis &diagnosis) {
  if (diagnosis.gains.empty())
    return;
  rim::Table table({{"channel", ""},
                    {"rows", ""},
                    {"horizon", "s"},
                    {"RMSE before", ""},
                    {"RMSE after", ""},
                    {"ratio", ""},
                    {"95 %", ""},
                    {"", ""}});
  for (const Gain &g : diagnosis.gains) {
    table.add({g.channel + (g.unit.empty() ? "" : " (" + g.unit + ")"), g.where,
               g.horizon_s > 0.0 ? fmt::format("{:g}", g.horizon_s) : "one step",
               rim::cell(g.rmse_before), rim::cell(g.rmse_after), fmt::format("{:.3f}", g.ratio),
               fmt::format("{:.3f} - {:.3f}", g.ratio_ci95.low, g.ratio_ci95.high),
               g.worse ? "WORSE" : ""});
  }
  std::printf("\nGain, %s:\n", diagnosis.gains.front().data.c_str());
  table.print();
}

int cmd_diagnose(int argc, char **argv) {
  DiagnoseArguments o;
  rim::cli::Arguments app{
      "Find where and why measured logs contradict a simulation, correct the simulation, and "
      "measure how much that reduces its error.",
      "rim diagnose"};
  declare(app, o);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  check_logs(o);
  check_output_folder(o.out);
  std::optional<rim::Schema> schema;
  if (!o.schema.empty())
    schema = rim::read_schema(o.schema);
  std::unique_ptr<rim::world::Predictor> predictor;
  if (!o.world.empty())
    predictor = rim::world::make_world_predictor(o.world);
  else if (!o.model.empty())
    predictor = rim::world::make_image_predictor(o.model);
  Options options;
  options.catalogue = read_catalogue(rim::data_path("causes.toml"));
  if (!o.causes.empty())
    options.catalogue = merged(options.catalogue, read_catalogue(o.causes));
  const rim::Schema *mapping = schema ? &*schema : nullptr;
  const std::vector<rim::Log> logs = read_all(o.logs, mapping, predictor.get());
  options.holdout = read_all(o.holdout, mapping, predictor.get());
  if (!options.holdout.empty()) // what is wrong with them is said before the work
    (void)make_measured(options.holdout);
  const Measured given_for =
      o.extensions.empty() ? Measured{} : make_measured(logs, Constants::keep);
  for (const std::string &path : o.extensions) {
    const std::vector<Term> terms = read_extension(path);
    check_extension(terms, given_for, path);
    options.given.insert(options.given.end(), terms.begin(), terms.end());
  }
  if (mapping != nullptr)
    options.velocities = mapping->velocity_of;
  options.horizon_s = o.horizon_s;
  options.predictor = predictor.get();
  options.false_alarm = o.false_alarm;
  options.null_runs = o.null_runs;
  options.seed = o.seed;
  options.command = rim::cli::command_line(argc, argv);
  options.model = predictor ? predictor->name() : "the logs' own predictions";
  Measured measured;
  const Diagnosis diagnosis = diagnose(logs, options, &measured);
  write_outputs(diagnosis, measured, o.out);
  print_findings(diagnosis);
  print_unconfirmed(diagnosis);
  print_gains(diagnosis);
  for (const std::string &note : diagnosis.notes)
    std::printf("note: %s\n", note.c_str());
  std::printf("\n%s/report.html\n", o.out.c_str());
  return diagnosis.adequate() ? rim::EXIT_FINE : rim::EXIT_FOUND;
}

} // namespace

RIM_COMMAND(diagnose,
            "find what a simulation gets wrong, where and why, and by how much a correction helps",
            cmd_diagnose)
