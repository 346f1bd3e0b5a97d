// SPDX-License-Identifier: MIT
#include "report/data.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include <Eigen/LU>

#include "log/log.hpp"
#include "util/error.hpp"

namespace rim::diagnose::report {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kLeastRows = 12;

Index at(std::size_t i) { return static_cast<Index>(i); }

bool is_sensor_fault(const Finding &finding) {
  return finding.term.kind == TermKind::stuck || finding.term.kind == TermKind::dropout;
}

Bin bin_of(const Vector &x, const Vector &y, const std::size_t *first, const std::size_t *last,
           double inflation) {
  Bin bin;
  const auto n = static_cast<double>(last - first);
  double sum_x = 0.0, sum = 0.0, squares = 0.0;
  for (const std::size_t *row = first; row != last; ++row) {
    sum_x += x(at(*row));
    sum += y(at(*row));
    squares += y(at(*row)) * y(at(*row));
  }
  bin.rows = static_cast<std::size_t>(last - first);
  bin.x = sum_x / n;
  bin.mean = sum / n;
  bin.rms = std::sqrt(squares / n);
  const double variance =
      std::max(0.0, squares / n - bin.mean * bin.mean) * n / std::max(1.0, n - 1);
  bin.half = 1.96 * std::sqrt(variance * inflation / n);
  bin.rms_half = 1.96 * bin.rms * std::sqrt(0.5 * inflation / n);
  return bin;
}

std::vector<Term> terms_of(const Diagnosis &diagnosis) {
  std::vector<Term> terms;
  for (const Finding &finding : diagnosis.findings)
    terms.push_back(finding.term);
  return terms;
}

// Whether an expression names the identifier.
bool mentions(const std::string &expression, char name) {
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
  };
  for (std::size_t i = 0; i < expression.size(); ++i) {
    if (expression[i] == name && (i == 0 || !is_word(expression[i - 1])) &&
        (i + 1 == expression.size() || !is_word(expression[i + 1])))
      return true;
  }
  return false;
}

} // namespace

std::string plain_cause(const std::string &cause) {
  std::string words = cause;
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

std::string feature_text(const std::string &name) {
  if (name == kTime)
    return "time since the log began";
  if (const std::string late = diagnose::late_text(name); !late.empty())
    return feature_text(diagnose::base_feature(name)) + " " + late;
  const std::string plain = plain_name(name);
  const bool says_so = plain.rfind("cmd", 0) == 0 || plain.rfind("command", 0) == 0;
  if (name.rfind("m.", 0) == 0)
    return "predicted " + plain;
  return (name.rfind("u.", 0) == 0 && !says_so ? "commanded " : "") + plain;
}

View view_of(const Diagnosis &diagnosis, const Measured &measured, const Channel &channel) {
  View v;
  v.diagnosis = &diagnosis;
  v.measured = &measured;
  v.channel = &channel;
  v.m_after = channel.m;
  v.sd_after = channel.sd;
  for (const ChannelState &state : diagnosis.channels) {
    if (state.channel != channel.name)
      continue;
    if (state.m_after.size() == channel.m.size())
      v.m_after = state.m_after;
    if (state.sd_after.size() == channel.sd.size())
      v.sd_after = state.sd_after;
    const double rho = std::clamp(state.autocorrelation, 0.0, 0.99);
    v.inflation = (1.0 + rho) / (1.0 - rho);
  }
  v.before = (channel.z - channel.m).cwiseQuotient(channel.sd);
  v.after = (channel.z - v.m_after).cwiseQuotient(v.sd_after);
  for (std::size_t i = 0; i < measured.rows(); ++i) {
    bool is_usable = std::isfinite(v.before(at(i))) && std::isfinite(v.after(at(i)));
    for (const Finding &f : diagnosis.findings) {
      if (f.term.channel == channel.name && is_sensor_fault(f) && i < f.acts.size() && f.acts[i])
        is_usable = false;
    }
    if (is_usable)
      v.usable.push_back(i);
  }
  return v;
}

Quantity quantity_of(const std::string &name, const View &view) {
  const Measured &t = *view.measured;
  if (name == "m")
    return {name, "predicted " + axis_text(view.channel->name, view.channel->unit),
            view.channel->m};
  if (name == kTime)
    return {name, feature_text(name) + " (s)",
            Eigen::Map<const Vector>(t.elapsed_s.data(), at(t.elapsed_s.size()))};
  const int f = t.find_feature(base_feature(name));
  std::string unit = f < 0 ? "" : t.features[static_cast<std::size_t>(f)].unit;
  unit = unit.empty() ? "" : " (" + unit + ")";
  try {
    return {name, feature_text(name) + unit, feature_column(t, name)};
  } catch (const DataError &) {
    return {name, feature_text(name) + " (not in these logs, drawn as 0)",
            Vector::Zero(at(t.rows()))};
  }
}

Range range_of(const Vector &values) {
  double low = INFINITY, high = -INFINITY;
  for (const double value : values) {
    if (std::isfinite(value)) {
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  return {low, high};
}

std::vector<Bin> bins_of(const Vector &x, const Vector &y, const Rows &rows, std::size_t most,
                         double inflation) {
  Rows sorted;
  for (const std::size_t row : rows) {
    if (std::isfinite(x(at(row))) && std::isfinite(y(at(row))))
      sorted.push_back(row);
  }
  std::sort(sorted.begin(), sorted.end(), [&x](std::size_t a, std::size_t b) {
    return x(at(a)) < x(at(b)) || (x(at(a)) == x(at(b)) && a < b);
  });
  const std::size_t want =
      std::max(kLeastRows, (sorted.size() + most - 1) / std::max<std::size_t>(1, most));
  std::vector<Bin> bins;
  const double width =
      sorted.empty() ? 0.0
                     : (x(at(sorted.back())) - x(at(sorted.front()))) / static_cast<double>(most);
  for (std::size_t first = 0; first < sorted.size();) {
    std::size_t last = std::min(sorted.size(), first + kLeastRows);
    while (last < sorted.size() && last - first < want &&
           x(at(sorted[last])) - x(at(sorted[first])) < width)
      ++last;
    while (last < sorted.size() && x(at(sorted[last])) == x(at(sorted[last - 1])))
      ++last;
    if (sorted.size() - last < kLeastRows)
      last = sorted.size();
    bins.push_back(bin_of(x, y, &sorted[first], sorted.data() + last, inflation));
    first = last;
  }
  return bins;
}

std::vector<Bin> steps_of(const Vector &x, const Vector &y, const Rows &rows, std::size_t count) {
  const Range range = range_of(x);
  std::vector<Rows> members(count);
  for (const std::size_t row : rows) {
    const double share = (x(at(row)) - range.low) / std::max(1e-300, range.high - range.low);
    if (!std::isfinite(share) || !std::isfinite(y(at(row))))
      continue;
    const double step = std::floor(share * static_cast<double>(count));
    members[static_cast<std::size_t>(std::clamp(step, 0.0, static_cast<double>(count - 1)))]
        .push_back(row);
  }
  std::vector<Bin> bins;
  for (const Rows &list : members) {
    if (!list.empty())
      bins.push_back(bin_of(x, y, list.data(), list.data() + list.size(), 1.0));
  }
  return bins;
}

bool in_bounds(const Gate &gate, std::size_t k, double value) {
  const bool above = value >= gate.lower[k], below = value <= gate.upper[k];
  return gate.lower[k] > gate.upper[k] ? above || below : above && below;
}

Rows rows_in_bounds(const Gate &gate, const View &view, const std::vector<std::string> &except) {
  Rows inside = view.usable;
  for (std::size_t k = 0; k < gate.features.size(); ++k) {
    if (std::find(except.begin(), except.end(), gate.features[k]) != except.end())
      continue;
    const Vector x = quantity_of(gate.features[k], view).value;
    inside.erase(std::remove_if(inside.begin(), inside.end(),
                                [&](std::size_t row) { return !in_bounds(gate, k, x(at(row))); }),
                 inside.end());
  }
  return inside;
}

std::pair<std::size_t, std::size_t> best_projection(const Gate &gate, const View &view) {
  const std::size_t d = gate.features.size();
  std::vector<std::size_t> order(d), kept(d, 0);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t k = 0; k < d; ++k) {
    const Vector x = quantity_of(gate.features[k], view).value;
    for (const std::size_t row : view.usable)
      kept[k] += in_bounds(gate, k, x(at(row)));
  }
  std::stable_sort(order.begin(), order.end(),
                   [&kept](std::size_t a, std::size_t b) { return kept[a] < kept[b]; });
  return {std::min(order[0], order[d > 1 ? 1 : 0]), std::max(order[0], order[d > 1 ? 1 : 0])};
}

std::vector<std::pair<double, double>> outline(const Gate &gate, std::size_t i, std::size_t j) {
  const std::size_t d = gate.features.size();
  std::vector<std::pair<double, double>> points;
  if (!gate.is_ellipse || gate.inverse_shape.size() != d * d || gate.center.size() != d) {
    const double a = gate.lower[i], b = gate.upper[i], c = gate.lower[j], e = gate.upper[j];
    return {{a, c}, {b, c}, {b, e}, {a, e}};
  }
  const Eigen::MatrixXd shape =
      Eigen::Map<const Eigen::MatrixXd>(gate.inverse_shape.data(), at(d), at(d)).inverse();
  // The shadow of (x-u)' A^-1 (x-u) < 1 on two axes has that block of A for its shape; its root by
  // Cholesky takes the unit circle there.
  const double aa = std::sqrt(std::max(0.0, shape(at(i), at(i))));
  const double ab = aa > 0.0 ? shape(at(i), at(j)) / aa : 0.0;
  const double bb = std::sqrt(std::max(0.0, shape(at(j), at(j)) - ab * ab));
  for (int k = 0; k < 96; ++k) {
    const double angle = 2.0 * 3.14159265358979 * k / 96.0;
    points.emplace_back(gate.center[i] + aa * std::cos(angle),
                        gate.center[j] + ab * std::cos(angle) + bb * std::sin(angle));
  }
  return points;
}

Vector effect_of(const Finding &finding, const View &view) {
  if (finding.term.kind != TermKind::mean)
    return Vector::Zero(view.channel->m.size());
  try {
    return effect_beside(finding.term, terms_of(*view.diagnosis), *view.channel, *view.measured);
  } catch (const DataError &) {
    return view.m_after - view.channel->m; // effect_problem() says so
  }
}

std::string effect_problem(const Finding &finding, const View &view) {
  if (finding.term.kind != TermKind::mean)
    return "";
  try {
    (void)effect_beside(finding.term, terms_of(*view.diagnosis), *view.channel, *view.measured);
    return "";
  } catch (const DataError &error) {
    return error.what();
  }
}

Share share_of(const Finding &finding, const View &view, const Vector &effect) {
  Share s;
  s.m_without = view.m_after - effect;
  s.sd_without = view.sd_after;
  for (const Finding &other : view.diagnosis->findings) {
    if (&other != &finding && other.term.channel == view.channel->name && !is_sensor_fault(other))
      s.alone = false;
  }
  if (s.alone) {
    s.m_without = view.channel->m;
    s.sd_without = view.channel->sd;
  } else if (finding.term.kind == TermKind::variance && !finding.term.sizes.empty()) {
    const double root = std::sqrt(std::max(1e-6, finding.term.sizes[0].value));
    for (const std::size_t row : rows_in_bounds(finding.term.gate, view, {}))
      s.sd_without(at(row)) /= root;
  }
  s.without = (view.channel->z - s.m_without).cwiseQuotient(s.sd_without);
  s.with = view.after;
  return s;
}

std::string telling_argument(const Finding &finding, const View &view, const Vector &effect) {
  std::vector<std::string> names;
  for (const auto &[placeholder, name] : finding.term.arguments)
    names.push_back(name);
  const std::vector<std::string> &basis = finding.term.basis;
  for (const char own : {'m', 't'}) {
    if (std::any_of(basis.begin(), basis.end(),
                    [own](const std::string &e) { return mentions(e, own); }))
      names.push_back(own == 'm' ? "m" : kTime);
  }
  std::string best = names.empty() ? kTime : names.front();
  double most = -1.0;
  for (const std::string &name : names) {
    double sum = 0.0, squares = 0.0, n = 0.0;
    for (const Bin &bin : steps_of(quantity_of(name, view).value, effect, view.usable, 40)) {
      const auto weight = static_cast<double>(bin.rows);
      n += weight;
      sum += weight * bin.mean;
      squares += weight * bin.mean * bin.mean;
    }
    const double spread = n > 0.0 ? squares / n - (sum / n) * (sum / n) : 0.0;
    if (spread > most) {
      most = spread;
      best = name;
    }
  }
  return best;
}

Stretch telling_stretch(const Finding &finding, const View &view, const Vector &effect,
                        std::size_t most) {
  const auto weight = [&](std::size_t row) {
    const double e = effect(at(row)) / view.channel->sd(at(row));
    if (finding.term.kind == TermKind::mean && std::isfinite(e))
      return e * e;
    return row < finding.acts.size() && finding.acts[row] != 0 ? 1.0 : 0.0;
  };
  Stretch best;
  std::size_t ties = 0; // windows after the best that are as good: its middle one is taken
  double best_sum = -1.0;
  for (std::size_t log = 0; log < view.measured->logs.size(); ++log) {
    const LogSpan &span = view.measured->logs[log];
    const std::size_t rows = std::min(most, span.rows);
    double sum = 0.0;
    for (std::size_t i = 0; i < span.rows; ++i) {
      sum += weight(span.first + i);
      if (i >= rows)
        sum -= weight(span.first + i - rows);
      const std::size_t first = span.first + i + 1 - std::min(rows, i + 1);
      if (i + 1 >= rows && sum > best_sum * (1.0 + 1e-9) + 1e-9) {
        best_sum = sum;
        best = {log, first, rows};
        ties = 0;
      } else if (log == best.log && first == best.first + ties + 1 &&
                 sum > best_sum * (1.0 - 1e-9) - 1e-9) {
        ++ties;
      }
    }
  }
  best.first += ties / 2;
  return best;
}

std::vector<std::pair<std::size_t, std::size_t>> runs_of(const std::vector<std::uint8_t> &acts,
                                                         std::size_t first, std::size_t rows) {
  std::vector<std::pair<std::size_t, std::size_t>> runs;
  const std::size_t last = std::min(acts.size(), first + rows);
  for (std::size_t i = first; i < last; ++i) {
    if (acts[i] == 0)
      continue;
    if (!runs.empty() && runs.back().second == i)
      ++runs.back().second;
    else
      runs.emplace_back(i, i + 1);
  }
  return runs;
}

Vector running_mean(const Vector &values, std::size_t width) {
  Vector out(values.size());
  const Index half = at(width / 2);
  for (Index i = 0; i < values.size(); ++i) {
    const Index low = std::max<Index>(0, i - half), high = std::min(values.size() - 1, i + half);
    double sum = 0.0;
    Index n = 0;
    for (Index k = low; k <= high; ++k) {
      if (std::isfinite(values(k))) {
        sum += values(k);
        ++n;
      }
    }
    out(i) = n > 0 ? sum / static_cast<double>(n) : NAN;
  }
  return out;
}

Rows thinned(const Rows &rows, std::size_t most) {
  if (rows.size() <= most)
    return rows;
  Rows few;
  for (std::size_t i = 0; i < most; ++i)
    few.push_back(rows[i * rows.size() / most]);
  return few;
}

} // namespace rim::diagnose::report
