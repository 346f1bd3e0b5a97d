// SPDX-License-Identifier: MIT
// diagnose/swing.hpp - what is periodic in time: a line in the spectrum of what a model leaves.
//
// The generalised Lomb-Scargle periodogram, whose mean floats (Zechmeister and Kuerster, Astronomy
// and Astrophysics 496, 577, 2009), summed over the logs: each has a phase of its own, since their
// clocks need not agree. Noise that is autocorrelated has a spectrum that is not flat, but smooth:
// a line is told by what it has more than the frequencies nearby.
#pragma once

#include <string>
#include <vector>

#include "diagnose/measured.hpp"
#include "diagnose/term.hpp"

namespace rim::diagnose {

struct Swing {
  double frequency_hz = 0.0; // 0: there is none
  double stderror_hz = 0.0;
  double fall = 0.0;        // of the half sum of squares, in stated sd, when it is taken off
  double background = 1.0;  // what noise takes off at a frequency near it, on average, in one log
  double frequencies = 1.0; // that can be told apart, among which it was looked for
  double p_value = 1.0;     // that noise of a smooth spectrum takes off as much at any of them
};

// The spectrum of one quantity, from two periods in the longest log to two rows a period. A log is
// what has one path: the pieces of one that is cut have its clock.
class Spectrum {
public:
  // values: rows, in any unit; weight: of their squares, 0 where there is none. O(rows ln rows).
  Spectrum(const Measured &measured, const Vector &values, const Vector &weight);

  // The line that stands out most from its neighbours.
  Swing strongest() const;
  // The line nearest to a frequency, by exact times.
  Swing near(double frequency_hz) const;
  // Fall of the half sum of squares at a frequency, by exact times. O(rows).
  double fall(double frequency_hz) const;
  // Share of the squares about the mean that a line at a frequency has, to within what can be told
  // apart; 0: none stands out there. O(1).
  double line_share(double frequency_hz) const;

private:
  struct Clock { // rows of one path
    std::vector<double> t, v, w;
  };
  void add_clocks(const Measured &measured, const Vector &values, const Vector &weight);
  void add_falls();
  void add_background();
  Spectrum without(double frequency_hz) const;
  double ln_background(double at) const;
  double p_at(double fall, double at) const;
  double p_beside(double fall, double at, double *ln_mean) const;
  double p_of(double ratio, double sd_of_ln) const;
  double p_of_any(double p_of_one, double ratio) const;
  double peak_near(double frequency_hz) const;

  std::vector<Clock> clocks_;
  double longest_s_ = 0.0;             // of a clock's rows
  double row_s_ = 0.0;                 // usual
  double step_hz_ = 0.0;               // of the grid
  double stride_ = 1.0;                // steps between frequencies that can be told apart
  double squares_ = 0.0;               // half of them, about the means of the clocks
  std::vector<double> falls_;          // by steps from 0 on
  std::vector<double> ln_;             // of the fall, less what that of noise is on average
  std::vector<double> ln_smooth_, sd_; // ln of the mean fall nearby, by frequencies, and its error
};

// Paths of the logs, each once.
std::vector<std::string> paths_of(const Measured &measured);

// Of a swing's term a sine and a cosine over the rows, in turn for each log that it has a phase in;
// one pair over all rows where it has one phase. 0 in other logs.
Eigen::MatrixXd swing_columns(const Term &term, const Measured &measured);

// What the term adds, for an amplitude of 1; where the logs differ, of the mean of theirs.
Vector swing_column(const Term &term, const Measured &measured);

// Amplitudes and phases of the term from the sizes of those columns. background: Swing::background,
// by which the covariance for noise of the stated sd is multiplied.
void set_swing(const Vector &sizes, const Eigen::MatrixXd &covariance, double background,
               Term *term);

} // namespace rim::diagnose
