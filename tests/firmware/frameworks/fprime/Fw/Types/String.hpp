// SPDX-License-Identifier: MIT
// F Prime's strings (3.5 and later).
#pragma once
#include <cstdint>
namespace Fw {
class StringBase {
public:
  virtual ~StringBase();
  virtual const char *toChar() const = 0;
};
class String : public StringBase {
public:
  explicit String(const char *src);
  const char *toChar() const override;
};
} // namespace Fw
