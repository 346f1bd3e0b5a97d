#!/bin/sh
# SPDX-License-Identifier: MIT
# size.sh SIZE BUILD: code and static RAM per module of librim, the largest frames, and the deepest
# stack of the calls an application makes, along the compiler's call graph.
size=$1 build=$2
echo "librim: code and constants, static RAM (bytes)"
$size "$build"/lib/src/*/*.o | awk 'NR > 1 {n = $6; sub(".*/", "", n); sub("\\.o$", "", n)
  printf "  %-16s %8d %8d\n", n, $1, $2 + $3; c += $1; r += $2 + $3}
  END {printf "  %-16s %8d %8d\n", "total", c, r}'
echo "stack: the ten largest frames (bytes)"
cat "$build"/lib/src/*/*.su | awk -F'\t' '{n = split($1, p, ":"); print $2, p[n], p[1]}' | sort -rn |
  head -10 | awk '{f = $3; sub(".*/", "", f); printf "  %8d %-28s %s\n", $1, $2, f}'
[ -n "$(ls "$build"/lib/src/*/*.ci 2> /dev/null)" ] || exit 0
echo "stack: deepest path (bytes; mem* and compiler helpers not counted)"
cat "$build"/lib/src/*/*.ci | awk -F'"' '
  /^node:/ && match($4, /[0-9]+ bytes/) {frame[$2] = substr($4, RSTART) + 0}
  /^edge:/ {callees[$2] = callees[$2] SUBSEP $4; if ($4 == "__indirect_call") indirect = 1}
  function depth(f,   list, n, i, d, most) {
    if (f in known) return known[f]
    if (f in busy) {print "  recursion through " f; bad = 1; return 0}
    busy[f] = 1; most = 0; n = split(callees[f], list, SUBSEP)
    for (i = 2; i <= n; i++) {d = depth(list[i]); if (d > most) {most = d; next_of[f] = list[i]}}
    delete busy[f]
    return known[f] = frame[f] + most
  }
  function bare(f) {sub(/.*:/, "", f); return f}
  END {
    count = split("rim_monitor_init rim_monitor_step rim_can_pack_detail rim_lcm_pack_alarm", top, " ")
    for (i = 1; i <= count; i++) {
      path = bare(top[i]); total = depth(top[i])
      for (f = top[i]; f in next_of; f = next_of[f]) path = path " > " bare(next_of[f])
      printf "  %8d %s\n", total, path
    }
    if (indirect) print "  (calls through pointers are not followed)"
    exit bad
  }'
