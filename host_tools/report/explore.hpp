// SPDX-License-Identifier: MIT
// report/explore.hpp - the part of a page that can be touched: hover, zoom, pan, selection,
// downloads. By dygraphs, which is built into the page when it is written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rim::report {

struct ExploreColumn {
  std::string name, unit;
  std::vector<double> values; // rows
};

// An outcome: measured, expected, and where there is one the extended model's; its sd.
struct ExploreChannel {
  std::string name, unit;
  std::vector<double> z, m, after, sd; // rows each; after and sd may be empty
};

struct ExploreLog {
  std::string name;
  std::size_t first = 0, rows = 0;
};

struct ExploreFinding {
  int number = 0;
  std::string text;
};

struct Explore {
  bool is_replay = false;
  std::vector<ExploreLog> logs;
  std::vector<double> time; // s, of each row, as in its log
  std::vector<ExploreChannel> channels;
  std::vector<ExploreColumn> features;
  std::vector<ExploreFinding> findings;         // at most 16 are shown
  std::vector<std::uint16_t> acts;              // rows: bit i for findings[i]
  std::size_t first_log = 0, first_channel = 0; // shown at first
};

// A section, hidden until its script runs, and the scripts for the end of the body. More rows than
// fit in some 3 MB are thinned, and the section says so. Both empty where dygraphs is not
// installed (Debian: libjs-dygraphs; RIM_DYGRAPHS names its folder).
struct ExploreParts {
  std::string section, scripts;
};
ExploreParts explore_parts(const Explore &data);

// dygraphs and its style sheet, as text for a page; empty where it is not installed.
struct Library {
  std::string script, style;
};
Library dygraphs();

} // namespace rim::report
