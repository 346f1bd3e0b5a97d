// SPDX-License-Identifier: MIT
// util/error.hpp - the two errors a user can cause; main() turns them into exit codes 3 and 2.
#pragma once

#include <stdexcept>
#include <string>

namespace rim {

// Data or I/O: "file:row N: column 'c': reason".
struct DataError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A wrong command line.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

} // namespace rim
