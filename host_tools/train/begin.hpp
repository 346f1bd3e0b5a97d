// SPDX-License-Identifier: MIT
// train/begin.hpp - what the commands were before a run's first row, and whether a run began there.
//
// An exponential mean of a command needs a past that no log holds. Where a vehicle stands still
// before its log begins, the first row's command is that past. Where logs are cut out of longer
// runs, it is not: a slow mean then stays for long at what the first row happened to be, and the
// few runs that began in a turn set the weight by which a fresh one is judged.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "train/run_store.hpp"
#include "train/survey.hpp"

namespace rim {

// The runs from which it is learnt, evenly spaced, at most 48: ascending. Empty where all runs
// begin with the same commands (or context), or where there are none.
std::vector<std::size_t> runs_for_begin(const Survey &survey);

// Fills basis->begin where the outcomes of runs left out are predicted better with it: every mean
// before the first row is then what it is on average in healthy runs where its input is as it was
// in the first row. Leaves it empty otherwise. blocks: those of runs_for_begin() with another
// basis; it is called three times.
void learn_begin(Basis *basis, double period_s,
                 const std::function<RunStore(const Basis &)> &blocks);

// After learn_start(): what the features are in the later blocks of the runs, how they go together
// in first and in later blocks, and how much likelier a first block must be as a later one than as
// a first one, so that none of these runs seems to have begun late, with a wrong sensor or without:
// a monitor that is started under way has no past either. Leaves `later` empty where no run has
// later blocks. O(blocks x features^2 + runs x features^3).
void learn_later(Basis *basis, const Layout &layout, const RunStore &runs);

} // namespace rim
