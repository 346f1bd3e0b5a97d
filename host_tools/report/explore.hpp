// SPDX-License-Identifier: MIT
// report/explore.hpp - the part of a page that can be touched: hover, zoom, pan, selection,
// downloads. By dygraphs, which is built into the page when it is written.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace rim::report {

// key: the name of its column, by which a region names it.
struct ExploreColumn {
  std::string name, unit, key;
  std::vector<double> values; // rows
};

// An outcome: measured, expected, and where there is one the extended model's; its sd.
struct ExploreChannel {
  std::string name, unit, key;
  std::vector<double> z, m, after, sd; // rows each; after and sd may be empty
};

struct ExploreLog {
  std::string name;
  std::size_t first = 0, rows = 0;
};

// A box or an ellipsoid over features; where it is open the data end, not the region.
struct ExploreRegion {
  std::vector<std::string> features; // keys; "m.KEY" is what was expected of a channel
  std::vector<double> lower, upper, center, inverse_shape;
  std::vector<std::pair<bool, bool>> open;
  bool is_ellipse = false;
};

struct ExploreFinding {
  int number = 0; // as it is counted beside its rows
  std::string text;
  int log = -1;     // of one log; -1: of all
  int channel = -1; // index; -1: not among those shown
  unsigned bit = 0; // in acts
  ExploreRegion region{};
};

struct Explore {
  bool is_replay = false;
  std::vector<ExploreLog> logs;
  std::vector<double> time; // s, of each row, as in its log
  std::vector<ExploreChannel> channels;
  std::vector<ExploreColumn> features;
  std::vector<ExploreFinding> findings;         // those of all logs, or of one: at most 16
  std::vector<std::uint16_t> acts;              // rows: a finding's bit
  std::size_t first_log = 0, first_channel = 0; // shown at first
};

// A section, hidden until its script runs, and the scripts for the end of the body. More rows than
// fit in some 3 MB are thinned, and the section says so. Both empty where dygraphs is not
// installed (Debian: libjs-dygraphs; RIM_DYGRAPHS names its folder).
struct ExploreParts {
  std::string section, scripts;
};
// Links to (id, title) of a page's sections, and to the part that can be touched, where it runs.
std::string jump_list(const std::vector<std::pair<std::string, std::string>> &sections);

ExploreParts explore_parts(const Explore &data);

// dygraphs and its style sheet, as text for a page; empty where it is not installed.
struct Library {
  std::string script, style;
};
Library dygraphs();

} // namespace rim::report
