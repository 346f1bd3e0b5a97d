#!/bin/bash
# SPDX-License-Identifier: MIT
# run.sh SEED COUNT [FAMILY]: COUNT cases from SEED on: nature draws, rim diagnose gets the logs
# alone, grade compares. Figures on stdout; the cases' lines, in the order of the seeds, in
# $HIDDEN_OUT (default: $BUILD/hidden/SEED_COUNT_FAMILY.jsonl). Two cases at a time (HIDDEN_JOBS).
#   BUILD        where tests/hidden/{nature,grade,oracle} are built     RIM  the tool
#   HIDDEN_SEEDS  these seeds, with blanks between, instead of COUNT from SEED on
#   HIDDEN_NATURE  who draws: nature (default) or machines.py
#   HIDDEN_TOOL  rim (default), oracle or silent: who diagnoses         HIDDEN_FLOORS  for grade
#   HIDDEN_LIMIT  seconds that a diagnosis may take (300); one that takes longer has failed
#   HIDDEN_KEEP  a folder in which every case's logs, truth and diagnosis are left
# Exit 1 when a floor is not reached, 3 when a case could not be made or graded.
set -u
[ $# -ge 2 ] || { echo "run.sh SEED COUNT [FAMILY]" >&2; exit 2; }
seed=$1 count=$2 family=${3:-any}
seeds=${HIDDEN_SEEDS:-$(seq "$seed" $((seed + count - 1)))}
count=$(echo $seeds | wc -w)
: "${BUILD:?}"
export bin=$BUILD/tests/hidden tool=${HIDDEN_TOOL:-rim} family keep=${HIDDEN_KEEP:-}
export RIM=${RIM:-$BUILD/rim} RIM_THREADS=${RIM_THREADS:-1}
export work; work=$(mktemp -d /tmp/rim_hidden_XXXXXX)
trap 'rm -rf "$work"' EXIT
trap 'exit 143' INT TERM
out=${HIDDEN_OUT:-$BUILD/hidden/${seed}_${count}_$family.jsonl}

# The logs lie in a folder of their own; the truth in another, of another name, not above it.
one() {
  local n=$1 logs truth status=0 begin end arguments=()
  logs=$(mktemp -d /tmp/rim_logs_XXXXXX) && truth=$work/$n
  mkdir -p "$truth"
  if "${HIDDEN_NATURE:-$bin/nature}" --seed "$n" --family "$family" --out "$logs" --truth "$truth/truth.json"; then
    for h in "$logs"/holdout_*.csv; do arguments+=(--holdout "$(basename "$h")"); done
    begin=$(date +%s.%N)
    case $tool in
    rim) (cd "$logs" && timeout "${HIDDEN_LIMIT:-300}" "$RIM" diagnose run_*.csv "${arguments[@]}" --out OUT) \
      > "$truth/stdout" 2> "$truth/stderr" || status=$? ;;
    oracle) "$bin/oracle" --truth "$truth/truth.json" --out "$logs/OUT" || status=$? ;;
    silent) "$bin/oracle" --truth "$truth/truth.json" --out "$logs/OUT" --silent || status=$? ;;
    esac
    end=$(date +%s.%N)
    if [ "$status" -ge 129 ] && [ "$status" -ne 134 ] && [ "$status" -ne 139 ]; then
      rm -rf "$logs"; return # stopped from outside: no grade (abort and segfault are the tool's)
    fi
    "$bin/grade" --truth "$truth/truth.json" --diagnosis "$logs/OUT" --exit "$status" \
      --said "$truth/stderr" --seconds "$(awk "BEGIN{printf \"%.2f\", $end - $begin}")" > "$truth/line.part" &&
      mv "$truth/line.part" "$truth/line"
  fi
  if [ -n "$keep" ]; then
    rm -rf "${keep:?}/$n"; mkdir -p "$keep/$n"; cp -r "$logs/." "$truth" "$keep/$n/"
  fi
  rm -rf "$logs"
}
export -f one

show() { # progress, on a terminal
  while sleep 1; do
    printf '\r%d of %d cases' "$(find "$work" -name line | wc -l)" "$count" >&2
  done
}
shower=
if [ -t 2 ]; then show & shower=$!; fi
echo $seeds | tr ' ' '\n' | xargs -P "${HIDDEN_JOBS:-2}" -I{} bash -c 'one {}'
if [ -n "$shower" ]; then kill "$shower"; wait "$shower" 2> /dev/null; printf '\r\033[K' >&2; fi

mkdir -p "$(dirname "$out")"
missing=0
for n in $seeds; do
  if [ -f "$work/$n/line" ]; then cat "$work/$n/line"; else
    echo "seed $n: no case or no grade" >&2; missing=1
  fi
done > "$out.part" && mv "$out.part" "$out"
"$bin/grade" --summary "$out" ${HIDDEN_FLOORS:+--floors "$HIDDEN_FLOORS"}
status=$?
echo "lines: $out"
[ $missing -eq 0 ] || exit 3
exit $status
