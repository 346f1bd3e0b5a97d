// SPDX-License-Identifier: MIT
// rim schema: proposes what the columns of foreign logs are.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/propose.hpp"
#include "log/read.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <cstdio>

namespace {

const char *const kFooter =
    "The time and its unit, the rate, roles, units, angles, constant and equal columns are "
    "guessed\n"
    "from names and values. GUESS marks a guess, DECIDE what only you can know: read it before "
    "you\n"
    "use it. data/README.md explains every key of a schema.\n\n"
    "Example:\n"
    "  rim schema rover/run_*.csv --out rover.toml\n"
    "  rim train rover/run_*.csv --schema rover.toml --out rover.rim";

void refuse_other_formats(const std::string &path) {
  const rim::LogForm form = rim::form_of_log(rim::read_file(path));
  if (form == rim::LogForm::candump)
    throw rim::DataError(path + ": holds CAN frames; the DBC of the bus says what they are: rim "
                                "can-table");
  if (form == rim::LogForm::lcm_events)
    throw rim::DataError(path + ": is an LCM event log, which carries no names: give those of the "
                                "values of RIM_OBSERVATION in a schema, observation = "
                                "[\"s.NAME\", ...]");
}

int cmd_schema(int argc, char **argv) {
  std::vector<std::string> logs;
  std::string out;
  rim::cli::Arguments app{"Propose a schema for logs with foreign column names.", "rim schema"};
  app.add_option("LOG", logs, "CSV logs of the same columns, any delimiter")
      ->required()
      ->type_name("...");
  app.add_option("--out", out, "write the schema there (default: standard output)")
      ->type_name("FILE.toml");
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  for (const auto &path : logs)
    refuse_other_formats(path);
  const std::string text = rim::proposal_text(rim::propose_schema(logs));
  if (out.empty()) {
    std::fputs(text.c_str(), stdout);
    return rim::EXIT_FINE;
  }
  rim::AtomicFile file(out);
  file.write(text);
  file.commit();
  std::printf("%s written: decide what is marked DECIDE, check what is marked GUESS\n",
              out.c_str());
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(schema, "propose a schema for logs with foreign column names", cmd_schema)
