// SPDX-License-Identifier: MIT
// grade --truth T --diagnosis DIR [--exit N] [--seconds S] [--said STDERR]: a case's line of JSON
// on stdout. grade --summary LINES.jsonl [--floors FILE]: the figures; exit 1 when a floor is not
// reached. Exit 2 usage, 3 unreadable input.
#include <cstdio>
#include <fstream>

#include "grade.hpp"
#include "program.hpp"

namespace {

std::string last_line(const std::string &path) {
  std::ifstream in(path);
  std::string line, last = "nothing on stderr";
  while (std::getline(in, line))
    last = line;
  return last;
}

int summarise(const std::string &path, const std::string &floors) {
  std::ifstream in(path);
  if (!in)
    throw std::runtime_error(path + ": cannot be read");
  std::vector<grade::Json> lines;
  for (std::string line; std::getline(in, line);)
    lines.push_back(grade::Json::parse(line));
  std::fputs(grade::summary_text(lines).c_str(), stdout);
  if (floors.empty())
    return 0;
  int failed = 0;
  std::printf("\n%s", grade::check_floors(lines, floors, failed).c_str());
  return failed > 0 ? 1 : 0;
}

} // namespace

int main(int argc, char **argv) {
  return run_as("grade", [&] {
    rim::cli::Arguments app("a diagnosis beside the truth", "grade");
    std::string truth, diagnosis, said, summary, floors;
    int exit_status = 0;
    double seconds = 0.0;
    app.add_option("--truth", truth, "what nature hid");
    app.add_option("--diagnosis", diagnosis, "the folder that rim diagnose wrote");
    app.add_option("--exit", exit_status, "its exit status");
    app.add_option("--said", said, "what it wrote to stderr: quoted when it failed");
    app.add_option("--seconds", seconds, "the time it took");
    app.add_option("--summary", summary, "lines of many cases: print the figures");
    app.add_option("--floors", floors, "lines 'figure bound' that must hold");
    if (!app.parse(argc, argv))
      return 0;
    if (!summary.empty())
      return summarise(summary, floors);
    if (truth.empty() || diagnosis.empty())
      throw rim::UsageError("--summary, or --truth and --diagnosis, is needed");
    grade::Json line = grade::grade_case(truth, diagnosis, exit_status, seconds);
    if (line["failed"].get<bool>())
      line["notes"].push_back(last_line(said));
    std::puts(line.dump().c_str());
    return 0;
  });
}
