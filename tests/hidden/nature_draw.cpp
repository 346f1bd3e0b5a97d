// SPDX-License-Identifier: MIT
// What a case is drawn from, and the drawing: again and again until the case is fair.
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "nature.hpp"

namespace nature {

const std::vector<Family> &families() {
  static const std::vector<Family> list = {
      {"bias", "bias", "a constant, everywhere"},
      {"bias_interval", "bias", "a constant in an interval of one feature"},
      {"bias_box", "bias", "a constant in a box of two features"},
      {"bias_ellipse", "bias", "a constant in an ellipse of two features"},
      {"gain", "gain", "a factor on the prediction, everywhere or in an interval"},
      {"drift", "drift", "linear in the time since the log began"},
      {"noise", "noise", "more variance, everywhere, in an interval or a box"},
      {"dropout", "dropout", "runs of 1 to 5 exact zeros"},
      {"stuck", "stuck", "runs of 5 to 40 rows that repeat a value"},
      {"delay", "delay", "the command acts some rows late"},
      {"saturation", "saturation", "the prediction's magnitude is limited"},
      {"coupling", "coupling", "a multiple of another axis' command or rate"},
      {"coulomb_friction", "coulomb_friction", "-c sign(v)"},
      {"viscous_friction", "viscous_friction", "-c v"},
      {"quadratic_drag", "quadratic_drag", "-c v |v|"},
      {"density_drag", "quadratic_drag", "-c v |v| exp(-h / H) (lander)"},
      {"slope", "slope", "c sin(heading - phase) (robot)"},
      {"periodic", "periodic", "harmonic 2 to 6 of an angle"},
      {"hinge", "hinge", "c max(0, f - level)"},
      {"product", "product", "c f g"},
      {"bump", "unknown", "a Gaussian bump in one feature: in no catalogue"},
      {"wiggle", "unknown", "sin(u) / u of one feature: in no catalogue"}};
  return list;
}

const std::vector<Family> &nulls() {
  static const std::vector<Family> list = {
      {"white", "", "nothing hidden, white noise"},
      {"autocorrelated", "", "nothing hidden, noise of lag-1 correlation .3 to .7"},
      {"quantised", "", "nothing hidden, rounded to .3 to 1 sd"},
      {"heavy_tailed", "", "nothing hidden, Student t of 4 to 6 degrees of freedom"},
      {"sd_off", "", "nothing hidden, the stated sd a tenth too small or too large"}};
  return list;
}

namespace {

const Family *find(const std::vector<Family> &list, const std::string &name) {
  for (const Family &f : list)
    if (name == f.name)
      return &f;
  return nullptr;
}

std::string pick_null(Random &random) {
  return random.uniform() < 0.36 ? "white" : nulls()[1 + random.below(nulls().size() - 1)].name;
}

std::string pick_family(Random &random, bool in_catalogue) {
  for (;;) {
    const Family &f = families()[random.below(families().size())];
    if (!in_catalogue || std::string(f.cause) != "unknown")
      return f.name;
  }
}

// So that forty seeds in a row hold every family, every null and some pairs.
std::string each_of(std::uint64_t seed, Random &random) {
  const std::size_t n = seed % 40, effects = families().size(), whites = nulls().size() + 3;
  if (n < effects)
    return families()[n].name;
  if (n < effects + whites)
    return n - effects < nulls().size() ? nulls()[n - effects].name : "white";
  return n < effects + whites + 6 ? "two" : pick_family(random, false);
}

// The values of one quantity in all nominal rows, sorted.
Row sorted_values(const std::vector<Record> &pool, std::size_t feature) {
  Row values;
  for (const Record &r : pool)
    for (const Row &x : r.x)
      values.push_back(x[feature]);
  std::sort(values.begin(), values.end());
  return values;
}

double quantile(const Row &sorted, double q) {
  return sorted[std::min(sorted.size() - 1,
                         static_cast<std::size_t>(q * static_cast<double>(sorted.size())))];
}

Gate draw_gate(const World &world, const std::vector<Record> &pool, Random &random, int dimensions,
               bool ellipse) {
  Gate gate;
  gate.ellipse = ellipse;
  while (static_cast<int>(gate.features.size()) < dimensions) {
    const std::size_t f = random.below(world.features.size());
    const bool fits = dimensions == 1 ? world.features[f].name.find("wheel") == std::string::npos
                                      : world.features[f].region;
    if (fits && (gate.features.empty() || gate.features[0] != f))
      gate.features.push_back(f);
  }
  for (const std::size_t f : gate.features) {
    const Row values = sorted_values(pool, f);
    const double wide =
        dimensions == 1 ? 0.07 * std::pow(0.6 / 0.07, random.uniform()) : random.uniform(0.25, 0.7);
    const double from = random.uniform(0.0, 1.0 - wide);
    gate.lower.push_back(quantile(values, from));
    gate.upper.push_back(quantile(values, from + wide));
  }
  return gate;
}

// Is it more than a constant, nearly: as a factor of a product.
bool varies(const World &world, const std::vector<Record> &pool, std::size_t feature) {
  const Row v = sorted_values(pool, feature);
  return !world.features[feature].angle &&
         quantile(v, 0.84) - quantile(v, 0.16) > 0.8 * std::abs(quantile(v, 0.5));
}

// Non-angle features: for hinges, products, bumps.
int plain_feature(const World &world, Random &random) {
  for (;;) {
    const std::size_t f = random.below(world.features.size());
    if (!world.features[f].angle)
      return static_cast<int>(f);
  }
}

bool gated_by_chance(const std::string &name, Random &random) {
  if (name == "gain" || name == "noise")
    return random.uniform() < 0.5;
  if (name == "coulomb_friction" || name == "viscous_friction" || name == "coupling")
    return random.uniform() < 0.25;
  return false;
}

// Where, and which features; false when the channel cannot show this family.
bool draw_place(Effect &e, const World &world, const std::vector<Record> &pool, Random &random) {
  const Channel &channel = world.channels[e.channel];
  const std::string &name = e.family;
  if (name == "bias_interval" || gated_by_chance(name, random))
    e.gate =
        draw_gate(world, pool, random, name == "noise" && random.uniform() < 0.4 ? 2 : 1, false);
  if (name == "bias_box" || name == "bias_ellipse")
    e.gate = draw_gate(world, pool, random, 2, name == "bias_ellipse");
  if (name == "coulomb_friction" || name == "viscous_friction" || name == "quadratic_drag" ||
      name == "density_drag") {
    e.first = channel.velocity;
    e.second = name == "density_drag" ? world.altitude : -1;
    return e.first >= 0 && (name != "density_drag" || world.altitude >= 0);
  }
  if (name == "coupling")
    e.first = channel.couplings[random.below(channel.couplings.size())];
  if (name == "delay")
    return channel.command >= 0;
  if (name == "slope") {
    e.first = world.heading;
    return channel.tilts && e.first >= 0;
  }
  if (name == "periodic") {
    do
      e.first = static_cast<int>(random.below(world.features.size()));
    while (!world.features[static_cast<std::size_t>(e.first)].angle);
  }
  if (name == "hinge" || name == "product" || name == "bump" || name == "wiggle")
    e.first = plain_feature(world, random);
  while (name == "product" && (e.second < 0 || e.second == e.first))
    e.second = plain_feature(world, random);
  if (name == "product")
    return varies(world, pool, static_cast<std::size_t>(e.first)) &&
           varies(world, pool, static_cast<std::size_t>(e.second));
  return true;
}

// Everything of the form but its size.
void draw_shape(Effect &e, const std::vector<Record> &pool, Random &random) {
  const std::string &name = e.family;
  if (name == "slope" || name == "periodic")
    e.shape = random.uniform(-3.14159, 3.14159);
  if (name == "periodic")
    e.order = 2 + static_cast<int>(random.below(5));
  if (name == "delay")
    e.order = 2 + static_cast<int>(random.below(9));
  if (name == "density_drag")
    e.shape = random.uniform(6000.0, 9000.0);
  if (name == "hinge")
    e.shape =
        quantile(sorted_values(pool, static_cast<std::size_t>(e.first)), random.uniform(0.3, 0.8));
  if (name == "bump" || name == "wiggle") {
    const Row v = sorted_values(pool, static_cast<std::size_t>(e.first));
    const double range = quantile(v, 0.98) - quantile(v, 0.02);
    e.shape = quantile(v, random.uniform(0.2, 0.8));
    e.width =
        range * (name == "bump" ? random.uniform(0.10, 0.25) / 2.3548 : random.uniform(0.03, 0.07));
  }
  if (name == "saturation") {
    Row size;
    for (const Record &r : pool)
      for (const double m : r.m[e.channel])
        size.push_back(std::abs(m));
    std::sort(size.begin(), size.end());
    e.shape = quantile(size, 1.0 - random.uniform(0.1, 0.4));
  }
  if (name == "dropout")
    e.share = random.uniform(0.02, 0.12);
  if (name == "stuck")
    e.share = random.uniform(0.05, 0.2);
}

// rms of the basis over the nominal rows on which it acts.
double basis_rms(const Effect &e, const World &world, const std::vector<Record> &pool) {
  Row values;
  double largest = 0.0;
  for (const Record &r : pool) {
    for (std::size_t i = 0; i < r.rows(); ++i) {
      if (!e.gate.contains(r.x[i]))
        continue;
      const std::size_t back = static_cast<std::size_t>(e.order);
      const double b =
          basis(e, world, r.x[i], r.x[i >= back ? i - back : 0], r.m[e.channel][i], r.t_s[i]);
      values.push_back(b);
      largest = std::max(largest, std::abs(b));
    }
  }
  double sum = 0.0, n = 0.0;
  for (const double b : values) {
    if (std::abs(b) > 0.05 * largest) {
      sum += b * b;
      n += 1.0;
    }
  }
  return n > 20.0 ? std::sqrt(sum / n) : 0.0;
}

bool draw_effect(const std::string &family, World &world, const std::vector<Record> &pool,
                 Random &random, Effect &e) {
  e = Effect{};
  e.family = family;
  e.cause = find(families(), family)->cause;
  e.kind = family == "noise"     ? Kind::variance
           : family == "dropout" ? Kind::dropout
           : family == "stuck"   ? Kind::stuck
                                 : Kind::mean;
  do
    e.channel = random.below(world.channels.size());
  while (!world.channels[e.channel].logged);
  if (!draw_place(e, world, pool, random))
    return false;
  draw_shape(e, pool, random);
  const double wanted = 0.3 * std::pow(2.0 / 0.3, random.uniform());
  const double turn = random.uniform() < 0.5 ? -1.0 : 1.0;
  if (e.kind == Kind::variance)
    e.size = random.uniform(1.5, 4.0);
  if (e.kind != Kind::mean)
    return true;
  const double rms = basis_rms(e, world, pool);
  if (rms <= 0.0)
    return false;
  double &sd = world.channels[e.channel].sd;
  if (family == "delay" || family == "saturation")
    sd = rms / wanted; // their size is given by the form
  else
    e.size =
        (family.find("friction") != std::string::npos || family.find("drag") != std::string::npos
             ? 1.0
             : turn) *
        wanted * sd / rms;
  return true;
}

void draw_world(Case &c, Random &random) {
  c.world = random.uniform() < 0.5 ? draw_robot(random) : draw_lander(random);
  auto &channels = c.world->channels;
  const std::size_t wanted = 2 + random.below(3);
  for (std::size_t logged = 0; logged < wanted;) {
    Channel &channel = channels[random.below(channels.size())];
    logged += channel.logged ? 0 : 1;
    channel.logged = true;
  }
  const std::size_t total = 1500 + random.below(2501);
  const std::size_t logs = std::min<std::size_t>(2 + random.below(3), total / 700);
  std::size_t left = total;
  for (std::size_t i = 1; i < logs; ++i) {
    const double part = static_cast<double>(total) / static_cast<double>(logs);
    c.run_rows.push_back(static_cast<std::size_t>(part * random.uniform(0.85, 1.15)));
    left -= c.run_rows.back();
  }
  c.run_rows.push_back(left);
  c.holdout_rows.assign(2, 700 + random.below(500));
}

void draw_noise(Case &c, const std::string &null, Random &random) {
  c.noise = null;
  c.noise_parameter = null == "autocorrelated" ? random.uniform(0.3, 0.7)
                      : null == "quantised"    ? random.uniform(0.3, 1.0)
                      : null == "heavy_tailed" ? static_cast<double>(4 + random.below(3))
                      : null == "sd_off"       ? (random.uniform() < 0.5 ? 0.9 : 1.1)
                                               : 0.0;
}

std::vector<Record> all_records(const Case &c, bool with_effects) {
  std::vector<Record> records;
  for (std::size_t i = 0; i < c.logs(); ++i)
    records.push_back(simulate(c, i, with_effects));
  return records;
}

// One try; false when it came out impossible or unfair.
bool attempt_case(Case &c, const std::vector<std::string> &wanted, std::vector<Record> &records) {
  Random random(c.seed, c.attempt, 7);
  c.effects.clear();
  c.run_rows.clear();
  draw_world(c, random);
  if (wanted.empty()) {
    draw_noise(c, c.family, random);
    records = all_records(c, false);
    return true;
  }
  const std::vector<Record> pool = all_records(c, false);
  for (const std::string &family : wanted) {
    Effect e;
    if (!draw_effect(family, *c.world, pool, random, e))
      return false;
    c.effects.push_back(e);
  }
  records = all_records(c, true);
  for (std::size_t k = 0; k < c.effects.size(); ++k)
    if (!judge(c, records, k).unfair.empty())
      return false;
  return true;
}

} // namespace

Case draw_case(std::uint64_t seed, const std::string &family, std::vector<Record> &records) {
  Random random(seed, 0, 1);
  Case c;
  c.seed = seed;
  c.family = family;
  const double luck = random.uniform();
  if (family == "any")
    c.family = luck < 0.2 ? "null" : luck < 0.35 ? "two" : pick_family(random, false);
  if (family == "each")
    c.family = each_of(seed, random);
  if (c.family == "null")
    c.family = pick_null(random);
  const bool two = c.family == "two", null = find(nulls(), c.family) != nullptr;
  if (!two && !null && find(families(), c.family) == nullptr)
    throw std::runtime_error("no family '" + family + "'; --list names them");
  std::vector<std::string> wanted;
  for (c.attempt = 0; c.attempt < 4000; ++c.attempt) {
    if (two && c.attempt % 40 == 0) {
      wanted = {pick_family(random, true), pick_family(random, true)};
      while (std::string(find(families(), wanted[0])->cause) == find(families(), wanted[1])->cause)
        wanted[1] = pick_family(random, true);
    } else if (!two && !null) {
      wanted = {c.family};
    }
    if (attempt_case(c, wanted, records))
      return c;
  }
  throw std::runtime_error("no fair case of '" + c.family + "' from seed " + std::to_string(seed));
}

} // namespace nature
