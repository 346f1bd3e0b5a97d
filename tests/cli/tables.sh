#!/bin/bash
# SPDX-License-Identifier: MIT
# Tables as loggers and spreadsheets write them: lines above the header, a line of units below it, texts
# among numbers, switches in words, the date in a column of its own, dates of other countries, blanks as
# separators, units in other spellings. Each is proposed a schema for, read by it, and compared with
# the same table in plain CSV. The values are from a fixed formula; nothing is drawn at random.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
cat > write.py <<'END'
"""The same 200 rows at 10 Hz, as different loggers write them."""
rows = [(i / 10, i // 40 % 2, 0.5 + i % 7 / 8, 10 + i * i % 11 / 4) for i in range(200)]


def write(name, head, row, encoding="utf-8"):
    with open(name, "w", encoding=encoding, newline="") as file:
        file.write(head + "\n" + "".join(row(*r) + "\n" for r in rows))


def comma(number, digits=3):
    return f"{number:.{digits}f}".replace(".", ",")


def clock(t, start=8 * 3600):
    s = (start + t) % 86400
    return f"{int(s // 3600):02d}:{int(s // 60 % 60):02d}:{s % 60:04.1f}"


def half(t):
    s = 12 * 3600 + 59 * 60 + 50 + t
    return f"{int(s // 3600 - 1) % 12 + 1}:{int(s // 60 % 60):02d}:{s % 60:04.1f} PM"


plain = "t_s,x.lid,s.speed_mps,s.current_A"
write("plain.csv", plain, lambda t, b, v, c: f"{t:.1f},{b},{v:.3f},{c:.2f}")
write("above.csv", "Logger;Kneader 7\nSerial;0815\n\nt [s];lid;speed [m/s];current / A",
      lambda t, b, v, c: f"{comma(t, 1)};{b};{comma(v)};{comma(c, 2)}", "utf-8-sig")
write("excel.csv", "sep=;\nt [s];lid;speed, m/s;current in A",
      lambda t, b, v, c: f"{comma(t, 1)};{b};{comma(v)};{comma(c, 2)}")
write("units.csv", "time;lid;speed;current\ns;-;m/s;A", lambda t, b, v, c: f"{t:.1f};{b};{v:.3f};{c:.2f}")
write("words.csv", "time,lid,speed_m_s,current_A", lambda t, b, v, c: f"{t:.1f},{'open' if b else 'closed'},{v:.3f},{c:.2f}")
write("german.csv", "time,lid,speed [m/s],current [A]", lambda t, b, v, c: f"{t:.1f},{'WAHR' if b else 'FALSCH'},{v:.3f},{c:.2f}")
write("blanks.txt", "  time lid speed_mps current_A", lambda t, b, v, c: f"{t:9.2f}   {b}  {v:8.3f} {c:.2f} ")
write("end.csv", "time,lid,speed_mps,current_A,", lambda t, b, v, c: f"{t:.1f},{b},{v:.3f},{c:.2f},")
write("apart.csv", "Datum;Uhrzeit;lid;speed_mps;current_A",
      lambda t, b, v, c: f"{'13' if t < 10 else '14'}.04.2025;{clock(t, 86390)};{b};{v:.3f};{c:.2f}")
write("midnight.csv", "clock,lid,speed_mps,current_A", lambda t, b, v, c: f"{clock(t, 86390)},{b},{v:.3f},{c:.2f}")
write("usa.csv", "Timestamp,lid,speed_mps,current_A", lambda t, b, v, c: f"04/13/2025 {half(t)},{b},{v:.3f},{c:.2f}")
write("uk.csv", "Timestamp,lid,speed_mps,current_A",
      lambda t, b, v, c: f"{'30/04/2025' if t < 10 else '1/5/2025'} {clock(t, 86390)},{b},{v:.3f},{c:.2f}")
write("month.csv", "Timestamp,lid,speed_mps,current_A",
      lambda t, b, v, c: f"{'31-Dec-2024' if t < 10 else '1-jan-2025'} {clock(t, 86390)},{b},{v:.3f},{c:.2f}")
write("short.csv", "Timestamp,lid,speed_mps,current_A", lambda t, b, v, c: f"13.4.25 {clock(t)},{b},{v:.3f},{c:.2f}")
write("marks.csv", "time,lid,speed_mps,current_A",
      lambda t, b, v, c: f"{t:.1f},{b},{'---' if 5 < t < 5.5 else f'{v:.3f}'},{'#N/A' if t == 7 else f'{c:.2f}'}")
write("numbers.csv", "0,0,1,2", lambda t, b, v, c: f"{t:.1f},{b},{v:.3f},{c:.2f}")
write("hash.csv", "# time,lid,speed,current\n-1,0,1,2", lambda t, b, v, c: f"{t:.1f},{b},{v:.3f},{c:.2f}")
write("three.csv", "time,phase,speed_mps", lambda t, b, v, c: f"{t:.1f},{'up' if t < 5 else 'level' if t < 15 else 'down'},{v:.3f}")
write("odd.csv", "time,channel g,phase s,I_Motor / mA", lambda t, b, v, c: f"{t:.1f},{v:.3f},{c:.2f},{v * c:.3f}")
END
python3 write.py; check "tables" 0 $?
numbers() { sed 's|"path": "[^"]*"||; s|^.*"begin_s".*$||; s|^.*"end_s".*$||'; }
want=$("$RIM" show plain.csv --json | numbers)
# as_plain FILE PATTERN...: what the proposal says of it, and that it is read as the plain table is
as_plain() {
  local file=$1 said
  shift
  "$RIM" schema "$file" > mine.toml 2> err.txt; check "$file: proposed" 0 $? || cat err.txt
  said=$(cat mine.toml)
  for pattern in "$@"; do contains "$file: proposed" "$said" "$pattern"; done
  check "$file: read" "$want" "$("$RIM" show "$file" --schema mine.toml --json 2> err.txt | numbers)"
}
as_plain above.csv '^decimal = ","' '^column = "t \[s\]"' 'name = "s.current_A"'
as_plain excel.csv '^delimiter = ";"'
as_plain units.csv '^units_line = true' 'scale = 1   # to seconds, from s'
as_plain words.csv '^words = \["closed", "open"\]   # read as 0 and 1' '# values = \["closed", "open"\]' 'name = "s.speed_mps"'
as_plain german.csv '^words = \["FALSCH", "WAHR"\]'
as_plain blanks.txt '^delimiter = " "'
as_plain end.csv 'name = "s.current_A"'
check "end.csv: nothing is said of the empty column" "" "$("$RIM" schema end.csv | grep 'Left out')"
as_plain apart.csv '^date = "Datum"' '^column = "Uhrzeit"'
as_plain midnight.csv '^column = "clock"   # dates and times of day'
as_plain usa.csv 'name = "x.lid"'
as_plain uk.csv '^day_first = true'
as_plain month.csv '^column = "Timestamp"'
as_plain short.csv '^column = "Timestamp"'

"$RIM" schema marks.csv > mine.toml
contains "marks: proposed" "$(cat mine.toml)" '^missing = \["---"\]   # GUESS'
said=$("$RIM" show marks.csv --schema mine.toml 2>&1); check "marks: read" 0 $?
contains "marks: rows counted" "$said" "200 rows, 5 skipped"
contains "marks: the first named" "$said" "row 52: column 'speed_mps': '---' (line 53 of the file)"
contains "three states are left to the user" "$("$RIM" schema three.csv)" '^# words = \["up", "level", "down"\]'
said=$("$RIM" schema odd.csv)
contains "a last word that is no unit" "$said" 'name = "s.channel_g_value"'
contains "another" "$said" 'name = "s.phase_s_value"'
contains "a unit behind a stroke" "$said" 'name = "s.i_motor_mA"'

# refuse WHAT PATTERN ARGUMENT...: exit 3 and what it says
refuse() {
  local what=$1 pattern=$2
  shift 2
  "$RIM" "$@" > out.txt 2> err.txt; check "$what" 3 $?
  contains "$what: said" "$(cat err.txt)" "$pattern"
}
refuse "a header of numbers" "numbers.csv: line 1 holds numbers where the columns' names should stand: write a line of names" schema numbers.csv
refuse "a header behind a hash" "hash.csv: line 2 holds numbers .* is the comment above it the header? Take its # away" schema hash.csv
"$RIM" schema units.csv | grep -v units_line > no.toml
refuse "units that no schema names" "row 1: column 'time': 's' is not a number: is this a line of units? units_line = true .*(line 2 of the file)" show units.csv --schema no.toml
"$RIM" schema marks.csv | grep -v ^missing > no.toml
refuse "marks that no schema names" "row 52: column 'speed_mps': '---' is not a number; if it stands for no value, missing = \[\"---\"\] in a schema" show marks.csv --schema no.toml
"$RIM" schema words.csv | sed 's/"closed", "open"/"shut", "open"/' > no.toml
refuse "a word that the schema has not" "row 1: column 'lid': 'closed' is none of the words that the schema names" show words.csv --schema no.toml
printf 'schema = "rim-schema/1"\nunits_line = 1\n' > no.toml
refuse "a flag that is none" "no.toml:line 2: units_line must be true or false" show plain.csv --schema no.toml
printf 'schema = "rim-schema/1"\n[[column]]\nfrom = "a"\nname = "x.a"\nwords = ["A", "B", "A"]\n' > no.toml
refuse "a word twice" "words: 'A' is given twice" show plain.csv --schema no.toml
sed 's/04\/13/13\/04/' usa.csv > day.csv
printf 'schema = "rim-schema/1"\n[time]\ncolumn = "Timestamp"\n[[column]]\nfrom = "lid"\nname = "x.lid"\n' > no.toml
refuse "a day as a month" "'13/04/2025 .*' is not a number" show day.csv --schema no.toml
finish
