/* SPDX-License-Identifier: MIT */
/* Outcomes rolled forward from the start of the run on commands and disturbances alone (section
 * BASIS): a speed, a level or a temperature that keeps what was put into it. Its own sensor is
 * looked at in the run's first two blocks and never after, so that a sensor's fault stays visible.
 *
 * Where the states are z, a block's rates are the sums of weight times three factors each: means of
 * filters over the block, states, or 1. A step follows them by the midpoint rule: its factors that
 * are filters are the mean product of this block and of the one before, its states those in the
 * middle of the step. A block's mean of a state is then the one before plus one block of the rates,
 * which is what a mean of the outcome over a block does, too. */
#ifndef RIM_SRC_ROLLED_H
#define RIM_SRC_ROLLED_H

#include "image/basis.h"

/* Blocks from middle to middle that a step covers at most: a block, what a gap cut off the one
 * before, and half a block that is missing. What the commands did in a longer gap is not known. */
#define ROLLED_LONGEST 2.5
#define ROLLED_PARTS 2u /* of a step, integrated one after the other */

/* The first block that has states: state[states], readings half a block before its middle, is taken
 * half a block on. filter[inputs times]: means over the block. Sets part[rates], which the next
 * step needs. O(rates). */
void rimi_rolled_begin(const rim_basis *basis, const double *filter, double block_s, double *state,
                       double *part);

/* The block `elapsed_s` after the one before (from middle to middle). share: of both, how much of
 * the time is in this one; 0.5 unless one of them is longer. O(rates) per block of it. */
void rimi_rolled_step(const rim_basis *basis, const double *filter, double share, double elapsed_s,
                      double block_s, double *state, double *part);

/* Rows are missing in which the inputs went from `from` to `to`, [inputs] each, nobody knows when:
 * what that adds to the states' variance[states] of what is not known of them. lost_s:
 * the time of these rows. O(rates). */
void rimi_rolled_lose(const rim_basis *basis, const double *from, const double *to, double lost_s,
                      const double *state, double *variance);

/* What a step of elapsed_s leaves of errors of the states. An error decays, or grows, as the rates
 * of its state do, and adds to the states of whose rates it is a factor: at most so much as if all
 * had one sign. part: by rimi_rolled_step(). variance[states]: of errors. kept[states]: what is
 * left of an error at the beginning, but for what others add. O(rates). */
void rimi_rolled_forget(const rim_basis *basis, const double *part, const double *state,
                        double elapsed_s, double *variance, double *kept);

/* The block after a gap that no step covers: each state goes on by what its outcome's readings
 * moved, moved[states], and so stays as far from them as it was before. What deviated still does;
 * the gap itself says nothing. Sets part[rates]. O(rates). */
void rimi_rolled_resume(const rim_basis *basis, const double *filter, const double *moved,
                        double *state, double *part);

/* A term of a state (BASIS_ROLLED) in the block; filter, state: as above. */
double rimi_rolled_term(const rim_basis *basis, size_t term, const double *filter,
                        const double *state);

/* The states that the prediction of an outcome's block mean depends on, itself or by other states:
 * bit s for state s. O(terms + rates states). */
uint32_t rimi_rolled_states(const rim_basis *basis, const rim_behaviour *behaviour,
                            uint32_t outcome);

#endif
