// SPDX-License-Identifier: MIT
// rim schema: proposes what the columns of foreign logs are.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/propose.hpp"
#include "log/read.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <cstdio>
#include <filesystem>

namespace {

const char *const kFooter =
    "The command guesses from names and values which column is the time and in which unit, the\n"
    "rate of the rows, the roles and units of the columns, and which of them are angles, constant\n"
    "or equal. In the schema GUESS marks a guess and DECIDE what only you can know. Read the\n"
    "schema before you use it. data/README.md explains every key.\n\n"
    "Example:\n"
    "  rim schema rover/run_*.csv --out rover.toml\n"
    "  rim train rover/run_*.csv --schema rover.toml --out rover.rim\n"
    "Example: CAN frames\n"
    "  rim schema drive.candump --dbc rover.dbc --out rover.toml";

// A schema names files beside itself.
void put_beside(const std::string &out, rim::ReaderOptions *reader) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::absolute(out.empty() ? "." : out).parent_path();
  const auto one = [&](std::string &file) {
    if (!file.empty())
      file = fs::proximate(fs::absolute(file), out.empty() ? fs::current_path() : folder).string();
  };
  one(reader->dbc);
  one(reader->packets);
  for (std::string &file : reader->types)
    one(file);
}

int cmd_schema(int argc, char **argv) {
  std::vector<std::string> logs;
  std::string out;
  rim::ReaderOptions reader;
  rim::cli::Arguments app{"Propose a schema for logs with foreign column names.", "rim schema"};
  app.add_option("LOG", logs, "logs of the same columns, of any format that rim reads")
      ->required()
      ->reads();
  app.add_option("--out", out, "write the schema there (default: standard output)")
      ->type_name("FILE.toml")
      ->writes();
  app.add_option("--dbc", reader.dbc, "for candump logs: the DBC that describes their frames")
      ->type_name("FILE.dbc");
  app.add_option("--packets", reader.packets,
                 "for CCSDS packets: a table of their fields, as ccsdspy reads it")
      ->type_name("FILE.csv");
  app.add_option("--types", reader.types,
                 "for LCM event logs: the types of their messages; may be repeated")
      ->type_name("FILE.lcm")
      ->repeated();
  app.add_option("--rows", reader.rows,
                 "for logs with several topics: the topic whose messages make the rows (default:\n"
                 "the one with most messages)")
      ->type_name("TOPIC");
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  std::error_code ignored;
  if (!out.empty() && std::filesystem::is_regular_file(out, ignored))
    throw rim::DataError(out + ": is there already, and may have been edited by hand: it is not "
                               "written over. Give another name, or remove it");
  rim::Proposal proposal = rim::propose_schema(logs, reader);
  put_beside(out, &proposal.reader);
  const std::string text = rim::proposal_text(proposal);
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
