// SPDX-License-Identifier: MIT
// Products of readings: inputs, terms, section.
#include "train/quadratic.hpp"

#include <algorithm>

#include "image/image_writer.hpp"
#include "stats/single.hpp"

extern "C" {
#include "image/quadratic.h"
#include "monitor/blocks.h"
}

namespace rim {

namespace {

// Terms that may be learnt, at most: the solutions cost their cube. And blocks per term, at least.
constexpr Eigen::Index kMostTerms = 600, kBlocksPerTerm = 4;

Eigen::Index terms_of(Eigen::Index inputs, Eigen::Index paired) {
  return 1 + 2 * inputs + paired * (paired + 1) / 2;
}

} // namespace

Eigen::Index reading_inputs(const Layout &layout) {
  return rimi_level_inputs(layout.command.data(), static_cast<std::uint32_t>(layout.features()),
                           nullptr, nullptr);
}

Matrix reading_inputs(const Layout &layout, const Matrix &context) {
  Matrix x(context.rows(), reading_inputs(layout));
  for (Eigen::Index i = 0; i < context.rows(); ++i)
    (void)rimi_level_inputs(layout.command.data(), static_cast<std::uint32_t>(layout.features()),
                            context.row(i).data(), x.row(i).data());
  return x;
}

Quadratic quadratic_inputs(const Layout &layout, const RunStore &runs) {
  const Eigen::Index d = reading_inputs(layout);
  Quadratic of;
  Eigen::Index blocks = 0;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(d), squares = sum;
  for (const BlockRun &run : runs) {
    const Matrix x = reading_inputs(layout, run.context);
    sum += x.colwise().sum().transpose();
    blocks += run.blocks();
  }
  for (const Eigen::Index paired : {2 * d, d}) {
    const Eigen::Index terms = terms_of(d, paired);
    if (of.paired == 0 && terms <= kMostTerms && blocks >= kBlocksPerTerm * terms &&
        d <= static_cast<Eigen::Index>(RIM_QUADRATIC_MAX_INPUTS))
      of.paired = paired;
  }
  if (of.paired == 0)
    return of;
  of.centre = (sum / static_cast<double>(blocks)).unaryExpr(&single);
  for (const BlockRun &run : runs) {
    const Matrix x = reading_inputs(layout, run.context);
    squares += (x.rowwise() - of.centre.transpose()).array().square().colwise().sum().matrix();
  }
  const Eigen::ArrayXd sd = (squares / static_cast<double>(blocks)).cwiseSqrt().array();
  const Eigen::ArrayXd least = 1e-9 * (1.0 + of.centre.array().abs());
  of.inverse_scale = sd.max(least).inverse().matrix().unaryExpr(&single);
  return of;
}

Matrix quadratic_terms(const Quadratic &of, const Layout &layout, const BlockRun &run) {
  const Eigen::Index n = run.blocks(), d = of.centre.size();
  const Matrix raw = reading_inputs(layout, run.context).rowwise() - of.centre.transpose();
  const Matrix now = (raw * of.inverse_scale.asDiagonal())
                         .array()
                         .max(-RIM_QUADRATIC_CLIP)
                         .min(RIM_QUADRATIC_CLIP)
                         .matrix();
  Matrix x(n, terms_of(d, of.paired));
  x.col(0).setOnes();
  x.middleCols(1, d) = now;
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool follows = i > 0 && run.follows[static_cast<std::size_t>(i)];
    x.row(i).segment(1 + d, d) = now.row(follows ? i - 1 : i);
  }
  Eigen::Index at = 1 + 2 * d;
  for (Eigen::Index i = 0; i < of.paired; ++i) {
    for (Eigen::Index j = i; j < of.paired; ++j)
      x.col(at++) = x.col(1 + i).cwiseProduct(x.col(1 + j));
  }
  return x;
}

std::vector<Eigen::Index> quadratic_columns(const Quadratic &of, const Layout &layout,
                                            std::size_t outcome, Readings readings) {
  const Eigen::Index d = of.centre.size();
  const auto &outcomes = layout.outcome_feature;
  const auto own = static_cast<Eigen::Index>(outcomes[outcome]);
  // The sines of angles follow on the features.
  const auto is_reading = [&](Eigen::Index f) {
    return f >= static_cast<Eigen::Index>(layout.features()) ||
           std::find(outcomes.begin(), outcomes.end(), f) != outcomes.end();
  };
  const auto may = [&](Eigen::Index input) {
    const bool is_before = input >= d;
    if (readings == Readings::before)
      return is_before || !is_reading(input);
    return input % d != own || (is_before && readings == Readings::own_before);
  };
  std::vector<Eigen::Index> columns = {0};
  Eigen::Index at = 1;
  for (Eigen::Index i = 0; i < 2 * d; ++i, ++at) {
    if (may(i))
      columns.push_back(at);
  }
  for (Eigen::Index i = 0; i < of.paired; ++i) {
    for (Eigen::Index j = i; j < of.paired; ++j, ++at) {
      if (may(i) && may(j))
        columns.push_back(at);
    }
  }
  return columns;
}

double slope_along_own(const Quadratic &of, Eigen::Index own, double sd,
                       const Eigen::VectorXd &weight) {
  return weight[1 + of.centre.size() + own] * of.inverse_scale[own] * sd;
}

void show_offset_in_full(const Quadratic &of, Eigen::Index own, double mean, double sd, double g,
                         Eigen::VectorXd *weight) {
  (*weight)[0] -= g * (of.centre[own] - mean) / sd;
  (*weight)[1 + own] -= g / (of.inverse_scale[own] * sd);
  *weight /= 1.0 - g;
}

std::vector<std::uint8_t> quadratic_section(const Quadratic &of) {
  SectionBytes bytes;
  if (of.models.empty())
    return bytes.bytes();
  bytes.u32(RIM_QUADRATIC_LAYOUT);
  bytes.u32(static_cast<std::uint32_t>(of.centre.size()));
  bytes.u32(static_cast<std::uint32_t>(of.models.size()));
  bytes.u32(static_cast<std::uint32_t>(of.paired));
  for (const Eigen::VectorXd *values : {&of.centre, &of.inverse_scale}) {
    for (const double v : *values)
      bytes.f32(static_cast<float>(v));
  }
  for (const auto &[use, outcome, weight] : of.models) {
    bytes.u16(static_cast<std::uint16_t>(outcome));
    bytes.u16(static_cast<std::uint16_t>(use));
    for (const double v : weight)
      bytes.f32(static_cast<float>(v));
  }
  return bytes.bytes();
}

} // namespace rim
