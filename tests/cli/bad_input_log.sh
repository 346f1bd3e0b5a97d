#!/bin/bash
# SPDX-License-Identifier: MIT
# Bad logs into `rim train`: file, row, column and reason on stderr, exit 3, no model left behind.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
has_command train || skip "no rim train"

good() { # good NAME: a small healthy log of 400 rows
  awk -v seed="$2" 'BEGIN {srand(seed); print "t_s,u.c,s.a_m,s.b_mps"; a = 0
    for (i = 0; i < 400; i++) {c = sin(i / 30); a += 0.05 * c; printf "%.2f,%.6f,%.6f,%.6f\n", i * 0.05, c, a + 0.01 * rand(), c + 0.01 * rand()}}' > "$1"
}
for i in 1 2 3 4; do good "ok$i.csv" "$i"; done

refused() { # refused WHAT FILE PATTERN...
  local what=$1 file=$2 err rc; shift 2
  err=$("$RIM" train ok1.csv ok2.csv ok3.csv ok4.csv "$file" --out model.rim 2>&1 >/dev/null); rc=$?
  check "$what: exit status" 3 "$rc"
  for pattern in "$file" "$@"; do contains "$what" "$err" "$pattern"; done
  [ -z "$(find . -name 'model.rim*')" ]; check "$what: nothing left behind" 0 $?
}

refused "a missing file" missing.csv "No such file"
mkdir folder; refused "a folder" folder "is a folder"
: > empty.csv; refused "an empty file" empty.csv "is empty"
head -1 ok1.csv > header.csv; refused "a header alone" header.csv "no rows"
sed 's/t_s/time/' ok1.csv > notime.csv; refused "no time" notime.csv "column 't_s'"
sed '4s/,[^,]*$//' ok1.csv > short.csv; refused "a short row" short.csv "row 3" "3 fields"
head -c 3000 ok1.csv | sed '$s/,[^,]*$//' | head -c -1 > cut.csv; refused "a file cut off" cut.csv "row [0-9]*" "fields"
sed '6s/,[^,]*$/,abc/' ok1.csv > text.csv; refused "text in a number" text.csv "row 5: column 's.b_mps': 'abc'"
awk -F, 'NR==10{print; print; next} {print}' ok1.csv > again.csv; refused "time that repeats" again.csv "row 10: column 't_s'" "repeats"
awk -F, -v OFS=, 'NR==10{$1=0.1} {print}' ok1.csv > back.csv; refused "time that runs backwards" back.csv "row 9: column 't_s'" "backwards"
noise 32 2000 > noise.csv; printf '\0' >> noise.csv; refused "binary noise" noise.csv "noise.csv"

sed -e '7s/,[^,]*$/,nan/' -e '9s/,[^,]*$/,/' -e '11s/,[^,]*$/,inf/' ok4.csv > holes.csv
err=$("$RIM" train ok1.csv ok2.csv ok3.csv ok4.csv holes.csv --out model.rim 2>&1 >/dev/null)
check "a log with holes is used" 0 $?
contains "skipped rows are counted" "$err" "holes.csv: 3 of 400 rows skipped"
contains "the first is named" "$err" "row 6: column 's.b_mps'"
finish
