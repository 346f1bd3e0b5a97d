// SPDX-License-Identifier: MIT
#define RIM_EIGEN_KERNEL
#include "util/eigen_kernels.hpp"
