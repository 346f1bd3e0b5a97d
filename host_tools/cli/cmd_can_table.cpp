// SPDX-License-Identifier: MIT
// rim can-table: which CAN signals are the values of a model's rows, from a DBC into the flight
// image.
#include "bus/can_table.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "rim/can_table.h"
#include "util/atomic_file.hpp"
#include "util/error.hpp"

#include <cstdio>

namespace {

const char *const kFooter =
    "With the table rimd can read its rows from CAN (`input = can`), and rim replay can read logs\n"
    "of `candump -L`.\n"
    "Without --map a value comes from the signal of the same name with _ for the dot: "
    "s_altitude_m\n"
    "for s.altitude_m. A map is TOML:\n"
    "  schema = \"rim-can/1\"\n"
    "  trigger = \"State\"            # message that completes a row (default: the last to "
    "arrive)\n"
    "  time = \"State.Clock\"         # default: the time of reception; also time_scale = 0.001\n"
    "  [[signal]]\n"
    "  name = \"s.altitude_m\"        # of the model\n"
    "  from = \"State.Altitude\"      # of the DBC; also scale, offset, min, max\n\n"
    "Example:\n"
    "  rim can-table --dbc vehicle.dbc --model lander.rim --out lander_can.rim\n"
    "  rim replay --model lander_can.rim flight.candump";

int cmd_can_table(int argc, char **argv) {
  std::string dbc, map, model, out;
  rim::cli::Arguments app{"Compile a table of CAN signals from a DBC into a flight image.",
                          "rim can-table"};
  app.add_option("--dbc", dbc, "description of the bus")
      ->required()
      ->type_name("FILE.dbc")
      ->reads();
  app.add_option("--map", map, "map from signals to values")->type_name("FILE.toml")->reads();
  app.add_option("--model", model, "flight image written by rim train")
      ->required()
      ->type_name("FILE.rim")
      ->reads();
  app.add_option("--out", out, "where to write the image with the table")
      ->required()
      ->type_name("FILE.rim")
      ->check(rim::cli::new_or_image())
      ->writes();
  app.footer(kFooter);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  const rim::LoadedImage image = rim::load_image(model);
  const rim::Dbc bus = rim::read_dbc(dbc);
  const auto table = rim::compile_can_table(bus, map, rim::row_names(image.view(), model));
  const auto bytes = rim::with_can_table(image.view(), table);
  rim::AtomicFile file(out);
  file.write(bytes.data(), bytes.size());
  file.commit();
  rim_can_table view;
  (void)rim_can_table_open(&view, table.data(), table.size());
  std::printf("%s: %u values from %u signals of %u messages, table of %zu bytes; a row is complete "
              "%s, its time is %s\n",
              out.c_str(), view.values, view.signals, view.frames, table.size(),
              view.trigger == RIM_CAN_TABLE_NONE ? "when all have come" : "with its trigger",
              view.time == RIM_CAN_TABLE_NONE ? "that of reception" : "a signal");
  return rim::EXIT_FINE;
}

} // namespace

// A name with a hyphen is beyond RIM_COMMAND.
static const rim::CommandRegistration rim_command_can_table{
    "can-table", "compile the CAN signals that make a model's rows into its flight image",
    cmd_can_table};
