// SPDX-License-Identifier: MIT
// rim-thesis merge: folds the files of a campaign's shards into one.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "thesis/shard.hpp"

#include <cstdio>

namespace {

int cmd_merge(int argc, char **argv) {
  std::vector<std::string> files;
  std::string out;
  rim::cli::Arguments app{
      "Fold the files that the shards of one campaign wrote into one, in the order of the "
      "units, to the same bits as one machine would have given.",
      "rim-thesis merge"};
  app.add_option("FILE", files, "files written with --shard I/N")->required();
  app.add_option("--out", out, "the folded file")->required();
  app.footer("Example:\n  rim-thesis experiment golf --shard 1/2 --out a.json   # on one machine\n"
             "  rim-thesis experiment golf --shard 2/2 --out b.json   # on another\n"
             "  rim-thesis merge a.json b.json --out golf.json");
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  const rim::Campaign merged = rim::merge_campaigns(files);
  rim::write_campaign(merged, out);
  std::printf("%s: %zu of %llu units%s\n", out.c_str(), merged.units.size(),
              static_cast<unsigned long long>(merged.total),
              merged.complete() ? "" : " (shards are missing)");
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(merge, "fold the files of a campaign's shards into one", cmd_merge)
