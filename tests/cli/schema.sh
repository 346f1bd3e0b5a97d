#!/bin/bash
# SPDX-License-Identifier: MIT
# rim schema, show and check: the tutorial of data/README.md as it is printed there, then foreign logs
# of other kinds, images, alarms and DBC looked into, and bad input. Seed 1.
. "$(dirname "$0")/check.inc"
mkdir "$here/bin" && ln -s "$RIM" "$here/bin/rim"
export PATH=$here/bin:$PATH RIM_DATA=${RIM_DATA:-$root/data}
python=python3
[ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
cd "$here" || exit 1

# --- the tutorial: its own lines, so that what is printed is what runs
awk '/^## A tutorial/ {on = 1; next} /^## / {on = 0} on && /^    / {print substr($0, 5)}' "$root/data/README.md" > commands
[ "$(wc -l < commands)" -gt 8 ]; check "the tutorial has commands" 0 $?
status=
while IFS= read -r line; do
  bash -c "$line" > said.txt 2>&1; code=$?
  status="$status $code"
  case $line in
  *"rim schema"*) contains "schema: what to do" "$(cat said.txt)" "DECIDE" ;;
  *"rim replay"*) contains "replay: which and how" "$(cat said.txt)" "odo vx reads 0\.0[0-9]* m/s low" ;;
  *"rim diagnose"*) contains "diagnose: the cause" "$(cat said.txt)" "odo vx is 0\.9[23][0-9]* times what is predicted" ;;
  *"rim check"*) contains "check: understood" "$(cat said.txt)" "understood: 1800 of 1800 rows used" ;;
  esac
done < commands
# 1: rim diagnose found something, as the tutorial says.
check "every command of the tutorial" 0 "$(echo "$status" | tr ' ' '\n' | grep -cv '^[01]*$')"
check "one of them finds" 1 "$(echo "$status" | tr ' ' '\n' | grep -c '^1$')"
for line in 'name = "x.heading_rad"' 'name = "u.vx_mps"' 'name = "z.odo_vx_mps"' 'name = "m.odo_vx_mps"' \
  'name = "sd.odo_vx_mps"' 'column = "stamp \[ms\]"' 'scale = 0.001 ' 'uptime equals stamp'; do
  contains "tutorial's schema" "$(cat rover.toml)" "$line"; done

# --- looking into what it made
out=$(rim show rover.rim); check "show an image" 0 $?
for text in "flight image [0-9a-f]\{8\}, 6 features, 3 outcomes" "Rows come at 19.99 Hz" "2  x.heading_rad .*angle" \
  "3  u.vx_mps  *m/s  *command" "0  z.odo_vx_mps  *m/s" "At most [0-9.]* % of healthy runs" "RAM of one monitor"; do
  contains "image" "$out" "$text"; done
rim show rover.rim --json > image.json; check "show --json" 0 $?
rim show alarms.jsonl --json > alarms.json; check "show alarms" 0 $?
contains "alarms in words" "$(rim show alarms.jsonl)" "rim raised: odo vx reads"
rim show diagnosis/diagnosis.json --json > diagnosis.json; check "show a diagnosis" 0 $?
contains "diagnosis in words" "$(rim show diagnosis/diagnosis.json)" "^1. Measured odo vx is 0.9"
contains "extension in words" "$(rim show diagnosis/extension.toml)" "^odo_vx_mps: gain: "
contains "log in words" "$(rim show faulty.csv --schema rover.toml)" "1800 rows.* 0 gaps"
python3 - << 'END' > py.txt 2>&1
import json
i, a, d = (json.load(open(n + ".json")) for n in ("image", "alarms", "diagnosis"))
print("kinds", i["kind"], a["kind"], d["kind"])
print("order", [f["name"] for f in i["features"]][3], i["outcomes"][0]["name"], i["features"][3]["unit"])
print("range", 0.6 < i["features"][3]["high"] < 0.9, abs(1 / i["period_s"] - 20) < 0.1)
print("size", i["bytes"] > sum(s["bytes"] for s in i["sections"]) > 0, i["monitor_bytes"] > 0)
print("raised", a["raised"], all("sentence" in r for r in a["records"]))
END
for text in "kinds image alarms diagnosis" "order u.vx_mps z.odo_vx_mps m/s" "range True True" "size True True" "raised 1 True"; do
  contains "as JSON" "$(cat py.txt)" "$text"; done
rim replay faulty.csv --schema rover.toml --extension diagnosis/extension.toml > /dev/null; check "its extension can be used" 0 $?

# --- the image's own DBC
rim show --dbc rover.rim --node 5 > rover.dbc; check "show --dbc" 0 $?
contains "DBC: outcomes" "$(cat rover.dbc)" 'VAL_ 1157 Outcome 0 "z.odo_vx_mps \[m/s\]" 1 '
contains "DBC: the node's identifiers" "$(cat rover.dbc)" "^BO_ 389 RIM_SUMMARY"
if has_packages $python cantools; then
  cat > decode.py << 'END'
import cantools, sys
bus = cantools.database.load_file("rover.dbc")
summaries = 0
for line in open("faulty.candump"):
    frame, data = line.split()[-1].split("#", 1)
    if int(frame, 16) == 0x180 + 5:
        seen = bus.decode_message(int(frame, 16), bytes.fromhex(data))
        summaries += 1
        print(seen["Kind"], seen["ModelId"])
finding = bus.get_message_by_name("RIM_FINDING")
print("channel", finding.get_signal_by_name("Outcome").choices[0], finding.frame_id == 0x480 + 5)
print("summaries", summaries > 0)
END
  rim replay faulty.csv --schema rover.toml --model rover.rim --candump faulty.candump --node 5 > /dev/null
  out=$($python decode.py 2>&1); check "cantools reads it" 0 $?
  for text in "shift [0-9a-f]\{8\}" "channel z.odo_vx_mps \[m/s\] True" "summaries True"; do contains "cantools" "$out" "$text"; done
else
  skipped=$((skipped + 1))
fi

# --- rim check says why not, as replay does
awk -F, -v OFS=, 'NR > 1 {$6 *= 3.6} {print}' faulty.csv > kmh.csv
awk 'NR == 1 || NR % 10 == 2' faulty.csv > slow.csv
for name in kmh slow; do
  out=$(rim check $name.csv --schema rover.toml --model rover.rim 2> /dev/null); check "check $name" 3 $?
  why=$(printf '%s\n' "$out" | head -1)
  replayed=$(rim replay $name.csv --schema rover.toml --model rover.rim 2> /dev/null)
  if printf '%s\n' "$replayed" | grep -qF -- "${why#*: }"; then ok; else bad "$name: not replay's words: $why"; fi
done
contains "another unit" "$(rim check kmh.csv --schema rover.toml --model rover.rim)" "^u.vx_mps  *m/s  *0 to 2.52 "
contains "another rate" "$(rim check slow.csv --schema rover.toml --model rover.rim)" "STALE: rows come at 2.0[0-9]* Hz, the model wants 19.99 Hz"
awk -F, -v OFS=, 'NR == 1 {print "t_s,u.vx_mps,s.other_m"; next} {print $1 / 1000, $6, $9}' faulty.csv > other.csv
out=$(rim check other.csv --model rover.rim); check "check: other columns" 3 $?
contains "what is missing" "$out" "column 'x.pos_x_m', .*'m.odo_yaw_rate_radps' is missing"
contains "what is not used" "$out" "does not know them: 's.other_m'"

# --- foreign logs of other kinds
awk 'BEGIN {srand(3); print "TIMESTAMP;seq;WheelSpeed(km/h);course;volts_V;mode;note;alt [ft];empty"
  for (i = 0; i < 400; i++) printf "%d;%d;%.3f;%.2f;24;%d;%s;%.2f;\n", 50000 * i + (i > 200) * 1000000, i, 10 + rand(),
    (i * 7) % 360, i / 100, (i < 200 ? "cruise" : "climb"), 100 + rand()}' > other.log
rim schema other.log > other.toml; check "semicolons" 0 $?
for line in 'delimiter = ";"' 'scale = 1e-06   # GUESS' 'name = "s.wheel_speed_kmph"' 'name = "s.course_deg"' 'GUESS: an angle in deg' \
  'It jumps by a whole turn' '24 in every row, which teaches nothing: volts_V' 'scale = 0.3048   # to m' 'name = "s.alt_m"' 'name = "x.mode"' \
  'values = \["cruise", "climb"\]' 'seq counts the rows' 'DECIDE: the file names none' '1 gap is longer'; do
  contains "semicolons" "$(cat other.toml)" "$line"; done
out=$(rim show other.log --schema other.toml --json); check "the proposal reads the log" 0 $?
contains "in metres" "$out" '"min": 30\.[4-9]'
printf 't_s,s.a_m\n0,1\n0.1,2\n0.2,1\n' > own.csv
contains "names that say it" "$(rim schema own.csv)" "used as they stand: s.a_m"
# A schema does what it says: what it calls left out is not read, whatever its name.
for i in 1 2 3 4; do awk -v seed=$i 'BEGIN {srand(seed); print "t_s,u.c,s.a_m,s.note,s.fw_version,x.mode,s.seq,s.none"
  for (i = 0; i < 400; i++) {c = sin(i / 30); a += 0.05 * c; printf "%.2f,%.6f,%.6f,note %d of the day,7,%s,%d,\n", i * 0.05, c, a + 0.01 * rand(), i, (i % 3 == 0 ? "fast" : i % 3 == 1 ? "slow" : "off"), i}}' > noted$i.csv; done
rim schema noted[1-4].csv --out noted.toml > /dev/null; check "left out" 0 $?
contains "left out: what" "$(cat noted.toml)" '^leave_out = \["s.note", "s.fw_version", "x.mode", "s.seq", "s.none"\]'
contains "left out: why" "$(cat noted.toml)" '7 in every row, which teaches nothing: s.fw_version'
out=$(rim train noted[1-4].csv --schema noted.toml --out noted.rim 2>&1); check "left out: train" 0 $?
contains "left out: the rest is used" "$out" "1 sensor, 1 command, 0 further context"
printf 'schema = "rim-schema/1"\nleave_out = ["s.b"]\n' > none.toml
rim show own.csv --schema none.toml > /dev/null 2> err.txt; check "leave out what is not there" 3 $?
contains "leave out what is not there" "$(cat err.txt)" "own.csv: column 's.b': missing (a leave_out of the schema)"
# A table that was written with its index: nothing stands above the time.
awk 'BEGIN {print ",v_mps"; for (i = 0; i < 50; i++) printf "%.1f,%.3f\n", i / 10, sin(i / 5)}' > index.csv
rim schema index.csv > index.toml; check "no name above the time" 0 $?
rim show index.csv --schema index.toml > out.txt 2>&1; check "no name above the time: read" 0 $?
contains "no name above the time: rows" "$(cat out.txt)" "50 rows"
# Of dates that either order allows, the proposal says what it takes; one day decides.
for day in 06 16; do awk -v d=$day 'BEGIN {print "when,v_mps"; for (i = 0; i < 50; i++) printf "11/%s/2016 00:%02d,%.3f\n", d, i, sin(i / 5)}' > date$day.csv
  rim schema date$day.csv > date$day.toml; check "dates of $day" 0 $?; done
contains "either order" "$(cat date06.toml)" "^day_first = false   # GUESS"
check "one order" 0 "$(grep -c day_first date16.toml)"
printf 'zeit;wert\n0,1;1,5\n0,2;2,5\n' > comma.csv
rim schema comma.csv > out.txt 2> err.txt; check "decimal commas" 0 $?
contains "decimal commas: proposed" "$(cat out.txt)" '^decimal = ","'

# --- bad input: refuse WHAT CODE PATTERN ARGUMENT...
refuse() {
  local what=$1 code=$2 pattern=$3
  shift 3
  rim "$@" > out.txt 2> err.txt; check "$what" "$code" $?
  contains "$what: said" "$(cat err.txt)" "$pattern"
}
printf 'a,b\n3,1\n2,1\n1,2\n' > falls.csv; printf 'a,b\n1,1\n2\n' > ragged.csv; printf 't,a,a\n1,1,2\n2,1,2\n' > twice.csv
printf '{"a": 1}\n' > no.jsonl; head -c 3000 rover.rim > cut.rim; : > empty.csv
sed 's|11/16/|16/11/|' date16.csv > day_first.csv
refuse "the day first" 3 "'16/11/2016 00:00' is not a number: is its day first? day_first = true" show day_first.csv --schema date16.toml
refuse "no time" 3 "falls.csv: no column can be the time: none increases.*are 'a', 'b'" schema falls.csv
refuse "a short row" 3 "ragged.csv: row 2: 1 fields where the header has 2" schema ragged.csv
refuse "a name twice" 3 "twice.csv: column 'a': stands twice" schema twice.csv
rim replay faulty.csv --schema rover.toml --model rover.rim --candump faulty.candump --lcm "file://$here/bus.lcm?mode=w" > /dev/null
refuse "CAN frames" 3 "faulty.candump: holds CAN frames.*rim can-table" schema faulty.candump
refuse "an LCM event log" 3 "bus.lcm: is an LCM event log.*observation = " schema bus.lcm
printf 't_s,s.a_m,s.a_m\n0,1,2\n1,1,2\n' > two.csv
printf 'schema = "rim-schema/1"\n[time]\ncolumn = "t"\n[[column]]\nfrom = "a"\nname = "s.a_m"\n' > a.toml
refuse "a sensor twice" 3 "two.csv: column 's.a_m': stands twice" show two.csv
refuse "a mapped column twice" 3 "twice.csv: column 'a': stands twice" show twice.csv --schema a.toml
refuse "other columns" 3 "own.csv: .* columns where " schema other.log own.csv
refuse "no file" 3 "none.csv" schema none.csv
refuse "an empty file" 3 "empty.csv: is empty" schema empty.csv
refuse "a cut image" 3 "cut.rim: .*truncated" show cut.rim
refuse "no alarms" 3 "no.jsonl:line 1: is no record" show no.jsonl
refuse "DBC of a log" 3 "own.csv" show --dbc own.csv
refuse "--dbc and --json" 2 "dbc" show --dbc --json rover.rim
refuse "check without a model" 2 "model" check own.csv
refuse "a foreign log without a schema" 3 "column 't_s': missing (the time).*'TIMESTAMP', 'seq'.*rim schema" show other.log
finish
