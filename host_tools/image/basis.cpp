// SPDX-License-Identifier: MIT
#include "image/basis.hpp"

#include "image/image_writer.hpp"

extern "C" {
#include "../../lib/src/image/basis.h"
}

namespace rim {

std::size_t filters_of(const Basis::Term &term) {
  switch (static_cast<basis_op>(term.op)) {
  case BASIS_MEAN:
  case BASIS_ABS:
  case BASIS_SIDE:
    return 1;
  case BASIS_PRODUCT:
    return 2;
  case BASIS_TRIPLE:
    return 3;
  default:
    return 0;
  }
}

std::vector<std::uint8_t> basis_section(const Basis &basis) {
  SectionBytes bytes;
  for (const std::size_t word : {std::size_t{BASIS_LAYOUT}, basis.inputs.size(), basis.share.size(),
                                 basis.terms.size(), basis.means.size(),
                                 std::size_t{basis.first_sd.empty() ? 0U
                                             : basis.start.empty()  ? 1U
                                             : basis.learnt_s > 0.0 ? 3U
                                                                    : 2U},
                                 basis.states.size(), basis.rates.size()})
    bytes.u32(static_cast<std::uint32_t>(word));
  for (const Basis::Input &input : basis.inputs) {
    bytes.u16(input.a);
    bytes.u16(input.b);
  }
  for (const double share : basis.share)
    bytes.f32(static_cast<float>(share));
  for (const Basis::Term &term : basis.terms) {
    bytes.u16(term.op);
    bytes.u16(term.a);
    bytes.u16(term.b);
    bytes.u16(term.c);
  }
  for (const auto *numbers : {&basis.center, &basis.inverse_sd}) {
    for (const double v : *numbers)
      bytes.f32(static_cast<float>(v));
  }
  for (const std::uint16_t filter : basis.means) {
    bytes.u16(filter);
    bytes.u16(0);
  }
  for (const auto *numbers : {&basis.mean_center, &basis.mean_inverse_sd}) {
    for (const double v : *numbers)
      bytes.f32(static_cast<float>(v));
  }
  for (const auto *numbers : {&basis.first, &basis.first_sd, &basis.start, &basis.start_sd}) {
    for (const double v : *numbers)
      bytes.f32(static_cast<float>(v));
  }
  if (basis.learnt_s > 0.0) {
    bytes.f32(static_cast<float>(basis.learnt_s));
    for (std::size_t k = 0; k < 2 * basis.inputs.size() * basis.share.size(); ++k)
      bytes.f32(
          static_cast<float>(basis.begin.empty() ? static_cast<double>(k % 2) : basis.begin[k]));
  }
  for (std::size_t s = 0; s < (basis.states.size() + 1) / 2 * 2; ++s)
    bytes.u16(s < basis.states.size() ? basis.states[s].outcome : std::uint16_t{0});
  for (const Basis::State &state : basis.states) {
    bytes.f32(static_cast<float>(state.low));
    bytes.f32(static_cast<float>(state.high));
  }
  for (const Basis::Rate &rate : basis.rates) {
    for (const std::uint16_t word : {rate.state, rate.a, rate.b, rate.c})
      bytes.u16(word);
  }
  for (const Basis::Rate &rate : basis.rates)
    bytes.f32(static_cast<float>(rate.weight));
  return bytes.bytes();
}

} // namespace rim
