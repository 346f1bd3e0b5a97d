// SPDX-License-Identifier: MIT
// thesis/shard.hpp - campaigns of independent units, split over machines and folded to the same
// bits.
//
// Unit i of a campaign is a function of the configuration and i alone. A shard I/N computes the
// units i with i % N == I - 1 and writes them to a file; merge_campaigns() puts the files together.
// Whoever summarises walks the units in the order of their number, so the sums are the same however
// they were split. JSON keeps doubles exactly (shortest form that reads back to the same bits).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "util/shard.hpp"

namespace rim {

struct Campaign {
  std::string kind;      // e.g. "golf-f1"
  nlohmann::json config; // everything that decides the units' values
  std::uint64_t total = 0;
  std::map<std::uint64_t, nlohmann::json> units;
  bool complete() const { return units.size() == total; }
};

// Computes the units that the shard owns, in parallel, into campaign->units; `label`: of the
// progress bar. Whatever the number of threads and shards, unit i is unit_value(i).
void compute_units(Campaign *campaign, const Shard &shard, const std::string &label,
                   const std::function<nlohmann::json(std::uint64_t)> &unit_value);

void write_campaign(const Campaign &campaign, const std::string &path);
// DataError when it is no campaign file or a unit's number is out of range.
Campaign read_campaign(const std::string &path);
// DataError unless the campaign is of this kind and none of its shards is missing.
void require_whole(const Campaign &campaign, const std::string &kind);
// DataError when kind, configuration or total differ, or a unit comes twice with different values.
Campaign merge_campaigns(const std::vector<std::string> &paths);

} // namespace rim
