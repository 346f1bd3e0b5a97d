// SPDX-License-Identifier: MIT
// diagnose/roles.hpp - what a feature is to a channel: which are velocities, and which velocity a
// channel's friction or drag acts on.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "diagnose/catalogue.hpp"
#include "diagnose/measured.hpp"
#include "diagnose/term.hpp"

namespace rim::diagnose {

// Whether a name holds one of the words, as "u.yaw_rate" holds "yaw".
bool has_word(const std::string &name, std::initializer_list<const char *> words);

// Whether the feature is an angle of whose sine something may depend: it wraps, or it is one by its
// unit or, without a unit, by its name, and has more of a turn than a straight line would do for.
bool turns(const Feature &feature, const Vector &x);

// Makes the feature an argument of the term. An angle in degrees is put into radians in the basis,
// as sines want it.
void bind(const Argument &argument, const Feature &feature, Term *term);

// Whether the feature, of values x, is a height that changes so much that the air thins with it.
bool is_altitude(const Feature &feature, const Vector &x);

// Whether the feature is the speed of what a vehicle of this velocity moves in.
bool is_stream(const Feature &feature, const Feature &velocity);

// Features that are velocities: by their unit; where a feature has no unit, by its name, or as the
// rate of change of another feature. Commands and predictions are none.
std::vector<int> velocities(const Measured &measured);

// The velocity that a channel's friction acts on: the one whose increments follow the prediction
// (an acceleration, a force, the velocity's own next value); of several that do, the one whose name
// has words or a number of the channel's ("torque2", "qd2"). All that it could be where neither
// tells: then the search decides. Empty for channels that can have none (a temperature, a
// position).
std::vector<int> own_velocity(const Measured &measured, const Channel &channel);

// Whether a friction or drag takes motion away, its sizes as they are: a size that helps departs
// from another law. A velocity of unknown sense is taken to count as the channel does.
bool opposes(const Term &term, const Channel &channel);

// Whether the velocity of a friction or drag counts as the channel does (1) or against it (-1);
// 0: the logs do not tell.
int sense_of(const Term &term, const Channel &channel);

// Fills Channel::senses from the logs: a velocity's increments go with a prediction of motion, or a
// force by inverse dynamics with its acceleration, or the other way round. O(rows x features^2).
void find_senses(Measured *measured);

// Whether a force is measured, so that friction adds to what a model without it predicts.
bool is_force(const Channel &channel);

// The feature that is the channel's own state, one row earlier: the prediction starts from its
// reading. -1: none.
int own_state(const Measured &measured, const Channel &channel);

// Whether the prediction starts from the readings of this feature: what these jump by from row to
// row, it jumps by too.
bool starts_from(const Measured &measured, const Channel &channel, int feature);

} // namespace rim::diagnose
