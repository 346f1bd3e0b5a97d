// SPDX-License-Identifier: MIT
#include "thesis/experiment/golf_points.hpp"

#include "world/golf.hpp"

namespace rim {
namespace {

constexpr std::size_t kAnomalous = 30;

}

rim_batch_data GolfPoints::data() const {
  return {static_cast<std::uint32_t>(r.size()), static_cast<std::uint16_t>(dims), 1, u.data(),
          r.data()};
}

GolfPoints golf_points(std::size_t dims, std::uint64_t seed, bool has_effect) {
  GolfParams field;
  if (!has_effect)
    field.shift = 0.0;
  GolfOptions options;
  options.dims = dims;
  options.anomalous = kAnomalous;
  Golf world(field, options, seed);
  GolfPoints out;
  out.dims = dims;
  out.place = world.features();
  for (const GolfShot &shot : world.all()) {
    for (std::size_t k = 0; k < dims; ++k)
      out.u.push_back(k == out.place[0]   ? shot.x[k] / field.length_m
                      : k == out.place[1] ? shot.x[k] / field.width_m
                                          : 0.5 * (shot.x[k] + 1.0));
    out.r.push_back((shot.z - shot.m) / shot.sd);
    out.truth.push_back(shot.anomalous);
  }
  return out;
}

} // namespace rim
