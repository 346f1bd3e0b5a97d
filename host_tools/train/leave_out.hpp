// SPDX-License-Identifier: MIT
// train/leave_out.hpp - models without the features that they do not need.
#ifndef TRAIN_LEAVE_OUT_HPP
#define TRAIN_LEAVE_OUT_HPP

#include <vector>

#include "train/behaviour.hpp"
#include "train/fitter.hpp"

namespace rim {

// Takes features away from every target, one by one, as long as that does not make its error
// larger: the geometric mean of the error that chooses and the one with the runs' means in full.
//
// A feature that hardly changes within a run (ambient temperature, a load) is fitted by its noise
// and then differs between runs: what it adds to the predictions of a run is an offset, which looks
// like an effect that runs have. The error that chooses counts such offsets by a fifth alone. And
// in a closed loop commands go together: a model shares among all of them what one of them does.
void leave_out(const Fitter &fitter, const Basis &basis, const Layout &layout,
               std::vector<TargetModel> *targets);

} // namespace rim

#endif
