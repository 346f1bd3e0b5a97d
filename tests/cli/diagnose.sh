#!/bin/bash
# SPDX-License-Identifier: MIT
# rim diagnose end to end: what it leaves, its exit status, an extension given back, foreign logs
# with --world, an image with --model, the user's own causes, and everything that it must refuse.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
data=$root/data
cd "$here" || exit 1

# drive NAME SEED EXTRA [ROWS [COLUMNS]]: a robot's speed, predicted; EXTRA is what the simulation
# does not know, an awk expression over speed v, battery b, heading a, row i.
drive() {
  awk -v seed="$2" -v rows="${4:-1000}" '
    function uniform() {seed = (seed * 16807) % 2147483647; return seed / 2147483647}
    function normal(  i, s) {s = -6; for (i = 0; i < 12; i++) s += uniform(); return s}
    function max(x, y) {return x > y ? x : y}
    BEGIN {
      seed = (seed * 7919 + 17) % 2147483647
      for (i = 0; i < 20; i++) uniform()
      print "t_s,u.push,x.battery_V,x.tilt_rad,s.speed_mps,z.accel_mps2,m.accel_mps2,sd.accel_mps2"
      p = normal(); v = 0.5
      for (i = 0; i < rows; i++) {
        u = sin(i / 60 + p) + 0.4 * sin(i / 17)
        b = 12.5 - 0.6 * sin(i / 210 + p) + 0.02 * normal()
        a = 0.3 * sin(i / 77 - p)
        m = 0.8 * u - 0.1 * v
        z = m + ('"$3"') + 0.1 * normal()
        printf "%.2f,%.6f,%.5f,%.6f,%.6f,%.6f,%.6f,0.1\n", i * 0.1, u, b, a, v, z, m
        v += 0.1 * (m + 0.02 * normal())
      }
    }' > "$1"
}
diagnose() { "$RIM" diagnose "$@" 2> err.txt; }
# json FILE EXPRESSION over d
json() { python3 -c "import json,sys; d=json.load(open(sys.argv[1])); print($2)" "$1"; }
few="--null-runs 12"

# --- found: a constant in a region; what is left; given back it explains all
for n in 1 2 3; do drive bias$n.csv $n 'b > 12.8 ? -0.12 : 0'; done
drive held.csv 9 'b > 12.8 ? -0.12 : 0'
out=$(diagnose bias*.csv --holdout held.csv --horizon 1 --out found $few); check "found" 1 $?
contains "found: said" "$out" "battery"
contains "found: gain" "$out" "held-out logs"
check "what is left" "diagnosis.json extension.toml labels.csv report.html" "$(echo $(ls found))"
check "nothing beside it" "" "$(ls | grep -e '^found\.' -e '\.tmp')"
check "schema" rim-diagnosis/1 "$(json found/diagnosis.json "d['schema']")"
check "verdict" inadequate "$(json found/diagnosis.json "d['verdict']")"
check "its cause" bias "$(json found/diagnosis.json "d['findings'][0]['cause']")"
check "its region" "['x.battery_V']" "$(json found/diagnosis.json "d['findings'][0]['region']['features']")"
python3 - << 'END'; check "fields of the contract" 0 $?
import json
d = json.load(open("found/diagnosis.json"))
f = d["findings"][0]
for key in ("channel", "cause", "sentence", "expression", "parameters", "region", "inside_fraction", "ln_anom",
            "p_value", "alternatives", "separable"):
    assert key in f, key
for key in ("features", "center", "inverse_shape", "bounds"):
    assert key in f["region"], key
size = f["parameters"]["size"]
assert set(("value", "stderr", "unit")) <= set(size), size
assert abs(size["value"] + 0.12) < 4 * size["stderr"] < 0.1, size
assert size["unit"] == "m/s^2", size
for a in f["alternatives"]:
    assert set(("cause", "delta_bic", "heldout_r2")) <= set(a), a
assert isinstance(f["separable"], bool) and 0 < f["inside_fraction"] < 1 and f["p_value"] < 0.05
g = d["gain"]["channels"]["accel_mps2"]
for key in ("rmse_before", "rmse_after", "nll_before", "nll_after", "ratio", "ratio_ci95"):
    assert key in g, key
assert g["ratio"] < 0.98 and g["ratio_ci95"][0] <= g["ratio"] <= g["ratio_ci95"][1]
END
check "labels: header" log,row,t_s,finding "$(grep -v '^#' found/labels.csv | head -1)"
check "labels: every row of every log" 3000 "$(grep -v '^#' found/labels.csv | tail -n +2 | wc -l)"
check "labels: logs" "bias1.csv bias2.csv bias3.csv" \
  "$(echo $(grep -v '^#' found/labels.csv | tail -n +2 | cut -d, -f1 | sort -u))"
python3 - << 'END'; check "labels: where the effect is" 0 $?
import csv
rows = lambda path: list(csv.DictReader(l for l in open(path) if not l.startswith("#")))
truth = [float(r["x.battery_V"]) > 12.8 for n in (1, 2, 3) for r in rows(f"bias{n}.csv")]
said = [r["finding"] != "0" for r in rows("found/labels.csv")]
both = sum(a and b for a, b in zip(truth, said))
f1 = 2 * both / (sum(truth) + sum(said))
assert f1 > 0.95, f1
END
out=$(diagnose bias*.csv --extension found/extension.toml --out again $few); check "explained" 0 $?
check "explained: verdict" adequate "$(json again/diagnosis.json "d['verdict']")"
"$RIM" replay bias1.csv --extension found/extension.toml > /dev/null 2>&1; check "replay takes it" 0 $?

# --- the same again, to the byte, whatever the threads; an earlier diagnosis is replaced
mkdir one two
(cd one && ln -s ../bias*.csv . && RIM_THREADS=1 "$RIM" diagnose bias*.csv --out d $few > out.txt 2>&1)
cp -r found two/d # the earlier one, of other options
! cmp -s found/diagnosis.json one/d/diagnosis.json; check "of other options: another diagnosis" 0 $?
(cd two && ln -s ../bias*.csv . && RIM_THREADS=2 "$RIM" diagnose bias*.csv --out d $few > out.txt 2>&1)
sed -i '/ s so far$/d' one/out.txt two/out.txt # progress comes by the clock
check "one thread or two, beside an earlier one or not" "" "$(diff -r one two)"

# --- adequate: white noise alone
for n in 1 2 3; do drive white$n.csv 5$n 0; done
out=$(diagnose white*.csv --out white $few); check "white noise" 0 $?
check "white noise: verdict" adequate "$(json white/diagnosis.json "d['verdict']")"
check "white noise: labels" 0 "$(grep -v '^#' white/labels.csv | tail -n +2 | grep -v -c ',0$')"

# --- a fault in one log of several: said of that log, and neither of all of them nor adequate
# pump NAME SEED GAIN: a flow that is predicted; from the middle on it reads GAIN times as much.
pump() {
  awk -v seed="$2" -v gain="$3" '
    function uniform() {seed = (seed * 16807) % 2147483647; return seed / 2147483647}
    function normal(  i, s) {s = -6; for (i = 0; i < 12; i++) s += uniform(); return s}
    BEGIN {
      seed = (seed * 7919 + 17) % 2147483647
      for (i = 0; i < 20; i++) uniform()
      print "t_s,u.duty_pct,s.press_kPa,z.flow_Lpm,m.flow_Lpm,sd.flow_Lpm"
      for (i = 0; i < 600; i++) {
        if (i % 50 == 0) duty = 10 + 90 * uniform()
        flow += 0.15 * (0.4 * duty - flow)
        printf "%.1f,%.2f,%.2f,%.3f,%.4f,0.2\n", i * 0.1, duty, 20 + 0.05 * flow * flow + 0.5 * normal(),
               flow * (i < 300 ? 1 : gain) + 0.2 * normal(), flow
      }
    }' > "$1"
}
pump bad.csv 98 1.1; for n in 1 2; do pump good$n.csv $n 1; done
beside=(good1.csv)
is_long && beside+=("good1.csv good2.csv")
for others in "${beside[@]}"; do
  out=$(diagnose $others bad.csv --out single $few); check "beside $others" 1 $?
  contains "beside $others: where" "$out" "In bad.csv, one of "
  check "beside $others: not of the rest" "" "$(echo "$out" | grep -e '^[0-9]*\. Measured' -e 'borne out (' -e 'is adequate')"
  check "beside $others: why" gain "$(json single/diagnosis.json "d['findings'][0]['cause']")"
  check "beside $others: how much" True \
    "$(json single/diagnosis.json "abs(d['findings'][0]['parameters']['size']['value'] - 0.1) < 0.01")"
  check "beside $others: its rows" bad.csv \
    "$(echo $(grep -v '^#' single/labels.csv | tail -n +2 | grep -v ',0$' | cut -d, -f1 | sort -u))"
done

# --- the user's own catalogue
cat > mine.toml << 'END'
schema = "rim-causes/1"
[[cause]]
cause = "cube_law"
description = "opposes motion in proportion to the cube of speed"
basis = ["-v^3"]
arguments = { v = "own" }
per = ["v", "v", "v"]
positive = true
END
for n in 1 2; do drive cube$n.csv 7$n '-0.004 * v * v * v'; done
diagnose cube*.csv --causes mine.toml --out cube $few > /dev/null; check "my cause: found" 1 $?
check "my cause: named" cube_law "$(json cube/diagnosis.json "d['findings'][0]['cause']")"

# --- foreign logs and a world
awk 'BEGIN {srand(4); print "t_s,x_m,y_m,theta_rad,cmd_v_mps,cmd_w_radps,pose_ok"
  for (i = 0; i < 3000; i++) {v = 0.2 + 0.1 * sin(i / 400); w = 0.6 * sin(i / 900)
    printf "%.2f,%.5f,%.5f,%.5f,%.4f,%.4f,1\n", i * 0.02, x, y, th, v, w
    n = rand() - 0.5; x += 0.02 * (0.8 * v + 0.02 * n) * cos(th); y += 0.02 * (0.8 * v + 0.02 * n) * sin(th)
    th += 0.02 * w
    if (th > 3.14159265) th -= 6.2831853; if (th < -3.14159265) th += 6.2831853}}' > robot.csv
diagnose robot.csv --world unicycle --schema "$data/diagnose_mrclam.toml" --out robot $few > out.txt
check "unicycle: it drives slower than commanded" 1 $?
contains "unicycle: model" "$(json robot/diagnosis.json "d.get('model')")" "unicycle"
awk 'BEGIN {srand(5); h = 60000; v = 300; print "t_s,speed_mps,altitude_m,alt_res_m,phase,burn,near_event"
  for (i = 0; i < 6000; i++) {n = -6; for (k = 0; k < 12; k++) n += rand()
    printf "%.4f,%.3f,%.0f,100,%s,0,0\n", i / 30, v + 0.1 * n, 100 * int(h / 100), (h > 40000 ? "coast" : "aero")
    v += (9.8 - 2e-4 * exp(-h / 7200) * v * v) / 30; h -= v / 30; if (h < 3000) break}}' > fall.csv
diagnose fall.csv --world falcon --schema "$data/diagnose_falcon9.toml" --out fall $few > out.txt
check "falcon: there is air" 1 $?
contains "falcon: model" "$(json fall/diagnosis.json "d.get('model')")" "falcon"

# --- an image
for n in 1 2 3 4; do toy train$n.csv $n 800; done
"$RIM" train train*.csv --out toy.rim > /dev/null 2>&1; check "an image" 0 $?
toy test.csv 21 300
diagnose test.csv --model toy.rim --out image $few > out.txt; code=$?
[ $code -le 1 ]; check "image: runs" 0 $?
[ -s image/report.html ]; check "image: report" 0 $?
# --- bad input: refuse WHAT CODE PATTERN ARGUMENT...: nothing is left
refuse() {
  local what=$1 code=$2 pattern=$3
  shift 3
  "$RIM" diagnose "$@" --out no $few > out.txt 2> err.txt; check "$what" "$code" $?
  contains "$what: said" "$(cat err.txt)" "$pattern"
  check "$what: no folder" "" "$(ls -d no* 2> /dev/null)"
}
plain() { cut -d, -f1-5 "$1"; }
plain bias1.csv > plain.csv
refuse "no prediction" 3 "plain.csv: no z. column.*--world NAME, or --model" plain.csv
cut -d, -f1-6 bias1.csv > half.csv
refuse "z. without m." 3 "half.csv.*m.accel_mps2" half.csv
sed '11s/0\.1$/0/' bias1.csv > zero.csv
refuse "sd zero" 3 "zero.csv:row 10: column 'sd.accel_mps2': .*above 0, not 0" zero.csv
sed '11s/0\.1$/-0.1/' bias1.csv > negative.csv
refuse "sd negative" 3 "negative.csv:row 10: column 'sd.accel_mps2'.*not -0.1" negative.csv
refuse "sd zero in a hold-out" 3 "zero.csv:row 10: column 'sd.accel_mps2'" bias2.csv --holdout zero.csv
head -30 bias1.csv > short.csv
refuse "too few rows" 3 "short.csv: 29 rows in all; a diagnosis needs" short.csv
sed '11s/^[^,]*,[^,]*/1.0,what/' bias1.csv > text.csv
refuse "text" 3 "text.csv:row 10.*what" text.csv
refuse "no file" 3 "none.csv" none.csv
refuse "other columns" 3 "robot.csv: no column has a role" bias1.csv robot.csv
refuse "held out and trained on" 3 "bias1.csv: is a training log" bias1.csv bias2.csv --holdout bias1.csv
refuse "by another path" 3 "is a training log" bias1.csv bias2.csv --holdout "$here/./bias1.csv"
ln -s bias1.csv link.csv
refuse "by a link" 3 "link.csv: is a training log" bias1.csv bias2.csv --holdout link.csv
cp bias1.csv copy.csv
refuse "by a copy" 3 "copy.csv: .*training log" bias1.csv bias2.csv --holdout copy.csv
refuse "one training log twice" 3 "bias1.csv.*twice" bias1.csv bias2.csv ./bias1.csv
refuse "no log" 2 "LOG" --seed 1
refuse "no such world" 2 "world" bias1.csv --world moon
refuse "horizon" 2 "horizon" bias1.csv --horizon -1
refuse "world and model" 2 "model" bias1.csv --world falcon --model toy.rim
refuse "no image" 3 "none.rim" bias1.csv --model none.rim
refuse "no schema" 3 "none.toml" bias1.csv --schema none.toml
printf 'schema = "rim-causes/1"\n[[cause]]\ncause = "lift"\n' > bad.toml
refuse "catalogue: form" 3 "bad.toml:line 2: unknown form 'lift'" bias1.csv --causes bad.toml
printf 'schema = "rim-causes/1"\n[[cause]]\ncause = "lift"\nbasis = ["v"]\n' > bad.toml
refuse "catalogue: name" 3 "bad.toml:line 4: expression 'v'" bias1.csv --causes bad.toml
cp found/extension.toml bad.toml
sed -i 's/^form = "bias"/form = "lift"/; s/^basis = .*//' bad.toml
refuse "extension: form" 3 "bad.toml:line [0-9]*: .*'lift'" bias1.csv --extension bad.toml
sed 's/\["V"\]/["kV"]/' found/extension.toml > bad.toml
refuse "extension: unit" 3 "bad.toml:line [0-9]*: .*V" bias1.csv --extension bad.toml
sed 's/^basis = .*/basis = ["f"]\narguments = { f = "z.accel_mps2" }/' found/extension.toml > bad.toml
refuse "extension: cycle" 3 "bad.toml:line [0-9]*: .*cycle" bias1.csv --extension bad.toml
sed 's/x.battery_V/x.none_V/' found/extension.toml > bad.toml
refuse "extension: feature" 3 "bad.toml:line [0-9]*: .*'x.none_V'" bias1.csv --extension bad.toml

# --- the schema says which velocity a friction acts on: here a command, which is never inferred
for n in 1 2 3; do drive rub$n.csv $n 'u > 0 ? -0.2 : 0.2'; done
printf 'schema = "rim-schema/1"\n[[friction]]\noutcome = "z.accel_mps2"\nvelocity = "u.push"\n' > rub.toml
diagnose rub*.csv --schema rub.toml --out rub $few > out.txt; check "friction on what the schema says" 1 $?
check "it is claimed" "coulomb_friction u.push" \
  "$(json rub/diagnosis.json "d['findings'][0]['cause'] + ' ' + d['findings'][0]['form']['arguments'].get('v', '')")"
diagnose rub1.csv --out rubbed $few > out.txt
check "it is not inferred" False \
  "$(json rubbed/diagnosis.json "any(f['form']['arguments'].get('v') == 'u.push' for f in d['findings'])")"
check "the range it was learnt from" u.push "$(json rub/diagnosis.json "d['findings'][0]['learnt'][0]['feature']")"
sed 's/u.push/u.pull/' rub.toml > bad.toml
refuse "schema: friction's velocity" 3 "rub1.csv: .*'u.pull'" rub1.csv --schema bad.toml
sed 's/z.accel_mps2/s.speed_mps/' rub.toml > bad.toml
refuse "schema: friction's outcome" 3 "bad.toml:line 2: .*'s.speed_mps'" rub1.csv --schema bad.toml

# --- rows that are no measurements: the gain without and with them
awk -F, -v OFS=, 'NR > 1 && NR % 17 == 0 {$6 = 0} 1' bias1.csv > gone1.csv
awk -F, -v OFS=, 'NR > 1 && NR % 17 == 0 {$6 = 0} 1' bias2.csv > gone2.csv
diagnose gone1.csv gone2.csv --out gone $few > out.txt; check "dropouts" 1 $?
contains "the gain without and with them" "$(cat out.txt)" "with flagged"
contains "a share of the rows below all" "$(grep 'Cause: dropout' out.txt)" "(6 % of the rows)"
awk -F, -v OFS=, 'NR > 1 && NR % 17 == 0 {$6 = 0} 1' white1.csv > gone1.csv
awk -F, -v OFS=, 'NR > 1 && NR % 17 == 0 {$6 = 0} 1' white2.csv > gone2.csv
diagnose gone1.csv gone2.csv --out gone $few > out.txt; check "dropouts alone" 1 $?
check "of rows that are left out no gain is said" 0 "$(head -1 out.txt | grep -c -e 'borne out' -e Correcting)"

# --- constant: a feature is left out and said, a channel that never changes is no crash
awk -F, -v OFS=, 'NR > 1 {$3 = 12.5} 1' white1.csv > level.csv
diagnose level.csv --out level $few > out.txt; check "a constant feature" 0 $?
contains "a constant feature: said" "$(cat out.txt)" "x.battery_V never changes"
awk -F, -v OFS=, 'NR > 1 {$6 = 1; $7 = 1} 1' white1.csv > flat.csv
diagnose flat.csv --out flat $few > out.txt; code=$?
[ $code -le 1 ] || [ $code -eq 3 ]; check "a constant channel: status $code" 0 $?
[ $code -ne 3 ] || contains "a constant channel: said" "$(cat err.txt)" "flat.csv.*z.accel_mps2"
# --- the folder: another's is not touched
mkdir kept; echo mine > kept/notes.txt
diagnose white1.csv --out kept $few > out.txt; check "a folder of others" 3 $?
check "a folder of others: as it was" notes.txt "$(ls kept)"
# --- a curve of straight pieces goes on beyond the speeds that it was learnt from, as a whole: with
# one piece of it left out there, the held-out log would be predicted far worse than before
clamped() { # clamped FILE SEED FASTEST WIDTH: a force that grows with the speed up to a width
  awk -v s="$2" -v far="$3" -v width="$4" '
    function uniform() {s = (s * 16807) % 2147483647; return s / 2147483647}
    function normal(  i, x) {x = -6; for (i = 0; i < 12; i++) x += uniform(); return x}
    BEGIN {
      s = (s * 7919 + 17) % 2147483647
      for (i = 0; i < 20; i++) uniform()
      print "t_s,x.rod_mmps,z.force_kN,m.force_kN,sd.force_kN"
      phase = 6.28 * uniform()
      for (i = 0; i < 1500; i++) {
        v = far * (sin(i / 40 + phase) + 0.3 * sin(i / 17))
        r = 2 * (v > width ? width : v < -width ? -width : v) + 0.01 * v
        printf "%.2f,%.5f,%.5f,0,0.2\n", i * 0.02, v, r + 0.2 * normal()
      }
    }' > "$1"
}
for width in 1 4; do
  for i in 1 2 3; do clamped slow$i.csv $i 20 $width; done
  clamped fast.csv 9 60 $width
  "$RIM" diagnose slow?.csv --holdout fast.csv --out clamped$width > out.txt 2> err.txt; check "straight pieces, $width" 1 $?
  left=$(awk '$1 == "force_kN" && $3 == "all" {print $8}' out.txt)
  check "straight pieces, $width: the part of the error left where it is faster, $left" 1 \
    "$(awk -v left="$left" 'BEGIN {print (left > 0 && left < 0.2)}')"
done

# --- what swings with the time: period and amplitude are said; the phase is each log's own, so that
# another log is given none, and is predicted as less sure
for n in 1 2; do drive swing$n.csv $n "0.12 * sin(i / 7.3 + 2 * $n)"; done
drive other.csv 5 '0.12 * sin(i / 7.3)'
out=$(diagnose swing?.csv --out swing $few); check "what swings: found" 1 $?
contains "what swings: said" "$out" "swings by 0.12"
contains "what swings: its phase" "$out" "is each log's own, and is not known in another"
check "what swings" "periodic True True" "$(json swing/diagnosis.json \
  "d['findings'][0]['cause'], abs(d['findings'][0]['parameters']['period']['value'] - 4.587) < 0.02, \
   d['findings'][0]['parameters']['phase']['stderr'] > 0" | tr -d "(),'")"
out=$(diagnose swing?.csv --extension swing/extension.toml --out again $few); check "what swings: given back" 0 $?
diagnose other.csv --extension swing/extension.toml --out other $few > out.txt
contains "what swings: the extension says so" "$(cat swing/extension.toml)" "hold for other logs, the phase does not"
check "what swings: in another log it is found anew" 2 \
  "$(json other/diagnosis.json "sum('period' in f['parameters'] for f in d['findings'])")"
finish
