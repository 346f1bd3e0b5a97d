#!/bin/bash
# SPDX-License-Identifier: MIT
# rim simulate keepaway; rim-thesis experiment fig3.3, fig3.4 and fig3.5: shards merge to the bytes of the
# whole; tables, pictures, wrong use. Seeds 91000 on.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/figure.inc"
skip_under_sanitizers "small campaigns take an hour there; tests/host/test_experiment_*, test_fig3_3, test_keepaway and test_plan run there"
cd "$here" || exit 1

"$RIM" simulate keepaway --out a --runs 2 --seed 5 --rows 30 --truth truth.csv > /dev/null
check "simulate keepaway" 0 $?
RIM_THREADS=1 "$RIM" simulate keepaway --out b --runs 1 --first 2 --seed 5 --rows 30 > /dev/null
cmp -s a/run_0002.csv b/run_0002.csv; check "a run whatever the others" 0 $?
contains "columns" "$(head -1 a/run_0001.csv)" \
  "x.ahead_m,x.beside_m,x.v_ahead_mps,x.v_beside_mps,x.ball_speed_mps,z.success,m.success,sd.success"
check "a row a pass" 31 "$(wc -l < a/run_0001.csv)"
check "truth of every pass" 61 "$(wc -l < truth.csv)"
"$RIM" simulate keepaway --out c --runs 2 --seed 5 --rows 30 --params a/simulate.toml > /dev/null
cmp -s a/run_0001.csv c/run_0001.csv; check "its own parameters again" 0 $?
printf 'habit = []\n' > plain.toml
"$RIM" simulate keepaway --out d --seed 5 --rows 30 --params plain.toml --truth plain.csv > /dev/null
check "without habits" 0 $?
grep -q ',1$' plain.csv; check "no habit acts" 1 $?
printf '[keepaway]\ntakers = 9\n' > bad.toml
error=$("$RIM" simulate keepaway --out e --params bad.toml 2>&1); check "too many takers" 3 $?
contains "are named" "$error" "bad.toml: key 'keepaway.takers'"
"$RIM" simulate keepaway --out e --effect 02_thrust_loss 2> /dev/null; check "no effects" 2 $?
"$RIM" simulate keepaway --out e --dims 7 2> /dev/null; check "no dims" 2 $?
[ ! -e e ]; check "nothing half-written" 0 $?

figure fig3.3 "--runs 2 --nominal 2 --shots 50 --q 0.2" 91000-91003
contains "thesis's highest" "$out" "thesis 20.8"
contains "its threshold" "$out" "^0.2 *41.6"
cp merged.json golf.json
figure fig3.4 "--runs 2 --passes 60 --nominal 5" 91000-91001
contains "the first fifty passes" "$out" "^ *1-50"
contains "baseline" "$out" "TP(theta0)"
figure fig3.5 "--runs 2 --passes 100 --nominal 5" 91000-91001
contains "MPA" "$out" "^MPA (eq. 3.38)"
"$RIM_THESIS" experiment fig3.5 --from golf.json > /dev/null 2>&1; check "another figure's file" 3 $?
"$RIM_THESIS" experiment fig3.3 --q 0.9 2> /dev/null; check "q above p" 2 $?
finish
