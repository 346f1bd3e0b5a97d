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

namespace {

void put(SectionBytes *bytes, std::initializer_list<const std::vector<double> *> all) {
  for (const auto *numbers : all)
    bytes->f32s(*numbers);
}

// How runs begin, and how far they go.
void put_begins(SectionBytes *bytes, const Basis &basis) {
  put(bytes, {&basis.first, &basis.first_sd, &basis.start, &basis.start_sd});
  if (!(basis.learnt_s > 0.0))
    return;
  bytes->f32(static_cast<float>(basis.learnt_s));
  for (std::size_t k = 0; k < 2 * basis.inputs.size() * basis.share.size(); ++k)
    bytes->f32(
        static_cast<float>(basis.begin.empty() ? static_cast<double>(k % 2) : basis.begin[k]));
  if (basis.later.empty())
    return;
  bytes->f32(static_cast<float>(basis.late_nats));
  put(bytes, {&basis.later, &basis.later_sd, &basis.start_inverse, &basis.later_inverse});
}

// The header's word S.
std::size_t what_is_known_of_begins(const Basis &basis) {
  return basis.first_sd.empty()    ? 0
         : basis.start.empty()     ? 1
         : !(basis.learnt_s > 0.0) ? 2
         : basis.later.empty()     ? 3
                                   : 4;
}

} // namespace

std::vector<std::uint8_t> basis_section(const Basis &basis) {
  SectionBytes bytes;
  for (const std::size_t word :
       {std::size_t{BASIS_LAYOUT}, basis.inputs.size(), basis.share.size(), basis.terms.size(),
        basis.means.size(), what_is_known_of_begins(basis), basis.states.size(),
        basis.rates.size()})
    bytes.u32(static_cast<std::uint32_t>(word));
  for (const Basis::Input &input : basis.inputs) {
    bytes.u16(input.a);
    bytes.u16(input.b);
  }
  bytes.f32s(basis.share);
  for (const Basis::Term &term : basis.terms) {
    bytes.u16(term.op);
    bytes.u16(term.a);
    bytes.u16(term.b);
    bytes.u16(term.c);
  }
  put(&bytes, {&basis.center, &basis.inverse_sd});
  for (const std::uint16_t filter : basis.means) {
    bytes.u16(filter);
    bytes.u16(0);
  }
  put(&bytes, {&basis.mean_center, &basis.mean_inverse_sd});
  put_begins(&bytes, basis);
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
