#!/bin/bash
# SPDX-License-Identifier: MIT
# run.sh TEST...: runs CMocka binaries and scripts (*.sh), $TEST_JOBS at once in this order, says of
# each when it ends what came out, how long it took and how much of a processor, and counts the cases of
# all in the last line.
# Exit 1 on a failure.
# Scripts that have a line '# Mostly waits.' take little of a processor: one at a time runs beside the
# others, from the beginning.
# A test that dies, times out or runs no case counts as a failure; a script's last line is
# 'N passed, N failed[, N skipped]'.
set -u
export logs=$BUILD/test-logs limit=${TEST_TIMEOUT:-600}
# Python keeps what it compiled in the build folder: without that, every call compiles its packages anew
# (those of build/venv are installed uncompiled), and with its default it would write beside the sources.
unset PYTHONDONTWRITEBYTECODE
export PYTHONPYCACHEPREFIX=$BUILD/pycache
rm -rf "$logs"; mkdir -p "$logs"
# A python3 that is a script (pyenv's) takes five times as long to start as Python itself, of which the tests
# start many: they get the one that it would call.
if [ "$(head -c 2 "$(command -v python3)" | tr -d '\0')" = '#!' ]; then
  mkdir -p "$BUILD/test-bin"
  printf '#!/bin/sh\nexec %s "$@"\n' "$(python3 -c 'import sys; print(sys.executable)')" > "$BUILD/test-bin/python3"
  chmod +x "$BUILD/test-bin/python3"
  export PATH=$BUILD/test-bin:$PATH
fi
twice=$(for t in "$@"; do basename "$t" .sh; done | sort | uniq -d)
[ -z "$twice" ] || { echo "run.sh: two tests have this name: $twice" >&2; exit 1; }

cmocka() { sed -n "$1" "$log" | awk '{n += $1} END {print n + 0}'; }
run_one() {
  name=$(basename "$1" .sh) log=$logs/$(basename "$1" .sh).log
  local began=$SECONDS rc p f s
  timeout "$limit" "$1" > "$log" 2>&1 < /dev/null
  rc=$?
  case $1 in
  *.sh) read -r p f s < <(awk 'match($0, /^[0-9]+ passed, [0-9]+ failed/) {p = $1; f = $3; s = NF > 4 ? $5 : 0}
      END {print p + 0, f + 0, s + 0}' "$log") ;;
  *)
    p=$(cmocka 's/^\[  PASSED  \] \([0-9]*\) test.*/\1/p')
    f=$(cmocka 's/^\[  FAILED  \] \([^:]*: \)\{0,1\}\([0-9]*\) test(s), listed.*/\2/p')
    s=$(cmocka 's/^\[  SKIPPED \] \([^:]*: \)\{0,1\}\([0-9]*\) test(s), listed.*/\2/p') ;;
  esac
  if [ $rc -ne 0 ] && [ "$f" -eq 0 ]; then f=1; echo "exit status $rc" >> "$log"; fi
  if [ $rc -eq 0 ] && [ $((p + f + s)) -eq 0 ]; then f=1; echo "ran no test" >> "$log"; fi
  echo "$p $f $s" > "$logs/$name.count"
  times > "$logs/$name.times" # of this shell, then of what it ran: each 0m0.00s 0m0.00s
  { # in one piece, or those that run at once would mix
    printf '%-40s %4d passed %3d failed %4d s %6.1f cpu%s\n' "$name" "$p" "$f" $((SECONDS - began)) \
      "$(tr ms '  ' < "$logs/$name.times" | awk 'NR == 2 {print 60 * $1 + $2 + 60 * $3 + $4}')" \
      "$([ "$s" -gt 0 ] && echo ", $s skipped")"
    if [ "$f" -gt 0 ]; then tail -60 "$log" | sed 's/^/    /'; fi
  } > "$logs/$name.said"
  cat "$logs/$name.said"
}
export -f run_one cmocka
waiting=() working=()
for t in "$@"; do
  if [ "${t%.sh}" != "$t" ] && grep -q '^# Mostly waits\.' "$t"; then waiting+=("$t"); else working+=("$t"); fi
done
at_once() { xargs -0 -r -n 1 -P "$1" bash -c 'run_one "$1"' _; }
[ ${#waiting[@]} -eq 0 ] || printf '%s\0' "${waiting[@]}" | at_once 1 &
[ ${#working[@]} -eq 0 ] || printf '%s\0' "${working[@]}" | at_once "${TEST_JOBS:-2}"
wait
cat "$logs"/*.count | awk -v tests=$# '{p += $1; f += $2; s += $3} END {
  if (NR < tests) {print tests - NR " tests left no count"; f += tests - NR}
  printf "%d passed, %d failed%s\n", p, f, s ? ", " s " skipped" : ""
  exit f > 0}'
