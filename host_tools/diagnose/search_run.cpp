// SPDX-License-Identifier: MIT
// What a healthy run does of its own: offsets, gains and slow wander that trained runs have too.
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace rim::diagnose {

namespace {
using Index = Eigen::Index;
constexpr int kRunRounds = 2;
// Share of the whole error, as amplitude, that a term must account for beside the run's effects:
// they are only about what healthy runs do.
constexpr double kRelevantBesideRun = 0.2;
} // namespace

bool ChannelSearch::has_run() const { return channel_.run.cols() > 0; }

// The run's effects as columns in stated sd: of every log its own.
Eigen::MatrixXd ChannelSearch::run_columns() const {
  const Index k = channel_.run.cols(), logs = static_cast<Index>(measured_.logs.size());
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(y_.size(), k * logs);
  for (Index l = 0; l < logs; ++l) {
    const LogSpan &log = measured_.logs[static_cast<std::size_t>(l)];
    const auto first = static_cast<Index>(log.first), rows = static_cast<Index>(log.rows);
    out.block(first, k * l, rows, k) =
        channel_.sd.segment(first, rows).cwiseInverse().asDiagonal() *
        channel_.run.middleRows(first, rows);
  }
  return out;
}

// Beside these members the run's effects b, whose sizes are N(0, 1): -2 ln likelihood is |y - H
// beta - W b|^2 / divisor + |b|^2, least over both. Returns half of each; run: W b.
ChannelSearch::RunLoss ChannelSearch::loss_beside_run(const std::vector<Member> &members,
                                                      Vector *run) const {
  const Vector raw = (channel_.z - channel_.m).cwiseQuotient(channel_.sd);
  Index free = 0;
  Vector target = raw;
  for (const Member &member : members) {
    if (member.is_fixed)
      target -= member.h.rowwise().sum();
    else
      free += member.h.cols();
  }
  const Eigen::MatrixXd w = run_columns();
  Eigen::MatrixXd h(y_.size(), free + w.cols());
  Index at = 0;
  for (const Member &member : members) {
    if (!member.is_fixed) {
      h.middleCols(at, member.h.cols()) = member.h;
      at += member.h.cols();
    }
  }
  h.rightCols(w.cols()) = w;
  const double divisor = out_.noise.divisor();
  const Eigen::MatrixXd weighted = out_.noise.weight.asDiagonal() * h;
  Eigen::MatrixXd gram = h.transpose() * weighted / divisor;
  gram.diagonal().array() *= 1.0 + 1e-9;
  gram.diagonal().tail(w.cols()).array() += 1.0;
  const Vector right = weighted.transpose() * target / divisor, size = gram.ldlt().solve(right);
  if (run != nullptr)
    *run = w * size.tail(w.cols());
  const Vector effects = size.tail(w.cols());
  const double both = 0.5 * (target.cwiseAbs2().dot(out_.noise.weight) / divisor - right.dot(size));
  return {both - 0.5 * effects.squaredNorm(), 0.5 * effects.squaredNorm()};
}

// Nats that the member says beside the run's effects: by how much less of a healthy run these would
// be without it, and by how much worse they would do, where that is no trifle.
double ChannelSearch::gain_beside_run(std::size_t which) const {
  const RunLoss with = loss_beside_run(out_.members, nullptr),
                less = loss_beside_run(without(which), nullptr);
  const Vector raw = (channel_.z - channel_.m).cwiseQuotient(channel_.sd);
  const double trifle = 0.5 * raw.cwiseAbs2().dot(out_.noise.weight) / out_.noise.divisor() *
                        kRelevantBesideRun * kRelevantBesideRun;
  const double left = less.left - with.left;
  return less.prior - with.prior + (left > trifle ? left : std::min(left, 0.0));
}

// What healthy runs do of their own is no finding: the terms that say no more than that go, the
// weakest first.
void ChannelSearch::drop_within_run() {
  for (;;) {
    std::size_t weakest = out_.members.size();
    double least = options_.least;
    for (std::size_t j = 0; j < out_.members.size(); ++j) {
      const double score = gain_beside_run(j) - out_.members[j].penalty;
      if (!out_.members[j].is_given && score < least) {
        least = score;
        weakest = j;
      }
    }
    if (weakest == out_.members.size())
      return;
    set_aside(weakest, "healthy runs differ from each other by as much");
    estimate_noise();
  }
}

// Of what was seen more than once and not claimed, what was seen first: the later ones are what the
// run's effects left of it.
void ChannelSearch::list_unconfirmed_once() {
  std::vector<Unconfirmed> once;
  for (const Unconfirmed &seen : out_.unconfirmed) {
    if (std::none_of(once.begin(), once.end(), [&seen](const Unconfirmed &other) {
          return other.term.cause == seen.term.cause;
        }))
      once.push_back(seen);
  }
  out_.unconfirmed = std::move(once);
}

// The search once more without what the run does of its own, as far as that is known beside what
// was found.
void ChannelSearch::search_beside_run(const std::vector<Term> &given) {
  if (!has_run())
    return;
  for (int round = 0; round < kRunRounds; ++round) {
    drop_within_run();
    Vector run;
    loss_beside_run(out_.members, &run);
    y_ = (channel_.z - channel_.m).cwiseQuotient(channel_.sd) - run;
    std::vector<Unconfirmed> seen = std::move(out_.unconfirmed);
    prepare(given);
    out_.unconfirmed = std::move(seen);
    find_members({});
    drop_unconfirmed();
    estimate_noise();
    fill_sizes();
  }
  drop_within_run();
  estimate_noise();
  fill_sizes();
  settle();
  list_unconfirmed_once();
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    Claim &claim = out_.claims[j];
    claim.ln_anom = std::min(claim.ln_anom, gain_beside_run(j));
    claim.score = claim.ln_anom - out_.members[j].penalty;
  }
}

} // namespace rim::diagnose
