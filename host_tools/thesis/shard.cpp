// SPDX-License-Identifier: MIT
#include "thesis/shard.hpp"

#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"
#include "util/version.hpp"

#include <algorithm>

namespace rim {

namespace {

constexpr const char *kSchema = "rim-campaign/1";

} // namespace

void compute_units(Campaign *campaign, const Shard &shard, const std::string &label,
                   const std::function<nlohmann::json(std::uint64_t)> &unit_value) {
  std::vector<std::uint64_t> mine;
  for (std::uint64_t unit = 0; unit < campaign->total; ++unit) {
    if (shard.owns(unit))
      mine.push_back(unit);
  }
  std::vector<nlohmann::json> values(mine.size());
  Progress progress(label, mine.size());
  parallel_for(mine.size(), [&](std::size_t k) {
    values[k] = unit_value(mine[k]);
    progress.add();
  });
  for (std::size_t k = 0; k < mine.size(); ++k)
    campaign->units[mine[k]] = std::move(values[k]);
}

void write_campaign(const Campaign &campaign, const std::string &path) {
  nlohmann::json units = nlohmann::json::array();
  for (const auto &[number, value] : campaign.units)
    units.push_back({{"unit", number}, {"value", value}});
  const nlohmann::json file = {{"schema", kSchema},       {"version", RIM_VERSION},
                               {"kind", campaign.kind},   {"config", campaign.config},
                               {"total", campaign.total}, {"units", units}};
  AtomicFile out(path);
  out.write(file.dump(1) + "\n");
  out.commit();
}

Campaign read_campaign(const std::string &path) {
  const std::string text = read_file(path);
  try {
    const auto file = nlohmann::json::parse(text);
    if (file.at("schema") != kSchema)
      throw DataError(path + ": not a " + kSchema + " file");
    Campaign campaign{file.at("kind"), file.at("config"), file.at("total"), {}};
    for (const auto &unit : file.at("units")) {
      const std::uint64_t number = unit.at("unit");
      if (number >= campaign.total)
        throw DataError(path + ": unit " + std::to_string(number) + " of " +
                        std::to_string(campaign.total));
      campaign.units[number] = unit.at("value");
    }
    return campaign;
  } catch (const nlohmann::json::exception &e) {
    throw DataError(path + ": not a " + kSchema + " file: " + e.what());
  }
}

Campaign merge_campaigns(const std::vector<std::string> &paths) {
  if (paths.empty())
    throw UsageError("merge: no files");
  Campaign merged = read_campaign(paths.front());
  for (std::size_t i = 1; i < paths.size(); ++i) {
    const Campaign next = read_campaign(paths[i]);
    if (next.kind != merged.kind || next.config != merged.config || next.total != merged.total)
      throw DataError(paths[i] + ": of another campaign than " + paths.front());
    for (const auto &[number, value] : next.units) {
      const auto [place, fresh] = merged.units.emplace(number, value);
      if (!fresh && place->second != value)
        throw DataError(paths[i] + ": unit " + std::to_string(number) +
                        " differs from the one in an earlier file");
    }
  }
  return merged;
}

void require_whole(const Campaign &campaign, const std::string &kind) {
  if (campaign.kind != kind)
    throw DataError("campaign of kind '" + campaign.kind + "', not " + kind);
  if (!campaign.complete())
    throw DataError(kind + ": shards are missing");
}

} // namespace rim
