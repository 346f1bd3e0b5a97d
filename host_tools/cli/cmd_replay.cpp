// SPDX-License-Identifier: MIT
// rim replay: the onboard monitor over logs, deterministically.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "diagnose/apply_extension.hpp"
#include "replay/outputs.hpp"
#include "replay/replay.hpp"
#include "rim/can.h"
#include "rim/image.h"
#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"
#include "util/progress.hpp"
#include "util/version.hpp"

#include <cmath>
#include <cstdio>
#include <fmt/format.h>
#include <optional>
#include <unistd.h>

namespace {

struct Options {
  std::vector<std::string> logs, extensions;
  std::string model, save_model, schema;
  rim::OutputPaths outputs;
  rim::CalibrationOptions calibration;
  std::size_t calibration_runs = 0; // 0: the table
  bool fail_on_alarm = false, skip_bad_time = false;
};

const char *const kFooter =
    "The last line is 'digest HEX', a hash of every verdict: two replays with equal digests gave\n"
    "the same verdicts to the last bit. Alarms carry the replay flag.\n"
    "With --fail-on-alarm the exit status is 1 when something was found, and 3 when a log in\n"
    "which nothing was found is STALE: rows are too few, or a tenth of it was not judged. It is\n"
    "always 3 when rows come at another rate.\n\n"
    "Example: one faulty landing; its alarms go to a file and over LCM\n"
    "  rim replay --model lander.rim faulty/run_0101.csv --alarms alarms.jsonl \\\n"
    "      --plot alarms.svg --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "Example: frames of `candump -L`, by the table that rim can-table put into the image\n"
    "  rim replay --model lander_can.rim flight.candump\n"
    "Example: a log with the user's own predictions (z. m. sd. columns) needs no model\n"
    "  rim replay golf/run_0001.csv --labels labels.csv\n"
    "Example: the same with the corrections that rim diagnose found, and an image with them\n"
    "  rim replay golf/run_0001.csv --extension found/extension.toml --save-model corrected.rim";

void declare_outputs(rim::cli::Arguments &app, rim::OutputPaths &out) {
  app.add_option("--alarms", out.alarms, "write the alarm records, one JSON object per line")
      ->type_name("FILE.jsonl")
      ->writes();
  app.add_option(
         "--labels", out.labels,
         "write log,row,t_s,finding for every row: the number of the finding (1, 2, ...) whose\n"
         "deviation was in it, 0 for none")
      ->type_name("FILE.csv")
      ->writes();
  app.add_option("--lcm", out.lcm_url, "publish alarms and health over LCM")->type_name("URL");
  app.add_option("--can", out.can, "send alarms on a CAN interface, with the replay flag")
      ->type_name("IFACE");
  app.add_option("--candump", out.candump,
                 "write the CAN frames of the alarms as `candump -L` text")
      ->type_name("FILE")
      ->writes();
  app.add_option("--node", out.node, "CAN node number (default 1)")
      ->check(rim::cli::range(0u, RIM_CAN_MAX_NODE));
  app.add_flag("--can-fd", out.can_fd, "CAN FD: the detail is one frame of 64 bytes, not segments");
  app.add_option("--trace", out.trace, "write t_s,ln_anom,threshold,score,level,log for every row")
      ->type_name("FILE.csv")
      ->writes();
  app.add_option("--report", out.report,
                 "write a page that shows, for every alarm, measured against expected, where and\n"
                 "since when; its charts can be zoomed where dygraphs is installed (Debian:\n"
                 "libjs-dygraphs)")
      ->type_name("FILE.html")
      ->writes();
  app.add_option(
         "--mcap", out.mcap,
         "write verdicts and alarms as MCAP, for Foxglove and PlotJuggler (needs Python's mcap)")
      ->type_name("FILE.mcap")
      ->writes();
  app.add_option("--plot", out.plot,
                 "draw ln anom, the log likelihood ratio of the best region, and its "
                 "threshold\n(needs gnuplot)")
      ->type_name("FILE.svg|png")
      ->writes();
}

void declare(rim::cli::Arguments &app, Options &o) {
  app.add_option("LOG", o.logs, "logs to replay; each is a run of its own")
      ->required()
      ->type_name("")
      ->reads();
  app.add_option("--model", o.model,
                 "flight image written by rim train; not needed for logs with z. and m. columns")
      ->type_name("FILE.rim")
      ->reads();
  app.add_option("--save-model", o.save_model,
                 "write a flight image: without --model the one made from the predictions in the\n"
                 "logs, with --extension the one that contains its corrections")
      ->type_name("FILE.rim")
      ->check(rim::cli::new_or_image())
      ->writes();
  app.add_option(
         "--extension", o.extensions,
         "add the terms that rim diagnose found to the predictions; may be repeated. With a\n"
         "trained model only constant shifts are used, which correct what it predicts from\n"
         "the commands")
      ->type_name("FILE.toml")
      ->repeated()
      ->reads();
  declare_outputs(app, o.outputs);
  app.add_option("--schema", o.schema, "roles, units and rates of logs with other column names")
      ->type_name("FILE.toml")
      ->reads();
  app.add_flag("--fail-on-alarm", o.fail_on_alarm, "exit with status 1 when something was found");
  app.add_flag("--skip-bad-time", o.skip_bad_time,
               "skip and count rows whose time repeats or runs backwards, instead of stopping");
  app.add_flag("--flight", o.calibration.flight,
               "without --model: search less per row and use less memory, for small processors");
  app.add_option(
         "--false-alarm", o.calibration.false_alarm,
         "without --model: largest acceptable share of healthy runs with any alarm\n(default 0.05)")
      ->check(rim::cli::range(1e-6, 0.999999));
  app.add_option(
         "--calibration-runs", o.calibration_runs,
         "without --model: set the threshold by this many Monte Carlo runs on the contexts of\n"
         "the logs, instead of by the table that the program contains")
      ->check(rim::cli::range(3, 4096));
  app.footer(kFooter);
}

void check(const rim::cli::Arguments &app, const Options &o) {
  if (!o.model.empty() && !o.save_model.empty() && o.extensions.empty())
    throw rim::UsageError(
        "--save-model with --model needs --extension: there is nothing new to write");
  for (const char *option : {"--false-alarm", "--calibration-runs", "--flight"}) {
    if (!o.model.empty() && app.count(option) > 0)
      throw rim::UsageError(std::string(option) + ": the model has its own calibration");
  }
  if (!o.outputs.plot.empty())
    rim::check_plot_path(o.outputs.plot);
}

using Bytes = std::vector<std::uint8_t>;
using Extensions = std::vector<rim::diagnose::Extension>;

// The image with what of the extensions can ride in it.
Bytes corrected(const Bytes &image, const rim::Layout &layout, const Extensions &extensions,
                const std::string &name) {
  if (extensions.empty())
    return image;
  const std::uint32_t kinds = 1u << RIM_KIND_SHIFT;
  const rim::diagnose::Correction correction =
      rim::diagnose::correction_section(extensions, layout, kinds);
  for (const std::string &reason : correction.left_out)
    std::fprintf(stderr, "rim: note: not in the image: %s\n", reason.c_str());
  return correction.section.empty()
             ? image
             : rim::diagnose::with_correction(image, correction.section, name);
}

void save(rim::AtomicFile *file, const Bytes &image) {
  file->write(image.data(), image.size());
  file->commit();
}

rim::Replayer open_model(const Options &o, const Extensions &extensions) {
  const std::string text = rim::read_file(o.model);
  if (text.empty())
    throw rim::DataError(o.model + ": is empty, not a flight image");
  const Bytes image(text.begin(), text.end());
  rim::Replayer plain(image, o.model);
  // The logs' own predictions are corrected row by row, by every kind of term.
  const bool in_the_log = plain.layout().external;
  if (extensions.empty() || (in_the_log && o.save_model.empty()))
    return plain;
  const Bytes corrected_image = corrected(image, plain.layout(), extensions, o.model);
  if (!o.save_model.empty()) {
    rim::AtomicFile file(o.save_model);
    save(&file, corrected_image);
  }
  if (in_the_log)
    return plain;
  if (corrected_image == image)
    throw rim::DataError(extensions.front().path + ": no term can be used with " + o.model +
                         " (see the notes)");
  return rim::Replayer(corrected_image, o.model);
}

void print_calibration(const Options &o, const rim::ExternalImage &made) {
  const bool drawn = o.calibration_runs > 0;
  std::printf("calibrated by %s: at most %.3g %% of healthy runs raise an alarm",
              drawn ? fmt::format("{} Monte Carlo runs", o.calibration_runs).c_str() : "a table",
              100.0 * made.promised_rate);
  if (drawn && made.promised_rate > o.calibration.false_alarm * (1.0 + 1e-6)) {
    std::printf("; %.3g %% needs --calibration-runs %.0f", 100.0 * o.calibration.false_alarm,
                std::ceil(1.0 / o.calibration.false_alarm - 1e-9) - 1.0);
  }
  std::printf("\n%s\n", made.residuals_sentence.c_str());
}

rim::Replayer open_external(const Options &o, const std::vector<rim::Log> &logs,
                            const Extensions &extensions) {
  std::optional<rim::AtomicFile> file; // a place that cannot be written is found before the work
  if (!o.save_model.empty())
    file.emplace(o.save_model);
  const rim::ExternalImage made = rim::external_image(logs, o.calibration_runs, o.calibration);
  if (file)
    save(&*file, corrected(made.image, rim::layout_of(logs.front()), extensions, "calibration"));
  for (const std::string &outcome : made.sd_estimated) {
    std::fprintf(stderr,
                 "rim: note: '%s' has no sd. column: its standard deviation is estimated "
                 "from the log itself\n",
                 outcome.c_str());
  }
  print_calibration(o, made);
  return rim::Replayer(made.image, "calibration");
}

rim::ReadOptions read_options(const Options &o, const rim::Replayer *replayer) {
  rim::ReadOptions options;
  if (replayer != nullptr)
    options = replayer->read_options(o.model);
  options.skip_bad_time = o.skip_bad_time;
  return options;
}

// What the logs together came to.
struct Tally {
  bool found = false, other_rate = false;
  std::size_t logs = 0, stale = 0;

  void add(const rim::ReplayedLog &log) {
    const bool found_here = log.raised > 0 || log.interference.raised > 0;
    found = found || found_here;
    other_rate = other_rate || rim::is_at_another_rate(log);
    stale += rim::is_stale(log) && !found_here ? 1 : 0;
    ++logs;
  }
  // A log that nobody judged must not look like a good one to whom the status is to say so.
  int status(bool fail_on_alarm) const {
    if (stale > 0)
      std::fprintf(stderr,
                   "rim: %zu of %zu logs STALE, for the reasons given: what nobody judged is not "
                   "healthy%s\n",
                   stale, logs,
                   other_rate ? " (for rows at another rate a schema with resample_hz may help)"
                              : "");
    if (other_rate || (stale > 0 && fail_on_alarm))
      return rim::EXIT_DATA;
    return found && fail_on_alarm ? rim::EXIT_FOUND : rim::EXIT_FINE;
  }
};

int cmd_replay(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Run the onboard monitor over logs, as it would have run in flight.",
                          "rim replay"};
  declare(app, o);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  check(app, o);
  o.outputs.made_by = rim::cli::command_line(argc, argv);
  o.outputs.model = o.model;
  std::optional<rim::Schema> schema;
  if (!o.schema.empty())
    schema = rim::read_schema(o.schema);
  const rim::Schema *mapping = schema ? &*schema : nullptr;
  const Extensions extensions = rim::diagnose::read_extensions(o.extensions);
  std::vector<rim::Log> logs; // all at once only where the thresholds are made from them
  if (o.model.empty()) {
    for (const std::string &path : o.logs) {
      logs.push_back(rim::read_log(path, mapping, read_options(o, nullptr)));
      if (!extensions.empty())
        rim::diagnose::apply_extension(extensions, &logs.back());
    }
  }
  rim::Replayer replayer =
      o.model.empty() ? open_external(o, logs, extensions) : open_model(o, extensions);
  rim::ReplayOutputs outputs(o.outputs, replayer);
  rim::ReplayOptions options;
  options.label = !o.outputs.labels.empty() || !o.outputs.report.empty();
  if (schema && schema->resample_hz > 0.0)
    options.hold_s = 1.5 / schema->resample_hz;
  Tally tally;
  std::optional<rim::Progress> progress; // on a terminal the results themselves show it
  if (::isatty(STDOUT_FILENO) == 0)
    progress.emplace("replay", o.logs.size());
  for (std::size_t i = 0; i < o.logs.size(); ++i) {
    rim::Log log = o.model.empty() ? std::move(logs[i])
                                   : rim::read_log(o.logs[i], mapping, read_options(o, &replayer));
    if (!o.model.empty() && !extensions.empty() && replayer.layout().external)
      rim::diagnose::apply_extension(extensions, &log);
    outputs.begin(log);
    options.record = [&](const rim_alarm &record) { outputs.record(record); };
    const rim::ReplayedLog result = replayer.replay(
        log, options, [&](std::size_t, const rim_verdict &verdict) { outputs.verdict(verdict); });
    outputs.end(result);
    tally.add(result);
    std::fputs(rim::replay_text(result, replayer.names()).c_str(), stdout);
    std::fflush(stdout); // into a pipe, too: an interruption must not take what was replayed
    if (progress)
      progress->add();
  }
  progress.reset();
  outputs.commit();
  std::printf("digest %016llx\n", static_cast<unsigned long long>(replayer.digest()));
  return tally.status(o.fail_on_alarm);
}

} // namespace

RIM_COMMAND(replay, "run the onboard monitor over logs and write its alarms, labels and a figure",
            cmd_replay)
