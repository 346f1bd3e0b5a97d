#!/bin/bash
# SPDX-License-Identifier: MIT
# prove.sh ESBMC [quick]: proves the decoders of what comes from outside memory-safe, free of overflow and terminating
# (unwinding assertions) for every input up to the length named, by bounded model checking with ESBMC. One line per proof;
# exit 1 when one fails, or is not decided in its time. quick: those that take seconds.
# What is assumed: firmware/ASSURANCE.md.
cd "$(dirname "$0")/../.." || exit 1
esbmc=$1 tier=${2:-all} status=0 proved=0
wire=lib/src/wire region=lib/src/base/region.c crc=lib/src/base/crc.c
made=$(mktemp -d)
trap 'rm -rf "$made"' EXIT
# PROMISED=A|B: these static functions of FROM are replaced by what the harness says under their name; their own bodies
# go on as A_as_it_is. WRONG=1: the harness has to find something where a byte less may be read, or a little more is claimed.
# SMALL='HEADER NAME VALUE': with a smaller constant. For what the checker does not decide otherwise: an index times a size
# that is a power of two takes seconds, any other is not decided.
prove() { # NAME UNWIND SECONDS(of the processor) WHAT SOURCE...
  local name=$1 unwind=$2 seconds=$3 what=$4; shift 4
  [ "$tier" = quick ] && [ "$seconds" -gt 120 ] && return
  local began=$SECONDS verdict flags=()
  [ -n "$SECTION" ] && flags+=("-DSECTION=$SECTION")
  [ -n "$PART" ] && flags+=("-DPART=$PART")
  [ -n "$BYTES" ] && flags+=("-DBYTES=$BYTES")
  [ -n "$READS" ] && flags+=("-DREADS=$READS")
  [ -n "$RING" ] && flags+=("-DRING=$RING")
  [ -n "$MOST" ] && flags+=("-DMOST=${MOST}u")
  [ -n "$FROM" ] && perl -0pe "s/^static ([^;{}()=]*?\b)(${PROMISED:-none})(\([^{};]*\)) \{/static \$1\$2\$3;\nstatic \$1\$2_as_it_is\$3 {/mg" \
    "$FROM" > "$made/$(basename "$FROM")"
  [ -n "$SMALL" ] && smaller $SMALL
  check "$@"
  case $verdict in
    *SUCCESSFUL) verdict=proved; proved=$((proved + 1)) ;;
    *FAILED) verdict=FAILED; status=1; grep -a -A3 'Violated' "$made/said" ;;
    *) verdict='not decided'; status=1 ;;
  esac
  if [ "$verdict" = proved ] && [ -n "$WRONG" ]; then
    flags+=(-DWRONG); check "$@"
    [[ $verdict = *FAILED ]] && verdict=proved || { verdict='says nothing'; proved=$((proved - 1)) status=1; }
  fi
  rm -rf "$made"/*
  printf '%-13s %-12s %4s s  %s\n' "$name" "$verdict" $((SECONDS - began)) "$what"
}
smaller() { # HEADER NAME VALUE
  local folder; folder=$made/$(basename "$(dirname "$1")")
  mkdir -p "$folder" && sed "s/^#define $2 [0-9]*u/#define $2 ${3}u/" "$1" > "$folder/$(basename "$1")"
}
check() { # SOURCE...: sets verdict
  (ulimit -t "$seconds"; exec timeout $((12 * seconds)) "$esbmc" "tests/assurance/prove/$name.c" "$@" --unwind "$unwind" --overflow-check \
    "-D__builtin_assume_aligned(p,n)=(p)" "${flags[@]}" -I"$made" ${FROM:+-I"$(dirname "$FROM")"} \
    -Ilib/include -Ilib/src -Ifirmware --std c11) > "$made/said" 2>&1
  verdict=$(grep -a '^VERIFICATION' "$made/said" | head -n 1)
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
image=lib/src/image fragments=firmware/transport/lcm_fragments.c
WRONG=1
MOST=8 prove numbers 10 60 "numbers in a row, up to 8: no other is read"
SECTION=2 BYTES=200 MOST=1 FROM=$image/noise.c prove readers 42 60 "noise, of a channel: any 0..200 bytes"
SECTION=3 BYTES=160 MOST=2 FROM=$image/nominal.c prove readers 12 60 "level: any 0..160 bytes, up to 2 of each"
SECTION=4 BYTES=240 MOST=1 FROM=$image/correct.c PROMISED='check_region|tidy|pack_region' prove readers 10 150 "correction of a region: any 0..240 bytes"
SECTION=5 BYTES=160 MOST=2 FROM=$image/basis.c prove readers 12 60 "basis: any 0..160 bytes, up to 2 of each"
SECTION=7 BYTES=160 MOST=2 FROM=$image/basis.c prove readers 12 60 "agreement: any 0..160 bytes, up to 2 of each"
SECTION=9 BYTES=160 MOST=2 FROM=$image/quadratic.c prove readers 12 60 "products: any 0..160 bytes, up to 2 of each"
SECTION=8 BYTES=124 MOST=2 FROM=$wire/can_table.c PROMISED='signal_at|check_signal' prove readers 3 60 "table of CAN signals: any 0..124 bytes, up to 2 of each"
WRONG=
PART=1 BYTES=90 FROM=$fragments prove fragments 72 60 "LCM fragment of any 0..90 bytes"
PART=2 BYTES=90 FROM=$fragments PROMISED='open_part|is_whole|message_of' prove fragments 72 60 "any fragment, any message under way: inductive"
PART=3 BYTES=90 FROM=$fragments prove fragments 72 60 "any message of up to 64 parts: whole or not"
WRONG=1
PART=1 prove messages 140 60 "LCM observation, any 0..size + 1 bytes"
WRONG= PART=2 FROM=$wire/entry.c PROMISED=is_pose prove messages 140 60 "LCM plan, any 0..size + 1 bytes"
PART=3 prove messages 140 60 "LCM model, any 0..size + 1 bytes"
PART=1 BYTES=128 prove names 140 60 "names: any 0..128 bytes, any index"
PART=2 BYTES=64 prove names 140 60 "unit of a name of any 0..64 characters"
FROM=lib/src/interference/detector.c PROMISED=check prove interference 600 60 "interference: any 0..size + 1 bytes, any check sum"
BYTES=256 READS=4 prove state_file 12 60 "state file of any length and bytes, parts up to 256 bytes, read in up to 4 pieces"
RING=6 FROM=lib/src/search/search_private.h PROMISED=search_at prove walk 8 60 "a pass of the search over a ring of up to 6 blocks, any mask"
PART=4 BYTES=90 SMALL="firmware/transport/lcm_fragments.h LCM_FRAGMENTS_BYTES 160" FROM=$fragments prove fragments 12 60 "any fragment, any four messages under way: which it belongs to"
WRONG=
prove can_detail   310 400 "any frame, any assembly under way: inductive" $wire/can.c $crc $region
prove image        20  600 "any image of 0..160 bytes, any check sum: sections inside, aligned" lib/src/image/image.c
echo "$proved proved"
exit $status
