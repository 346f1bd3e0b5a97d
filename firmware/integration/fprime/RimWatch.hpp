// SPDX-License-Identifier: MIT
// RimWatch.hpp - the monitor as an active component of F Prime.
#ifndef RIM_RIM_WATCH_HPP
#define RIM_RIM_WATCH_HPP

#include "RimWatchComponentAc.hpp"

#include "rim_watch.h"

namespace Rim {

class RimWatch final : public RimWatchComponentBase {
public:
  explicit RimWatch(const char *compName);

  // Opens the flight image, which stays where it is; before the task starts. False: refused, and an
  // event says why.
  bool configure(const void *image, FwSizeType bytes);

private:
  static constexpr FwSizeType kMonitorBytes = 65536; // `rim show` prints what an image needs
  static constexpr F64 kSchedSeconds = 1.0;          // of the rate group at schedIn

  void rowIn_handler(FwIndexType portNum, F64 timeSeconds, U32 count,
                     const RowValues &values) override;
  void schedIn_handler(FwIndexType portNum, U32 context) override;
  void pingIn_handler(FwIndexType portNum, U32 key) override;
  void ACKNOWLEDGE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence, U32 modelId) override;
  void CLEAR_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence, U32 modelId) override;

  void obey(FwOpcodeType opCode, U32 cmdSeq, const rim_command &command);
  static void take(void *self, const rim_alarm *record);

  rim_watch m_watch{};
  F64 m_seconds = 0.0; // told by schedIn
  alignas(8) unsigned char m_monitor[kMonitorBytes];
};

} // namespace Rim

#endif
