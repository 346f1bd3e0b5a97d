#!/bin/bash
# SPDX-License-Identifier: MIT
# prove.sh ESBMC [quick]: proves the decoders of what comes from outside memory-safe, free of overflow and terminating
# (unwinding assertions) for every input up to the length named, by bounded model checking with ESBMC. One line a proof;
# exit 1 when one fails, or is not decided in its time. quick: those that take seconds.
# What is assumed: firmware/ASSURANCE.md.
cd "$(dirname "$0")/../.." || exit 1
esbmc=$1 tier=${2:-all} status=0 proved=0
wire=lib/src/wire region=lib/src/base/region.c crc=lib/src/base/crc.c
prove() { # NAME UNWIND SECONDS WHAT SOURCE...
  local name=$1 unwind=$2 seconds=$3 what=$4; shift 4
  [ "$tier" = quick ] && [ "$seconds" -gt 120 ] && return
  local began=$SECONDS said verdict flags=()
  [ -n "$SECTION" ] && flags+=("-DSECTION=$SECTION")
  [ -n "$BYTES" ] && flags+=("-DBYTES=$BYTES")
  [ -n "$MOST" ] && flags+=("-DMOST=$MOST")
  said=$(timeout "$seconds" "$esbmc" "tests/assurance/prove/$name.c" "$@" --unwind "$unwind" --overflow-check \
    "-D__builtin_assume_aligned(p,n)=(p)" "${flags[@]}" \
    -Ilib/include -Ilib/src -Ifirmware --std c11 2>&1)
  verdict=$(printf '%s\n' "$said" | grep -a '^VERIFICATION' | head -n 1)
  case $verdict in
    *SUCCESSFUL) verdict=proved; proved=$((proved + 1)) ;;
    *FAILED) verdict=FAILED; status=1; printf '%s\n' "$said" | grep -a -A3 'Violated' ;;
    *) verdict='not decided'; status=1 ;;
  esac
  printf '%-13s %-12s %4s s  %s\n' "$name" "$verdict" $((SECONDS - began)) "$what"
}
prove can_short    70  60 "summary, heartbeat, command, entry: any frame" $wire/can.c $wire/control.c $wire/entry.c $crc $region
prove packet       85  60 "datagram: any 0..80 bytes, payload inside" firmware/transport/lcm_packet.c
prove lcm_health   70  60 "any 0..size + 1 bytes" $wire/lcm.c $region
prove lcm_command  70  60 "any 0..size + 1 bytes" $wire/control.c $region
prove lcm_entry    70  60 "any 0..size + 1 bytes" $wire/entry.c $region
prove lcm_counters 140 60 "any 0..size + 1 bytes" $wire/control.c $region
prove lcm_alarm    70  120 "any 0..size + 1 bytes" $wire/lcm.c $region
prove can_signal   12  60 "table of CAN signals, an entry of any bytes: its bits inside the frame"
prove seal         60  60 "sealed command, any 0..size + 1 bytes, any frame" $crc
prove clock        12  60 "any guard, configuration and time" lib/src/monitor/clock_guard.c
SECTION=6 BYTES=72 prove sections 12 60 "behaviour: any 0..72 bytes" lib/src/image/basis.c
SECTION=1 BYTES=72 prove sections 30 120 "threshold: any 0..72 bytes" lib/src/image/threshold.c
BYTES=160 MOST=2 prove readers 12 120 "basis: any 0..160 bytes, up to 2 of each: sizes and indices"
prove can_detail   310 400 "any frame, any assembly under way: inductive" $wire/can.c $crc $region
prove image        20  600 "any image of 0..160 bytes, any check sum: sections inside, aligned" lib/src/image/image.c
echo "$proved proved"
exit $status
