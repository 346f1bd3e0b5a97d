// SPDX-License-Identifier: MIT
// oracle --truth T --out DIR [--silent]: the diagnosis of one who knows the truth, or, silent, of
// one who never finds anything. The grader must give the first everything and the second nothing.
// Exit as rim diagnose: 1 when something was found.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "program.hpp"

using Json = nlohmann::json;

namespace {

Json diagnosis_of(const Json &truth, bool silent) {
  Json findings = Json::array(), channels = Json::object();
  for (const Json &e : truth.at("effects"))
    if (!silent)
      findings.push_back({{"channel", e.at("channel")},
                          {"cause", e.at("cause")},
                          {"region", e.at("gate").is_null() ? Json::object() : e.at("gate")},
                          {"separable", true}});
  const char *rmse = silent ? "rmse_before" : "rmse_true";
  const char *nll = silent ? "nll_before" : "nll_true";
  for (const auto &[name, best] : truth.at("holdout").items())
    channels[name] = {{"rmse_before", best.at("rmse_before")},
                      {"rmse_after", best.at(rmse)},
                      {"nll_before", best.at("nll_before")},
                      {"nll_after", best.at(nll)}};
  return {{"schema", "rim-diagnosis/1"},
          {"verdict", findings.empty() ? "adequate" : "inadequate"},
          {"findings", findings},
          {"gain", {{"channels", channels}}}};
}

void write(const Json &truth, bool silent, const std::string &folder) {
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/diagnosis.json") << diagnosis_of(truth, silent).dump() << "\n";
  std::ofstream labels(folder + "/labels.csv");
  labels << "log,row,t_s,finding\n";
  for (const Json &log : truth.at("logs")) {
    if (log.at("holdout"))
      continue;
    std::size_t row = 0;
    for (const Json &acts : log.at("acts"))
      labels << log.at("file").get<std::string>() << "," << ++row << ",,"
             << (silent ? 0 : acts.get<int>()) << "\n";
  }
}

} // namespace

int main(int argc, char **argv) {
  return run_as("oracle", [&] {
    rim::cli::Arguments app("a diagnosis from the truth", "oracle");
    std::string truth_path, folder;
    bool silent = false;
    app.add_option("--truth", truth_path).required();
    app.add_option("--out", folder).required();
    app.add_flag("--silent", silent);
    if (!app.parse(argc, argv))
      return 0;
    std::ifstream in(truth_path);
    const Json truth = Json::parse(in);
    write(truth, silent, folder);
    return silent || truth.at("effects").empty() ? 0 : 1;
  });
}
