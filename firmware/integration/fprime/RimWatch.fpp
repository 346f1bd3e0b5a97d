# SPDX-License-Identifier: MIT
module Rim {

  @ Values of a row at most
  constant MAX_VALUES = 32

  array RowValues = [MAX_VALUES] F64

  @ How the vehicle stands by the newest row (rim_level)
  enum Level : U8 {
    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3
    OUT_OF_RANGE = 4
  }

  @ One row of telemetry: the features in the order of the flight image
  port Row(
    timeSeconds: F64 @< must increase
    count: U32 @< values in use
    values: RowValues
  )

  @ Watches the vehicle's model of itself
  active component RimWatch {

    @ A row, from the component that knows the vehicle's telemetry
    async input port rowIn: Row drop

    @ Every second: silence and telemetry
    async input port schedIn: Svc.Sched drop

    @ Pings of Svc.Health
    async input port pingIn: Svc.Ping
    output port pingOut: Svc.Ping

    @ Somebody has seen the alarm whose newest record is named
    async command ACKNOWLEDGE(sequence: U32, modelId: U32) opcode 0

    @ The cause is gone: forget the alarm and its observations
    async command CLEAR(sequence: U32, modelId: U32) opcode 1

    event AlarmStands(words: string size 120) severity warning high id 0 format "{}"
    event AlarmEnds(words: string size 120) severity activity high id 1 format "{}"
    event Stale(words: string size 120) severity warning low id 2 format "{}"
    event ImageRefused(reason: string size 60) severity warning high id 3 format "flight image refused: {}"
    event CommandRefused(sequence: U32) severity warning low id 4 format "no such alarm: record {}"

    telemetry VehicleLevel: Level id 0
    telemetry Rows: U32 id 1
    telemetry RowsRefused: U32 id 2
    telemetry Records: U32 id 3
    @ Of all verdicts: that of `rim replay` over the same rows
    telemetry Digest: U64 id 4

    time get port timeCaller
    command reg port cmdRegOut
    command recv port cmdIn
    command resp port cmdResponseOut
    event port logOut
    text event port logTextOut
    telemetry port tlmOut
  }
}
