// SPDX-License-Identifier: MIT
// fprime IMAGE: the component's handlers, as its queue would call them: twenty rows, then schedIn.
#include "rows.h"

#include <cstdint>

#define private public // the handlers, which generated code calls
#include "RimWatch.hpp"
#undef private

static F64 values_of_a_row[Rim::RowValues::SIZE];
static unsigned newest_level;

namespace Fw {
ActiveComponentBase::ActiveComponentBase(const char *) {}
ActiveComponentBase::~ActiveComponentBase() {}
StringBase::~StringBase() {}
String::String(const char *) {}
const char *String::toChar() const { return ""; }
CmdResponse::CmdResponse(const T) {}
} // namespace Fw

namespace Rim {
F64 &RowValues::operator[](const U32 i) { return values_of_a_row[i]; }
const F64 &RowValues::operator[](const U32 i) const { return values_of_a_row[i]; }
Level::Level(const T e) { newest_level = e; }
RimWatchComponentBase::RimWatchComponentBase(const char *name) : ActiveComponentBase(name) {}
void RimWatchComponentBase::pingOut_out(FwIndexType, U32) {}
void RimWatchComponentBase::cmdResponse_out(FwOpcodeType, U32, Fw::CmdResponse) {}
void RimWatchComponentBase::log_WARNING_HI_AlarmStands(const Fw::StringBase &) const {}
void RimWatchComponentBase::log_ACTIVITY_HI_AlarmEnds(const Fw::StringBase &) const {}
void RimWatchComponentBase::log_WARNING_LO_Stale(const Fw::StringBase &) const {}
void RimWatchComponentBase::log_WARNING_HI_ImageRefused(const Fw::StringBase &) const {}
void RimWatchComponentBase::log_WARNING_LO_CommandRefused(U32) const {}
void RimWatchComponentBase::tlmWrite_VehicleLevel(const Level &) {}
void RimWatchComponentBase::tlmWrite_Rows(U32) {}
void RimWatchComponentBase::tlmWrite_RowsRefused(U32) {}
void RimWatchComponentBase::tlmWrite_Records(U32) {}
void RimWatchComponentBase::tlmWrite_Digest(U64) {}
} // namespace Rim

int main(int argc, char **argv) {
  static Rim::RimWatch watch("rim");
  const size_t bytes = argc > 1 ? run_read(argv[1]) : 0;
  if (bytes == 0 || !watch.configure(run_image, bytes))
    return 3;
  run_limit(watch.m_watch.monitor);
  const int second = static_cast<int>(1.0 / RUN_STEP_S);
  for (int i = 0; i < RUN_GOOD + RUN_REFUSED; i++) {
    const double t_s = run_row(i, values_of_a_row);
    watch.rowIn_handler(0, t_s, RUN_VALUES, Rim::RowValues());
    if (i % second == second - 1)
      watch.schedIn_handler(0, 0);
    if (i == RUN_GOOD - 1 || i == RUN_GOOD + RUN_REFUSED - 1)
      printf("level %u\n", newest_level);
  }
}
