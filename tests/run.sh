#!/bin/bash
# run.sh BINARY... -- SCRIPT...: runs every CMocka binary ($TEST_JOBS at once), then every script in
# turn, shows what failed, and ends with one line that counts the cases of all. Exit 1 on a failure.
# A binary that dies, times out or runs no case counts as a failure; a script's last line is
# 'N passed, N failed[, N skipped]'.
set -u
logs=$BUILD/test-logs
rm -rf "$logs"; mkdir -p "$logs"
limit=${TEST_TIMEOUT:-600}
binaries=() scripts=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do binaries+=("$1"); shift; done
[ $# -gt 0 ] && shift
scripts=("$@")
passed=0 failed=0 skipped=0

count() { # count NAME LOG RC: reads either kind of log
  local p f s
  if [ "$4" = cmocka ]; then
    p=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) test.*/\1/p' "$2" | awk '{n+=$1} END {print n+0}')
    f=$(sed -n 's/^\[  FAILED  \] \([^:]*: \)\{0,1\}\([0-9]*\) test(s), listed.*/\2/p' "$2" | awk '{n+=$1} END {print n+0}')
    s=$(sed -n 's/^\[  SKIPPED \] \([^:]*: \)\{0,1\}\([0-9]*\) test(s), listed.*/\2/p' "$2" | awk '{n+=$1} END {print n+0}')
  else
    read -r p f s < <(awk 'match($0, /^[0-9]+ passed, [0-9]+ failed/) {p=$1; f=$3; s=(NF>4 ? $5 : 0)}
      END {print p+0, f+0, s+0}' "$2")
  fi
  if [ "$3" -ne 0 ] && [ "$f" -eq 0 ]; then f=1; echo "exit status $3" >> "$2"; fi
  if [ "$3" -eq 0 ] && [ $((p + f + s)) -eq 0 ]; then f=1; echo "ran no test" >> "$2"; fi
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
  printf '%-40s %4d passed %3d failed%s\n' "$1" "$p" "$f" "$([ "$s" -gt 0 ] && echo " $s skipped")"
  if [ "$f" -gt 0 ]; then sed 's/^/    /' "$2" | tail -60; fi
}

run_one() { timeout "$limit" "$1" > "$2.log" 2>&1 < /dev/null; echo $? > "$2.rc"; }
export -f run_one; export limit
for b in "${binaries[@]}"; do printf '%s\0%s\0' "$b" "$logs/$(basename "$b")"; done |
  xargs -0 -r -n 2 -P "${TEST_JOBS:-2}" bash -c 'run_one "$1" "$2"' _
for b in "${binaries[@]}"; do
  log=$logs/$(basename "$b")
  count "$(basename "$b")" "$log.log" "$(cat "$log.rc")" cmocka
done
for s in "${scripts[@]}"; do
  log=$logs/$(basename "$s" .sh)
  run_one "$s" "$log"
  count "$s" "$log.log" "$(cat "$log.rc")" script
done
line="$passed passed, $failed failed"
[ "$skipped" -gt 0 ] && line="$line, $skipped skipped"
echo "$line"
[ "$failed" -eq 0 ]
