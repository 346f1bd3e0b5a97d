#!/bin/bash
# SPDX-License-Identifier: MIT
# Names and units on the bus: the frames of `rim replay --candump` decode to the last one by cantools, with the
# shipped DBC and with the image's own; the details by python can-isotp; `rim show --lcm` compiles by lcm-gen.
# Skipped in part where Python has no cantools (make test-can puts it there).
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
python=python3
[ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
cd "$here" || exit 1
toy_model toy.rim
toy everywhere.csv 50 900 'if (i > 400) a += 0.6'
toy region.csv 102 1200 'if (x > 1) v += 0.5'
for log in everywhere region; do
  "$RIM" replay --model toy.rim $log.csv --alarms $log.jsonl --candump $log.candump > /dev/null; check "replay $log" 0 $?
  "$RIM" replay --model toy.rim $log.csv --candump $log.fd --can-fd --node 7 > /dev/null; check "replay $log, CAN FD" 0 $?
done
contains "classic frames alone" "$(grep -c '##' everywhere.candump)" "^0$"
contains "FD frames too" "$(grep -c '##1[0-9A-F]\{128\}$' everywhere.fd)" "^$(wc -l < everywhere.jsonl)$"
"$RIM" show --dbc toy.rim > node1.dbc; check "the image's DBC" 0 $?
"$RIM" show --dbc toy.rim --node 7 --can-fd > node7.dbc; check "of another node, CAN FD" 0 $?
"$RIM" show --can-fd toy.rim > said 2>&1; check "--can-fd without --dbc" 2 $?
# What the two shipped files have in common is the same.
common() { grep -v -e RIM_DETAIL -e ' 641 ' -e '^CM_ "' "$1" | awk '/^BO_ /{on = $2 == 641} !on || /^$/' | sed '/^BO_ 641/,/^$/d'; }
check "the shipped files agree" "$(common "$root/lib/wire/rim.dbc" | grep -v '^ SG_')" "$(common "$root/lib/wire/rim_fd.dbc" | grep -v '^ SG_')"

"$RIM" show --lcm toy.rim > model_constants_t.lcm; check "show --lcm" 0 $?
contains "an index" "$(cat model_constants_t.lcm)" "const int32_t OUTCOME_S_POSITION_B_M = 1;  // s.position_b_m, m"
"$RIM" show --lcm --json toy.rim > said 2>&1; check "--lcm and --json" 2 $?
if command -v lcm-gen > /dev/null; then
  lcm-gen -p --ppath . model_constants_t.lcm; check "lcm-gen takes it" 0 $?
  (cd "$here" && $python -c 'import sys, types
sys.modules.setdefault("cStringIO", types.ModuleType("cStringIO"))
sys.path.insert(0, ".")
from rim.model_constants_t import model_constants_t as c
assert c.OUTCOME_S_SPEED_MPS == 2 and c.FEATURE_U_PUSH == 0 and c.LEVEL_STALE == 3 and c.COMMAND_DESCRIBE == 3' 2> said); check "its constants" 0 $?
  cat said
else
  skipped=$((skipped + 1))
fi

if ! has_packages $python cantools isotp; then
  echo "not here: cantools and can-isotp for Python; make test-can installs them"
  skipped=$((skipped + 1)); finish
fi
for log in everywhere region; do
  $python "$root/tests/firmware/decode_alarms.py" node1.dbc $log.jsonl $log.candump > said 2>&1; check "$log, classic" 0 $?
  cat said
  $python "$root/tests/firmware/decode_alarms.py" node7.dbc $log.jsonl $log.fd FD > said 2>&1; check "$log, FD" 0 $?
  cat said
  # The shipped file, with the default node as it is, and with a mask for any other.
  $python -m cantools decode --single-line "$root/lib/wire/rim.dbc" < $log.candump > said 2>&1; check "$log, cantools decode" 0 $?
  check "$log, cantools decodes all" "$(wc -l < $log.candump) 0" "$(grep -c 'RIM_[A-Z]*(' said) $(grep -c -i 'unknown frame\|wrong data\|failed' said)"
  [ $log = region ] || is_long || continue
  "$RIM" replay --model toy.rim $log.csv --candump other.candump --node 99 > /dev/null
  $python -m cantools decode --single-line --frame-id-mask 0x780 "$root/lib/wire/rim.dbc" < other.candump > said 2>&1
  check "$log, any node by the mask" "$(wc -l < other.candump) 0" "$(grep -c 'RIM_[A-Z]*(' said) $(grep -c -i 'unknown frame\|wrong data\|failed' said)"
done
# The test can fail: one frame whose identifier is not ours, one bit in a segment.
sed '3s/ 481#/ 4FF#/' everywhere.candump > bad.candump
$python "$root/tests/firmware/decode_alarms.py" node1.dbc everywhere.jsonl bad.candump > said 2>&1; check "a foreign frame is told" 1 $?
sed '/ 281#23/s/.$/0/;/ 281#24/s/.$/1/' everywhere.candump > bad.candump
$python "$root/tests/firmware/decode_alarms.py" node1.dbc everywhere.jsonl bad.candump > said 2>&1; check "a damaged segment is told" 1 $?
finish
