// SPDX-License-Identifier: MIT
// bus/dbc.hpp - messages and signals of a DBC file: what the compiler of the CAN table needs of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace rim {

struct DbcSignal {
  std::string name, unit;
  unsigned start = 0, bits = 0; // as in the file
  bool motorola = false, is_signed = false;
  int floating = 0; // 0, 32 or 64 (SIG_VALTYPE_)
  double scale = 1.0, offset = 0.0;
  bool selector = false; // M
  bool selected = false; // m N
  bool nested = false;   // both, or extended multiplexing: not supported
  std::uint32_t selector_value = 0;
  unsigned line = 0;
};

struct DbcMessage {
  std::string name;
  std::uint32_t id = 0; // bit 31: 29 bits
  unsigned bytes = 0;
  bool fd = false; // longer than 8 bytes, or VFrameFormat says so
  std::vector<DbcSignal> signals;
  unsigned line = 0;
};

struct Dbc {
  std::string path;
  std::vector<DbcMessage> messages;
};

// Reads BO_, SG_, SIG_VALTYPE_, SG_MUL_VAL_ and BA_ "VFrameFormat"; everything else is passed over.
// DataError "PATH:line N: reason" for a line of these that cannot be understood, a signal without a
// message, an identifier or a name twice; "PATH: reason" for a file that cannot be read or has no
// message.
Dbc read_dbc(const std::string &path);

} // namespace rim
