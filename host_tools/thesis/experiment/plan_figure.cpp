// SPDX-License-Identifier: MIT
#include "thesis/experiment/plan_figure.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/rng.h"
#include "util/gnuplot.hpp"

namespace rim {
namespace {

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
  std::string text = fmt::format(
      "set title {} noenhanced\nset xlabel {} offset 0,0.6\nset ylabel {}\nplot ",
      gnuplot_text(panel.title), gnuplot_text(panel.x_label), gnuplot_text(panel.y_label));
  for (std::size_t c = 0; c < panel.curves.size(); ++c) {
    text += fmt::format("{0}$d{1}_{2} using 1:($2-$3):($2+$3) with filledcurves fs transparent "
                        "solid 0.2 noborder lc rgb '{3}' notitle, $d{1}_{2} using 1:2 with lines "
                        "lw 2 lc rgb '{3}' title {4}",
                        c == 0 ? "" : ", ", number, c, kColours[c % 4],
                        gnuplot_text(panel.curves[c].name));
  }
  return text + "\n";
}

std::string script(const std::vector<PlanPanel> &panels, const std::string &to, bool svg) {
  const int width = kPanelWidth * static_cast<int>(panels.size());
  std::string text =
      fmt::format("set terminal {} size {},{} {}\nset output {}\nset tics nomirror "
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

std::string interval_text(const Bootstrapped &x, int digits) {
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
