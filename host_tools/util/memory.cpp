// SPDX-License-Identifier: MIT
#include "util/memory.hpp"

#include <malloc.h>

namespace rim {

void map_large_pieces() {
#ifdef M_MMAP_THRESHOLD
  constexpr int bytes = 8 * 1024 * 1024;
  ::mallopt(M_MMAP_THRESHOLD, bytes);
#endif
#ifdef M_TOP_PAD
  constexpr int kept = 16 * 1024 * 1024;
  ::mallopt(M_TOP_PAD, kept);
#endif
}

void give_back_memory() {
#ifdef __GLIBC__
  ::malloc_trim(0);
#endif
}

} // namespace rim
