// SPDX-License-Identifier: MIT
// rim show: what a file holds.
#include "bus/model_dbc.hpp"
#include "bus/model_lcm.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/schema.hpp"
#include "report/show.hpp"
#include "rim/can.h"
#include "util/atomic_file.hpp"

#include <cstdio>
#include <filesystem>
#include <optional>

namespace {

const char *const kFooter =
    "FILE is a flight image, alarms (replay --alarms), the folder or diagnosis.json of a\n"
    "diagnosis, an extension.toml or a log.\n"
    "--dbc prints the DBC of the image's alarms: the outcomes and features have their names and\n"
    "units there, so that any CAN tool shows them. --lcm prints a type for lcm-gen whose "
    "constants\n"
    "are the codes in our LCM messages and the indices of the image's features and outcomes.\n\n"
    "Example:\n"
    "  rim show lander.rim\n"
    "  rim show lander.rim --json | jq '.features[].name'\n"
    "  rim show --dbc lander.rim --node 1 > lander.dbc\n"
    "  rim show --lcm lander.rim > model_constants_t.lcm && lcm-gen -p model_constants_t.lcm";

struct Options {
  std::string file, schema;
  bool json = false, dbc = false, lcm = false, can_fd = false;
  unsigned node = 1;
};

// What `rim diagnose --out FOLDER` left is shown by the folder's name too.
std::string file_of(const std::string &path) {
  const std::string diagnosis = path + "/diagnosis.json";
  std::error_code ignored;
  return std::filesystem::is_regular_file(diagnosis, ignored) ? diagnosis : path;
}

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
  rim::cli::Arguments app{
      "Show what a flight image, alarms, a diagnosis, an extension or a log holds.", "rim show"};
  app.add_option("FILE", o.file, "the file")->required();
  const rim::cli::Option json = app.add_flag("--json", o.json, "print one JSON object");
  app.add_option("--schema", o.schema, "roles, units and rates of a log with other column names")
      ->type_name("FILE.toml");
  const rim::cli::Option dbc =
      app.add_flag("--dbc", o.dbc, "print the DBC of an image's alarms")->excludes(json);
  app.add_option("--node", o.node, "for that DBC: the CAN node number (default 1)")
      ->check(rim::cli::range(0u, RIM_CAN_MAX_NODE))
      ->needs(dbc);
  app.add_flag("--can-fd", o.can_fd, "for that DBC: the detail is one CAN FD frame of 64 bytes")
      ->needs(dbc);
  app.add_flag("--lcm", o.lcm,
               "print a type for lcm-gen with the codes and indices of an image's LCM messages")
      ->excludes(json)
      ->excludes(dbc);
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  o.file = file_of(o.file);
  if (o.dbc || o.lcm) {
    const std::string text = rim::read_file(o.file);
    const rim::ImageFacts facts = rim::facts_of_image({text.begin(), text.end()}, o.file);
    const std::string made =
        o.lcm ? rim::model_lcm(facts) : rim::model_dbc(facts, o.node, o.can_fd);
    std::fputs(made.c_str(), stdout);
    return rim::EXIT_FINE;
  }
  const rim::Shown what = shown(o);
  std::fputs(o.json ? what.json.c_str() : what.text.c_str(), stdout);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(show, "print what a flight image, alarms, a diagnosis, an extension or a log holds",
            cmd_show)
