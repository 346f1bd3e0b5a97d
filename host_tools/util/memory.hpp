// SPDX-License-Identifier: MIT
// util/memory.hpp - freed memory goes back to the system.
#pragma once

namespace rim {

// Once, before much is allocated: large pieces are mapped each by itself, so that freeing one gives
// it back. Without it the C library raises the size from which it does so to that of the largest
// piece ever freed, and long-lived small pieces keep what was freed around them. Each thread keeps
// some megabytes at the end of its heap: to give them back and ask anew at every small piece takes
// a fifth of the time of a training.
void map_large_pieces();
// Between stages of a computation: gives back what is free by now.
void give_back_memory();

} // namespace rim
