// SPDX-License-Identifier: MIT
#include "RimWatch.hpp"

#include <Fw/Types/String.hpp>

namespace Rim {

RimWatch::RimWatch(const char *const compName) : RimWatchComponentBase(compName) {}

bool RimWatch::configure(const void *image, FwSizeType bytes) {
  const rim_status status = rim_watch_open(&m_watch, m_monitor, sizeof m_monitor, image,
                                           static_cast<size_t>(bytes), &RimWatch::take, this);
  const bool fits = status == RIM_OK && m_watch.values <= RowValues::SIZE;
  if (!fits)
    this->log_WARNING_HI_ImageRefused(
        Fw::String(status != RIM_OK ? rim_status_text(status) : "more values than MAX_VALUES"));
  return fits;
}

void RimWatch::rowIn_handler(FwIndexType portNum, F64 timeSeconds, U32 count,
                             const RowValues &values) {
  (void)portNum;
  F64 row[RowValues::SIZE];
  for (U32 i = 0; i < RowValues::SIZE; i++)
    row[i] = values[i];
  (void)rim_watch_row(&m_watch, timeSeconds, row, count, nullptr); // another count is counted
}

void RimWatch::schedIn_handler(FwIndexType portNum, U32 context) {
  (void)portNum;
  (void)context;
  m_seconds += kSchedSeconds;
  rim_watch_tick(&m_watch, m_seconds);
  this->tlmWrite_VehicleLevel(static_cast<Level::T>(m_watch.level));
  this->tlmWrite_Rows(m_watch.rows);
  this->tlmWrite_RowsRefused(m_watch.refused);
  this->tlmWrite_Records(m_watch.records);
  this->tlmWrite_Digest(m_watch.digest);
}

void RimWatch::pingIn_handler(FwIndexType portNum, U32 key) {
  (void)portNum;
  this->pingOut_out(0, key);
}

void RimWatch::obey(FwOpcodeType opCode, U32 cmdSeq, const rim_command &command) {
  const bool obeyed = rim_watch_command(&m_watch, &command) == RIM_OK;
  if (!obeyed)
    this->log_WARNING_LO_CommandRefused(command.sequence);
  this->cmdResponse_out(opCode, cmdSeq,
                        obeyed ? Fw::CmdResponse::OK : Fw::CmdResponse::VALIDATION_ERROR);
}

void RimWatch::ACKNOWLEDGE_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence, U32 modelId) {
  obey(opCode, cmdSeq, {sequence, modelId, RIM_COMMAND_ACKNOWLEDGE});
}

void RimWatch::CLEAR_cmdHandler(FwOpcodeType opCode, U32 cmdSeq, U32 sequence, U32 modelId) {
  obey(opCode, cmdSeq, {sequence, modelId, RIM_COMMAND_CLEAR});
}

void RimWatch::take(void *user, const rim_alarm *record) {
  RimWatch &self = *static_cast<RimWatch *>(user);
  char words[120];
  (void)rim_watch_words(&self.m_watch, record, words, sizeof words);
  if (record->level == RIM_LEVEL_STALE)
    self.log_WARNING_LO_Stale(Fw::String(words));
  else if (record->state == RIM_ALARM_RAISED || record->state == RIM_ALARM_UPDATED)
    self.log_WARNING_HI_AlarmStands(Fw::String(words));
  else
    self.log_ACTIVITY_HI_AlarmEnds(Fw::String(words));
}

} // namespace Rim
