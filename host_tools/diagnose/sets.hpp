// SPDX-License-Identifier: MIT
// diagnose/sets.hpp - the best small set of forms: searched jointly, for what enters one at a time
// is not what explains best together.
//
// One currency: - n_eff RSS / (2 n s2) less every form's penalty (its cost, ln of its alternatives,
// k/2 ln n of its sizes). n_eff and s2 come from what the best set so far leaves: a smooth error
// that a form explains is no autocorrelation of the noise. A beam of sets, begun with every single
// form and with those that come together, is expanded by every form.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/library.hpp"
#include "diagnose/model.hpp"

namespace rim::diagnose {

// What a residual says of the noise.
struct NoiseState {
  double rows = 0.0;            // that count
  double variance = 1.0;        // of what remains, large ones cut, not below its floors
  double spread = 1.0;          // rows over effective rows, with the model's own error allowed for
  double scatter = 1.0;         // root of the variance without floors
  double spread_of_sizes = 1.0; // by autocorrelation alone: for standard errors
  double autocorrelation = 0.0; // lag 1
  double kurtosis = 3.0, spread_of_squares = 1.0;
};

// left: what remains, in stated sd, cut to 4 median absolute deviations where larger; y_rms: before
// anything was explained.
// least_sd: noise below is not believed.
NoiseState noise_state(const Vector &left, const Vector &weight, const Measured &measured,
                       double y_rms, double sizes, double least_sd);

// Of a stated sd half is the least that is believed; one that was estimated from the whole residual
// says nothing about the noise.
double least_noise(const Channel &channel);

// A term must account for this share of the whole error, as amplitude: what does less is no finding
// beside those that explain it.
inline constexpr double kRelevant = 0.03;

// Or for this share of the squares that are left without it, and at least this share of the whole
// error: two quantities that together explain most of what a large law leaves are no trifle because
// each alone explains a small part of the whole.
inline constexpr double kRelevantRest = 0.2, kTrifle = 0.015;

// Whether a fall of the squares is a trifle; left: the squares without the term, whole: those
// before anything was explained.
bool is_trifle(double fall, double left, double whole);

// Nats that sizes which differ between logs cost beside the sizes themselves.
inline constexpr double kSizesDiffer = 2.0;

// What may be searched for, beside all else.
struct Allowed {
  bool late = true;   // what comes late, and play
  bool levels = true; // where the prediction ends or begins
  bool operator()(const Term &term) const {
    return (late || !remembers(term)) && (levels || !is_level(term));
  }
};

struct FormSet {
  std::vector<int> candidates; // of the library
  int differs = -1;            // index into candidates: its sizes differ between the logs
  double score = 0.0;
};

// Products of a library's columns with all its columns by these weights: searches beside other
// members need the same ones.
struct Products {
  Vector weight;
  std::map<int, Vector> of; // by column
};

class SetSearch {
public:
  // kept: members that stay whatever is found. weight: of every row's square. least_sd: of noise.
  // known: products of this library's columns, to which those that are computed are added; begun
  // anew where the weight is another.
  SetSearch(const Measured &measured, const Library &library, const Vector &y, const Vector &weight,
            const std::vector<Member> &kept, double least_sd, Products *known);
  FormSet best(const Allowed &allowed, NoiseState *noise);

private:
  struct State {
    std::vector<int> atoms, columns; // candidates; their free columns, kept ones first
    Vector beta;
    double rss = 0.0, penalty = 0.0;
    double opposed = 0.0; // nats for resistances that work against each other
    int differs = -1;
  };
  const Vector &gram(int column);
  void fetch(const std::vector<int> &atoms);
  void fetch_columns(const std::vector<int> &columns);
  Vector column(int index) const;
  bool is_free(const Candidate &candidate) const;
  bool may_join(const State &state, int atom) const;
  bool solve(State *state);
  double opposed(const State &state) const;
  double score(const State &state) const;
  double fall_of(std::size_t which, const Vector &s, const Eigen::MatrixXd &cross,
                 const Eigen::MatrixXd &solved) const;
  std::vector<State> children(const State &state);
  State begin() const;
  State with(const State &state, int atom) const;
  State without(const State &state, std::size_t which) const;
  void keep_best(std::vector<State> *beam, std::size_t most) const;
  std::vector<State> expand(std::vector<State> beam);
  State prune(State state);
  Eigen::MatrixXd columns_of(const State &state) const;
  State split(const State &state, std::size_t which) const;
  State best_split(const std::vector<State> &states);
  Vector left_by(const State &state) const;
  void look_again(const State &state);
  Eigen::MatrixXd best_columns(const Eigen::MatrixXd &h, Eigen::Index first,
                               Eigen::Index rows) const;
  Vector left_by_ridge(const Eigen::MatrixXd &h, Eigen::Index first, Eigen::Index rows) const;
  NoiseState noise_elsewhere(const Eigen::MatrixXd &h) const;
  void begin_noise();
  std::vector<State> starts();

  const Measured &measured_;
  const Library &library_;
  const Vector &y_, &weight_;
  Products &known_;
  Eigen::MatrixXd kept_; // free columns of members that stay
  Vector fixed_;         // what the fixed ones among them explain
  std::vector<std::string> kept_groups_;
  Vector target_;            // y less fixed_, large residuals cut
  Vector products_;          // of every column with the target
  Vector norm_;              // of the library's columns: weighted squares
  double squares_ = 0.0;     // of the target
  double whole_ = 0.0;       // before anything was explained
  std::vector<double> pair_; // of candidates with two columns: their product
  std::map<int, Vector> gram_;
  NoiseState noise_;
  double rms_ = 0.0, least_effective_ = 0.0, least_sd_ = 0.0;
  Allowed allowed_;
};

} // namespace rim::diagnose
