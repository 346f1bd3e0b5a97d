// SPDX-License-Identifier: MIT
// image/basis.hpp - section BASIS of a flight image: the inputs that the models take.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace rim {

// Groups of terms of section BASIS, from which a model takes some. outside: of sensors, which show
// what acts on the vehicle from outside (wind, ambient temperature, slope). rolled: of the rolled
// states. movement: of how commands move.
enum class TermGroup { mean, shape, slow, initial, steep, outside, rolled, movement };

// Section BASIS as numbers. Center 0 and scale 1 until they are learnt.
struct Basis {
  struct Input {
    std::uint16_t a, b; // see lib/src/image/basis.h
  };
  struct Term {
    std::uint16_t op, a, b, c;
    TermGroup group;
  };
  std::vector<Input> inputs;
  std::vector<double> share; // per time constant
  std::vector<Term> terms;
  std::vector<double> center, inverse_sd;
  std::vector<std::uint16_t> means; // filters
  std::vector<double> mean_center, mean_inverse_sd;
  std::vector<double> first, first_sd; // per outcome: of the first readings of the runs
  std::vector<double> start, start_sd; // per feature: of the first blocks of the runs
  // Of the later ones; a first block that is likelier by so much as one of these is none. Lower
  // triangles of the inverse correlations of the features in first and in later blocks.
  std::vector<double> later, later_sd, start_inverse, later_inverse;
  double late_nats = 0.0;
  double learnt_s = 0.0;               // how far the healthy runs went; 0: not known yet
  std::vector<double> begin;           // per filter two; empty: as in the first row
  struct State {
    std::uint16_t outcome;
    double low, high;
  };
  struct Rate {
    std::uint16_t state, a, b, c;
    double weight;
  };
  std::vector<State> states; // rolled forward by the rates
  std::vector<Rate> rates;
};

// The filters of a term, as places among its a, b and c; none of an integral, whose a is an input,
// and of a rolled state, whose b may be one.
std::size_t filters_of(const Basis::Term &term);

// The section's bytes, as lib/src/image/basis.h describes them.
std::vector<std::uint8_t> basis_section(const Basis &basis);

} // namespace rim
