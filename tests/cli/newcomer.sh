#!/bin/bash
# SPDX-License-Identifier: MIT
# A stranger's logs with the README's own commands: German names, semicolons, decimal comma, BOM, CRLF, dates
# and times of day, a counter, gaps, empty fields. From the clone at most seven commands, typed as
# they stand there (but for clone, deps and make), to an alarm that names the right sensor; then what a
# stranger does wrong, and what he is told. Seeds 1 to 22.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
mkdir build healthy && ln -s "$RIM" build/rim
cat > stranger.py <<'EOF'
"""Logs of a pump's test stand, by its logger: of this project it knows nothing."""
import datetime
import math
import random


def run(name, seed, fault=False, rate=5.0, rows=1200, column="Druck [bar]"):
    draw = random.Random(seed)
    start = datetime.datetime(2025, 3, 1, 8) + datetime.timedelta(days=seed)
    speed = flow = wanted = 0.0
    heat, offset, step = 22 + draw.gauss(0, 1), draw.gauss(0, 0.02), 1 / rate
    with open(name, "w", encoding="utf-8-sig", newline="") as file:
        file.write("Zeitstempel;Lfd. Nr.;Sollwert Drehzahl [1/min];Drehzahl [1/min];Durchfluss [l/min];"
                   f"{column};Motorstrom [A];Temperatur [°C];Zustand\r\n")
        for i in range(rows):
            if i % 60 == 0:
                wanted = draw.choice([0, 600, 900, 1200, 1500, 1800]) if i else 600
            speed += step * (wanted - speed) / 1.5
            flow += step * (speed * 0.02 - flow) / 0.8
            current = 0.4 + 2.2 * (speed / 1800) ** 2 + 0.3 * (wanted - speed) / 1800 + draw.gauss(0, 0.03)
            heat += step * (20 + 9 * current - heat) / 120
            if fault and i > 700 and speed > 1000:
                current += 0.25
            if 400 <= i < 410 and seed % 4 == 0:
                continue  # lost rows
            values = [(speed + draw.gauss(0, 3), 1), (flow + draw.gauss(0, 0.1), 2),
                      (1 + 3 * (speed / 1800) ** 2 + draw.gauss(0, 0.02) + offset, 3), (current, 3),
                      (heat + draw.gauss(0, 0.05), 2)]
            texts = [f"{v:.{d}f}".replace(".", ",") for v, d in values]
            if draw.random() < 0.002:
                texts[-1] = ""
            at = start + datetime.timedelta(seconds=i * step)
            file.write(";".join([at.isoformat(timespec="milliseconds"), str(i + 1), str(int(wanted)), *texts,
                                 "LAUF" if wanted else "STOPP"]) + "\r\n")


for k in range(1, 13):
    run(f"healthy/messung_{k:02d}.csv", k)
run("suspect.csv", 20, fault=True)
run("gesund.csv", 21)
run("langsam.csv", 22, rate=1.0, rows=240)
run("umbenannt.csv", 21, column="Pressure")
EOF
python3 stranger.py; check "logs" 0 $?

awk '/^## Your own logs/ {on = 1; next} /^## / {on = 0} on && /^    / {print substr($0, 5)}' "$root/README.md" > commands.txt
[ "$(wc -l < commands.txt)" -le 7 ]; check "at most seven commands in the README" 0 $?
check "the first four are clone, cd, deps, make" "git clone cd rimwatch make deps make" "$(sed -n 1,4p commands.txt | cut -d' ' -f1,2 | xargs)"
sed 1,4d commands.txt > typed.sh
out=$(sh -e typed.sh 2> err.txt); check "the others, typed as they stand" 0 $? || cat err.txt
contains "the alarm names the right sensor, direction and unit" "$out" 'suspect.csv: FOUND at t = 1[4-7][0-9]'
contains "and how much" "$out" 'motorstrom reads 0.2[3-7][0-9]* A high .* since t = 1[34][0-9] s'
[ -s flight.html ]; check "and a report" 0 $?
contains "the time was found" "$(cat mine.toml)" 'column = "Zeitstempel"   # dates and times of day'
contains "the rate too" "$(cat mine.toml)" 'Rows come at 5 Hz'
contains "the wanted speed is a command, in rpm" "$(cat mine.toml)" 'name = "u.drehzahl_rpm"   # a command'
contains "the counter is left out, though it jumps" "$(cat mine.toml)" '# Lfd. Nr. counts the rows'
contains "a healthy run" "$("$RIM" replay gesund.csv --schema mine.toml --model mine.rim 2> /dev/null)" '^gesund.csv: healthy'

# told WHAT STATUS PATTERN ARGUMENT...: what stderr and stdout say of a mistake
told() {
  local what=$1 status=$2 pattern=$3
  shift 3
  said=$("$RIM" "$@" 2>&1); check "$what: status" "$status" $?
  contains "$what" "$said" "$pattern"
}
told "no schema" 3 "column 't_s': missing (the time); the file has 'Zeitstempel'.*\`rim schema\` proposes a --schema" train healthy/*.csv --out a.rim
told "one log only" 3 'at least 3 logs, each a run of its own; got 1' train healthy/messung_01.csv --schema mine.toml --out a.rim
told "a log of another rate in training" 3 'langsam.csv: its rows come at 1 Hz, those of the other runs at 5 Hz' train healthy/*.csv langsam.csv --schema mine.toml --out a.rim
told "of another rate in a proposal" 0 'DECIDE: langsam.csv comes at 1 Hz' schema healthy/messung_01.csv healthy/messung_02.csv langsam.csv
told "of another rate in flight" 3 'langsam.csv: STALE: rows come at' replay langsam.csv --schema mine.toml --model mine.rim
told "a column that was renamed" 3 "column 'Druck \[bar\]': missing (asked for by mine.toml); the file has .*'Pressure'" replay umbenannt.csv --schema mine.toml --model mine.rim
told "a schema in place of the model" 3 'mine.toml: is no flight image' replay suspect.csv --schema mine.toml --model mine.toml
told "a log in place of the model" 3 'suspect.csv: is no flight image' replay mine.rim --schema mine.toml --model suspect.csv
told "a schema that is there already" 3 'mine.toml: is there already, and may have been edited' schema suspect.csv --out mine.toml
told "a schema shown" 3 'mine.toml: is a schema' show mine.toml
printf 'PK\3\4 and more' > table.xlsx
told "a spreadsheet" 3 'table.xlsx: is a spreadsheet or a zip archive: save the table as CSV' schema table.xlsx
told "a program" 3 'is of no format that is known here' schema "$RIM"
told "a diagnosis without predictions" 3 'no z. column: a diagnosis needs predictions' diagnose suspect.csv --schema mine.toml --out d
check "nothing was written by what failed" "" "$(ls a.rim d 2> /dev/null)"

# Dates and times: forms that mean the same instants, and what is none.
times() { { echo "t_s,s.a_m"; n=0; for t in "$@"; do n=$((n + 1)); echo "\"$t\",$n"; done; } > t.csv; "$RIM" show t.csv 2>&1; }
whole=$(times 0 0.5 1 1.5 | sed 's/^t.csv//')
for form in "2025-03-01T23:59:59 2025-03-01T23:59:59.5 2025-03-02T00:00:00Z 2025-03-02T01:00:00.5+01:00" \
  "2024/02/29_23:59:59 2024/02/29_23:59:59,500 2024/03/01_00:00:00 2024/03/01_00:00:00.5" \
  "28.02.2025_23:59:59 28.02.2025_23:59:59.5 01.03.2025_00:00:00 01.03.2025_00:00:00.5" \
  "08:00:00 08:00:00.5 08:00:01 08:00:01.5"; do
  set -- $form
  check "times: $1" "$whole" "$(times "${@//_/ }" | sed 's/^t.csv//')"
done
for bad in 2025-13-01T00:00:00 2025-03-01 24:61:00 08:00:00x 2025-03-01T00:00:00+1; do
  contains "no time: $bad" "$(times 08:00:00 "$bad")" "row 2: column 't_s': '$bad' is not a number"
done
# Letters of other encodings: the same text whatever the logger writes.
python3 - << 'EOT'
rows = "t_s;Öldruck [bar];Länge (°C);Ort\n" + "".join(f"{i / 10};{i % 7},5;{i % 3};Köln\n" for i in range(40))
for name, encoding in (("latin", "latin-1"), ("utf8", "utf-8"), ("mark", "utf-8-sig"), ("wide", "utf-16"), ("big", "utf-16-be")):
    open(f"{name}.csv", "wb").write((b"\xfe\xff" if name == "big" else b"") + rows.encode(encoding))
EOT
"$RIM" schema utf8.csv > utf8.toml; check "umlauts" 0 $?
contains "umlauts: a name without" "$(cat utf8.toml)" 'name = "s.oldruck_bar"'
contains "the documented spelling of a unit" "$(printf 't_s,Oil [degC],Force [N]\n0,1.5,2\n1,2.5,3\n2,1.1,9\n' | "$RIM" schema -)" 's.oil_degC"'
contains "umlauts: the header's own" "$(cat utf8.toml)" 'from = "Länge (°C)"'
contains "umlauts: a unit" "$(cat utf8.toml)" 'name = "x.lange_degC"   # GUESS: context'
contains "a column of one word" "$(cat utf8.toml)" '"Köln" in every row, which teaches nothing: Ort'
for form in latin mark wide big; do
  check "umlauts: $form, proposed" "$(sed 1d utf8.toml)" "$("$RIM" schema $form.csv | sed 1d)"
  check "umlauts: $form, read" "$("$RIM" show utf8.csv --schema utf8.toml | sed 1d)" "$("$RIM" show $form.csv --schema utf8.toml | sed 1d)"
done

# Rows that a logger wrote twice: refused with the way out, which the proposal takes.
awk 'BEGIN {print "ms,s.a_m"; for (i = 0; i < 300; i++) for (k = i % 100 != 50; k < 2; k++) printf "170000000%04d,%d\n", 20 * i, i % 9}' > doubled.csv
"$RIM" schema doubled.csv > doubled.toml; check "rows twice" 0 $?
contains "rows twice: proposed" "$(cat doubled.toml)" '^not_increasing = "skip"   # DECIDE: in 3 rows the time repeats'
said=$("$RIM" show doubled.csv --schema doubled.toml 2>&1); check "rows twice: read" 0 $?
contains "rows twice: counted" "$said" '3 of 303 rows skipped, the first: row 52: column .ms.: time repeats'
contains "rows twice: used" "$said" '303 rows, 3 skipped'
grep -v not_increasing doubled.toml > strict.toml
told "rows twice: the way out" 3 'row 52: .* repeats .*not_increasing = "skip" under \[time\]' show doubled.csv --schema strict.toml
sed 's/"skip"/"drop"/' doubled.toml > wrong.toml
told "not_increasing of another value" 3 'not_increasing must be "skip" or "refuse"' show doubled.csv --schema wrong.toml
told "a page of HTML" 3 'flight.html: is a page of HTML or XML' show flight.html
contains "time that runs back" "$(times 2025-03-01T08:00:00 2025-03-01T07:59:59)" 'row 2: column .t_s.: time runs backwards'
finish
