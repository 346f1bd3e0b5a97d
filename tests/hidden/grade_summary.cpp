// SPDX-License-Identifier: MIT
// The figures over many cases.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "grade.hpp"
#include "world/random.hpp"

namespace grade {

namespace {

using Lines = std::vector<Json>;

template <class... Arguments> std::string text(const char *format, Arguments... arguments) {
  char buffer[400];
  std::snprintf(buffer, sizeof buffer, format, arguments...);
  return buffer;
}

// Wilson's interval of a share (Wilson, JASA 1927).
void wilson(Figure &f) {
  const double n = static_cast<double>(f.cases), p = static_cast<double>(f.hits) / n, z = 1.959964;
  const double middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
  const double half = z / (1.0 + z * z / n) * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  f.value = p;
  f.low = std::max(0.0, middle - half);
  f.high = std::min(1.0, middle + half);
}

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  const std::size_t n = v.size();
  return n % 2 == 1 ? v[n / 2] : 0.5 * (v[n / 2 - 1] + v[n / 2]);
}

// 95 % from 1000 resamplings of the cases.
void median_figure(Figure &f, const std::vector<double> &values) {
  f.share = false;
  f.cases = values.size();
  if (values.empty())
    return;
  f.value = median(values);
  rim::world::Random random(1, 0, 9);
  std::vector<double> medians;
  for (int b = 0; b < 1000; ++b) {
    std::vector<double> drawn;
    for (std::size_t i = 0; i < values.size(); ++i)
      drawn.push_back(values[random.below(values.size())]);
    medians.push_back(median(drawn));
  }
  std::sort(medians.begin(), medians.end());
  f.low = medians[25];
  f.high = medians[974];
}

template <class Counts, class Hit>
Figure share_figure(const char *key, const char *what, double asked, bool at_most,
                    const Lines &lines, Counts counts, Hit hit) {
  Figure f;
  f.key = key;
  f.what = what;
  f.asked = asked;
  f.at_most = at_most;
  for (const Json &l : lines) {
    if (!counts(l))
      continue;
    ++f.cases;
    f.hits += hit(l) ? 1 : 0;
  }
  if (f.cases > 0)
    wilson(f);
  return f;
}

std::vector<double> values_of(const Lines &lines, const char *key) {
  std::vector<double> values;
  for (const Json &l : lines)
    if (l.at(key).is_number())
      values.push_back(l.at(key));
  return values;
}

bool yes(const Json &l, const char *key) { return l.at(key).is_boolean() && l.at(key).get<bool>(); }

bool in_catalogue(const Json &l) {
  for (const Json &e : l.at("expected"))
    if (e.get<std::string>().rfind("unknown@", 0) == 0)
      return false;
  return true;
}

std::string joined(const Json &list) {
  std::string out;
  for (const Json &e : list)
    out += (out.empty() ? "" : ", ") + e.get<std::string>();
  return out.empty() ? "nothing" : out;
}

// What is wrong with a case, in words; empty: nothing.
std::string complaint(const Json &l) {
  std::string out;
  const auto add = [&out](const std::string &what) { out += (out.empty() ? "" : "; ") + what; };
  if (yes(l, "failed"))
    add("FAILED");
  if (yes(l, "false_claim"))
    add("false claim");
  if (l.at("found").is_boolean() && !yes(l, "found"))
    add(text("not found (F1 %.2f)", l.at("f1").get<double>()));
  else if (l.at("f1").is_number() && l.at("f1").get<double>() < 0.7)
    add(text("F1 %.2f", l.at("f1").get<double>()));
  if (l.at("named").is_boolean() && !yes(l, "named"))
    add(yes(l, "listed") ? "misnamed (the truth is listed)" : "misnamed");
  if (l.at("two_named").is_boolean() && !yes(l, "two_named"))
    add("not both named");
  if (l.at("gain_share").is_number() && l.at("gain_share").get<double>() < 0.7)
    add(text("gain %.2f of the true model's", l.at("gain_share").get<double>()));
  if (yes(l, "worse"))
    add(text("a hold-out %.3f times worse", l.at("worse_ratio").get<double>()));
  for (const Json &n : l.at("notes"))
    add(n.get<std::string>());
  return out;
}

std::string figure_line(const Figure &f) {
  if (f.cases == 0)
    return text("  %-52s %8s\n", f.what.c_str(), "no case");
  const double scale = f.share ? 100.0 : 1.0;
  const std::string count = f.share ? text("%zu/%zu", f.hits, f.cases) : text("of %zu", f.cases);
  const char *format = f.share ? "  %-52s %6.1f %% %9s   %5.1f to %5.1f %%   %s %4.0f %%   %s\n"
                               : "  %-52s %6.3f   %9s   %5.3f to %5.3f     %s %4.2f     %s\n";
  return text(format, f.what.c_str(), scale * f.value, count.c_str(), scale * f.low, scale * f.high,
              f.at_most ? "at most " : "at least", scale * f.asked, f.reached() ? "yes" : "NO");
}

std::string family_table(const Lines &lines) {
  struct Tally {
    int cases = 0, found = 0, named = 0;
    std::vector<double> f1, gain;
    std::map<std::string, int> instead;
  };
  std::map<std::string, Tally> tally;
  for (const Json &l : lines) {
    Tally &t = tally[l.at("family").get<std::string>()];
    ++t.cases;
    t.found += yes(l, "found") || (yes(l, "null") && !yes(l, "false_claim")) ? 1 : 0;
    const bool named = yes(l, "named") || yes(l, "two_named");
    t.named += named ? 1 : 0;
    if (l.at("f1").is_number())
      t.f1.push_back(l.at("f1"));
    if (l.at("gain_share").is_number())
      t.gain.push_back(l.at("gain_share"));
    if (!named && (!yes(l, "null") || yes(l, "false_claim"))) {
      const std::string first = l.at("claimed").empty() ? "nothing" : l.at("claimed")[0];
      ++t.instead[first.substr(0, first.find('@'))];
    }
  }
  std::string out = text("  %-18s %5s %6s %6s %6s %6s   %s\n", "family", "cases", "found", "named",
                         "F1", "gain", "called instead (first finding)");
  for (const auto &[name, t] : tally) {
    std::string instead;
    for (const auto &[cause, n] : t.instead)
      instead += (instead.empty() ? "" : ", ") + cause + " " + std::to_string(n);
    out += text("  %-18s %5d %6d %6d %6s %6s   %s\n", name.c_str(), t.cases, t.found, t.named,
                t.f1.empty() ? "-" : text("%.2f", median(t.f1)).c_str(),
                t.gain.empty() ? "-" : text("%.2f", median(t.gain)).c_str(), instead.c_str());
  }
  return out;
}

} // namespace

std::vector<Figure> figures(const Lines &lines) {
  const auto effect = [](const Json &l) { return !yes(l, "null"); };
  const auto found = [](const Json &l) { return yes(l, "found"); };
  std::vector<Figure> list;
  list.push_back(share_figure("found", "hidden effects found", 0.95, false, lines, effect, found));
  list.push_back(share_figure(
      "named", "found, one, in the catalogue: named first", 0.90, false, lines,
      [&](const Json &l) { return found(l) && !yes(l, "two") && in_catalogue(l); },
      [](const Json &l) { return yes(l, "named"); }));
  Figure gain;
  gain.key = "gain_median";
  gain.what = "share of the true model's gain, held out: median";
  gain.asked = 0.9;
  median_figure(gain, values_of(lines, "gain_share"));
  list.push_back(gain);
  list.push_back(share_figure(
      "gain_tenth", "share of the true model's gain at least .7", 0.9, false, lines,
      [](const Json &l) { return l.at("gain_share").is_number(); },
      [](const Json &l) { return l.at("gain_share").get<double>() >= 0.7; }));
  list.push_back(share_figure(
      "two", "two effects: both found and named", 0.70, false, lines,
      [](const Json &l) { return yes(l, "two"); },
      [](const Json &l) { return yes(l, "found") && yes(l, "two_named"); }));
  Figure f1;
  f1.key = "f1_median";
  f1.what = "F1 of labels.csv: median";
  f1.asked = 0.9;
  median_figure(f1, values_of(lines, "f1"));
  list.push_back(f1);
  const auto claim = [](const Json &l) { return yes(l, "false_claim"); };
  list.push_back(share_figure(
      "false_white", "nothing hidden, white noise: anything claimed", 0.05, true, lines,
      [](const Json &l) { return yes(l, "null") && l.at("noise") == "white"; }, claim));
  list.push_back(share_figure(
      "false_other", "nothing hidden, other noise: anything claimed", 0.10, true, lines,
      [](const Json &l) { return yes(l, "null") && l.at("noise") != "white"; }, claim));
  list.push_back(share_figure(
      "worse", "a hold-out made worse by more than 2 %", 0.02, true, lines,
      [](const Json &) { return true; }, [](const Json &l) { return yes(l, "worse"); }));
  list.push_back(share_figure(
      "failed", "no usable diagnosis", 0.0, true, lines, [](const Json &) { return true; },
      [](const Json &l) { return yes(l, "failed"); }));
  return list;
}

std::string summary_text(const Lines &lines) {
  std::size_t nulls = 0, two = 0;
  std::vector<double> seconds;
  for (const Json &l : lines) {
    nulls += yes(l, "null") ? 1 : 0;
    two += yes(l, "two") ? 1 : 0;
    seconds.push_back(l.at("seconds"));
  }
  std::string out = text("%zu cases: %zu with one effect, %zu with two, %zu with none\n\n",
                         lines.size(), lines.size() - nulls - two, two, nulls);
  out += text("  %-52s %8s %9s   %-17s %-16s %s\n", "figure", "measured", "cases", "95 % interval",
              "asked", "reached");
  for (const Figure &f : figures(lines))
    out += figure_line(f);
  if (!seconds.empty())
    out += text("  %-52s %6.2f s; the longest %.2f s\n", "time a case: median", median(seconds),
                *std::max_element(seconds.begin(), seconds.end()));
  out += "\n" + family_table(lines) + "\n";
  for (const Json &l : lines) {
    const std::string what = complaint(l);
    if (!what.empty())
      out += text("  seed %-6llu ", static_cast<unsigned long long>(l.at("seed"))) +
             l.at("family").get<std::string>() + " (" + l.at("world").get<std::string>() +
             "): " + what + " | hidden " + joined(l.at("expected")) + " | claimed " +
             joined(l.at("claimed")) + "\n";
  }
  return out;
}

std::string check_floors(const Lines &lines, const std::string &path, int &failed) {
  std::ifstream in(path);
  if (!in)
    throw std::runtime_error(path + ": cannot be read");
  const std::vector<Figure> list = figures(lines);
  std::string out, line;
  failed = 0;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string key;
    double bound = 0.0;
    if (!(words >> key) || key[0] == '#')
      continue;
    const auto at =
        std::find_if(list.begin(), list.end(), [&key](const Figure &f) { return f.key == key; });
    if (at == list.end() || !(words >> bound))
      throw std::runtime_error(path + ": '" + line + "'");
    const bool ok = at->cases > 0 && (at->at_most ? at->value <= bound : at->value >= bound);
    failed += ok ? 0 : 1;
    out += text("%s: %s, %.3f of %zu cases, %s %.3f\n", ok ? "ok" : "FAILED", at->what.c_str(),
                at->value, at->cases, at->at_most ? "at most" : "at least", bound);
  }
  return out;
}

} // namespace grade
