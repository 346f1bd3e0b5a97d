#!/bin/bash
# SPDX-License-Identifier: MIT
# Logs in other formats: packed and piped CSV, separators, decimal commas, lines that an editor shows;
# and one file of every format, written by the format's own library, read by `rim` into the same
# table as its CSV. Nothing is drawn at random.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
export RIM_READERS=${RIM_READERS:-$root/host_tools/python/src/rimwatch}

# The rows of a log, by rim: unit times, so that only values are compared.
awk 'BEGIN {print "t_s,u.cmd,s.speed_mps"; for (i = 0; i < 200; i++) printf "%.2f,%d,%.3f\n", i / 10, i % 5, i % 7 / 8}' > a.csv
want=$("$RIM" show a.csv --json | sed 's|"path": "[^"]*"||')
same() { # same WHAT SHOWN
  check "$1" "$want" "$(printf '%s\n' "$2" | sed 's|"path": "[^"]*"||')"
}
refuse() { # refuse WHAT PATTERN ARGUMENT...: exit 3 and what it says
  local what=$1 pattern=$2
  shift 2
  "$RIM" "$@" > out.txt 2> err.txt; check "$what" 3 $?
  contains "$what: said" "$(cat err.txt)" "$pattern"
}

# --- packed, piped, separated
gzip -k a.csv
same "gzip" "$("$RIM" show a.csv.gz --json)"
same "standard input" "$("$RIM" show - --json < a.csv)"
same "packed standard input" "$("$RIM" show - --json < a.csv.gz)"
same "a pipe" "$("$RIM" show <(cat a.csv) --json)"
cat a.csv.gz > twice.csv.gz; sed 1d a.csv | awk -F, -v OFS=, '{$1 += 20} 1' | gzip >> twice.csv.gz
contains "gzip of two members" "$("$RIM" show twice.csv.gz)" "400 rows"
head -c 300 a.csv.gz > cut.csv.gz; refuse "gzip cut off" "cut.csv.gz: gzip: is cut off" show cut.csv.gz
cp a.csv.gz bad.csv.gz; printf XYZXYZXYZ | dd of=bad.csv.gz bs=1 seek=120 conv=notrunc 2> /dev/null; refuse "damaged gzip" "bad.csv.gz: gzip: is damaged" show bad.csv.gz
if command -v zstd > /dev/null; then
  zstd -q -k a.csv
  same "Zstandard" "$("$RIM" show a.csv.zst --json)"
  head -c 100 a.csv.zst > cut.csv.zst; refuse "Zstandard cut off" "cut.csv.zst: Zstandard: is cut off" show cut.csv.zst
else
  skipped=$((skipped + 1)); echo "skipped: no zstd"
fi
tr , ';' < a.csv > semi.csv; same "semicolons" "$("$RIM" show semi.csv --json)"
tr , '\t' < a.csv > tab.csv; same "tabs" "$("$RIM" show tab.csv --json)"
tr '.,' ',;' < a.csv | sed '1s/u,/u./; 1s/s,speed/s.speed/' > comma.csv
refuse "a decimal comma" "comma.csv:row 1: column 't_s': '0,00' is not a number.*decimal = .*(line 2 of the file)" show comma.csv
printf 'schema = "rim-schema/1"\ndecimal = ","\n' > comma.toml
same "decimal commas by a schema" "$("$RIM" show comma.csv --schema comma.toml --json)"
contains "decimal commas proposed" "$("$RIM" schema comma.csv)" '^decimal = ","'
printf 'schema = "rim-schema/1"\ndecimal = ","\ndelimiter = ","\n' > both.toml
refuse "decimal and delimiter" "both.toml:line 2: decimal and delimiter" show a.csv --schema both.toml
{ echo '# a comment'; sed '50s/,[^,]*$/,x/' a.csv; } > text.csv
refuse "an editor's line" "text.csv:row 49: column 's.speed_mps': 'x' is not a number; .* (line 51 of the file)" show text.csv
tr '\n' '\r' < a.csv > old.csv; same "carriage returns alone" "$("$RIM" show old.csv --json)"
contains "carriage returns alone: proposed" "$("$RIM" schema old.csv)" "used as they stand: u.cmd, s.speed_mps"
{ awk 'BEGIN {for (i = 0; i < 300; i++) print "# a comment before it"}'; sed '50s/,[^,]*$/,1\x002/' a.csv; } > zero.csv
refuse "a zero byte in a number" "zero.csv:row 49: column 's.speed_mps': '1�2' is not a number; .* (line 350 of the file)" show zero.csv
noise 51 500 > noise.xyz; refuse "no format" "noise.xyz: is of no format that is known here: CSV, ULog" show noise.xyz
head -2 a.csv > one.csv; contains "one of them" "$("$RIM" show one.csv)" "^one.csv: 1 row, 0 skipped, .* 0 gaps$"
refuse "no such file" "none.csv: cannot read" show none.csv
RIM_PYTHON=/nowhere/python refuse "no Python" "noise.xyz: its reader needs /nowhere/python" show noise.xyz

# --- without its package a format names the command that installs it
printf 'ULog\001\022\065\001' > bare.ulg; head -c 64 /dev/zero >> bare.ulg
printf '#!/bin/sh\nexec python3 -S -E "$@"\n' > nothing && chmod +x nothing # no site-packages
RIM_PYTHON=$here/nothing refuse "no pyulog" "bare.ulg: is a ULog (PX4) file; its reader is not installed .*python3 -m pip install pyulog" show bare.ulg

printf '{"t_s":0,"s.a_m":1}\n{"t_s":1,"s.a_m":2}\n{"t_s":2,"s.a_m":4}\n' > lines.jsonl
RIM_PYTHON=$here/nothing refuse "no numpy" "lines.jsonl: its reader is not installed .*numpy.*python3 -m pip install numpy" show lines.jsonl

# --- every format by its own library
python=$BUILD/venv/bin/python3
if ! has_packages "$python" pyulog mcap_ros2 rosbags h5py pyarrow asammdf cantools ccsdspy lcm pymavlink; then
  echo "skipped: readers of other formats: their packages are not in $python"
  skipped=$((skipped + 1))
  finish
fi
export RIM_PYTHON=$python
contains "lines of JSON without a schema: a log" "$("$RIM" show lines.jsonl 2>&1)" "^lines.jsonl: 3 rows, "
mkdir files && "$python" "$root/tests/python/write_formats.py" files > write.txt 2>&1; check "the libraries write" 0 $?
cat > list.py << 'END'
import sys
sys.path.insert(0, sys.argv[1])
from write_formats import FORMATS
for name, (_, path, options, columns, scale) in FORMATS.items():
    print(name, path, "%g" % scale, *columns, *options)
END
"$python" list.py "$root/tests/python" > list.txt
cd files || exit 1
sed 's/^t_s,cmd,speed,temp/t_s,u.cmd,s.speed_mps,s.temp_degC/' rover.csv > native.csv
want=$("$RIM" show native.csv --json | sed 's|"path": "[^"]*"||')
while read -r name path scale time cmd speed temp options; do
  # shellcheck disable=SC2086
  "$RIM" schema "$path" $options > proposed.toml 2> err.txt; check "$name: a schema is proposed" 0 $?
  contains "$name: its time" "$(cat proposed.toml)" "^# The time is the column t_s\|^column = \"$time\""
  { echo 'schema = "rim-schema/1"'; sed -n '/^\[reader\]/,/^$/p' proposed.toml
    printf '[time]\ncolumn = "%s"\nscale = %s\n' "$time" "$scale"
    printf '[[column]]\nfrom = "%s"\nname = "u.cmd"\n' "$cmd"
    printf '[[column]]\nfrom = "%s"\nname = "s.speed_mps"\n' "$speed"
    printf '[[column]]\nfrom = "%s"\nname = "s.temp_degC"\n' "$temp"; } > "$name.toml"
  same "$name: the table of its CSV" "$("$RIM" show "$path" --schema "$name.toml" --json 2> err.txt)"
done < ../list.txt
check "formats" 14 "$(wc -l < ../list.txt)"
head -c 900 rover.parquet > cut.parquet
refuse "a cut file" "cut.parquet: is damaged, or no Parquet" show cut.parquet --schema parquet.toml
refuse "a packed one" "is neither CSV nor .* not packed" show <(gzip -c rover.h5) --schema hdf5.toml 2> /dev/null
refuse "frames without a DBC" "rover.candump: holds CAN frames" show rover.candump
refuse "messages without types" "rover.lcmlog: is an LCM event log" schema rover.lcmlog
refuse "no such topic" "rover.ulg: has no topic 'x'; it has rover" schema rover.ulg --rows x

# --- verdicts and alarms as MCAP, read by mcap's own reader
cd "$here" || exit 1
awk 'BEGIN {srand(4); print "t_s,u.c,z.v_mps,m.v_mps,sd.v_mps"
  for (i = 0; i < 900; i++) {n = -6; for (k = 0; k < 12; k++) n += rand(); m = cos(i / 40)
    printf "%.1f,%.3f,%.4f,%.4f,0.1\n", i / 10, m, m + 0.1 * n + (i > 500 ? 0.15 : 0), m}}' > own.csv
"$RIM" replay own.csv --mcap own.mcap --alarms own.jsonl --trace own.trace > /dev/null 2> err.txt; check "replay --mcap" 0 $?
"$python" - << 'END' > mcap.txt 2>&1
import json
from mcap.reader import make_reader
with open("own.mcap", "rb") as file:
    read = [(c.topic.rsplit("/", 1)[1], m.log_time, json.loads(m.data)) for _, c, m in make_reader(file).iter_messages()]
alarms = [json.loads(line) for line in open("own.jsonl")]
print("alarms", [v for k, t, v in read if k == "alarm"] == alarms and len(alarms) > 0)
rows = [line.split(",") for line in open("own.trace")][1:]
got = [v for k, t, v in read if k == "verdict"]
print("verdicts", len(got) == 900 and all(abs(float(r[3]) - v["score"]) < 1e-6 * (1 + abs(v["score"])) for r, v in zip(rows, got)))
print("times", all(t == round(1e9 * v["t_s"]) for k, t, v in read if k != "log"))
# What `mcap doctor` looks at: the CRCs, the summary against what is there, every channel and schema that a
# message names, times in order; and each message against the schema that it says it has.
import jsonschema
from collections import Counter
with open("own.mcap", "rb") as file:
    reader = make_reader(file, validate_crcs=True)
    summary, all_of = reader.get_summary(), list(reader.iter_messages())
    file.seek(0)
    in_file_order = [m.log_time for _, _, m in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False)]
counts = Counter(m.channel_id for _, _, m in all_of)
s = summary.statistics
print("doctor", s.message_count == len(all_of) and dict(s.channel_message_counts) == dict(counts)
      and s.message_start_time == min(in_file_order) and s.message_end_time == max(in_file_order)
      and s.channel_count == len(summary.channels) and s.schema_count == len(summary.schemas)
      and in_file_order == sorted(in_file_order) and len(summary.chunk_indexes) == s.chunk_count)
for schema, channel, message in all_of:
    assert channel.message_encoding == "json" and schema.encoding == "jsonschema"
    jsonschema.Draft202012Validator(json.loads(schema.data)).validate(json.loads(message.data))
names = Counter(schema.name for schema, _, _ in all_of)
print("schemas", names["rim.Alarm"] == names["foxglove.Log"] == len(alarms) and names["rim.Verdict"] == 900)
logs = [v for k, t, v in read if k == "log"]
print("texts", [v["message"].split(": ", 1)[1] for v in logs] == [a["sentence"] for a in alarms]
      and all(v["level"] in (3, 4) or v["message"].startswith("cleared") for v in logs)
      and all(v["timestamp"]["sec"] * 10**9 + v["timestamp"]["nsec"] == t for k, t, v in read if k == "log"))
END
for text in "alarms True" "verdicts True" "times True" "doctor True" "schemas True" "texts True"; do contains "MCAP" "$(cat mcap.txt)" "$text"; done
RIM_PYTHON=$here/nothing "$RIM" replay own.csv --mcap no.mcap > /dev/null 2> err.txt; check "without mcap" 3 $?
contains "without mcap: said" "$(cat err.txt)" "no.mcap: .*python3 -m pip install mcap"
check "nothing half-written" "" "$(ls -- *.lines.* no.mcap 2> /dev/null)"
finish
