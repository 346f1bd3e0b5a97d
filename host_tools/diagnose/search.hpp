// SPDX-License-Identifier: MIT
// diagnose/search.hpp - the terms of one channel: added while they pay, swapped, dropped, named.
//
// Forms that hold everywhere are searched as sets (diagnose/sets.hpp), terms in regions one at a
// time (diagnose/scan.hpp), in either order; the better model is kept. One currency for all: ln
// likelihood ratio, divided for what thins the evidence, less k/2 ln n a fitted size, ln of the
// number of alternatives a form, its shape and its region were chosen from, and the form's cost.
// A term is claimed when that exceeds what the whole search finds in noise (diagnose/null.hpp).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "diagnose/diagnosis.hpp"
#include "diagnose/expression.hpp"
#include "diagnose/flagged.hpp"
#include "diagnose/scan.hpp"
#include "diagnose/sets.hpp"
#include "diagnose/swing.hpp"

namespace rim::diagnose {

struct SearchOptions {
  double threshold = 3.0;               // nats of score that a term must exceed to enter
  double least = 3.0;                   // that it must keep in the joint model to be claimed
  const Measured *held = nullptr;       // logs that are judged but not fitted
  std::size_t most_terms = 6;           // a channel
  const Catalogue *catalogue = nullptr; // for the search behind a delay, and what swings
  double most_p = 0.0; // chance with which noise may be taken for what swings with the time
};

// Viscous friction that grows less than with the speed, made of two forms that were found.
inline constexpr const char *kViscousBySpeed = "viscous_by_speed";

// Autocorrelated beyond this, what remains is no noise of the readings.
inline constexpr double kMostSpread = 2.0;

// Blocks of a log, for what is held out.
inline constexpr std::size_t kBlocks = 10;

// What is claimed of a member besides its term.
struct Claim {
  Member rival;                             // the best term of another cause in its place
  double rival_bic = 1e300, rival_r2 = 0.0; // BIC more than this claim's; on rows not fitted
  double ln_anom = 0.0;                     // of the joint model with and without it
  double score = 0.0;                       // less its penalty
  double heldout_r2 = 0.0, heldout_ln = 0.0;
  bool is_confirmed = true; // where it was not fitted
  std::vector<Alternative> alternatives;
  bool is_separable = true;
};

struct VarianceClaim {
  Term term;
  Vector mask;
  double ln_anom = 0.0, score = 0.0;
};

// The prediction starts from a noisy reading: r(t) = e(t) - theta e(t-1).
struct StartNoise {
  double theta = 0.0;
  double sd = 0.0; // of the reading, in stated sd; 0: none
};

// Why a term is not claimed, where it leaves the simulation in doubt all the same.
inline constexpr const char *kNotElsewhere =
    "it does not hold in parts of the logs that it was not fitted to";
inline constexpr const char *kWorseHeld = "it makes the held-out logs worse";

// Seen in the logs that were fitted, and not claimed.
struct Unconfirmed {
  Term term;
  std::string reason;
};

struct ChannelFindings {
  Flagged flagged;
  std::vector<Unconfirmed> unconfirmed;
  StartNoise start;
  double step = 0.0;                // of a reading so coarse that it feigned something; 0: none
  bool is_noisy_prediction = false; // a lag would have smoothed it, or a level cut its noise
  std::vector<Member> members;      // terms with their sizes filled in
  std::vector<Claim> claims;        // one a member
  std::vector<VarianceClaim> variances;
  Noise noise;
  Fit fit;
  double autocorrelation = 0.0;
  std::vector<Member> rival_expressions; // of the one among the members
};

// "-v" times a negative size is "v" times a positive one: a force adds to what is measured.
void turn_sign(Term *term);

class ChannelSearch {
public:
  ChannelSearch(const Measured &measured, const Channel &channel, const Library &library,
                const SearchOptions &options);
  // given: terms of an extension for this channel, kept as they are.
  ChannelFindings run(const std::vector<Term> &given);

private:
  struct Best {
    Proposal proposal;
    Member member;
    double score = -1e300;
  };
  Member make_member(const Proposal &proposal) const;
  void try_proposal(Proposal proposal, const std::vector<Member> &members, const Fit &fit,
                    Best *best) const;
  double beyond_steps(const std::vector<Member> &members, double step) const;
  void drop_feigned_by_steps();
  void limit_hinges();
  bool join_one_way_gain();
  void leave_out_features(const std::vector<Member> &members, const Fit &fit, Best *best) const;
  Member table_member(int feature, int knots) const;
  double gain_of(const std::vector<Member> &members, double loss_without) const;
  Best best_of(const std::vector<Proposal> &proposals, const std::vector<Member> &members,
               const Fit &fit, std::size_t exact) const;
  void refine_lag(const std::vector<Member> &others, double loss, Member *member) const;
  void refine_shape(const std::vector<Member> &others, double loss, Member *member) const;
  void add_terms(bool is_rough);
  Member form_member(int candidate, bool differs) const;
  void join_forms();
  void join_forms_beside(std::vector<Member> kept);
  void try_stribeck();
  std::vector<std::vector<Member>> formula_alone() const;
  bool formula_overlaps_law() const;
  void join_laws_beside_formula();
  bool is_law(const Member &m) const;
  bool has_opposites() const;
  bool are_laws() const;
  bool asks_for_expression() const;
  double share_left() const;
  bool is_better_formula(const ChannelFindings &other, double by);
  bool says_more(const ChannelFindings &laws, double share) const;
  void formulas_for_tables();
  std::vector<std::size_t> parts_said(const Candidate &candidate, std::size_t formula,
                                      std::size_t part) const;
  std::vector<Member> named_part(std::size_t formula, std::size_t part) const;
  void split_products();
  void name_parts();
  std::vector<Member> as_straight_line(std::size_t formula) const;
  void try_expressions(const std::vector<Member> &kept);
  std::vector<Expression> expressions_beside(const std::vector<Member> &base);
  double score_of(const std::vector<Member> &members, const Noise &noise) const;
  double tuned_score(std::vector<Member> members) const;
  void take_noise(const NoiseState &state);
  void search_from(const std::vector<Member> &kept);
  bool excludes(const Proposal &proposal, const std::vector<Member> &members) const;
  void prepare(const std::vector<Term> &given);
  void find_members(const Allowed &allowed);
  bool take_off_start(const Vector &left);
  Vector whitened(const Vector &x) const;
  Vector left_beside_start(const Vector &raw) const;
  Vector with_neighbours(int reach) const;
  bool is_region_of_noise(const Gate &gate) const;
  void drop_regions_of_noise();
  bool does_as_well(std::size_t which, const Vector &smoother) const;
  bool smooths_prediction() const;
  bool is_level_of_noise() const;
  double alternation(const Vector &left) const;
  void find_beside_start(const std::vector<Term> &given);
  struct Whole { // the table of all rows
    const Measured &table;
    const Channel &channel;
    Vector y, used;
  };
  Whole whole_table() const;
  Fit fit_on(const Whole &whole, const std::vector<Member> &members, Vector *of_last) const;
  Member swing_member(const Swing &swing, bool is_shared) const;
  Member swing_beside(const Whole &whole, const std::vector<Member> &others) const;
  void sharpen(const Whole &whole, const std::vector<Member> &others, Member *swing) const;
  void share_phase(const Whole &whole, const std::vector<Member> &others, Member *swing) const;
  void part_phases();
  bool is_of_form(const Member &swing) const;
  bool is_of_feature(const Whole &whole, const Member &swing) const;
  bool says_more_than_found(const Member &swing) const;
  bool add_swing(const Whole &whole, const std::vector<Term> &given);
  void find_swings(const std::vector<Term> &given);
  Noise plain_noise() const;
  void refit_plain();
  std::vector<Member> best_delays(const std::vector<Member> &others, const Noise &plain) const;
  std::size_t late_member() const;
  std::vector<Member> delays_to_follow(std::size_t at, const Noise &plain) const;
  void follow_delay();
  void take_followed(ChannelFindings found);
  bool has_run() const;
  Eigen::MatrixXd run_columns() const;
  struct RunLoss { // what is left over the noise; the run's effects over what is usual of them
    double left = 0.0, prior = 0.0;
  };
  RunLoss loss_beside_run(const std::vector<Member> &members, Vector *run) const;
  double gain_beside_run(std::size_t which) const;
  void drop_within_run();
  void list_unconfirmed_once();
  void search_beside_run(const std::vector<Term> &given);
  Noise least_noise_of(const std::vector<ChannelFindings> &found, const Noise &plain) const;
  double loss_behind(const Term &delay, std::vector<Member> members, const Noise &noise) const;
  Member tuned(const Member &delay, const std::vector<Member> &beside, const Noise &noise) const;
  ChannelFindings search_behind(const Member &delay, const Noise &noise) const;
  std::vector<Member> gain_and_bias() const;
  Member behind_level(const std::string &kind, const Member &delay,
                      const std::vector<Member> &beside, const Noise &noise) const;
  double level_held_out(const std::string &kind, const Member &delay,
                        const std::vector<Member> &beside, const Noise &noise) const;
  std::vector<Member> behind_levels(const std::vector<Member> &delays, const Noise &noise) const;
  void add_level(const Noise &noise, double without);
  void drop_unconfirmed();
  bool let_differ(std::size_t which);
  void join_sizes();
  void limit_support();
  void claim_overall_variance();
  void weigh();
  bool swap_terms();
  void drop_terms();
  bool is_relevant(double gain, const Member &member, double without) const;
  void estimate_noise();
  bool claim_variance();
  bool is_beside_law(const Proposal &variance) const;
  std::map<std::string, std::vector<std::size_t>> pieces() const;
  bool is_smoother(const Member &table, const std::vector<Member> &others,
                   std::size_t pieces) const;
  void smooth_unknowns();
  void judge();
  void settle();
  void set_aside(std::size_t which, const std::string &reason);
  std::vector<Term> sized(const std::vector<Member> &members);
  double held_loss(const std::vector<Member> &members);
  std::vector<double> held_squares(const Vector &after) const;
  const Channel &held_channel() const;
  bool has_held() const;
  std::vector<int> variants(const Member &member) const;
  void drop_contradicted();
  void shrink_to_held();
  bool vary_to_held();
  double left_where_not_fitted(const std::vector<Member> &members, std::size_t which) const;
  bool is_beaten(const Claim &claim) const;
  double innovations(std::vector<Member> members);
  bool is_beaten_beside_start(std::size_t which);
  void open_edges();
  Member judge_alternatives(std::size_t which, const std::vector<Member> &others,
                            Claim *claim) const;
  struct Part { // held out: half sums of squares with the term and without it, where it acts
    double with = 0.0, less = 0.0, acts = 0.0;
  };
  template <class See> void for_each_row(See see) const; // see(row, log, block of the log)
  void hold_out(std::size_t which, Claim *claim) const;
  double heldout_r2_of(const std::vector<Member> &members) const;
  void add_rival_expressions(const std::vector<Member> &others, const Fit &without,
                             Claim *claim) const;
  void judge_parts(const std::vector<Part> &parts, bool by_log, double divisor,
                   Claim *claim) const;
  void fill_sizes();
  void bend_friction();
  void add_unrefined();
  Parameter mixed_size(Eigen::Index first, const Member &member) const;
  std::vector<Member> without(std::size_t which) const;

  const Measured &measured_;
  const Channel &channel_;
  const Library &library_;
  SearchOptions options_;
  Vector y_;
  std::unique_ptr<Scanner> scanner_;
  Products products_;           // of the library's columns
  Vector measured_rows_;        // 1, or 0 where flagged
  std::vector<Member> swings_;  // found already: every search begins with them
  double extra_variance_ = 0.0; // added to every stated variance: what no multiple of it explains
  Allowed allowed_;
  ChannelFindings out_;
};

template <class See> void ChannelSearch::for_each_row(See see) const {
  for (std::size_t l = 0; l < measured_.logs.size(); ++l) {
    const LogSpan &log = measured_.logs[l];
    for (std::size_t i = 0; i < log.rows; ++i)
      see(static_cast<Eigen::Index>(log.first + i), l, i * kBlocks / log.rows);
  }
}

// The member's columns over a table, in stated sd; m: the prediction that its expressions see.
void set_columns(const Measured &table, const Channel &channel, const Vector &m, Member *member);

// Near rest, where a friction bends with the speed; and standard errors that span both accounts of
// a size, without and with what refines it, or near rest and over all speeds.
void set_near_rest(std::vector<Member> *members);
void widen_sizes(Term *term);

// What was found in a thinned table, with sizes, standard errors and flags of the whole one.
void refit_on(const Measured &whole, const Channel &channel, ChannelFindings *found);

// The largest score that the whole search finds in residuals y that are noise: one entry of the
// null (eq. 3.9, p. 29).
double null_score(const Library &library, const Scanner &scanner, const Vector &y);

} // namespace rim::diagnose
