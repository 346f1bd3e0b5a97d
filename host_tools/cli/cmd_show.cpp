// SPDX-License-Identifier: MIT
// rim show: what a file holds.
#include "bus/model_dbc.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/schema.hpp"
#include "report/show.hpp"
#include "rim/can.h"
#include "util/atomic_file.hpp"

#include <cstdio>
#include <optional>

namespace {

const char *const kFooter =
    "FILE is a flight image, alarms (replay --alarms), a diagnosis.json, an extension.toml or a "
    "log.\n"
    "--dbc prints the DBC of the image's alarms: the outcomes and features have their names and\n"
    "units there, so that any CAN tool shows them.\n\n"
    "Example:\n"
    "  rim show lander.rim\n"
    "  rim show lander.rim --json | jq '.features[].name'\n"
    "  rim show --dbc lander.rim --node 1 > lander.dbc";

struct Options {
  std::string file, schema;
  bool json = false, dbc = false;
  unsigned node = 1;
};

rim::Shown shown(const Options &o) {
  switch (o.schema.empty() ? rim::kind_of_file(o.file) : rim::FileKind::log) {
  case rim::FileKind::image:
    return rim::show_image(o.file);
  case rim::FileKind::alarms:
    return rim::show_alarms(o.file);
  case rim::FileKind::diagnosis:
    return rim::show_diagnosis(o.file);
  case rim::FileKind::extension:
    return rim::show_extension(o.file);
  case rim::FileKind::log:
    break;
  }
  std::optional<rim::Schema> schema;
  if (!o.schema.empty())
    schema = rim::read_schema(o.schema);
  return rim::show_log(rim::read_log(o.file, schema ? &*schema : nullptr));
}

int cmd_show(int argc, char **argv) {
  Options o;
  CLI::App app{"Show what a flight image, alarms, a diagnosis, an extension or a log holds.",
               "rim show"};
  app.add_option("FILE", o.file, "the file")->required()->type_name("");
  CLI::Option *json = app.add_flag("--json", o.json, "as one JSON object");
  app.add_option("--schema", o.schema, "of a log with other column names")->type_name("FILE.toml");
  CLI::Option *dbc =
      app.add_flag("--dbc", o.dbc, "of an image: the DBC of its alarms")->excludes(json);
  app.add_option("--node", o.node, "CAN node number of that DBC (default 1)")
      ->check(CLI::Range(0u, RIM_CAN_MAX_NODE))
      ->needs(dbc);
  app.footer(kFooter);
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  if (o.dbc) {
    const std::string text = rim::read_file(o.file);
    const rim::ImageFacts facts = rim::facts_of_image({text.begin(), text.end()}, o.file);
    std::fputs(rim::model_dbc(facts, o.node).c_str(), stdout);
    return rim::EXIT_FINE;
  }
  const rim::Shown what = shown(o);
  std::fputs(o.json ? (what.json.dump(1) + "\n").c_str() : what.text.c_str(), stdout);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(show, "what an image, alarms, a diagnosis, an extension or a log holds", cmd_show)
