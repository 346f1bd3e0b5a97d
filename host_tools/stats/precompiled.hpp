// SPDX-License-Identifier: MIT
// stats/precompiled.hpp - the headers that most sources of the host tools begin with. The build
// compiles them once per level of optimisation. Nothing depends on it: every source includes what
// it uses.
#include "stats/eigen_kernels.hpp"
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>
