// SPDX-License-Identifier: MIT
#include "diagnose/diagnose.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "diagnose/gain.hpp"
#include "diagnose/null.hpp"
#include "diagnose/regions.hpp"
#include "diagnose/roles.hpp"
#include "diagnose/rollout.hpp"
#include "diagnose/search.hpp"
#include "diagnose/sentence.hpp"
#include "diagnose/single_logs.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kLeastRows = 60;
constexpr std::size_t kMostFolds = 5;
// Rows that are searched: of more, some are looked at; of many features and channels fewer, for the
// forms grow with the square of the features.
constexpr std::size_t kMostSearched = 8000, kLeastSearched = 1500, kMostCells = 60;
// Below this score the null's threshold is not believed: it is a fitted law.
constexpr double kLeastThreshold = 2.0;
// Searches of noise over all channels, and the least of one.
constexpr std::size_t kMostNull = 64, kLeastNull = 6;
// The law is fitted to a first look at each simulated residual; the real one is looked at more
// often (swaps, ellipses), so a tenth of what is allowed is asked of it.
constexpr double kStrict = 0.1;
constexpr double kLeastP = 1e-12; // no law's tail is believed further

std::size_t most_searched(const Measured &measured) {
  const std::size_t cells = measured.features.size() * measured.channels.size();
  return cells <= kMostCells ? kMostSearched
                             : std::max(kLeastSearched, kMostSearched * kMostCells / cells);
}

// Nats that a term needs to enter a model, and to be claimed in the end.
struct Thresholds {
  double enter = 0.0, keep = 0.0;
  double most_p = 0.0; // chance that noise is taken for what swings with the time
};

std::vector<Term> terms_of(const ChannelFindings &found) {
  std::vector<Term> terms;
  for (const Member &member : found.members)
    terms.push_back(member.term);
  for (const VarianceClaim &claim : found.variances)
    terms.push_back(claim.term);
  return terms;
}

// The search of a channel; terms of the extension first. Of a large table some rows are searched,
// `few`, and all fitted. library: of the channel; nullptr: made here.
ChannelFindings search_channel(const Measured &measured, const Measured &few, std::size_t c,
                               const std::vector<Term> &given, const SearchOptions &options,
                               const Library *library) {
  const Library own =
      library == nullptr ? make_library(few, few.channels[c], *options.catalogue) : Library{};
  ChannelFindings found =
      ChannelSearch(few, few.channels[c], library == nullptr ? own : *library, options).run(given);
  if (few.whole != nullptr)
    refit_on(measured, measured.channels[c], &found);
  return found;
}

SearchOptions search_options(const Thresholds &threshold, const Catalogue &catalogue,
                             const Measured *held) {
  SearchOptions options;
  options.threshold = threshold.enter;
  options.least = threshold.keep;
  options.most_p = threshold.most_p;
  options.held = held;
  options.catalogue = &catalogue;
  return options;
}

// libraries: of all channels, or empty: made one after the other.
std::vector<ChannelFindings> search_all(const Measured &measured, const Measured &few,
                                        const std::vector<Library> &libraries,
                                        const Options &options, const Thresholds &threshold) {
  Measured held;
  if (!options.holdout.empty())
    held = thinned(make_measured(options.holdout, Constants::keep), most_searched(measured));
  const SearchOptions search =
      search_options(threshold, options.catalogue, options.holdout.empty() ? nullptr : &held);
  std::vector<ChannelFindings> found(measured.channels.size());
  Progress progress("searching", found.size());
  parallel_for(found.size(), [&](std::size_t c) {
    found[c] = search_channel(measured, few, c, options.given, search,
                              libraries.empty() ? nullptr : &libraries[c]);
    progress.add();
  });
  return found;
}

Finding mean_finding(const Member &member, const Claim &claim, const std::vector<Term> &terms,
                     const Channel &channel, const Measured &measured, const Null &null) {
  Finding f;
  f.term = member.term;
  f.given = member.is_given;
  f.ln_anom = claim.ln_anom;
  f.p_value =
      is_swing(member.term) && !member.is_given
          ? std::clamp(member.p_value * static_cast<double>(measured.channels.size()), kLeastP, 1.0)
          : null.p_value(claim.score);
  f.heldout_r2 = claim.heldout_r2;
  f.alternatives = claim.alternatives;
  f.separable = claim.is_separable;
  const Vector effect =
      effect_beside(member.term, terms, channel, measured).cwiseAbs().cwiseQuotient(channel.sd);
  f.acts.resize(measured.rows());
  for (std::size_t i = 0; i < f.acts.size(); ++i)
    f.acts[i] = effect(static_cast<Index>(i)) > kActs ? 1 : 0;
  f.inside_fraction = gate_mask(member.term.gate, measured).mean();
  return f;
}

Finding sensor_finding(const Channel &channel, TermKind kind, const std::vector<std::uint8_t> &rows,
                       std::size_t count, double ln_anom, const Null &null) {
  Finding f;
  f.term.channel = channel.name;
  f.term.kind = kind;
  f.term.cause = f.term.form = kind == TermKind::stuck ? "stuck" : "dropout";
  f.acts = rows;
  f.inside_fraction = static_cast<double>(count) / static_cast<double>(rows.size());
  f.ln_anom = ln_anom;
  f.p_value = null.p_value(ln_anom);
  return f;
}

void add_findings(const ChannelFindings &found, const Channel &channel, const Measured &measured,
                  const Null &null, std::vector<Finding> *findings) {
  if (found.flagged.stuck_rows > 0)
    findings->push_back(sensor_finding(channel, TermKind::stuck, found.flagged.stuck,
                                       found.flagged.stuck_rows, found.flagged.stuck_ln, null));
  if (found.flagged.dropout_rows > 0)
    findings->push_back(sensor_finding(channel, TermKind::dropout, found.flagged.dropout,
                                       found.flagged.dropout_rows, found.flagged.dropout_ln, null));
  std::vector<Term> terms;
  for (const Member &member : found.members)
    terms.push_back(member.term);
  for (std::size_t j = 0; j < found.members.size(); ++j)
    findings->push_back(
        mean_finding(found.members[j], found.claims[j], terms, channel, measured, null));
  for (const VarianceClaim &claim : found.variances) {
    Finding f;
    f.term = claim.term;
    f.ln_anom = claim.ln_anom;
    f.p_value = null.p_value(claim.score);
    f.inside_fraction = claim.mask.mean();
    f.acts.resize(measured.rows());
    for (std::size_t i = 0; i < f.acts.size(); ++i)
      f.acts[i] = claim.mask(static_cast<Index>(i)) > 0.0 ? 1 : 0;
    findings->push_back(f);
  }
}

// The rows of one fold, or all others, as a table of its own; spans that are cut become logs.
Measured select(const Measured &measured, const std::vector<std::uint8_t> &fold_of_row, int fold,
                bool is_held) {
  Measured out;
  out.features = measured.features;
  std::vector<Index> rows;
  for (const LogSpan &log : measured.logs) {
    bool is_open = false;
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      if ((fold_of_row[i] == fold) != is_held) {
        is_open = false;
        continue;
      }
      if (!is_open)
        out.logs.push_back({log.path, rows.size(), 0, 0});
      is_open = true;
      out.logs.back().rows += 1;
      rows.push_back(static_cast<Index>(i));
      out.t_s.push_back(measured.t_s[i]);
      out.elapsed_s.push_back(measured.elapsed_s[i]);
      out.row.push_back(measured.row[i]);
    }
  }
  out.x = measured.x(rows, Eigen::all);
  for (const Channel &channel : measured.channels) {
    Channel part = channel;
    part.z = channel.z(rows);
    part.m = channel.m(rows);
    part.sd = channel.sd(rows);
    part.run = channel.run(rows, Eigen::all);
    out.channels.push_back(part);
  }
  return out;
}

// Whole logs where there are several, unless asked otherwise; else stretches of each.
std::vector<std::uint8_t> folds_of(const Measured &measured, bool is_within, int *folds) {
  std::vector<std::uint8_t> fold(measured.rows());
  const std::size_t logs = measured.logs.size();
  const bool by_log = logs >= 2 && !is_within;
  *folds = static_cast<int>(by_log ? std::min(logs, kMostFolds) : 4);
  for (std::size_t l = 0; l < logs; ++l) {
    for (std::size_t r = 0; r < measured.logs[l].rows; ++r)
      fold[measured.logs[l].first + r] = static_cast<std::uint8_t>(
          by_log ? l % static_cast<std::size_t>(*folds)
                 : r * static_cast<std::size_t>(*folds) / measured.logs[l].rows);
  }
  return fold;
}

// Whether something swings in a phase that is each log's own: what a log that was left out has is
// not known, and only stretches of the same log tell whether it holds. Of two logs each alone does
// not tell that they have one phase.
bool any_own_phase(const std::vector<ChannelFindings> &found, std::size_t logs) {
  return std::any_of(found.begin(), found.end(), [logs](const ChannelFindings &of_channel) {
    return std::any_of(
        of_channel.members.begin(), of_channel.members.end(), [logs](const Member &m) {
          return is_swing(m.term) && !m.is_given && (!m.term.logs.empty() || logs == 2);
        });
  });
}

// Another log is predicted with none of a size that differs between the logs.
void forget_new_log(Term *term) {
  for (Parameter &size : term->sizes) {
    if (!size.per_log.empty())
      size.new_log = 0.0;
  }
}

void forget_new_log(std::vector<Term> *terms) {
  for (Term &term : *terms)
    forget_new_log(&term);
}

// Judges the terms on held-out logs; without any, each fold by what is found without it: structure
// and sizes are learnt anew.
class Gains {
public:
  Gains(const Measured &measured, const Options &options, const Thresholds &threshold)
      : measured_(measured), options_(options), threshold_(threshold),
        one_step_(measured.channels.size()), horizon_(measured.channels.size()) {}

  // By what is found without each fold. What it shows to be worth nothing to another log is taken
  // from what was found in all.
  void cross_validate(std::vector<ChannelFindings> *found);
  void hold_out(const std::vector<Term> &terms);
  std::vector<Gain> summary() const;

private:
  void judge(const std::vector<Term> &terms, const Measured &held, const std::vector<Log> *logs);
  void judge_horizon(const std::vector<Term> &terms, const Measured &held,
                     const std::vector<Log> *logs);
  void judge_folds(const std::vector<std::uint8_t> &fold_of_row,
                   const std::vector<std::vector<Term>> &terms);
  void keep_from_others(const std::vector<std::uint8_t> &fold_of_row,
                        std::vector<ChannelFindings> *found, std::vector<std::vector<Term>> *terms);

  const Measured &measured_;
  const Options &options_;
  Thresholds threshold_;
  bool is_within_ = false; // the logs: folds are stretches of each
  std::vector<Judged> one_step_, horizon_;
};

void Gains::hold_out(const std::vector<Term> &terms) {
  judge(terms, make_measured(options_.holdout, Constants::keep), &options_.holdout);
}

std::vector<Gain> Gains::summary() const {
  const bool is_held_out = !options_.holdout.empty();
  std::vector<Gain> gains;
  for (std::size_t c = 0; c < measured_.channels.size(); ++c) {
    const bool is_within = is_within_ && measured_.logs.size() > 1;
    const std::string data = is_held_out ? "held-out logs"
                             : is_within ? "cross-validated within logs"
                                         : "cross-validated";
    for (const Judged *judged : {&one_step_[c], &horizon_[c]}) {
      const auto some =
          summarise(*judged, measured_.channels[c],
                    judged == &horizon_[c] ? options_.horizon_s : 0.0, data, options_.seed);
      gains.insert(gains.end(), some.begin(), some.end());
    }
  }
  return gains;
}

void Gains::judge(const std::vector<Term> &terms, const Measured &held,
                  const std::vector<Log> *logs) {
  for (std::size_t c = 0; c < measured_.channels.size(); ++c) {
    const int there = held.find_channel(measured_.channels[c].name);
    if (there < 0)
      throw DataError(fmt::format("{}: column 'z.{}' is missing", held.logs.front().path,
                                  measured_.channels[c].name));
    append_judged(terms, held, static_cast<std::size_t>(there), &one_step_[c]);
  }
  if (options_.horizon_s > 0.0)
    judge_horizon(terms, held, logs);
}

// Rolled out where the predictor can; folds of a cross-validation are no whole logs and are not.
// Either every log or none: where one log cannot be, means over windows are compared in all.
void Gains::judge_horizon(const std::vector<Term> &terms, const Measured &held,
                          const std::vector<Log> *logs) {
  std::vector<Judged> rolled(held.channels.size());
  bool is_rolled = options_.predictor != nullptr && logs != nullptr;
  for (std::size_t l = 0; is_rolled && l < logs->size(); ++l)
    is_rolled = append_rolled(terms, (*logs)[l], options_.horizon_s, *options_.predictor, &rolled);
  for (std::size_t c = 0; c < measured_.channels.size(); ++c) {
    const auto there = static_cast<std::size_t>(held.find_channel(measured_.channels[c].name));
    if (is_rolled)
      horizon_[c] = std::move(rolled[there]);
    else
      append_means(terms, held, there, options_.horizon_s, &horizon_[c]);
  }
}

// What is left of the table without a fold, while channels are searched in it: copies of a large
// one take much memory.
struct Rest {
  std::mutex making;
  std::unique_ptr<Measured> all, few;
  std::size_t to_come = 0; // channels
};

void Gains::cross_validate(std::vector<ChannelFindings> *found) {
  int folds = 0;
  is_within_ = any_own_phase(*found, measured_.logs.size());
  const std::vector<std::uint8_t> fold_of_row = folds_of(measured_, is_within_, &folds);
  const std::size_t channels = measured_.channels.size();
  std::vector<Rest> rests(static_cast<std::size_t>(folds));
  std::vector<std::vector<Term>> terms(rests.size() * channels);
  const SearchOptions search = search_options(threshold_, options_.catalogue, nullptr);
  Progress progress("cross-validation", terms.size());
  parallel_for(terms.size(), [&](std::size_t i) {
    const std::size_t fold = i / channels;
    Rest &rest = rests[fold];
    {
      const std::lock_guard<std::mutex> lock(rest.making);
      if (rest.all == nullptr) {
        rest.to_come = channels;
        rest.all = std::make_unique<Measured>(
            select(measured_, fold_of_row, static_cast<int>(fold), false));
        // As thin as the whole search was.
        const std::size_t most = most_searched(measured_) * rest.all->rows() / measured_.rows() + 1;
        rest.few = std::make_unique<Measured>(thinned(*rest.all, most));
      }
    }
    terms[i] = terms_of(
        search_channel(*rest.all, *rest.few, i % channels, options_.given, search, nullptr));
    progress.add();
    const std::lock_guard<std::mutex> lock(rest.making);
    if (--rest.to_come == 0) {
      rest.few.reset();
      rest.all.reset();
    }
  });
  judge_folds(fold_of_row, terms);
  // Else a fold knows one log, and not that sizes differ.
  if (measured_.logs.size() > 2 && !is_within_)
    keep_from_others(fold_of_row, found, &terms);
}

// Judges every fold by what was found without it: terms, fold by fold and channel by channel.
void Gains::judge_folds(const std::vector<std::uint8_t> &fold_of_row,
                        const std::vector<std::vector<Term>> &terms) {
  const std::size_t channels = measured_.channels.size();
  one_step_.assign(channels, {});
  horizon_.assign(channels, {});
  for (std::size_t fold = 0; fold < terms.size() / channels; ++fold) {
    std::vector<Term> of_fold;
    for (std::size_t c = 0; c < channels; ++c) {
      const std::vector<Term> &of_channel = terms[fold * channels + c];
      of_fold.insert(of_fold.end(), of_channel.begin(), of_channel.end());
    }
    judge(of_fold, select(measured_, fold_of_row, static_cast<int>(fold), true), nullptr);
  }
}

// A size that differs from log to log tells another log's too little where logs that it was not
// fitted to are better off without: it then is that of the fitted logs alone.
void Gains::keep_from_others(const std::vector<std::uint8_t> &fold_of_row,
                             std::vector<ChannelFindings> *found,
                             std::vector<std::vector<Term>> *terms) {
  const std::size_t channels = measured_.channels.size();
  const std::vector<std::vector<Term>> with = *terms;
  std::vector<double> ratio(channels, 0.0); // with what another log is predicted with
  for (std::size_t c = 0; c < channels; ++c) {
    const auto gains = summarise(one_step_[c], measured_.channels[c], 0.0, "", options_.seed);
    if (gains.empty() || !gains.front().worse)
      continue;
    ratio[c] = gains.front().ratio;
    for (std::size_t i = c; i < terms->size(); i += channels)
      forget_new_log(&(*terms)[i]);
  }
  if (std::all_of(ratio.begin(), ratio.end(), [](double of) { return of == 0.0; }))
    return;
  judge_folds(fold_of_row, *terms);
  bool any_kept = false;
  for (std::size_t c = 0; c < channels; ++c) {
    if (ratio[c] == 0.0)
      continue;
    const auto gains = summarise(one_step_[c], measured_.channels[c], 0.0, "", options_.seed);
    if (gains.front().ratio < ratio[c]) {
      for (Member &member : (*found)[c].members)
        forget_new_log(&member.term);
      continue;
    }
    any_kept = true;
    for (std::size_t i = c; i < terms->size(); i += channels)
      (*terms)[i] = with[i];
  }
  if (any_kept)
    judge_folds(fold_of_row, *terms);
}

// Findings and state of every channel; returns all terms.
std::vector<Term> add_channels(const Measured &measured, const std::vector<ChannelFindings> &found,
                               const std::vector<std::vector<InOneLog>> &single, const Null &null,
                               double threshold, Diagnosis *diagnosis) {
  std::vector<Term> terms;
  for (std::size_t c = 0; c < found.size(); ++c) {
    add_findings(found[c], measured.channels[c], measured, null, &diagnosis->findings);
    for (Term &term : terms_of(found[c]))
      terms.push_back(std::move(term));
    for (const InOneLog &one : single[c]) {
      for (const Finding &f : one.findings)
        terms.push_back(f.term);
    }
    ChannelState state;
    state.channel = measured.channels[c].name;
    Prediction after = extended_prediction(terms, measured.channels[c], measured);
    state.m_after = std::move(after.m);
    state.sd_after = std::move(after.sd);
    state.autocorrelation = found[c].autocorrelation;
    state.scale = found[c].noise.scale;
    state.threshold = threshold;
    state.rows_flagged = found[c].flagged.stuck_rows + found[c].flagged.dropout_rows;
    diagnosis->channels.push_back(std::move(state));
  }
  return terms;
}

// Where, before why: of every channel of which something is claimed of its mean.
void add_regions(const Measured &measured, const std::vector<ChannelFindings> &found,
                 const std::vector<std::vector<InOneLog>> &single, Diagnosis *diagnosis) {
  std::vector<std::vector<ResidualRegion>> regions(found.size());
  parallel_for(found.size(), [&](std::size_t c) {
    if (found[c].members.empty() && single[c].empty())
      return;
    const Vector used = (found[c].noise.weight.array() > 0.0).cast<double>();
    regions[c] = find_regions(measured, measured.channels[c], used, found[c].noise.divisor());
  });
  for (const auto &of_channel : regions)
    diagnosis->regions.insert(diagnosis->regions.end(), of_channel.begin(), of_channel.end());
}

void add_unconfirmed(const Measured &measured, const std::vector<ChannelFindings> &found,
                     Diagnosis *diagnosis) {
  for (std::size_t c = 0; c < found.size(); ++c) {
    for (const Unconfirmed &seen : found[c].unconfirmed) {
      Finding f;
      f.term = seen.term;
      f.inside_fraction = gate_mask(seen.term.gate, measured).mean();
      f.sentence = unconfirmed_sentence(f, measured.channels[c], seen.reason);
      diagnosis->doubts += seen.reason == kNotElsewhere || seen.reason == kWorseHeld ? 1 : 0;
      diagnosis->unconfirmed.push_back(std::move(f));
    }
  }
}

void add_notes(const Measured &measured, const std::vector<ChannelFindings> &found,
               Diagnosis *diagnosis) {
  for (std::size_t c = 0; c < found.size(); ++c) {
    const Channel &channel = measured.channels[c];
    if (channel.sd_estimated)
      diagnosis->notes.push_back(fmt::format(
          "{}: there is no sd. column; its standard deviation is estimated from the residuals",
          channel.name));
    if (found[c].start.sd > 0.0)
      diagnosis->notes.push_back(fmt::format("{}: what remains alternates from row to row: the "
                                             "prediction starts from a noisy reading, "
                                             "whose noise is about {:.2g}{}; what that alone would "
                                             "feign (a gain below one, a hinge) is "
                                             "allowed for",
                                             channel.name, found[c].start.sd * channel.sd.mean(),
                                             channel.unit.empty() ? "" : " " + channel.unit));
    if (found[c].step > 0.0)
      diagnosis->notes.push_back(
          fmt::format("{}: it is read in steps of {:.3g}; what these alone would feign "
                      "is not claimed",
                      channel.name, found[c].step));
    if (found[c].is_noisy_prediction)
      diagnosis->notes.push_back(fmt::format(
          "{}: the prediction is made of noisy readings: a lag or delay that would only "
          "smooth it, or a level that its noise alone goes beyond, is not claimed",
          channel.name));
    const double scale = found[c].noise.scatter;
    if (!channel.sd_estimated && found[c].variances.empty() && std::abs(scale - 1.0) > 0.04)
      diagnosis->notes.push_back(
          fmt::format("{}: what remains scatters with {:.2f} times the stated sd; allowed for",
                      channel.name, scale));
    if (found[c].noise.spread > 1.2)
      diagnosis->notes.push_back(fmt::format(
          "{}: what remains is autocorrelated (lag 1: {:.2f}); every log likelihood ratio is "
          "divided by {:.1f} for it",
          channel.name, found[c].autocorrelation, found[c].noise.spread));
  }
}

// A drag that helps is how a friction departs from its law: its size has a meaning only beside it.
bool refines(const Finding &f, const Measured &measured) {
  const int c = measured.find_channel(f.term.channel);
  return f.term.cause == "quadratic_drag" && c >= 0 &&
         !opposes(f.term, measured.channels[static_cast<std::size_t>(c)]);
}

bool shares_velocity(const Finding &a, const Finding &b) {
  const auto va = a.term.arguments.find("v"), vb = b.term.arguments.find("v");
  return a.term.channel == b.term.channel && va != a.term.arguments.end() &&
         vb != b.term.arguments.end() && va->second == vb->second &&
         a.term.gate.everywhere() == b.term.gate.everywhere();
}

// By the likelihood lost without each; what came with an extension last, and what is wrong with the
// mean before how the rest scatters.
void put_in_order(const Measured &measured, std::vector<Finding> *findings) {
  std::stable_sort(findings->begin(), findings->end(), [](const Finding &a, const Finding &b) {
    if (a.given != b.given)
      return b.given;
    const bool is_scatter = a.term.kind == TermKind::variance,
               other = b.term.kind == TermKind::variance;
    return is_scatter != other ? other : a.ln_anom > b.ln_anom;
  });
  for (std::size_t i = 1; i < findings->size(); ++i) {
    for (std::size_t j = i; j > 0 && !refines((*findings)[j], measured); --j) {
      std::size_t before = j;
      while (before > 0 && !(refines((*findings)[before - 1], measured) &&
                             shares_velocity((*findings)[before - 1], (*findings)[j])))
        --before;
      if (before == 0 || (*findings)[j].given)
        break;
      std::rotate(findings->begin() + static_cast<std::ptrdiff_t>(before) - 1,
                  findings->begin() + static_cast<std::ptrdiff_t>(j),
                  findings->begin() + static_cast<std::ptrdiff_t>(j) + 1);
      j = before;
    }
  }
}

// Which velocity a channel's friction acts on, where the schema says it.
void take_velocities(const std::map<std::string, std::string> &velocities, Measured *measured) {
  for (const auto &[outcome, feature] : velocities) {
    const int c = measured->find_channel(outcome.rfind("z.", 0) == 0 ? outcome.substr(2) : outcome);
    if (c < 0 || measured->find_feature(feature) < 0)
      throw DataError(fmt::format("{}: the schema's [[friction]] names '{}', which is {}",
                                  measured->logs.front().path, c < 0 ? outcome : feature,
                                  c < 0 ? "no outcome here" : "no feature here, or never changes"));
    measured->channels[static_cast<std::size_t>(c)].velocity = feature;
  }
}

// Of a law that goes on beyond the rows it was learnt from: their range, and how many of the
// held-out rows lie beyond.
void add_learnt(const Measured &measured, const std::vector<Log> &holdout,
                std::vector<Finding> *findings) {
  Measured held;
  if (!holdout.empty())
    held = make_measured(holdout, Constants::keep);
  for (Finding &f : *findings) {
    if (f.term.kind != TermKind::mean || f.given || !f.term.logs.empty())
      continue;
    for (const auto &[placeholder, name] : f.term.arguments) {
      const auto &bounded = f.term.support.features;
      if (std::find(bounded.begin(), bounded.end(), name) != bounded.end())
        continue; // nothing is added beyond
      const int at = measured.find_feature(base_feature(name));
      if (at < 0 || measured.features[static_cast<std::size_t>(at)].is_angle)
        continue;
      const Vector x = feature_column(measured, name);
      Learnt learnt{name, measured.features[static_cast<std::size_t>(at)].unit, x.minCoeff(),
                    x.maxCoeff()};
      if (held.rows() > 0 && held.find_feature(base_feature(name)) >= 0) {
        const Vector there = feature_column(held, name);
        learnt.beyond =
            ((there.array() < learnt.low) || (there.array() > learnt.high)).cast<double>().mean();
        learnt.least = there.minCoeff();
        learnt.most = there.maxCoeff();
      }
      f.learnt.push_back(learnt);
    }
  }
}

// Which of what swings has a period that goes a whole number of times into that of another.
void find_harmonics(std::vector<Finding> *findings) {
  constexpr double kErrors = 3.0, kMostHarmonic = 9.0;
  for (Finding &f : *findings) {
    for (const Finding &first : *findings) {
      if (!is_swing(f.term) || !is_swing(first.term) || f.term.channel != first.term.channel ||
          f.term.logs != first.term.logs || f.given || first.given)
        continue;
      const Parameter &period = f.term.shape[0], &whole = first.term.shape[0];
      const double times = whole.value / period.value, nearest = std::round(times);
      const double error =
          times * std::hypot(whole.stderror / whole.value, period.stderror / period.value);
      if (nearest >= 2.0 && nearest <= kMostHarmonic && std::abs(times - nearest) < kErrors * error)
        f.harmonic = static_cast<int>(nearest);
    }
  }
}

void put_in_words(const Measured &measured, Diagnosis *diagnosis) {
  find_harmonics(&diagnosis->findings);
  for (std::size_t i = 0; i < diagnosis->findings.size(); ++i) {
    Finding &f = diagnosis->findings[i];
    f.number = static_cast<int>(i) + 1;
    if (f.sentence.empty()) // what is in one log alone says it already
      f.sentence = finding_sentence(
          f, measured.channels[static_cast<std::size_t>(measured.find_channel(f.term.channel))]);
  }
  diagnosis->sentence = diagnosis_sentence(*diagnosis);
}

} // namespace

Diagnosis diagnose(const std::vector<Log> &logs, const Options &options, Measured *table) {
  std::vector<std::string> constant;
  Measured measured = make_measured(
      logs, options.given.empty() ? Constants::leave_out : Constants::keep, &constant);
  take_velocities(options.velocities, &measured);
  find_senses(&measured);
  if (measured.rows() < kLeastRows)
    throw DataError(fmt::format("{}: {} rows in all; a diagnosis needs at least {}",
                                measured.logs.front().path, measured.rows(), kLeastRows));
  Diagnosis diagnosis;
  diagnosis.seed = options.seed;
  diagnosis.command = options.command;
  diagnosis.model = options.model;
  for (const std::string &name : constant)
    diagnosis.notes.push_back(name + " never changes and is left out");
  const Measured few = thinned(measured, most_searched(measured));
  if (few.whole != nullptr)
    diagnosis.notes.push_back(fmt::format("{} of {} rows are searched; all are fitted and judged",
                                          few.rows(), measured.rows()));
  std::vector<Library> libraries; // of few channels: made once
  const std::size_t runs = options.null_runs > 0
                               ? options.null_runs
                               : std::max(kLeastNull, kMostNull / measured.channels.size());
  const Null null = simulate_null(few, options.catalogue, runs, options.seed, &libraries);
  const Thresholds threshold{
      std::max(kLeastThreshold, null.threshold(kStrict * options.false_alarm)),
      std::max(kLeastThreshold, null.threshold(options.false_alarm)),
      kStrict * options.false_alarm / static_cast<double>(measured.channels.size())};
  std::vector<ChannelFindings> found = search_all(measured, few, libraries, options, threshold);
  libraries.clear();
  Gains gains(measured, options, threshold);
  if (options.gains && options.holdout.empty())
    gains.cross_validate(&found);
  std::vector<std::vector<InOneLog>> single(found.size());
  if (options.holdout.empty()) {
    diagnosis.gains = gains.summary();
    single = find_in_single_logs(logs, measured, found, diagnosis.gains, options);
    claim_in_single_logs(single, measured, diagnosis.gains, &found);
  }
  const std::vector<Term> terms =
      add_channels(measured, found, single, null, threshold.enter, &diagnosis);
  add_single_logs(single, measured, &diagnosis);
  add_unconfirmed(measured, found, &diagnosis);
  add_regions(measured, found, single, &diagnosis);
  put_in_order(measured, &diagnosis.findings);
  add_learnt(measured, options.holdout, &diagnosis.findings);
  if (options.gains && !options.holdout.empty()) {
    gains.hold_out(terms);
    diagnosis.gains = gains.summary();
  }
  put_in_words(measured, &diagnosis);
  add_notes(measured, found, &diagnosis);
  if (table != nullptr)
    *table = measured;
  return diagnosis;
}

} // namespace rim::diagnose
