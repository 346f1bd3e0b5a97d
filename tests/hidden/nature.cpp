// SPDX-License-Identifier: MIT
// nature --seed N [--family F|any] --out DIR --truth FILE: measured logs of a vehicle that hides
// something from its simulation, and, elsewhere, what. Exit 0; 2 usage; 3 anything else.
#include <cstdio>
#include <filesystem>

#include "nature.hpp"
#include "program.hpp"

namespace {

void list() {
  for (const nature::Family &f : nature::families())
    std::printf("%-18s %-18s %s\n", f.name, f.cause, f.what);
  for (const nature::Family &f : nature::nulls())
    std::printf("%-18s %-18s %s\n", f.name, "(nothing)", f.what);
  std::puts(
      "two                                   two of the first list with different causes\n"
      "null                                  one of the second list\n"
      "any                                   20 % nulls, 15 % two, else one effect\n"
      "each                                  seed modulo 40: every family, null and six of two");
}

} // namespace

int main(int argc, char **argv) {
  return run_as("nature", [&] {
    rim::cli::Arguments app("logs of a vehicle with an effect hidden in them, drawn from a seed",
                            "nature");
    std::uint64_t seed = 1;
    std::string family = "any", folder, truth;
    bool only_list = false;
    app.add_flag("--list", only_list, "the families, and what a diagnosis should call them");
    app.add_option("--seed", seed, "the case");
    app.add_option("--family", family, "a family, null, two, any or each");
    app.add_option("--out", folder, "folder for run_*.csv and holdout_*.csv");
    app.add_option("--truth", truth, "file for what is hidden; not in the folder of the logs");
    app.footer("Example: nature --seed 7 --family hinge --out /tmp/case --truth /tmp/truth.json");
    if (!app.parse(argc, argv))
      return 0;
    if (only_list) {
      list();
      return 0;
    }
    if (folder.empty() || truth.empty())
      throw rim::UsageError("--out and --truth are needed");
    namespace fs = std::filesystem;
    if (fs::weakly_canonical(fs::absolute(truth)).parent_path() ==
        fs::weakly_canonical(fs::absolute(folder)))
      throw rim::UsageError("--truth must not lie beside the logs");
    std::vector<nature::Record> records;
    const nature::Case c = nature::draw_case(seed, family, records);
    nature::write_logs(c, records, folder);
    nature::write_truth(c, records, truth);
    return 0;
  });
}
