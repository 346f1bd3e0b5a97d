// SPDX-License-Identifier: MIT
#include "diagnose/single_logs.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// Each costs a search of its own.
constexpr std::size_t kMostLogs = 4;
// Of a log alone parts must be left out, and still say something.
constexpr std::size_t kLeastRows = 120;
// By how much the mean square of a log is above that of half of them, when it is unlike them.
constexpr double kUnlike = 2.0;
constexpr double kNone = 0.1; // of the largest size among the logs: what is next to nothing

const Gain *gain_of(const std::vector<Gain> &gains, const std::string &channel) {
  for (const Gain &gain : gains) {
    if (gain.channel == channel && gain.where == "all" && !(gain.horizon_s > 0.0))
      return &gain;
  }
  return nullptr;
}

bool any_given(const ChannelFindings &found) {
  return std::any_of(found.members.begin(), found.members.end(),
                     [](const Member &m) { return m.is_given; });
}

// Of a size that differs between the logs another log is not predicted, and need not be. Where most
// have next to nothing of it, it is in the others alone.
bool is_in_most(const Member &member) {
  if (!member.differs || member.term.sizes.empty())
    return false;
  const std::vector<double> &sizes = member.term.sizes[0].per_log;
  double most = 0.0;
  for (const double size : sizes)
    most = std::max(most, std::abs(size));
  const auto have = std::count_if(sizes.begin(), sizes.end(),
                                  [most](double size) { return std::abs(size) > kNone * most; });
  return 2 * static_cast<std::size_t>(have) > sizes.size();
}

bool any_in_most(const ChannelFindings &found) {
  return std::any_of(found.members.begin(), found.members.end(), is_in_most);
}

bool any_differs(const ChannelFindings &found) {
  return std::any_of(found.members.begin(), found.members.end(),
                     [](const Member &m) { return m.differs; });
}

// Mean square of what is left, in stated sd, of every log.
std::vector<double> squares_of(const Measured &measured, const Channel &channel,
                               const ChannelFindings &found) {
  std::vector<Term> terms;
  for (const Member &member : found.members)
    terms.push_back(member.term);
  const Vector after = extended_prediction(terms, channel, measured).m,
               left = (channel.z - after).cwiseQuotient(channel.sd);
  std::vector<double> squares;
  for (const LogSpan &log : measured.logs) {
    double sum = 0.0, rows = 0.0;
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      if (found.flagged.stuck[i] != 0 || found.flagged.dropout[i] != 0)
        continue;
      sum += std::pow(left(static_cast<Index>(i)), 2.0);
      rows += 1.0;
    }
    squares.push_back(rows > 0.0 ? sum / rows : 0.0);
  }
  return squares;
}

// The logs in which most is left; none where there is nothing to be looked for.
std::vector<std::size_t> logs_to_see(const Measured &measured, const Channel &channel,
                                     const ChannelFindings &found, const Gain *gain) {
  const bool is_claimed = !found.members.empty();
  if (any_given(found) || any_in_most(found) ||
      (is_claimed && (gain == nullptr || is_borne_out(*gain))))
    return {};
  const std::vector<double> squares = squares_of(measured, channel, found);
  std::vector<double> sorted = squares;
  std::sort(sorted.begin(), sorted.end());
  const double usual = sorted[(sorted.size() - 1) / 2];
  const bool is_seen = is_claimed || !found.unconfirmed.empty();
  std::vector<std::size_t> logs;
  for (std::size_t l = 0; l < squares.size(); ++l) {
    if (measured.logs[l].rows >= kLeastRows && (is_seen || squares[l] > kUnlike * usual))
      logs.push_back(l);
  }
  std::stable_sort(logs.begin(), logs.end(),
                   [&](std::size_t a, std::size_t b) { return squares[a] > squares[b]; });
  logs.resize(std::min(logs.size(), kMostLogs));
  return logs;
}

// As it is said of one log of several.
Finding of_one_log(const Finding &alone, const Measured &measured, std::size_t which) {
  const LogSpan &log = measured.logs[which];
  Finding f = alone;
  f.term.logs = {log.path};
  f.acts.assign(measured.rows(), 0);
  std::copy(alone.acts.begin(), alone.acts.end(),
            f.acts.begin() + static_cast<std::ptrdiff_t>(log.first));
  f.inside_fraction *= static_cast<double>(log.rows) / static_cast<double>(measured.rows());
  f.p_value = std::min(1.0, f.p_value * static_cast<double>(measured.logs.size()));
  f.sentence[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(f.sentence[0])));
  f.sentence = fmt::format("In {}, one of {} logs: {}", log.path, measured.logs.size(), f.sentence);
  return f;
}

// What remains beside what single logs have. Scatter that was claimed of all rows was of these.
void look_again(const std::vector<InOneLog> &single, const Measured &measured,
                const Channel &channel, ChannelFindings *found) {
  std::vector<Term> terms;
  for (const InOneLog &one : single) {
    for (const Finding &f : one.findings)
      terms.push_back(f.term);
  }
  found->variances.clear();
  found->noise.weight = (found->noise.weight.array() > 0.0).cast<double>();
  const Vector left =
      (channel.z - extended_prediction(terms, channel, measured).m).cwiseQuotient(channel.sd);
  const NoiseState state =
      noise_state(left, found->noise.weight, measured, 0.0, 0.0, least_noise(channel));
  found->noise.scale = std::sqrt(state.variance);
  found->noise.spread = state.spread;
  found->noise.scatter = state.scatter;
  found->autocorrelation = state.autocorrelation;
}

double strength(const InOneLog &one) { return one.findings.front().ln_anom; }

// A channel's gains in one log in place of those in all, which say nothing of it.
void put_gains(const InOneLog &one, const std::string &channel, std::vector<Gain> *gains) {
  if (gains->empty())
    return;
  const auto is_here = [&channel](const Gain &gain) { return gain.channel == channel; };
  gains->erase(std::remove_if(gains->begin(), gains->end(), is_here), gains->end());
  std::copy_if(one.gains.begin(), one.gains.end(), std::back_inserter(*gains), is_here);
}

} // namespace

std::vector<std::vector<InOneLog>> find_in_single_logs(const std::vector<Log> &logs,
                                                       const Measured &measured,
                                                       const std::vector<ChannelFindings> &found,
                                                       const std::vector<Gain> &gains,
                                                       const Options &options) {
  std::vector<std::vector<std::size_t>> to_see(found.size());
  for (std::size_t c = 0; logs.size() > 1 && c < found.size(); ++c)
    to_see[c] = logs_to_see(measured, measured.channels[c], found[c],
                            gain_of(gains, measured.channels[c].name));
  Options alone = options;
  alone.gains = true;
  // Of all the logs together no more is claimed by chance than was allowed.
  alone.false_alarm = options.false_alarm / static_cast<double>(logs.size());
  std::vector<std::vector<InOneLog>> single(found.size());
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const auto has = [l](const auto &some) {
      return std::find(some.begin(), some.end(), l) != some.end();
    };
    if (std::none_of(to_see.begin(), to_see.end(), has))
      continue;
    const Diagnosis own = diagnose({logs[l]}, alone, nullptr);
    for (std::size_t c = 0; c < found.size(); ++c) {
      const std::string &channel = measured.channels[c].name;
      const Gain *gain = gain_of(own.gains, channel);
      // All of the interval, for this stands against what the other logs say.
      if (!has(to_see[c]) || gain == nullptr || !(gain->ratio_ci95.high < 1.0))
        continue;
      InOneLog one;
      for (const Finding &f : own.findings) {
        if (f.term.channel == channel && f.term.kind == TermKind::mean && !f.given)
          one.findings.push_back(of_one_log(f, measured, l));
      }
      one.gains = own.gains;
      for (Gain &g : one.gains)
        g.data += " within " + logs[l].path;
      if (!one.findings.empty())
        single[c].push_back(std::move(one));
    }
  }
  return single;
}

void claim_in_single_logs(const std::vector<std::vector<InOneLog>> &single,
                          const Measured &measured, const std::vector<Gain> &gains,
                          std::vector<ChannelFindings> *found) {
  for (std::size_t c = 0; c < found->size(); ++c) {
    ChannelFindings &of_channel = (*found)[c];
    const Gain *gain = gain_of(gains, measured.channels[c].name);
    if (!single[c].empty()) {
      for (const Member &member : of_channel.members)
        of_channel.unconfirmed.push_back(
            {member.term, "in the other logs it is not borne out, and single logs say more"});
      of_channel.members.clear();
      of_channel.claims.clear();
      look_again(single[c], measured, measured.channels[c], &of_channel);
    } else if (gain != nullptr && gain->worse && !any_given(of_channel) &&
               !any_differs(of_channel)) {
      for (Member &member : of_channel.members)
        member.term.cause = "unknown";
    }
  }
}

void add_single_logs(const std::vector<std::vector<InOneLog>> &single, const Measured &measured,
                     Diagnosis *diagnosis) {
  const bool is_all = diagnosis->findings.empty();
  const InOneLog *first = nullptr;
  for (std::size_t c = 0; c < single.size(); ++c) {
    const InOneLog *best = nullptr;
    for (const InOneLog &one : single[c]) {
      diagnosis->findings.insert(diagnosis->findings.end(), one.findings.begin(),
                                 one.findings.end());
      if (best == nullptr || strength(one) > strength(*best))
        best = &one;
    }
    if (best == nullptr)
      continue;
    if (first == nullptr || strength(*best) > strength(*first))
      first = best;
    put_gains(*best, measured.channels[c].name, &diagnosis->gains);
  }
  if (is_all && first != nullptr && !diagnosis->gains.empty())
    diagnosis->gains = first->gains;
}

} // namespace rim::diagnose
