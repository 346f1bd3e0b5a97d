// SPDX-License-Identifier: MIT
#include "diagnose/roles.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <set>
#include <string>

#include <Eigen/Cholesky>

#include "stats/robust.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;

std::size_t idx(Index i) { return static_cast<std::size_t>(i); }

constexpr double kLeastTurn = 0.16; // turns: what is more than a straight line
// Own velocity: how well its changes must follow the prediction.
constexpr double kLeastOwnCorrelation = 0.3;
// Of velocities whose changes follow it nearly as well none is known to be the own one.
constexpr double kClearOwn = 0.6;
// A quantity of no known unit whose changes follow it so well is a velocity.
constexpr double kLeastMoving = 0.8;
// Rate of change: how near, in its own sd, a feature must be to the differences of another.
constexpr double kMostRateError = 0.3;
constexpr double kLeastStateCorrelation = 0.9;
constexpr double kLeastStartCorrelation = 0.5;
constexpr double kNoChange = 1e-6; // of the largest prediction
// A reading whose changes from row to row go on like this is smooth, and a prediction that starts
// from it then moves on as it does.
constexpr double kSmoothReading = 0.5, kLeastMovingOn = 0.2;
// Sense of a velocity: the least correlation of a level with the prediction; rows that are looked
// at.
constexpr double kSenseOfLevel = 0.8;
constexpr std::size_t kSenseRows = 20000;

// An altitude that hardly changes says nothing about the air.
constexpr double kLeastClimb_m = 500.0;

bool is_one_of(const std::string &unit, std::initializer_list<const char *> units) {
  return std::any_of(units.begin(), units.end(), [&unit](const char *u) { return unit == u; });
}

// Lengths and angles per time, as logs of vehicles, machines and motors write them.
bool is_linear_speed(const std::string &unit) {
  return is_one_of(unit, {"m/s", "km/s", "km/h", "mm/s", "cm/s", "um/s", "m/min", "mm/min", "ft/s",
                          "in/s", "mph", "kn", "kt", "knots"});
}
bool is_turning_speed(const std::string &unit) {
  return is_one_of(unit, {"rad/s", "mrad/s", "deg/s", "rpm", "rps", "rev/s", "rev/min"});
}
bool is_linear(const std::string &unit) {
  return is_linear_speed(unit) || unit.rfind("m/", 0) == 0 || unit.rfind("km/", 0) == 0;
}
bool is_turning(const std::string &unit) {
  return is_turning_speed(unit) || unit.rfind("rad", 0) == 0 || unit.rfind("deg/", 0) == 0;
}

struct Moments {
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  void add(double x, double y) {
    n += 1.0;
    a += x;
    b += y;
    aa += x * x;
    bb += y * y;
    ab += x * y;
  }
  double correlation() const {
    const double va = aa - a * a / n, vb = bb - b * b / n;
    return n >= 10.0 && va > 0.0 && vb > 0.0 ? (ab - a * b / n) / std::sqrt(va * vb) : 0.0;
  }
};

// Neighbouring rows are those of the whole table.
const Measured &full(const Measured &measured) {
  return measured.whole != nullptr ? *measured.whole : measured;
}

const Channel &full(const Measured &measured, const Channel &channel) {
  const int c = full(measured).find_channel(channel.name);
  return measured.whole == nullptr || c < 0 ? channel
                                            : full(measured).channels[static_cast<std::size_t>(c)];
}

// Calls see(k, k + 1, seconds) for neighbouring rows of one log.
template <class See> void each_step(const Measured &measured, See see) {
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i + 1 < log.first + log.rows; ++i) {
      const double dt = measured.elapsed_s[i + 1] - measured.elapsed_s[i];
      see(static_cast<Index>(i), static_cast<Index>(i) + 1, dt);
    }
  }
}

// Whether v is the rate at which feature q changes within so many rows, in whatever unit: the ratio
// of the two is fitted.
bool is_rate_of(const Measured &measured, const Vector &v, Index q, std::size_t rows) {
  std::vector<std::pair<double, double>> pairs; // difference quotient, mean of v
  double products = 0.0, squares = 0.0;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i + rows < log.first + log.rows; i += rows) {
      const double dt = measured.elapsed_s[i + rows] - measured.elapsed_s[i];
      const auto k = static_cast<Index>(i), next = static_cast<Index>(i + rows);
      const double rate = (measured.x(next, q) - measured.x(k, q)) / dt;
      double mean = 0.5 * (v(k) + v(next));
      for (Index j = k + 1; j < next; ++j)
        mean += v(j);
      mean /= static_cast<double>(rows);
      pairs.emplace_back(rate, mean);
      products += rate * mean;
      squares += mean * mean;
    }
  }
  if (pairs.size() < 20 || !(products > 0.0))
    return false;
  const double ratio = squares / products;
  std::vector<double> error;
  for (const auto &[rate, mean] : pairs)
    error.push_back(std::abs(ratio * rate - mean));
  const double sd = std::sqrt((v.array() - v.mean()).square().mean());
  return median(std::move(error)) < kMostRateError * sd;
}

// Whether v is the rate at which some other feature changes: readings that are coarse or noisy say
// so over several rows.
bool is_rate(const Measured &measured, int feature) {
  const Vector v = measured.x.col(feature);
  for (Index q = 0; q < measured.x.cols(); ++q) {
    if (q == feature || measured.features[static_cast<std::size_t>(q)].is_command)
      continue;
    for (const std::size_t rows : {1, 4, 16}) {
      if (is_rate_of(measured, v, q, rows))
        return true;
    }
  }
  return false;
}

// Words and numbers of a name without prefix and unit: "torque", "2" of "z.torque2_Nm".
std::set<std::string> words_of(const std::string &name, const std::string &unit) {
  std::string bare = name.size() > 1 && name[1] == '.' ? name.substr(2) : name;
  const std::size_t cut = bare.rfind('_');
  if (!unit.empty() && cut != std::string::npos)
    bare.resize(cut);
  std::set<std::string> words;
  std::string word;
  for (const char c : bare + "_") {
    const bool is_digit = std::isdigit(static_cast<unsigned char>(c)) != 0;
    const bool was_digit =
        !word.empty() && std::isdigit(static_cast<unsigned char>(word.back())) != 0;
    if (c == '_' || (!word.empty() && is_digit != was_digit)) {
      if (word.size() > 1 || was_digit || word == "v" || word == "w")
        words.insert(word);
      word.clear();
    }
    if (c != '_')
      word += c;
  }
  return words;
}

bool is_velocity(const Measured &measured, int feature) {
  const Feature &f = measured.features[static_cast<std::size_t>(feature)];
  if (f.is_command || f.is_prediction)
    return false;
  if (is_linear_speed(f.unit) || is_turning_speed(f.unit))
    return true;
  const std::set<std::string> words = words_of(f.name, f.unit);
  const auto is_word = [&words](const char *word) { return words.count(word) > 0; };
  const std::initializer_list<const char *> bare{
      "vel", "vx", "vy", "vz", "v", "qd", "dq", "w", "wz", "surge", "sway", "heave", "kmh", "kph"};
  return f.unit.empty() &&
         (std::any_of(bare.begin(), bare.end(), is_word) ||
          has_word(f.name, {"veloc", "speed", "rate", "climb", "omega", "qdot", "rpm"}) ||
          is_rate(measured, feature));
}

// How well the feature's change from row to row follows the channel: the prediction as a rate of
// change, or, in the feature's own unit, as its next value.
double own_correlation(const Measured &measured, const Channel &channel, int feature) {
  const Feature &f = measured.features[static_cast<std::size_t>(feature)];
  Moments rate, step;
  each_step(measured, [&](Index k, Index next, double dt) {
    const double change = measured.x(next, feature) - measured.x(k, feature);
    rate.add(change / dt, channel.m(k));
    step.add(change, channel.m(k) - measured.x(k, feature));
  });
  const double follows = rate.correlation();
  return f.unit == channel.unit ? std::max(follows, step.correlation()) : follows;
}

// The one of these velocities whose name has most in common with the channel's; -1: several or
// none.
int by_name(const Measured &measured, const Channel &channel, const std::vector<int> &fitting) {
  const std::set<std::string> wanted = words_of(channel.name, channel.unit);
  int best = -1;
  std::size_t most = 0;
  for (const int f : fitting) {
    const Feature &feature = measured.features[static_cast<std::size_t>(f)];
    std::size_t common = 0;
    for (const std::string &word : words_of(feature.name, feature.unit))
      common += wanted.count(word);
    if (common > most)
      best = f;
    else if (common == most)
      best = -1;
    most = std::max(most, common);
  }
  return best;
}

int sign_beyond(double correlation, double least) {
  return correlation > least ? 1 : correlation < -least ? -1 : 0;
}

// Whether the velocity counts as the channel does, or against it; 0: it cannot be told. A motion:
// the prediction is the velocity's next value, or its change.
int motion_sense(const Measured &measured, const Channel &channel, int feature) {
  Moments level;
  for (Index k = 0; k < channel.m.size(); ++k)
    level.add(measured.x(k, feature), channel.m(k));
  const bool is_level = measured.features[static_cast<std::size_t>(feature)].unit == channel.unit;
  if (const int sense = sign_beyond(level.correlation(), kSenseOfLevel); is_level && sense != 0)
    return sense;
  Moments rate;
  each_step(measured, [&](Index k, Index next, double dt) {
    rate.add((measured.x(next, feature) - measured.x(k, feature)) / dt, channel.m(k));
  });
  return sign_beyond(rate.correlation(), kLeastOwnCorrelation);
}

// A force by inverse dynamics: what it grows by with the acceleration, other quantities that are
// measured (weight by position) held fast.
int force_sense(const Measured &measured, const Channel &channel, int feature) {
  std::vector<int> beside;
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    const Feature &other = measured.features[static_cast<std::size_t>(f)];
    if (f != feature && !other.is_command && !other.is_prediction)
      beside.push_back(f);
  }
  const std::size_t rows = std::max<std::size_t>(1, measured.rows() / kSenseRows);
  std::vector<Index> at;
  std::vector<double> acceleration;
  std::size_t step = 0;
  each_step(measured, [&](Index k, Index next, double dt) {
    if (step++ % rows != 0)
      return;
    at.push_back(k);
    acceleration.push_back((measured.x(next, feature) - measured.x(k, feature)) / dt);
  });
  const auto n = static_cast<Index>(at.size()), p = static_cast<Index>(beside.size());
  if (n < 20 + 3 * p)
    return 0;
  Eigen::MatrixXd h(n, 2 * p + 1);
  h.col(0).setOnes();
  for (Index k = 0; k < p; ++k) {
    const Vector all = measured.x.col(beside[idx(k)]), x = all(at);
    const double size = std::sqrt(x.squaredNorm() / static_cast<double>(n)) + 1e-300;
    const Feature &other = measured.features[static_cast<std::size_t>(beside[idx(k)])];
    const double turn = turn_in(other.unit); // weight goes with the sine of an angle
    const Eigen::ArrayXd a = x.array() * (turn > 0.0 ? turn_in("rad") / turn : 1.0 / size);
    h.col(1 + 2 * k) = turn > 0.0 ? Vector(a.sin()) : Vector(a);
    h.col(2 + 2 * k) = turn > 0.0 ? Vector(a.cos()) : Vector(a.square());
  }
  Eigen::MatrixXd gram = h.transpose() * h;
  gram.diagonal().array() += 1e-6 * static_cast<double>(n);
  const auto less = [&](const Vector &y) -> Vector {
    return y - h * gram.ldlt().solve(h.transpose() * y);
  };
  const Vector a = less(Eigen::Map<const Vector>(acceleration.data(), n)), m = less(channel.m(at));
  const double both = std::sqrt(a.squaredNorm() * m.squaredNorm());
  return both > 0.0 ? sign_beyond(a.dot(m) / both, kLeastOwnCorrelation) : 0;
}

// A motion, an acceleration or a force.
bool is_of_motion(const Channel &channel) {
  return is_linear(channel.unit) || is_turning(channel.unit) || is_force(channel);
}

// How well what a feature changes by over so many rows follows the mean of the prediction there.
double integral_correlation(const Measured &measured, const Channel &channel, int feature,
                            std::size_t rows) {
  Moments both;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i + rows < log.first + log.rows; i += rows) {
      const auto k = static_cast<Index>(i), n = static_cast<Index>(rows);
      const double dt = measured.elapsed_s[i + rows] - measured.elapsed_s[i];
      both.add((measured.x(k + n, feature) - measured.x(k, feature)) / dt,
               channel.m.segment(k, n).mean());
    }
  }
  return both.correlation();
}

// The one feature without a known unit that is a velocity by what it does: it changes as the
// prediction, an acceleration or a force, says that it should. Empty: there is none, or several.
std::vector<int> moving(const Measured &measured, const Channel &channel) {
  std::vector<int> found;
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    const Feature &feature = measured.features[static_cast<std::size_t>(f)];
    if (feature.is_command || feature.is_prediction || !feature.unit.empty())
      continue;
    for (const std::size_t rows : {1, 4, 16}) {
      if (integral_correlation(measured, channel, f, rows) > kLeastMoving) {
        found.push_back(f);
        break;
      }
    }
  }
  return found.size() == 1 ? found : std::vector<int>{};
}

// A quantity that no motion resists.
bool may_have_velocity(const Channel &channel) {
  return !is_one_of(channel.unit, {"m", "km", "cm", "mm", "rad", "deg", "degC", "K", "Pa", "kPa",
                                   "bar", "pct", "%", "V", "s", "kg"});
}

// Whether a quantity of an unknown kind, whose prediction starts from its reading, may be a motion
// that is resisted.
bool may_move(const Measured &measured, const Channel &channel, int state) {
  return channel.unit.empty() && starts_from(measured, channel, state) &&
         !has_word(channel.name, {"temp", "level", "press", "volt", "charge", "angle", "pos",
                                  "head", "height", "altitude", "current", "conc", "soc", "swing"});
}

} // namespace

bool turns(const Feature &feature, const Vector &x) {
  const bool is_by_name =
      feature.unit.empty() && has_word(feature.name, {"angle", "theta", "phi", "psi", "heading",
                                                      "yaw", "pitch", "roll", "swing", "tilt"});
  const double turn = turn_in(is_by_name ? "rad" : feature.unit);
  return feature.is_angle || (!feature.is_command && !feature.is_prediction && turn > 0.0 &&
                              !has_word(feature.name, {"rate", "veloc", "speed", "acc"}) &&
                              x.maxCoeff() - x.minCoeff() > kLeastTurn * turn);
}

namespace {

std::string in_radians(const std::string &expression, const std::string &placeholder) {
  std::string out;
  for (std::size_t i = 0; i < expression.size();) {
    std::size_t end = i;
    while (
        end < expression.size() &&
        (std::isalnum(static_cast<unsigned char>(expression[end])) != 0 || expression[end] == '_'))
      ++end;
    end = std::max(end, i + 1);
    const std::string word = expression.substr(i, end - i);
    out += word == placeholder ? word + "*_pi/180" : word;
    i = end;
  }
  return out;
}

} // namespace

void bind(const Argument &argument, const Feature &feature, Term *term) {
  term->arguments[argument.name] = feature.name;
  const bool is_angle =
      argument.role == ArgumentRole::angle || argument.role == ArgumentRole::heading;
  for (std::string &basis : term->basis) {
    if (is_angle && turn_in(feature.unit) > turn_in("rad"))
      basis = in_radians(basis, argument.name);
  }
}

bool has_word(const std::string &name, std::initializer_list<const char *> words) {
  return std::any_of(words.begin(), words.end(),
                     [&name](const char *word) { return name.find(word) != std::string::npos; });
}

bool is_altitude(const Feature &feature, const Vector &x) {
  return (feature.unit == "m" || feature.unit == "km") &&
         has_word(feature.name, {"alt", "height", "agl", "msl"}) &&
         x.maxCoeff() - x.minCoeff() > kLeastClimb_m * (feature.unit == "km" ? 1e-3 : 1.0);
}

bool is_stream(const Feature &feature, const Feature &velocity) {
  return !feature.is_command && !feature.is_prediction && feature.unit == velocity.unit &&
         has_word(feature.name,
                  {"wind", "air", "current", "stream", "tide", "flow", "gust", "water"});
}

int sense_of(const Term &term, const Channel &channel) {
  const auto v = term.arguments.find("v");
  const auto known =
      v == term.arguments.end() ? channel.senses.end() : channel.senses.find(v->second);
  return known == channel.senses.end() ? 0 : known->second;
}

bool opposes(const Term &term, const Channel &channel) {
  if (term.basis.empty() || term.sizes.empty())
    return false;
  const bool is_against = term.basis[0][0] == '-', is_less = term.sizes[0].value < 0.0;
  const bool opposes = (is_against != is_less) != is_force(channel);
  return sense_of(term, channel) < 0 ? !opposes : opposes;
}

void find_senses(Measured *measured) {
  const std::vector<int> all = velocities(*measured);
  for (Channel &channel : measured->channels) {
    for (const int f : all) {
      const int sense = is_force(channel) ? force_sense(*measured, channel, f)
                                          : motion_sense(*measured, channel, f);
      if (sense != 0)
        channel.senses[measured->features[static_cast<std::size_t>(f)].name] = sense;
    }
  }
}

bool is_force(const Channel &channel) {
  return is_one_of(channel.unit, {"N", "kN", "N m", "Nm", "N*m", "A"}) ||
         has_word(channel.name, {"force", "torque", "effort"});
}

std::vector<int> velocities(const Measured &thin) {
  const Measured &measured = full(thin);
  std::vector<int> out;
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    if (is_velocity(measured, f))
      out.push_back(f);
  }
  return out;
}

std::vector<int> own_velocity(const Measured &thin, const Channel &of_thin) {
  const Measured &measured = full(thin);
  const Channel &channel = full(thin, of_thin);
  if (!channel.velocity.empty()) {
    const int said = measured.find_feature(channel.velocity);
    return said < 0 ? std::vector<int>{} : std::vector<int>{said};
  }
  if (!may_have_velocity(channel))
    return {};
  const std::vector<int> all = velocities(measured);
  std::vector<int> fitting;
  std::vector<double> follows;
  for (const int f : all) {
    const std::string &unit = measured.features[static_cast<std::size_t>(f)].unit;
    if ((is_linear(channel.unit) && is_turning(unit)) ||
        (is_turning(channel.unit) && is_linear(unit)))
      continue;
    fitting.push_back(f);
    follows.push_back(own_correlation(measured, channel, f));
  }
  if (fitting.empty() && is_of_motion(channel))
    fitting = moving(measured, channel);
  if (fitting.size() == 1)
    return fitting;
  if (fitting.empty()) {
    const int state = own_state(measured, channel);
    return state >= 0 && may_move(measured, channel, state) ? std::vector<int>{state}
                                                            : std::vector<int>{};
  }
  const double most = *std::max_element(follows.begin(), follows.end());
  if (most <= kLeastOwnCorrelation)
    return fitting;
  std::vector<int> own;
  for (std::size_t k = 0; k < fitting.size(); ++k) {
    if (follows[k] >= kClearOwn * most)
      own.push_back(fitting[k]);
  }
  const int named = by_name(measured, channel, fitting);
  return named >= 0 ? std::vector<int>{named} : own;
}

int own_state(const Measured &thin, const Channel &of_thin) {
  const Measured &measured = full(thin);
  const Channel &channel = full(thin, of_thin);
  int best = -1;
  double most = kLeastStateCorrelation;
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    const Feature &feature = measured.features[static_cast<std::size_t>(f)];
    if (feature.is_command || feature.is_prediction || feature.unit != channel.unit)
      continue;
    Moments next;
    each_step(measured,
              [&](Index k, Index later, double) { next.add(channel.z(k), measured.x(later, f)); });
    if (next.correlation() > most) {
      most = next.correlation();
      best = f;
    }
  }
  return best;
}

namespace {

// Whether what the prediction adds to the reading may be the change within a row: not where the
// reading moves smoothly and that is unlike its change. The prediction then is only alike, as that
// of an arm is to the angle of its motor.
bool moves_on(const Measured &measured, const Channel &channel, int feature) {
  Moments smooth, follows;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first + 1; i + 1 < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      const double change = measured.x(k + 1, feature) - measured.x(k, feature);
      smooth.add(measured.x(k, feature) - measured.x(k - 1, feature), change);
      follows.add(change, channel.m(k) - measured.x(k, feature));
    }
  }
  return smooth.correlation() < kSmoothReading || follows.correlation() > kLeastMovingOn;
}

} // namespace

bool starts_from(const Measured &thin, const Channel &of_thin, int feature) {
  const Measured &measured = full(thin);
  const Channel &channel = full(thin, of_thin);
  const Vector change = channel.m - measured.x.col(feature);
  if (change.cwiseAbs().maxCoeff() <= kNoChange * channel.m.cwiseAbs().maxCoeff())
    return false; // it is the reading: of no change within a row can anything come late
  if (!moves_on(measured, channel, feature))
    return false;
  Moments bends; // second differences: of what moves smoothly little is left
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first + 1; i + 1 < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      const auto bend = [k](const auto &x) { return x(k + 1) - 2.0 * x(k) + x(k - 1); };
      bends.add(bend(measured.x.col(feature)), bend(channel.m));
    }
  }
  return bends.correlation() > kLeastStartCorrelation;
}

} // namespace rim::diagnose
