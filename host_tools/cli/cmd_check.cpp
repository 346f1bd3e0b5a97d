// SPDX-License-Identifier: MIT
// rim check: would the monitor understand these logs.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/log.hpp"
#include "log/schema.hpp"
#include "replay/understand.hpp"
#include "util/atomic_file.hpp"

#include <cstdio>
#include <optional>

namespace {

const char *const kFooter =
    "The command checks the columns, the rate of the rows, the gaps, and the values against the\n"
    "trained ranges, where a wrong unit shows. It prints why the monitor could not judge a log,\n"
    "in the words of rim replay. It does not report alarms.\n"
    "Exit status 0: every log would be understood; 3: one would not.\n\n"
    "Example:\n"
    "  rim check rover/run_0013.csv --schema rover.toml --model rover.rim";

struct Options {
  std::vector<std::string> logs;
  std::string model, schema;
  bool all = false;
};

rim::Log read_one(const std::string &path, const rim::Schema *schema, const rim::Replayer &replayer,
                  const Options &o) {
  rim::ReadOptions options = replayer.read_options(o.model);
  options.skip_bad_time = true; // counted, like the monitor does
  return rim::read_log(path, schema, options);
}

int cmd_check(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Check whether the monitor would understand logs, and say why not.",
                          "rim check"};
  app.add_option("LOG", o.logs, "logs")->required();
  app.add_option("--model", o.model, "flight image written by rim train")
      ->required()
      ->type_name("MODEL.rim");
  app.add_option("--schema", o.schema, "roles, units and rates of logs with other column names")
      ->type_name("FILE.toml");
  app.add_flag("--all", o.all, "list every column, not only those out of range");
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  std::optional<rim::Schema> schema;
  if (!o.schema.empty())
    schema = rim::read_schema(o.schema);
  const std::string text = rim::read_file(o.model);
  const std::vector<std::uint8_t> image(text.begin(), text.end());
  const rim::ImageFacts facts = rim::facts_of_image(image, o.model);
  rim::Replayer replayer(image, o.model);
  bool understood = true;
  for (const std::string &path : o.logs) {
    const rim::Log log = read_one(path, schema ? &*schema : nullptr, replayer, o);
    const rim::Understanding u = rim::understand(&replayer, facts, log);
    std::fputs(rim::understanding_text(u, log, o.all).c_str(), stdout);
    understood = understood && u.why_not.empty();
  }
  return understood ? rim::EXIT_FINE : rim::EXIT_DATA;
}

} // namespace

RIM_COMMAND(check, "check whether the monitor would understand logs, and say why not", cmd_check)
