#!/bin/bash
# SPDX-License-Identifier: MIT
# rim diagnose on machines whose physics is published: an axis, an arm, rockets, a race car. Skipped,
# saying so, where ../shared/measured is absent. Random numbers: seed 1.
. "$(dirname "$0")/check.inc"
measured=${RIM_MEASURED:-$root/../shared/measured}
[ -d "$measured/emps" ] || skip "no $measured/emps"
skip_under_sanitizers "its campaign would take hours; other scripts run the same commands on fewer logs"
reference=$root/tests/measured/reference.py
cd "$here" || exit 1
# within WHAT VALUE LOW HIGH
within() {
  echo "$1: $2 ($3 to $4)"
  if awk -v a="$2" -v l="$3" -v h="$4" 'BEGIN {exit !(a != "" && a + 0 >= l + 0 && a + 0 <= h + 0)}'; then ok
  else bad "$1: '$2' is not in $3 to $4"; fi
}
# get FOLDER EXPRESSION over d: findings of the mean by cause in f, channels' gains in g
get() {
  python3 -c "
import json, sys
d = json.load(open(sys.argv[1] + '/diagnosis.json'))
f = {}
for x in d['findings']: f.setdefault(x['cause'], x)
g = d['gain']['channels']
size = lambda c: f[c]['parameters']['size']
inside = lambda c, truth: abs(size(c)['value'] - truth) <= 1.96 * size(c)['stderr']
print($2)" "$1"
}

# --- an axis, in three forms: Coulomb 20.39 N, viscous 203.5 N s/m, 95.1089 kg, rows of 20 ms
for form in v dv inv; do
  "$RIM" diagnose "$measured"/emps/${form}_fit*.csv --holdout "$measured/emps/${form}_pulses.csv" --out $form > out.txt 2> err.txt
  check "axis, $form" 1 $?
  scale=$([ $form = inv ] && echo 1 || echo "0.02/95.1089")
  check "axis, $form: first" "['coulomb_friction', 'viscous_friction']" "$(get $form "sorted(x['cause'] for x in d['findings'][:2])")"
  within "axis, $form: Coulomb, N" "$(get $form "size('coulomb_friction')['value']/($scale)")" 18.35 22.43
  within "axis, $form: viscous, N s/m" "$(get $form "size('viscous_friction')['value']/($scale)")" 183.2 223.9
  check "axis, $form: intervals hold the truth" "True True" \
    "$(get $form "inside('coulomb_friction', 20.39*$scale), inside('viscous_friction', 203.5*$scale)" | tr -d '(),')"
  within "axis, $form: left" "$(get $form "[x['ratio'] for x in g.values()][0]")" 0 0.102
done

# --- three joints of an arm: Coulomb and viscous friction; left at most what the published forms leave
while read -r joint bound; do
  "$RIM" diagnose "$measured"/ur10e/j${joint}_fit*.csv --holdout "$measured/ur10e/j${joint}_hold.csv" --out j$joint > out.txt 2> err.txt
  check "joint $joint" 1 $?
  check "joint $joint: first" "['coulomb_friction', 'viscous_friction']" "$(get j$joint "sorted(x['cause'] for x in d['findings'][:2])")"
    [ "$joint" != 1 ] || {
    within "joint 1: Coulomb, N m" "$(get j1 "size('coulomb_friction')['value']")" 11.3 13.8
    within "joint 1: viscous, N m s/rad" "$(get j1 "size('viscous_friction')['value']")" 19.14 23.38
    check "joint 1: intervals hold the published" "True True" \
      "$(get j1 "inside('coulomb_friction', 12.55), inside('viscous_friction', 21.26)" | tr -d '(),')"
  }
  within "joint $joint: left" "$(get j$joint "g['torque_Nm']['ratio']")" 0 "$bound"
done << END
1 .099
2 .151
3 .111
END

# --- rockets: drag in each, of its size by least squares with density; together: it differs
while read -r name low high; do
  "$RIM" diagnose "$measured/rockets/dv_$name.csv" --out $name > out.txt 2> err.txt; check "$name" 1 $?
  check "$name: first" quadratic_drag "$(get $name "d['findings'][0]['cause']")"
  within "$name: k, 1/m" "$(get $name "size('quadratic_drag')['value']/0.25")" "$low" "$high"
  within "$name: left, cross-validated" "$(get $name "g['dv_mps']['ratio']")" 0 .15
done << END
genesis 2.49e-4 3.05e-4
halcyon .94e-4 1.16e-4
END
out=$("$RIM" diagnose "$measured"/rockets/dv_genesis.csv "$measured/rockets/dv_halcyon.csv" --out both 2> err.txt)
check "both rockets" 1 $?
contains "both: said" "$out" "differs between the logs"
check "both: a size for each" 2 "$(get both "len(size('quadratic_drag')['per_log'])")"

# --- the published physics put back into the prediction: nothing is claimed that makes a hold-out worse
"$reference" --from "$measured" --out put_back; check "physics put back" 0 $?
for machine in put_back/*; do
  # One axis, one joint and one rocket: in `make test-long` the axis in two more units, three joints, both rockets.
  case $machine in */emps_v | */arm1 | */genesis) ;; *) is_long || continue ;; esac
  held=()
  case $machine in */genesis | */halcyon) ;; *) held=(--holdout "$machine/hold_1.csv") ;; esac
  "$RIM" diagnose "$machine"/fit_*.csv "${held[@]}" --out back > out.txt 2> err.txt
  [ $? -le 1 ]; check "$machine: diagnosed" 0 $?
  within "$machine: left" "$(get back "max([x['ratio'] for x in g.values()])")" 0 1.02
done
rm -rf put_back

# --- a race car: lag or delay in both channels
held=()
for n in 11 12 13 14 15 16 17 18 19 20; do held+=(--holdout "$measured/f1tenth/run$n.csv"); done
"$RIM" diagnose "$measured"/f1tenth/run0*.csv "$measured/f1tenth/run10.csv" "${held[@]}" --out car > out.txt 2> err.txt
check "car" 1 $?
for channel in speed_mps turn_radps; do
  check "car, $channel: late" True "$(get car "any(x['channel'] == '$channel' and x['cause'] in ('lag', 'delay') for x in d['findings'])")"
done
within "car, speed: left" "$(get car "g['speed_mps']['ratio']")" 0 .174
within "car, turn: left" "$(get car "g['turn_radps']['ratio']")" 0 .356
check "car: no fault of a sensor" "[]" "$(get car "[x['cause'] for x in d['findings'] if x['cause'] in ('stuck', 'dropout')]")"
finish
