#!/bin/bash
# SPDX-License-Identifier: MIT
# The blind test of rim diagnose: nature's and the grader's own tests on forty fixed seeds, then six of these diagnosed
# against the floors of tests/hidden/floors.txt (14 in `make test-long`; eight, without floors, under the sanitizers).
. "$(dirname "$0")/check.inc"
hidden=$root/tests/hidden
bin=$BUILD/tests/hidden
cd "$here" || exit 1
first=0 count=40 # of family 'each': every family, every null and pairs
[ -z "${SANITIZE:-}" ] || { count=8; export HIDDEN_LIMIT=3600; }

# nature: the same seed gives the same bytes; another seed other bytes; no truth beside the logs.
draw() { "$bin/nature" --seed "$1" --family "$2" --out "$3" --truth "$3.json"; }
draw 7 any a; check "nature" 0 $?
draw 7 any b; draw 8 any c
check "the same seed, the same bytes" "" "$(diff -r a b; diff a.json b.json)"
[ "$(cat a/run_1.csv | cksum)" != "$(cat c/run_1.csv | cksum)" ]; check "another seed differs" 0 $?
"$bin/nature" --seed 7 --out a --truth a/truth.json 2> err; check "truth beside the logs" 2 $?
"$bin/nature" --seed 7 --family nonsense --out d --truth d.json 2> err; check "no such family" 3 $?
contains "no such family: said" "$(cat err)" "nonsense"
[ "$("$bin/nature" --list | grep -c .)" -ge 27 ]; check "the list" 0 $?

# Every family's effect is in its logs, a null's logs hold nothing, and the check can fail.
wrong=0
for n in $(seq $first $((first + count - 1))); do
  draw "$n" each e && said=$("$bin/check" --truth e.json --logs e) || {
    wrong=$((wrong + 1)); echo "seed $n: $said"; }
  rm -rf e
done
check "cases that are not what their truth says" 0 $wrong
draw 1 bias f; draw 1 white g
"$bin/check" --truth g.json --logs f > said; check "logs of a bias under a null's truth" 1 $?
"$bin/check" --truth f.json --logs g > said; check "logs of a null under a bias's truth" 1 $?

# The grader gives one who knows the truth everything, and one who says nothing nothing.
campaign() { # campaign TOOL SEED COUNT [FLOORS]: lines to TOOL.jsonl, figures to TOOL.txt
  HIDDEN_TOOL=$1 HIDDEN_OUT=$here/$1.jsonl HIDDEN_FLOORS=${4:-} HIDDEN_SEEDS=${seeds:-} \
    "$hidden/run.sh" "$2" "$3" each > "$1.txt" 2> "$1.err"
}
value() { sed -n "s/^  $2 *\([0-9.]*\).*/\1/p" "$1.txt"; }
# Single effects, nulls and pairs: of each what is diagnosed in the least time, and all that floors.txt speaks of.
seeds="18 19 24 29 30 31"
is_long && seeds=$(seq 18 31)
[ $count -eq 40 ] || seeds=$(seq 18 21)
few=$(echo $seeds | wc -w)
campaign oracle 18 $few "$hidden/floors.txt"; oracle=$?
campaign silent 18 $few "$hidden/floors.txt"; silent=$?
if [ $count -eq 40 ]; then check "the oracle reaches every floor" 0 $oracle; fi
check "the silent one does not" 1 $silent
for figure in 'hidden effects found' 'found, one, in the catalogue: named first' \
  "share of the true model's gain at least .7"; do
  check "oracle: $figure" 100.0 "$(value oracle "$figure")"
done
check "silent: found" 0.0 "$(value silent 'hidden effects found')"
if [ $count -eq 40 ]; then
  check "oracle: two" 100.0 "$(value oracle 'two effects: both found and named')"
  check "silent: claims" 0.0 "$(value silent 'nothing hidden, white noise: anything claimed')"
fi
check "oracle: lines" $few "$(grep -c . oracle.jsonl)"

# A diagnosis that is missing, or whose exit status contradicts it, is a failure of the tool.
"$bin/grade" --truth f.json --diagnosis nowhere --exit 3 > line
contains "no diagnosis" "$(cat line)" '"failed":true'
"$bin/oracle" --truth f.json --out o
"$bin/grade" --truth f.json --diagnosis o --exit 0 > line
contains "a contradicting exit status" "$(cat line)" '"failed":true'
"$bin/grade" --truth f.json --diagnosis o --exit 1 > line
contains "the oracle's" "$(cat line)" '"failed":false.*"found":true.*"named":true'

if ! has_command diagnose; then
  echo "skipped: rim has no diagnose"; skipped=$((skipped + 1)); finish
fi
if [ $count -eq 40 ]; then
  campaign rim 18 $few "$hidden/floors.txt"
  sed -n '1,/^time/p' rim.txt
  while read -r line; do
    case $line in ok:*) ok ;; FAILED:*) bad "$line" ;; esac
  done < <(grep -e '^ok: ' -e '^FAILED: ' rim.txt)
  check "every floor was checked" "$(grep -c '^[a-z]' "$hidden/floors.txt")" \
    "$(grep -c -e '^ok: ' -e '^FAILED: ' rim.txt)"
  [ $failed -eq 0 ] || cat rim.txt rim.err
  # What was missed once: a rate without a unit; a product that the hold-out takes further; drag of
  # a size of its own in each of three short logs.
  machine() {
    HIDDEN_NATURE=$hidden/visitors.py HIDDEN_OUT=$here/$1.jsonl "$hidden/run.sh" "$2" 1 "$1" > "$1.txt" 2>&1
    cat "$1.jsonl"
  }
  contains "a wrist" "$(machine wrist 0)" 'coulomb_friction@tau4_Nm.*"two_named":true'
  contains "a satellite" "$(machine spin 24)" '"claimed":."product@dwx.*"gain_share":0.9'
  contains "a sounding rocket" "$(machine sounder 28)" '"claimed":."quadratic_drag@vz_mps"'
  # And channel by channel: rockets through a layer of wind, a centrifuge, which turns one way; one with
  # nothing wrong. `make test-long`: a reaction wheel whose start is noisy, cranes with payloads of their
  # own, another with nothing wrong.
  printf 'found 1\nfirst 1\nall .8\ngain_tenth .9\nfalse 0\nworse 0\n' > floors.txt
  guests=170023,170026,170032
  is_long && guests=$guests,170024,170025,170033
  "$hidden/channels.py" --rim "$RIM" --seeds $guests \
    --floors floors.txt > channels.txt 2>&1
  check "guests, channel by channel" 0 $?
  cat channels.txt
  # Friction beside a load of another size in each log; a room under a slow sun; a battery with a
  # slow resistance; rockets in thinning air; a ship in wind; a gear that saturates before it lags; a
  # machine with nothing wrong. And a press whose speed is in mm/s, and a car: it understeers, late,
  # and its wheel, predicted from a noisy speed with limits, is well.
  if has_packages python3 numpy; then
    printf 'found 1\nfirst 1\nall .8\ngain_tenth .95\nfalse 0\nworse 0\n' > floors.txt
    "$hidden/channels.py" --rim "$RIM" --drawer neighbours.py --floors floors.txt \
      --seeds 560002,560010,560015,560008,560006,560009,560016 > channels.txt 2>&1
    check "neighbours" 0 $?
    cat channels.txt
    printf 'found 1\nall 1\nworse 0\n' > floors.txt
    "$hidden/channels.py" --rim "$RIM" --drawer strangers.py --family press --seeds 500001 \
      --floors floors.txt > channels.txt 2>&1
    check "a press" 0 $?
    cat channels.txt
    printf 'found 1\nall 1\nworse 0\nfalse 0\n' > floors.txt
    "$hidden/channels.py" --rim "$RIM" --drawer newcomers.py --family car2 --seeds 520019,600001 \
      --floors floors.txt > channels.txt 2>&1
    check "a car" 0 $?
    cat channels.txt
  else
    echo "skipped: neighbours.py needs numpy"; skipped=$((skipped + 1))
  fi
  # Dead bands before a lag: a boat's rudder, a spool, a damper with dead time.
  if is_long; then
    printf 'found 1\nall 1\ngain_tenth .95\nfalse 0\nworse 0\n' > floors.txt
    "$hidden/channels.py" --rim "$RIM" --drawer valves.py --seed 422000 --count 2 --floors floors.txt > channels.txt 2>&1
    check "dead bands before a lag" 0 $?
    cat channels.txt
  fi
else
  seeds='' campaign rim $first $count
  check "no failed diagnosis under the sanitizers" 0.0 "$(value rim 'no usable diagnosis')"
fi
finish
