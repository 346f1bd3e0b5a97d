// SPDX-License-Identifier: MIT
#include "train/healthy_blocks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "image/image_writer.hpp"
#include "rim/monitor.h"
#include "train/calibrate_external.hpp"
#include "util/error.hpp"

extern "C" {
#include "monitor/blocks.h"
}

namespace rim {

namespace {

constexpr std::size_t kTimes = 9;
constexpr std::size_t kMostInputs = 20; // with those that are made of several commands, or of one
constexpr std::size_t kMostTerms = 420;     // but the steep ones
constexpr std::size_t kMostWideTerms = 512; // the rest of BASIS_MAX_TERMS is for rolled states
constexpr std::size_t kMostTriples = 120;
constexpr double kSideWidth = 0.05; // of the largest magnitude: where a direction turns round
constexpr std::size_t kDecays = 5;
constexpr std::size_t kMovementTimes = 5; // time constants of how a command moves, the quickest
constexpr std::size_t kMostFactors = 32; // outcomes from which on their products are not tried
// Raw terms come through the flight code's clip, which no number of single precision reaches then;
// a power of two, so that nothing is rounded.
constexpr float kRawScale = 0x1p-126F;
// What may become larger is no input and no term: an image could not hold its mean.
constexpr double kLargest = 1e37;
// The part of a filtered command that a gap may leave unknown.
constexpr double kMostUnknown = 0.1;

bool takes_both_signs(const Survey &survey, std::size_t feature) {
  return survey.low(feature) < 0.0 && survey.high(feature) > 0.0;
}

bool varies(const Survey &survey, std::size_t feature) {
  return survey.high(feature) > survey.low(feature);
}

// The number of a mode says nothing of how much: what each mode does is a table. On a few numbers
// m, 1, m, m^2 and the harmonics cos k m and sin k m are as many independent functions as there are
// numbers. How many harmonics a feature needs that is the number of a mode; 0: it is none.
std::size_t harmonics_of(const Survey &survey, std::size_t feature) {
  constexpr std::size_t told_apart = 3; // by 1, m and m^2
  const Layout &layout = survey.layout;
  if (layout.external || is_outcome(layout, feature) || is_angle(layout, feature))
    return 0;
  return (std::max(survey.modes(feature), told_apart) - told_apart + 1) / 2;
}

// The largest that an input may become in the healthy runs.
double largest(const Survey &survey, const Basis::Input &in) {
  const auto of = [&survey](std::size_t f) {
    return std::max(std::abs(survey.low(f)), std::abs(survey.high(f)));
  };
  if (in.b == BASIS_PLAIN || in.b == BASIS_MAGNITUDE)
    return of(in.a);
  if (rimi_basis_is_movement(in.b))
    return 2.0 * of(in.a);
  return in.b >= BASIS_LEAST_HARMONIC ? 1.0 : of(in.a) * of(in.b & ~BASIS_OF_PRODUCT);
}

// Commands and context are inputs: what is given to the vehicle, not what it does. In the order of
// their columns.
std::vector<std::uint16_t> given(const Survey &survey) {
  const Layout &layout = survey.layout;
  std::vector<std::uint16_t> features;
  for (std::size_t i = 0; i < layout.features(); ++i) {
    const auto f = static_cast<std::uint16_t>(i);
    if (!is_outcome(layout, f) && varies(survey, f) &&
        (is_angle(layout, f) || largest(survey, {f, BASIS_PLAIN}) <= kLargest))
      features.push_back(f);
  }
  return features;
}

// How many of them there is room for: an angle takes two inputs, its cosine and its sine.
std::size_t with_room(const Survey &survey, const std::vector<std::uint16_t> &features) {
  std::size_t inputs = 0, count = 0;
  for (; count < features.size(); ++count) {
    inputs += is_angle(survey.layout, features[count]) ? 2 : 1;
    if (inputs > kMostCommands)
      break;
  }
  return count;
}

// Fills in the inputs; the plain features come first, and are returned.
std::vector<std::uint16_t> choose_inputs(Basis *basis, const Survey &survey) {
  const Layout &layout = survey.layout;
  std::vector<std::uint16_t> all = given(survey), features;
  all.resize(with_room(survey, all));
  for (const std::uint16_t f : all) {
    if (!is_angle(layout, f)) {
      features.push_back(f);
      basis->inputs.push_back({f, BASIS_PLAIN});
    }
  }
  for (const std::uint16_t f : all) {
    if (is_angle(layout, f)) {
      basis->inputs.push_back({f, BASIS_COSINE});
      basis->inputs.push_back({f, BASIS_SINE});
    }
  }
  const auto add = [basis, &survey](std::uint16_t a, std::uint16_t b) {
    if (basis->inputs.size() < kMostInputs && largest(survey, {a, b}) <= kLargest)
      basis->inputs.push_back({a, b});
  };
  for (const std::uint16_t f : features) {
    for (std::size_t k = 0; k < harmonics_of(survey, f); ++k) {
      add(f, static_cast<std::uint16_t>(BASIS_COSINE - 2 * k));
      add(f, static_cast<std::uint16_t>(BASIS_SINE - 2 * k));
    }
    if (harmonics_of(survey, f) > 0)
      add(f, f);
  }
  for (const std::uint16_t f : features) {
    if (takes_both_signs(survey, f))
      add(f, BASIS_MAGNITUDE);
  }
  for (const std::uint16_t f : features) {
    if (harmonics_of(survey, f) == 0)
      add(f, f);
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (std::size_t j = i + 1; j < features.size(); ++j)
      add(features[i], features[j]);
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (std::size_t j = i + 1; j < features.size(); ++j) {
      if (takes_both_signs(survey, features[i]) || takes_both_signs(survey, features[j]))
        add(features[i], static_cast<std::uint16_t>(features[j] | BASIS_OF_PRODUCT));
    }
  }
  return features;
}

void choose_times(Basis *basis, double run_rows) {
  basis->share.push_back(1.0);
  const double longest = std::max(run_rows, 10.0);
  for (std::size_t k = 0; k + 1 < kTimes; ++k) {
    const double part = static_cast<double>(k) / static_cast<double>(kTimes - 2);
    const double rows = 2.5 * std::pow(longest / 2.5, part);
    basis->share.push_back(static_cast<double>(static_cast<float>(1.0 - std::exp(-1.0 / rows))));
  }
}

void choose_terms(Basis *basis, std::size_t plain, std::size_t outcomes) {
  const auto times = static_cast<std::uint16_t>(basis->share.size());
  const auto add = [basis](std::uint16_t op, std::size_t a, std::size_t b, TermGroup group) {
    if (basis->terms.size() < kMostTerms)
      basis->terms.push_back(
          {op, static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), 0, group});
  };
  for (std::size_t i = 0; i < basis->inputs.size() * times; ++i)
    add(BASIS_MEAN, i, 0, TermGroup::mean);
  // Of what nothing commands, a log begins anywhere: nothing settles from its start, and the first
  // readings (in full at once, by the mean of one row) say where it is.
  const bool settles = !basis->inputs.empty();
  for (std::size_t k = 0; settles && k < kDecays; ++k)
    add(BASIS_DECAY, 0, 1 + k * (times - 2) / (kDecays - 1), TermGroup::mean);
  for (std::size_t i = 0; i < plain; ++i)
    add(BASIS_INTEGRAL, i, 0, TermGroup::slow);
  add(BASIS_TIME, 0, 0, TermGroup::slow);
  for (std::size_t o = 0; o < std::min<std::size_t>(outcomes, 12); ++o) {
    if (!settles)
      add(BASIS_INITIAL, o, 0, TermGroup::initial);
    for (std::size_t k = 0; settles && k < kDecays; k += 2)
      add(BASIS_INITIAL, o, 1 + k * (times - 2) / (kDecays - 1), TermGroup::initial);
  }
  for (const std::size_t t : {1U, 2U, 3U, 4U}) { // what bends follows the filtered command
    for (std::size_t i = 0; i < plain; ++i)
      add(BASIS_ABS, i * times + t, 0, TermGroup::shape);
    for (std::size_t i = 0; i < plain; ++i) {
      for (std::size_t j = i; j < plain; ++j)
        add(BASIS_PRODUCT, i * times + t, j * times + t, TermGroup::shape);
    }
  }
  for (const std::size_t slow :
       {4U, 5U}) { // a rudder turns by the speed that the engine has built up
    for (std::size_t i = 0; i < plain; ++i) {
      for (std::size_t j = 0; j < plain; ++j)
        add(BASIS_PRODUCT, i * times + 2, j * times + slow, TermGroup::shape);
    }
  }
}

// What follows from forces: Coulomb friction turns round with the direction of a command; loads,
// lever arms and speeds multiply, three at a time, at the times in which a vehicle answers.
void add_steep_terms(Basis *basis, const Survey &survey, std::size_t plain) {
  const std::size_t times = basis->share.size();
  const auto is_factor = [&survey](const Basis::Input &i) {
    return i.b == BASIS_PLAIN || is_angle(survey.layout, i.a);
  };
  const auto factors = static_cast<std::size_t>(
      std::find_if_not(basis->inputs.begin(), basis->inputs.end(), is_factor) -
      basis->inputs.begin());
  const std::size_t triples = factors * (factors + 1) * (factors + 2) / 6;
  const auto add = [basis](std::uint16_t op, std::size_t a, std::size_t b, std::size_t c) {
    basis->terms.push_back({op, static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b),
                            static_cast<std::uint16_t>(c), TermGroup::steep});
  };
  std::size_t left = std::min(kMostTriples, kMostWideTerms - basis->terms.size());
  for (const std::size_t t : {2U, 1U, 3U}) {
    for (std::size_t i = 0; i < plain && left > 0; ++i) {
      const std::uint16_t f = basis->inputs[i].a;
      if (!takes_both_signs(survey, f))
        continue;
      const auto h = static_cast<float>(kSideWidth * std::max(-survey.low(f), survey.high(f)));
      std::uint32_t bits = 0;
      std::memcpy(&bits, &h, sizeof bits);
      add(BASIS_SIDE, i * times + t, bits & 0xffffU, bits >> 16U);
      --left;
    }
    if (triples > left)
      continue;
    for (std::size_t i = 0; i < factors; ++i) {
      for (std::size_t j = i; j < factors; ++j) {
        for (std::size_t k = j; k < factors; ++k)
          add(BASIS_TRIPLE, i * times + t, j * times + t, k * times + t);
      }
    }
    left -= triples;
  }
}

// What a sensor shows may come from outside and act on what other sensors show; fit_behaviour()
// finds out. All of them or none: which would be left out would depend on the order of the columns.
// Where there is room, by their products with the commands and with themselves too: a turbine's
// power rises with the cube of the wind, as far as its blades let it.
void add_outside_terms(Basis *basis, const Survey &survey, std::size_t plain) {
  const Layout &layout = survey.layout;
  std::vector<std::uint16_t> sensors;
  for (const std::uint16_t f : layout.outcome_feature) {
    if (!is_angle(layout, f) && varies(survey, f))
      sensors.push_back(f);
  }
  const std::size_t times = basis->share.size(), first = basis->inputs.size();
  const std::size_t means = sensors.size() * times, room = kMostWideTerms - basis->terms.size();
  if (first == 0) // without commands nothing tells what comes from outside
    return;
  if (first + sensors.size() > BASIS_MAX_INPUTS || means > room)
    return;
  const auto add = [basis](std::uint16_t op, std::size_t a, std::size_t b) {
    basis->terms.push_back(
        {op, static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b), 0, TermGroup::outside});
  };
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    basis->inputs.push_back({sensors[s], BASIS_PLAIN});
    for (std::size_t t = 0; t < times; ++t)
      add(BASIS_MEAN, (first + s) * times + t, 0);
  }
  const std::size_t product_times[] = {1, 3};
  if (means + sensors.size() * std::size(product_times) * (plain + 1) > room)
    return;
  for (std::size_t s = 0; s < sensors.size(); ++s) {
    for (const std::size_t t : product_times) {
      const std::size_t filter = (first + s) * times + t;
      add(BASIS_PRODUCT, filter, filter);
      for (std::size_t i = 0; i < plain; ++i)
        add(BASIS_PRODUCT, filter, i * times + t);
    }
  }
}

// What answers a command may be limited in its rate, or stick: what it does while the command moves
// is no linear filter of it. All commands or none, as above.
void add_movement_terms(Basis *basis, std::size_t plain) {
  const std::size_t times = basis->share.size(), first = basis->inputs.size();
  const std::size_t quick = std::min(kMovementTimes, times), moved = 2 * plain;
  if (first + moved > BASIS_MAX_INPUTS || basis->terms.size() + moved * quick > kMostWideTerms)
    return;
  for (std::size_t i = 0; i < moved; ++i) {
    const std::size_t p = i / 2;
    basis->inputs.push_back({basis->inputs[p].a, static_cast<std::uint16_t>(
                                                     BASIS_MOVEMENT + p +
                                                     (i % 2 == 1 ? BASIS_OF_SIZE : 0U))});
    for (std::size_t t = 0; t < quick; ++t)
      basis->terms.push_back({BASIS_MEAN, static_cast<std::uint16_t>((first + i) * times + t), 0, 0,
                              TermGroup::movement});
  }
}

// In every mode another command may count for more, or for less.
void add_mode_terms(Basis *basis, const Survey &survey, std::size_t plain) {
  const std::size_t times = basis->share.size();
  for (std::size_t m = 0; m < basis->inputs.size(); ++m) {
    const Basis::Input &in = basis->inputs[m];
    if (in.b < BASIS_LEAST_HARMONIC || in.b > BASIS_COSINE || is_angle(survey.layout, in.a))
      continue;
    for (const std::size_t t : {1U, 3U}) {
      for (std::size_t i = 0; i < plain; ++i) {
        if (basis->inputs[i].a != in.a && basis->terms.size() < kMostTerms)
          basis->terms.push_back({BASIS_PRODUCT, static_cast<std::uint16_t>(m * times + t),
                                  static_cast<std::uint16_t>(i * times + t), 0, TermGroup::shape});
      }
    }
  }
}

// Without the products that may become larger than a number of single precision.
void drop_large_terms(Basis *basis, const Survey &survey) {
  std::vector<double> most;
  for (const Basis::Input &in : basis->inputs)
    most.push_back(largest(survey, in));
  const std::size_t times = basis->share.size();
  const auto is_large = [&](const Basis::Term &t) {
    const std::uint16_t places[] = {t.a, t.b, t.c};
    double product = 1.0;
    for (std::size_t k = 0; k < filters_of(t); ++k)
      product *= most[places[k] / times];
    return product > kLargest;
  };
  basis->terms.erase(std::remove_if(basis->terms.begin(), basis->terms.end(), is_large),
                     basis->terms.end());
}

// Mean and standard deviation over the runs of every outcome's first readings.
void learn_first(Basis *basis, const Survey &survey) {
  const Layout &layout = survey.layout;
  for (std::size_t o = 0; o < layout.outcomes(); ++o) {
    double n = 0.0, sum = 0.0, squares = 0.0, size = 0.0;
    for (const RunFacts &run : survey.runs) {
      if (layout.external || run.rows == 0)
        continue;
      const double first = run.features[layout.outcome_feature[o]].first;
      n += 1.0;
      sum += first;
      squares += first * first;
      size = std::max(size, std::abs(first));
    }
    const double mean = n > 0.0 ? sum / n : 0.0;
    const double variance = n > 1.0 ? (squares - n * mean * mean) / (n - 1.0) : 1.0;
    basis->first.push_back(mean);
    basis->first_sd.push_back(std::sqrt(std::max(variance, 0.0)) + 1e-6 * size + 1e-9);
  }
}

} // namespace

std::vector<Integrand> possible_integrands(const Layout &layout) {
  std::vector<Integrand> all;
  if (layout.external)
    return all;
  const std::vector<std::uint16_t> &outcomes = layout.outcome_feature;
  for (const std::uint16_t f : outcomes)
    all.push_back({AGREEMENT_PLAIN, f, f});
  for (std::size_t i = 0; i < outcomes.size() && outcomes.size() <= kMostFactors; ++i) {
    for (std::size_t j = i; j < outcomes.size(); ++j) {
      if (!is_angle(layout, outcomes[i]) && !is_angle(layout, outcomes[j]))
        all.push_back({AGREEMENT_PRODUCT, outcomes[i], outcomes[j]});
    }
  }
  for (std::size_t b = 0; b < layout.features(); ++b) {
    for (const std::uint16_t a : outcomes) {
      if (!is_angle(layout, b) || is_angle(layout, a))
        continue;
      all.push_back({AGREEMENT_COSINE, a, static_cast<std::uint16_t>(b)});
      all.push_back({AGREEMENT_SINE, a, static_cast<std::uint16_t>(b)});
    }
  }
  return all;
}

std::vector<std::uint8_t> integrand_bytes(const std::vector<Integrand> &integrands) {
  SectionBytes bytes;
  for (const Integrand &g : integrands) {
    for (const std::uint16_t word : {g.op, g.a, g.b, std::uint16_t{0}})
      bytes.u16(word);
  }
  return bytes.bytes();
}

std::vector<std::uint16_t> no_inputs(const Survey &survey) {
  const std::vector<std::uint16_t> all = given(survey);
  return {all.begin() + static_cast<std::ptrdiff_t>(with_room(survey, all)), all.end()};
}

Basis make_basis(const Survey &survey, double run_rows) {
  Basis basis;
  const Layout &layout = survey.layout;
  const std::size_t plain = choose_inputs(&basis, survey).size();
  choose_times(&basis, run_rows);
  if (!layout.external)
    choose_terms(&basis, plain, layout.outcomes());
  if (!layout.external) {
    add_mode_terms(&basis, survey, plain);
    add_steep_terms(&basis, survey, plain);
    add_outside_terms(&basis, survey, plain);
    add_movement_terms(&basis, plain);
    drop_large_terms(&basis, survey);
  }
  basis.center.assign(basis.terms.size(), 0.0);
  basis.inverse_sd.assign(basis.terms.size(), 1.0);
  const std::size_t times = basis.share.size();
  for (std::size_t i = 0; i < plain && basis.means.size() + 2 <= BASIS_MAX_MEANS; ++i) {
    basis.means.push_back(static_cast<std::uint16_t>(i * times + 1));         // short
    basis.means.push_back(static_cast<std::uint16_t>(i * times + times / 2)); // slow
  }
  basis.mean_center.assign(basis.means.size(), 0.0);
  basis.mean_inverse_sd.assign(basis.means.size(), 1.0);
  learn_first(&basis, survey);
  return basis;
}

// Of few runs the deviation is uncertain, and a feature that starts alike in all may yet start a
// little off. No run that was learnt from began late: a switch that is on at the start of one run
// in thirty is five standard deviations off.
void learn_start(Basis *basis, const std::vector<Eigen::VectorXd> &starts,
                 const std::vector<double> &low, const std::vector<double> &high) {
  constexpr double least = 0.01;  // of the feature's range
  constexpr double beyond = 1.25; // of the farthest start, which is still a start
  basis->start.clear();
  basis->start_sd.clear();
  for (std::size_t f = 0; f < low.size(); ++f) {
    double n = 0.0, sum = 0.0, squares = 0.0;
    for (const Eigen::VectorXd &start : starts) {
      if (start.size() == 0) // of a run without rows
        continue;
      const double first = start[static_cast<Eigen::Index>(f)];
      n += 1.0;
      sum += first;
      squares += first * first;
    }
    const double mean = n > 0.0 ? sum / n : 0.0;
    const double variance = n > 1.0 ? (squares - n * mean * mean) / (n - 1.0) : 1.0;
    double most = 0.0;
    for (const Eigen::VectorXd &start : starts) {
      if (start.size() > 0)
        most = std::max(most, std::abs(start[static_cast<Eigen::Index>(f)] - mean));
    }
    const double few = 1.0 + 8.0 / std::max(n - 1.0, 1.0);
    const double width = std::max(high[f] - low[f], 1e-6 * std::abs(mean) + 1e-9);
    basis->start.push_back(mean);
    basis->start_sd.push_back(std::max({few * std::sqrt(std::max(variance, 0.0)), least * width,
                                        beyond * most / BASIS_START_LIMIT}));
  }
}

namespace {

// The flight code's blocks, with raw terms and without limits.
class Gatherer {
public:
  Gatherer(const Layout &layout, Basis raw, const BlockOptions &options) : layout_(layout) {
    std::fill(raw.center.begin(), raw.center.end(), 0.0);
    std::fill(raw.inverse_sd.begin(), raw.inverse_sd.end(), static_cast<double>(kRawScale));
    std::fill(raw.mean_center.begin(), raw.mean_center.end(), 0.0);
    std::fill(raw.mean_inverse_sd.begin(), raw.mean_inverse_sd.end(),
              static_cast<double>(kRawScale));
    if (!raw.begin.empty()) { // stands behind what is not learnt yet: any start, and any length
      raw.start.assign(layout.features(), 0.0);
      raw.start_sd.assign(layout.features(), 1e30);
      raw.later.clear();
      raw.learnt_s = 1e30;
    }
    section_ = basis_section(raw);
    for (std::size_t i = 0; i < raw.terms.size(); ++i) {
      if (raw.terms[i].op == BASIS_MEAN)
        filters_.push_back(i);
    }
    SectionBytes range, map;
    for (const auto *limits : {&options.low, &options.high}) {
      for (const float limit : *limits)
        range.f32(limit);
    }
    for (const std::uint16_t f : layout.outcome_feature)
      map.u16(f);
    range_ = range.bytes();
    integrands_ = integrand_bytes(options.integrands);
    map_ = map.bytes();
    blocks_config config{};
    config.features = static_cast<std::uint16_t>(layout.features());
    config.outcomes = static_cast<std::uint16_t>(layout.outcomes());
    config.block_rows = static_cast<std::uint16_t>(options.block_rows);
    config.external = layout.external;
    config.period_s = options.period_s;
    config.outcome_feature = layout.external ? nullptr : map_.data();
    config.role = layout.command.data();
    config.range = range_.data();
    config.integrands = static_cast<std::uint32_t>(options.integrands.size());
    config.integrand = integrands_.data();
    if (rimi_basis_open(&config.basis, section_.data(), section_.size(), config.features,
                        config.outcomes) != RIM_OK)
      throw std::logic_error("section BASIS is not as the library wants it");
    memory_.resize(rimi_blocks_size(&config) / 8 + 1);
    if (rimi_blocks_init(&blocks_, memory_.data(), memory_.size() * 8, &config) != RIM_OK)
      throw std::logic_error("rimi_blocks_init");
    terms_ = config.basis.terms;
    means_ = config.basis.means;
    integrand_count_ = config.integrands;
    block_rows_ = static_cast<Eigen::Index>(options.block_rows);
  }

  BlockRun gather(const Log &log);

private:
  // Whether a gap left too much of some filtered command unknown.
  bool lacks_commands() const {
    const std::uint16_t *unknown = rimi_blocks_unknown(blocks_);
    return !rimi_blocks_knows_all(blocks_) &&
           std::any_of(filters_.begin(), filters_.end(), [unknown](std::size_t i) {
             return unknown[i] > kMostUnknown * BASIS_UNKNOWN_SD;
           });
  }

  const Layout &layout_;
  std::vector<std::uint8_t> section_, range_, map_, integrands_;
  std::vector<std::size_t> filters_; // terms
  std::vector<std::uint64_t> memory_;
  blocks *blocks_ = nullptr;
  std::size_t terms_ = 0, means_ = 0, integrand_count_ = 0;
  Eigen::Index block_rows_ = 1;
};

// Makes more room where it is needed: bridged gaps add blocks. Room for a block of every row would
// be gigabytes of terms for millions of rows.
void append(Matrix *to, Eigen::Index row, const double *values, double factor = 1.0) {
  if (row == to->rows())
    to->conservativeResize(2 * row + 16, Eigen::NoChange);
  for (Eigen::Index c = 0; c < to->cols(); ++c)
    (*to)(row, c) = values[c] * factor;
}

BlockRun Gatherer::gather(const Log &log) {
  const auto features = static_cast<Eigen::Index>(layout_.features());
  const auto outcomes = static_cast<Eigen::Index>(layout_.outcomes());
  const Eigen::Index rows = log.values.rows();
  const bool ext = layout_.external;
  const ExternalRows external = ext ? external_rows(log, layout_) : ExternalRows{};
  Matrix context(rows, features);
  for (Eigen::Index f = 0; f < features; ++f)
    context.col(f) =
        log.values.col(find_column(log, layout_.feature_names[static_cast<std::size_t>(f)]));
  BlockRun run;
  const Eigen::Index room = rows / block_rows_ + 1; // append() makes more of it
  run.context.resize(room, features);
  for (Matrix *m : {&run.outcome, &run.predicted, &run.scatter, &run.repeats})
    m->resize(room, outcomes);
  run.terms.resize(room, static_cast<Eigen::Index>(terms_));
  run.means.resize(room, static_cast<Eigen::Index>(means_));
  for (Matrix *m : {&run.early, &run.late})
    m->resize(room, static_cast<Eigen::Index>(integrand_count_));
  run.time_s.resize(rows);
  run.share.resize(rows);
  Eigen::Index n = 0;
  bool has_last = false; // the block before
  for (Eigen::Index t = 0; t < rows; ++t) {
    if (rimi_blocks_row(blocks_, log.t_s[static_cast<std::size_t>(t)], context.row(t).data(),
                        ext ? external.outcome.row(t).data() : nullptr,
                        ext ? external.mean.row(t).data() : nullptr,
                        ext ? external.sd.row(t).data() : nullptr) != BLOCKS_DONE ||
        (!ext && !rimi_blocks_has_first(blocks_)))
      continue;
    if (lacks_commands()) {
      ++run.left_out;
      has_last = false;
      continue;
    }
    append(&run.context, n, rimi_blocks_context(blocks_));
    append(&run.outcome, n, rimi_blocks_outcomes(blocks_));
    append(&run.predicted, n, rimi_blocks_predicted(blocks_));
    append(&run.scatter, n, rimi_blocks_scatter(blocks_));
    append(&run.repeats, n, rimi_blocks_repeats(blocks_));
    append(&run.terms, n, rimi_blocks_terms(blocks_), 1.0 / static_cast<double>(kRawScale));
    append(&run.means, n, rimi_blocks_means(blocks_), 1.0 / static_cast<double>(kRawScale));
    append(&run.early, n, rimi_blocks_early(blocks_));
    append(&run.late, n, rimi_blocks_late(blocks_));
    run.follows.push_back(has_last && rimi_blocks_adjoins(blocks_));
    has_last = true;
    run.share[n] = rimi_blocks_share(blocks_);
    run.time_s[n++] = rimi_blocks_since_start_s(blocks_);
  }
  for (Matrix *m : {&run.context, &run.outcome, &run.predicted, &run.scatter, &run.repeats,
                    &run.terms, &run.means, &run.early, &run.late})
    m->conservativeResize(n, m->cols());
  run.time_s.conservativeResize(n);
  run.share.conservativeResize(n);
  run.first = Eigen::Map<const Eigen::VectorXd>(rimi_blocks_first(blocks_), outcomes);
  run.start.resize(rows > 0 ? features : 0);
  for (Eigen::Index f = 0; f < run.start.size(); ++f)
    run.start[f] = context.col(f).head(std::min(block_rows_, rows)).mean();
  return run;
}

} // namespace

BlockRun block_run(const Log &log, const Layout &layout, const Basis &basis,
                   const BlockOptions &options) {
  return Gatherer(layout, basis, options).gather(log);
}

} // namespace rim
