// SPDX-License-Identifier: MIT
// For libFuzzer: make fuzz-ground. With FUZZ_READER=K in the environment every input is for reader
// K, whatever its first byte.
#include "fuzz_ground.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t bytes);
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t bytes) {
  static const char *const only = std::getenv("FUZZ_READER");
  std::string copy(reinterpret_cast<const char *>(data), bytes);
  if (only != nullptr && bytes > 0)
    copy[0] = static_cast<char>(std::strtoul(only, nullptr, 10));
  (void)rim::fuzz::one_file(reinterpret_cast<const std::uint8_t *>(copy.data()), bytes);
  return 0;
}
