// SPDX-License-Identifier: MIT
#include "thesis/experiment/plan_figure.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "replay/plot.hpp"
#include "base/rng.h"

namespace rim {
namespace {

constexpr std::size_t kResamples = 2000;
constexpr std::uint64_t kBootstrapSeed = 5100;
constexpr int kPanelWidth = 480, kPanelHeight = 380;
const char *const kColours[] = {"#1f5fa8", "#b22222", "#2e8b57", "#444444"};

std::string panel_data(const PlanPanel &panel, std::size_t number) {
  std::string text;
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    const PlanCurve &curve = panel.curves[c];
    text += fmt::format("$d{}_{} << EOD\n", number, c);
    for (std::size_t t = 0; t < curve.mean.size(); ++t)
      text += fmt::format("{} {:.6g} {:.6g}\n", t + 1, curve.mean[t], curve.half[t]);
    text += "EOD\n";
  }
  return text;
}

std::string panel_plot(const PlanPanel &panel, std::size_t number) {
  std::string text =
      fmt::format("set title '{}' noenhanced\nset xlabel '{}' offset 0,0.6\nset ylabel '{}'\nplot ",
                  panel.title, panel.x_label, panel.y_label);
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    text += fmt::format("{0}$d{1}_{2} using 1:($2-$3):($2+$3) with filledcurves fs transparent "
                        "solid 0.2 noborder lc rgb '{3}' notitle, $d{1}_{2} using 1:2 with lines "
                        "lw 2 lc rgb '{3}' title '{4}'",
                        c == 0 ? "" : ", ", number, c, kColours[c % 4], panel.curves[c].name);
  }
  return text + "\n";
}

std::string script(const std::vector<PlanPanel> &panels, const std::string &to, bool svg) {
  const int width = kPanelWidth * static_cast<int>(panels.size());
  std::string text =
      fmt::format("set terminal {} size {},{} {}\nset output '{}'\nset tics nomirror "
                  "out\nset grid y lc rgb '#dddddd'\nset key below vertical maxrows 2 samplen 2 "
                  "width 3 height 0.5 Left reverse\nset "
                  "autoscale xfix\n",
                  svg ? "svg" : "pngcairo", width, kPanelHeight,
                  svg ? "dynamic font 'sans,13' background rgb 'white'" : "font 'sans,10'", to);
  for (std::size_t i = 0; i < panels.size(); ++i)
    text += panel_data(panels[i], i);
  text += fmt::format("set multiplot layout 1,{}\n", panels.size());
  for (std::size_t i = 0; i < panels.size(); ++i)
    text += panel_plot(panels[i], i);
  return text + "unset multiplot\nunset output\n";
}

} // namespace

MeanInterval
bootstrap_runs(std::size_t runs,
               const std::function<double(const std::vector<std::size_t> &)> &statistic) {
  std::vector<std::size_t> pick(runs);
  for (std::size_t i = 0; i < runs; ++i)
    pick[i] = i;
  MeanInterval out;
  out.value = statistic(pick);
  rim_rng rng;
  rimi_rng_seed(&rng, kBootstrapSeed, 0);
  std::vector<double> values(kResamples);
  for (double &value : values) {
    for (std::size_t &i : pick)
      i = rimi_rng_below(&rng, static_cast<std::uint32_t>(runs));
    value = statistic(pick);
  }
  std::sort(values.begin(), values.end());
  out.low = values[kResamples / 40];
  out.high = values[kResamples - 1 - kResamples / 40];
  return out;
}

MeanInterval bootstrap_mean(const std::vector<double> &values) {
  return bootstrap_runs(values.size(), [&values](const std::vector<std::size_t> &pick) {
    double sum = 0.0;
    for (const std::size_t i : pick)
      sum += values[i];
    return sum / static_cast<double>(pick.size());
  });
}

std::string interval_text(const MeanInterval &x, int digits) {
  return fmt::format("{:.{}f} [{:.{}f}, {:.{}f}]", x.value, digits, x.low, digits, x.high, digits);
}

PlanCurve curve_of(const std::string &name, const std::vector<std::vector<double>> &runs,
                   std::size_t window) {
  PlanCurve curve;
  curve.name = name;
  const double n = static_cast<double>(runs.size());
  for (std::size_t t = 0; t < runs.front().size(); ++t) {
    const std::size_t first = t + 1 > window ? t + 1 - window : 0;
    double sum = 0.0, squares = 0.0;
    for (const std::vector<double> &run : runs) {
      double moving = 0.0;
      for (std::size_t k = first; k <= t; ++k)
        moving += run[k];
      moving /= static_cast<double>(t + 1 - first);
      sum += moving;
      squares += moving * moving;
    }
    const double mean = sum / n;
    const double var = n > 1.0 ? std::max(0.0, squares - n * mean * mean) / (n - 1.0) : 0.0;
    curve.mean.push_back(mean);
    curve.half.push_back(1.96 * std::sqrt(var / n));
  }
  return curve;
}

void plot_panels(const std::vector<PlanPanel> &panels, const std::string &path) {
  write_gnuplot([&panels](const std::string &to, bool svg) { return script(panels, to, svg); },
                path);
}

} // namespace rim
