// SPDX-License-Identifier: MIT
// thesis/experiment/plan_figure.hpp - what the figures about planning share: intervals over runs,
// pictures.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace rim {

struct MeanInterval {
  double value = 0.0, low = 0.0, high = 0.0; // 95 %
};

// 2000 resamples of the runs 0 .. runs - 1, from a fixed seed; statistic(indices of runs).
MeanInterval
bootstrap_runs(std::size_t runs,
               const std::function<double(const std::vector<std::size_t> &)> &statistic);
MeanInterval bootstrap_mean(const std::vector<double> &values);
std::string interval_text(const MeanInterval &interval, int digits);

// One curve with its band: mean and 95 % interval (normal) at every abscissa 1, 2, ...
struct PlanCurve {
  std::string name;
  std::vector<double> mean, half;
};
PlanCurve curve_of(const std::string &name, const std::vector<std::vector<double>> &runs,
                   std::size_t window);
struct PlanPanel {
  std::string title, x_label, y_label;
  std::vector<PlanCurve> curves;
};
// By gnuplot into PATH, .svg or .png (UsageError otherwise); DataError when gnuplot fails.
void plot_panels(const std::vector<PlanPanel> &panels, const std::string &path);

} // namespace rim
