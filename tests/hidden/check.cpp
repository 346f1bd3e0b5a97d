// SPDX-License-Identifier: MIT
// check --truth T --logs DIR: are the logs what the truth says? Exit 1, with every complaint, when
// not: the shape of a case; no truth beside the logs; what is left of the residuals after the
// hidden effect has the noise's own moments; the effect gains the likelihood that it should; the
// faulty rows are faulty and no others. The bounds are five standard deviations of the statistic.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.hpp"

using Json = nlohmann::json;

namespace {

struct Csv {
  std::vector<std::string> names;
  std::map<std::string, std::vector<double>> column;
  std::size_t rows = 0;
};

int complaints = 0;

void expect(bool ok, const std::string &what) {
  if (ok)
    return;
  ++complaints;
  std::printf("%s\n", what.c_str());
}

Csv read_csv(const std::string &path) {
  std::ifstream in(path);
  Csv csv;
  std::string line, word;
  std::getline(in, line);
  for (std::istringstream words(line); std::getline(words, word, ',');)
    csv.names.push_back(word);
  for (; std::getline(in, line); ++csv.rows) {
    std::istringstream words(line);
    for (std::size_t i = 0; std::getline(words, word, ','); ++i)
      csv.column[csv.names.at(i)].push_back(std::stod(word));
  }
  return csv;
}

// Of the rows that are measurements, all logs of a channel: residuals in sd, the effect in sd.
struct Channel {
  std::vector<double> left, effect, ratio;
  std::vector<std::size_t> log;
  bool quantised = true;
  double llr = 0.0; // of the run logs, realised
};

bool in_gate(const Json &gate, const Csv &csv, std::size_t row) {
  if (gate.is_null())
    return true;
  double distance = 0.0;
  for (std::size_t i = 0; i < gate.at("features").size(); ++i) {
    const double v = csv.column.at(gate.at("features")[i])[row];
    const double low = gate.at("lower")[i], high = gate.at("upper")[i];
    const double slack = 1e-8 * (std::abs(low) + std::abs(high)); // the logs hold nine digits
    if (v < low - slack || v > high + slack)
      return false;
    distance += std::pow((2.0 * v - low - high) / (high - low), 2.0);
  }
  return !gate.at("ellipse").get<bool>() || distance < 1.0;
}

bool is_fault(const Json &e) { return e.at("kind") == "dropout" || e.at("kind") == "stuck"; }

// Rows of one log into `out`; faults are compared and left out.
void collect(const Json &truth, const Json &log, const Csv &csv, std::size_t number,
             const std::string &name, Channel &out) {
  const auto &z = csv.column.at("z." + name), &m = csv.column.at("m." + name),
             &sd = csv.column.at("sd." + name);
  const Json &effects = log.at("effect_sd");
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < csv.rows; ++i) {
    double ratio = 1.0;
    bool fault = false, alone = truth.at("effects").size() == 1;
    for (const Json &e : truth.at("effects")) {
      if (e.at("channel") != name)
        continue;
      if (e.at("kind") == "variance" && in_gate(e.at("gate"), csv, i))
        ratio *= e.at("size").get<double>();
      if (!is_fault(e))
        continue;
      fault = e.at("kind") == "dropout" ? std::abs(z[i]) <= 0.0
                                        : i > 0 && std::abs(z[i] - z[i - 1]) <= 0.0;
      if (alone)
        wrong += fault != (log.at("acts")[i].get<int>() != 0) ? 1 : 0;
    }
    if (fault)
      continue;
    const double e = effects.contains(name) ? effects.at(name)[i].get<double>() : 0.0;
    const double r = (z[i] - m[i]) / sd[i];
    out.left.push_back((r - e) / std::sqrt(ratio));
    out.effect.push_back(e);
    out.log.push_back(number);
    if (!log.at("holdout"))
      out.llr += 0.5 * (r * r - (r - e) * (r - e)) / ratio;
    if (truth.at("noise") == "quantised") {
      const double steps = z[i] / (sd[i] * truth.at("noise_parameter").get<double>());
      out.quantised =
          out.quantised && std::abs(steps - std::round(steps)) < 1e-4 + 1e-8 * std::abs(steps);
    }
  }
  expect(wrong == 0, name + ": " + std::to_string(wrong) + " rows wrongly flagged");
}

void check_noise(const Json &truth, const std::string &name, const Channel &c) {
  const double n = static_cast<double>(c.left.size());
  const double parameter = truth.at("noise_parameter");
  const std::string noise = truth.at("noise");
  double mean = 0.0, var = 0.0, lag = 0.0, fourth = 0.0;
  for (std::size_t i = 0; i < c.left.size(); ++i) {
    mean += c.left[i] / n;
    var += c.left[i] * c.left[i] / n;
    fourth += std::pow(c.left[i], 4.0) / n;
    if (i > 0 && c.log[i] == c.log[i - 1])
      lag += c.left[i] * c.left[i - 1] / n;
  }
  const double rho = noise == "autocorrelated" ? parameter : 0.0;
  const double longer = (1.0 + rho) / (1.0 - rho);
  double wanted = 1.0;
  if (noise == "sd_off")
    wanted = parameter * parameter;
  if (noise == "quantised")
    wanted += parameter * parameter / 12.0;
  const double tails = noise == "heavy_tailed" ? 60.0 : 1.0; // t of 4: no fourth moment
  const auto near = [n](double value, double target, double scale) {
    return std::abs(value - target) < 5.0 * std::sqrt(scale / n);
  };
  const auto text = [&name](const char *what, double value) {
    return name + ": " + what + " of what is left " + std::to_string(value);
  };
  expect(near(mean, 0.0, wanted * longer), text("mean", mean));
  expect(near(var, wanted, 2.0 * wanted * wanted * longer * tails), text("variance", var));
  expect(near(lag / var, rho, longer), text("lag-1 correlation", lag / var));
  if (noise == "heavy_tailed")
    expect(fourth / (var * var) > 3.3, text("kurtosis", fourth / (var * var)));
  else
    expect(near(fourth / (var * var), 3.0, 24.0 * longer * longer),
           text("kurtosis", fourth / (var * var)));
  if (noise == "quantised")
    expect(c.quantised, name + ": values between the steps");
}

void check_evidence(const Json &truth, const std::string &name, const Channel &c) {
  double wanted = 0.0;
  bool mean = false;
  for (const Json &e : truth.at("effects")) {
    if (e.at("channel") != name || e.at("kind") != "mean")
      continue;
    mean = true;
    wanted = std::max(wanted, e.at("llr").get<double>());
  }
  if (!mean)
    return;
  expect(wanted >= 30.0, name + ": little evidence was hidden, " + std::to_string(wanted));
  expect(c.llr > wanted - 5.0 * std::sqrt(2.0 * wanted),
         name + ": the true model gains " + std::to_string(c.llr) + " nats instead of " +
             std::to_string(wanted));
}

void check_shape(const Json &truth, const std::string &folder) {
  std::size_t rows = 0, files = 0;
  for (const auto &entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool log = name.rfind("run_", 0) == 0 || name.rfind("holdout_", 0) == 0;
    files += log ? 1 : 0;
    expect(log && entry.path().extension() == ".csv", "beside the logs: " + name);
  }
  expect(files == truth.at("logs").size(), "number of logs");
  for (const Json &log : truth.at("logs"))
    rows += log.at("holdout") ? 0 : log.at("rows").get<std::size_t>();
  expect(rows >= 1490 && rows <= 4000, "rows: " + std::to_string(rows));
  expect(truth.at("channels").size() >= 2 && truth.at("channels").size() <= 4, "channels");
}

void check_case(const Json &truth, const std::string &folder) {
  check_shape(truth, folder);
  std::map<std::string, Channel> channels;
  std::size_t number = 0;
  for (const Json &log : truth.at("logs")) {
    const Csv csv = read_csv(folder + "/" + log.at("file").get<std::string>());
    expect(csv.rows == log.at("rows"), "rows of " + log.at("file").get<std::string>());
    std::size_t features = 0;
    for (const std::string &name : csv.names)
      features += name[0] == 'x' || name[0] == 'u' || name.rfind("s.", 0) == 0 ? 1 : 0;
    expect(features >= 10 && features <= 15, "features: " + std::to_string(features));
    for (const Json &c : truth.at("channels"))
      collect(truth, log, csv, number, c.at("name"), channels[c.at("name")]);
    ++number;
    if (truth.at("effects").empty())
      for (const Json &acts : log.at("acts"))
        expect(acts == 0, "a null acts");
  }
  for (const auto &[name, channel] : channels) {
    check_noise(truth, name, channel);
    check_evidence(truth, name, channel);
  }
}

} // namespace

int main(int argc, char **argv) {
  return run_as("check", [&] {
    rim::cli::Arguments app("are the logs what the truth says", "check");
    std::string truth, logs;
    app.add_option("--truth", truth).required();
    app.add_option("--logs", logs).required();
    if (!app.parse(argc, argv))
      return 0;
    std::ifstream in(truth);
    check_case(Json::parse(in), logs);
    return complaints > 0 ? 1 : 0;
  });
}
