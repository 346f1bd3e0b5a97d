// SPDX-License-Identifier: MIT
// What a flight image holds of the behaviour models: only what they use.
#include <algorithm>
#include <cmath>

#include "image/image_writer.hpp"
#include "train/behaviour.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

// Calls visit(&filter) with every filter that the basis uses: input * time constants + time.
template <class Visit> void for_each_filter(Basis *basis, const Visit &visit) {
  for (Basis::Term &t : basis->terms) {
    if (t.op == BASIS_ROLLED && t.b != BASIS_PLAIN)
      visit(&t.b);
    std::uint16_t *const places[] = {&t.a, &t.b, &t.c};
    for (std::size_t k = 0; k < filters_of(t); ++k)
      visit(places[k]);
  }
  for (std::uint16_t &filter : basis->means)
    visit(&filter);
  for (Basis::Rate &rate : basis->rates) {
    for (std::uint16_t *factor : {&rate.a, &rate.b, &rate.c}) {
      if (*factor < BASIS_STATE)
        visit(factor);
    }
  }
}

// Drops the states that no term is of, unless another state's rates need them.
void drop_unused_states(Basis *basis, Behaviour *behaviour) {
  const std::size_t states = basis->states.size();
  std::vector<bool> used(states, false);
  for (const Basis::Term &t : basis->terms) {
    if (t.op != BASIS_ROLLED)
      continue;
    used[t.a] = true;
    if (t.c < states)
      used[t.c] = true;
  }
  const auto state_of = [](std::uint16_t factor) { return factor & (BASIS_MAX_STATES - 1U); };
  const auto is_state = [](std::uint16_t factor) {
    return factor >= BASIS_STATE && factor != BASIS_PLAIN;
  };
  for (std::size_t s = states; s-- > 0;) { // a state depends on itself and on earlier ones
    for (const Basis::Rate &rate : basis->rates) {
      for (const std::uint16_t factor : {rate.a, rate.b, rate.c}) {
        if (used[s] && rate.state == s && is_state(factor))
          used[state_of(factor)] = true;
      }
    }
  }
  std::vector<std::uint16_t> place(states);
  Basis small = *basis;
  small.states.clear();
  small.rates.clear();
  for (std::size_t s = 0; s < states; ++s) {
    place[s] = static_cast<std::uint16_t>(small.states.size());
    if (used[s])
      small.states.push_back(basis->states[s]);
  }
  for (Basis::Rate rate : basis->rates) {
    if (!used[rate.state])
      continue;
    rate.state = place[rate.state];
    for (std::uint16_t *factor : {&rate.a, &rate.b, &rate.c}) {
      if (is_state(*factor))
        *factor =
            static_cast<std::uint16_t>(*factor - state_of(*factor) + place[state_of(*factor)]);
    }
    small.rates.push_back(rate);
  }
  for (Basis::Term &t : small.terms) {
    if (t.op != BASIS_ROLLED)
      continue;
    t.a = place[t.a];
    if (t.c < states)
      t.c = place[t.c];
  }
  for (TargetModel &m : behaviour->targets) {
    for (std::uint16_t &s : m.states)
      s = place[s];
  }
  *basis = small;
}

void drop_unused_inputs(Basis *basis) {
  const std::size_t times = basis->share.size();
  std::vector<bool> used(basis->inputs.size(), false);
  for_each_filter(basis, [&](const std::uint16_t *filter) { used[*filter / times] = true; });
  for (const Basis::Term &t : basis->terms) {
    if (t.op == BASIS_INTEGRAL)
      used[t.a] = true;
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] && rimi_basis_is_movement(basis->inputs[i].b))
      used[rimi_basis_moves(basis->inputs[i].b)] = true;
  }
  std::vector<std::uint16_t> place;
  std::vector<Basis::Input> inputs;
  std::vector<double> begin;
  for (std::size_t i = 0; i < used.size(); ++i) {
    place.push_back(static_cast<std::uint16_t>(inputs.size()));
    if (!used[i])
      continue;
    inputs.push_back(basis->inputs[i]);
    if (rimi_basis_is_movement(inputs.back().b)) {
      const std::uint32_t p = rimi_basis_moves(inputs.back().b);
      inputs.back().b = static_cast<std::uint16_t>(inputs.back().b - p + place[p]);
    }
    for (std::size_t k = 2 * times * i; k < 2 * times * (i + 1) && !basis->begin.empty(); ++k)
      begin.push_back(basis->begin[k]);
  }
  for_each_filter(basis, [&](std::uint16_t *filter) {
    *filter = static_cast<std::uint16_t>(place[*filter / times] * times + *filter % times);
  });
  for (Basis::Term &t : basis->terms) {
    if (t.op == BASIS_INTEGRAL)
      t.a = place[t.a];
  }
  basis->inputs = inputs;
  basis->begin = begin;
}

} // namespace

void shrink_basis(Basis *basis, Behaviour *behaviour) {
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < basis->terms.size(); ++i) {
    const bool used = std::any_of(behaviour->targets.begin(), behaviour->targets.end(),
                                  [i](const TargetModel &m) {
                                    return std::abs(m.weight[static_cast<Eigen::Index>(i)]) > 0.0;
                                  });
    if (used)
      kept.push_back(i);
  }
  Basis small = *basis;
  small.terms.clear();
  small.center.clear();
  small.inverse_sd.clear();
  for (const std::size_t i : kept) {
    small.terms.push_back(basis->terms[i]);
    small.center.push_back(basis->center[i]);
    small.inverse_sd.push_back(basis->inverse_sd[i]);
  }
  for (TargetModel &m : behaviour->targets) {
    Eigen::VectorXd w(static_cast<Eigen::Index>(kept.size()));
    for (std::size_t i = 0; i < kept.size(); ++i)
      w[static_cast<Eigen::Index>(i)] = m.weight[static_cast<Eigen::Index>(kept[i])];
    m.weight = w;
  }
  drop_unused_states(&small, behaviour);
  drop_unused_inputs(&small);
  *basis = small;
}

std::vector<std::uint8_t> behaviour_section(const Basis &basis, const Behaviour &behaviour) {
  SectionBytes bytes;
  bytes.u32(1);
  bytes.u32(static_cast<std::uint32_t>(basis.terms.size()));
  bytes.u32(static_cast<std::uint32_t>(behaviour.targets.size()));
  bytes.u32(0);
  for (const TargetModel &m : behaviour.targets)
    bytes.u32(m.initial ? 1 : 0);
  for (const TargetModel &m : behaviour.targets)
    bytes.f32(static_cast<float>(m.intercept));
  for (const TargetModel &m : behaviour.targets) {
    for (Eigen::Index i = 0; i < m.weight.size(); ++i)
      bytes.f32(static_cast<float>(m.weight[i]));
  }
  return bytes.bytes();
}

} // namespace rim
