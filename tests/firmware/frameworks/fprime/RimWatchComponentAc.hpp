// SPDX-License-Identifier: MIT
// What fpp-to-cpp (F Prime 3.5 and later) generates from RimWatch.fpp, declarations alone.
#pragma once
#include <Fw/Types/String.hpp>
using U8 = std::uint8_t;
using U32 = std::uint32_t;
using U64 = std::uint64_t;
using F64 = double;
using FwIndexType = std::int16_t;
using FwSizeType = std::uint64_t;
using FwOpcodeType = U32;

namespace Fw {
class CmdResponse {
public:
  typedef enum T : U8 {
    OK,
    INVALID_OPCODE,
    VALIDATION_ERROR,
    FORMAT_ERROR,
    EXECUTION_ERROR,
    BUSY
  } T;
  CmdResponse(const T e);
};
class ActiveComponentBase {
public:
  explicit ActiveComponentBase(const char *name);
  virtual ~ActiveComponentBase();
};
} // namespace Fw

namespace Rim {
class RowValues {
public:
  enum { SIZE = 32 };
  F64 &operator[](const U32 i);
  const F64 &operator[](const U32 i) const;
};
class Level {
public:
  typedef enum T : U8 { OK = 0, WARN = 1, ERROR = 2, STALE = 3, OUT_OF_RANGE = 4 } T;
  Level(const T e);
};

class RimWatchComponentBase : public Fw::ActiveComponentBase {
protected:
  explicit RimWatchComponentBase(const char *compName = "");
  virtual void rowIn_handler(FwIndexType portNum, F64 timeSeconds, U32 count,
                             const Rim::RowValues &values) = 0;
  virtual void schedIn_handler(FwIndexType portNum, U32 context) = 0;
  virtual void pingIn_handler(FwIndexType portNum, U32 key) = 0;
  virtual void ACKNOWLEDGE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence,
                                      U32 modelId) = 0;
  virtual void CLEAR_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence, U32 modelId) = 0;
  void pingOut_out(FwIndexType portNum, U32 key);
  void cmdResponse_out(FwOpcodeType opCode, U32 cmdSeq, Fw::CmdResponse response);
  void log_WARNING_HI_AlarmStands(const Fw::StringBase &words) const;
  void log_ACTIVITY_HI_AlarmEnds(const Fw::StringBase &words) const;
  void log_WARNING_LO_Stale(const Fw::StringBase &words) const;
  void log_WARNING_HI_ImageRefused(const Fw::StringBase &reason) const;
  void log_WARNING_LO_CommandRefused(U32 sequence) const;
  void tlmWrite_VehicleLevel(const Rim::Level &arg);
  void tlmWrite_Rows(U32 arg);
  void tlmWrite_RowsRefused(U32 arg);
  void tlmWrite_Records(U32 arg);
  void tlmWrite_Digest(U64 arg);
};
} // namespace Rim
