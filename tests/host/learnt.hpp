// SPDX-License-Identifier: MIT
// The steps of train() up to the behaviour models, on logs in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "log/log_set.hpp"
#include "train/behaviour.hpp"

extern "C" {
#include "image/basis.h"
}

struct Learnt {
  rim::Layout layout;
  rim::Basis basis;
  rim::BlockOptions options;
  rim::RunStore runs;
  rim::Behaviour behaviour;
};

inline constexpr std::uint32_t kBlockRows = 10;

// The library takes section BASIS as it would fly.
inline bool basis_opens(const Learnt &l) {
  const std::vector<std::uint8_t> section = rim::basis_section(l.basis);
  rim_basis view;
  return rimi_basis_open(&view, section.data(), section.size(),
                         static_cast<std::uint32_t>(l.layout.features()),
                         static_cast<std::uint32_t>(l.layout.outcomes())) == RIM_OK;
}

// No reading may be farther from zero than the limit.
inline Learnt learn(const std::vector<rim::Log> &logs, float limit = 100.0F) {
  Learnt l;
  rim::LogSet set(logs);
  const rim::Survey survey = rim::survey_of(&set);
  l.layout = survey.layout;
  l.basis = rim::make_basis(survey, static_cast<double>(logs.front().t_s.size()));
  l.options.block_rows = kBlockRows;
  l.options.integrands = rim::possible_integrands(l.layout);
  l.options.period_s = survey.period_s();
  l.options.low.assign(l.layout.features(), -limit);
  l.options.high.assign(l.layout.features(), limit);
  std::vector<rim::BlockRun> runs;
  std::vector<Eigen::VectorXd> starts;
  for (const rim::Log &log : logs) {
    runs.push_back(rim::block_run(log, l.layout, l.basis, l.options));
    starts.push_back(runs.back().start);
  }
  std::vector<double> low, high;
  for (std::size_t f = 0; f < l.layout.features(); ++f) {
    low.push_back(survey.low(f));
    high.push_back(survey.high(f));
  }
  rim::learn_start(&l.basis, starts, low, high);
  l.runs = rim::RunStore(runs);
  l.behaviour = rim::fit_behaviour(&l.basis, l.layout, l.options.integrands, l.runs,
                                   kBlockRows * l.options.period_s);
  return l;
}
