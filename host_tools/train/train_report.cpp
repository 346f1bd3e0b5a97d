// SPDX-License-Identifier: MIT
#include "train/train_report.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "image/facts.hpp"
#include "image/names.hpp"
#include "util/table.hpp"

namespace rim {

std::string outcome_report(const Training &training) {
  const FlightPlan &plan = training.plan;
  std::string text =
      "\nNominal models, each run predicted without itself (R2: part of the variance explained)\n";
  Table table({{"outcome", ""},
               {"unit", ""},
               {"from the commands", "R2"},
               {"error", "rms"},
               {"from the others", "of it"},
               {"how", ""},
               {"run effects", "sd"},
               {"lag-1", "correlation"},
               {"seen from", "offset"},
               {"model", ""}});
  static const char *const how[] = {"residuals", "levels", "integral", "few readings",
                                    "what integrates it", "products"};
  std::string blind, constant;
  for (std::size_t o = 0; o < training.outcomes.size(); ++o) {
    const OutcomeReport &r = training.outcomes[o];
    const std::string words = quantity_of(plan.layout.outcome_names[o]).words;
    const std::string unit = plan.layout.outcome_units[o];
    table.add({words, unit.empty() ? "-" : unit, plan.layout.external ? "-" : cell(r.r2, 3),
               plan.layout.external ? "-" : cell(r.error, 3), cell(r.agreement, 3), how[r.source],
               cell(r.effect, 3), cell(r.rho, 2),
               std::isfinite(r.detectable) ? cell(r.detectable, 3) : "never",
               plan.layout.external ? "your own" : r.model});
    if (!std::isfinite(r.detectable))
      constant += (constant.empty() ? "" : ", ") + words;
    constexpr double poor = 0.3;
    if (!plan.layout.external && r.r2 < poor && r.agreement > 1.0 - poor)
      blind += (blind.empty() ? "" : ", ") + words;
  }
  text += table.text();
  text += "'Seen from' is the constant offset over half of a run that reaches the alarm, in the "
          "outcome's unit\n";
  if (!constant.empty())
    text += "No offset is ever seen in " + constant +
            ": healthy runs teach nothing of how it varies. There the monitor sees only what is "
            "out of range, scatters or repeats\n";
  if (!blind.empty())
    text += "Neither the commands nor the other sensors explain " + blind +
            ". There the monitor sees only what no healthy run did\n";
  return text;
}

namespace {

std::string ordinal(std::size_t n) {
  const std::size_t last = n % 100 / 10 == 1 ? 0 : n % 10;
  return std::to_string(n) + (last == 1 ? "st" : last == 2 ? "nd" : last == 3 ? "rd" : "th");
}

std::string wrapped(const std::vector<std::string> &words, const std::string &indent) {
  std::string text = indent, line;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string word = words[i] + (i + 1 < words.size() ? ", " : "");
    if (line.size() + word.size() > 90) {
      text += line + "\n" + indent;
      line.clear();
    }
    line += word;
  }
  return text + line + "\n";
}

// The runs that set the alarm's score, and what the others reach.
std::string highest_runs(const Training &training) {
  constexpr std::size_t most = 3;
  const std::vector<RunScore> &scores = training.scores;
  const std::vector<std::string> &names = training.plan.layout.outcome_names;
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&scores](std::size_t a, std::size_t b) {
    return scores[a].score > scores[b].score;
  });
  std::vector<double> all;
  for (const RunScore &s : scores)
    all.push_back(s.score);
  // set_alarm_from_runs(): runs that are beyond all others do not count in full.
  const auto most_counted = static_cast<double>(training.plan.thresholds.maxima.back());
  bool counts_less = false;
  std::vector<std::string> told;
  for (std::size_t i = 0; i < std::min(most, order.size()); ++i) {
    const RunScore &s = scores[order[i]];
    const bool is_less = s.score > most_counted + 0.05;
    counts_less = counts_less || is_less;
    told.push_back(fmt::format("{:.1f} in {} ({}{})", s.score, training.paths[order[i]],
                               quantity_of(names[s.channel % names.size()]).words,
                               is_less ? fmt::format(", counts as {:.1f}", most_counted) : ""));
  }
  told.front() = "highest: " + told.front();
  told.back() += fmt::format("; half of the runs reach at most {:.1f}", score_spread(all).middle);
  return wrapped(told, "  ") +
         (counts_less ? "  the highest run counts as much as where it is among those that taught, "
                        "but no\n  less than the next one; runs unlike the others count as the "
                        "next one; and none\n  counts more than the tail of the others allows in "
                        "its place\n"
                      : "");
}

// How the alarm's score follows from the runs' scores.
std::string alarm_sentence(const Training &training, double promised, double false_alarm) {
  const Thresholds &t = training.plan.thresholds;
  const std::size_t runs = t.maxima.size();
  const auto alarm = static_cast<double>(t.alarm_score);
  const std::string place =
      t.rank == runs ? std::string("highest") : ordinal(runs - t.rank + 1) + " highest";
  const std::string kept = fmt::format(
      "\n  {:.3g} % holds in {:.0f} of 100 sets of runs that one may happen to learn from\n",
      100.0 * std::max(promised, false_alarm), 100.0 * sets_kept(runs));
  if (t.by_tail) {
    std::vector<double> all;
    for (const RunScore &s : training.scores)
      all.push_back(s.score);
    std::sort(all.begin(), all.end());
    return fmt::format("  alarm at score {:.3g}: by the tail of the upper half of the {} runs' "
                       "largest scores, which is\n  lower than by the {} of them ({:.3g});{}",
                       alarm, runs, place, all[t.rank - 1], kept);
  }
  const double margin = alarm - static_cast<double>(t.maxima[t.rank - 1]);
  const bool is_limited = is_learnt_again(runs, training.plan.layout.external) &&
                          margin > kMostMarginOfFew - 1e-3;
  return fmt::format(
      "  alarm at score {:.3g}: the {} of the {} runs' largest scores ({:.3g} to {:.3g}) and "
      "{:.2g} more;{}",
      alarm, place, runs, static_cast<double>(t.maxima.front()),
      static_cast<double>(t.maxima.back()), margin,
      is_limited ? "\n  the most for so few runs: the promise is an average over sets of runs\n"
                 : kept);
}

} // namespace

std::string choice_report(const Training &training) {
  const FlightPlan &plan = training.plan;
  std::string text = fmt::format("\nA block is {} rows ({:.3g} s)\n", plan.block_rows,
                                 plan.block_rows * plan.period_s);
  std::vector<std::string> features;
  for (std::size_t i = 0; i < plan.region.size(); ++i) {
    features.push_back(quantity_of(plan.layout.feature_names[plan.region[i]]).words +
                       (plan.region_outcome[i] != 0xffff ? " (as predicted)" : ""));
  }
  const bool all = plan.region.size() >= plan.layout.features();
  text += fmt::format(
      "{} of {} features may describe a region{}\n", plan.region.size(), plan.layout.features(),
      all ? "" : " (the others repeat one of them, or there are more than are searched)");
  return text + wrapped(features, "  ");
}

std::string promise_report(const Training &training, double false_alarm) {
  const Thresholds &t = training.plan.thresholds;
  const std::size_t runs = t.maxima.size();
  const double promised = static_cast<double>(t.promised_rate);
  std::string text = fmt::format("\nCalibration: {} healthy runs, each judged by what the others "
                                 "taught\n",
                                 runs);
  if (promised > false_alarm * (1.0 + 1e-6)) {
    text += fmt::format(
        "  with {} runs no rate below {:.1f} % can be promised, which is used ({:.3g} % was "
        "asked for).\n  {:.0f} runs are the least for {:.3g} %\n",
        runs, 100.0 / static_cast<double>(runs + 1), 100.0 * false_alarm,
        std::ceil(1.0 / false_alarm - 1e-9) - 1.0, 100.0 * false_alarm);
  }
  text += fmt::format("  promised: at most {:.1f} % of healthy runs raise any alarm\n",
                      100.0 * promised);
  return text + alarm_sentence(training, promised, false_alarm) + highest_runs(training);
}

std::string image_report(const std::vector<std::uint8_t> &image) {
  const ImageFacts facts = facts_of_image(image, "image");
  Table table({{"section", ""}, {"size", "bytes"}});
  for (const ImageSectionSize &section : facts.sections)
    table.add({section.name, cell(section.bytes)});
  table.add({"whole image", cell(facts.bytes)});
  table.add({"RAM of one monitor", cell(facts.monitor_bytes)});
  return "\n" + table.text();
}

} // namespace rim
