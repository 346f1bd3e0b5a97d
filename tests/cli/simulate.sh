#!/bin/bash
# SPDX-License-Identifier: MIT
# simulate.sh: `rim simulate` end to end. $RIM is the program; prints 'N passed, N failed'.
set -u
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
passed=0 failed=0

is() { # is NAME COMMAND...: the command must succeed
  local name=$1; shift
  if "$@" > step.out 2> step.err; then passed=$((passed + 1)); else
    failed=$((failed + 1)); echo "FAILED: $name"; cat step.out step.err; fi
}
refuses() { # refuses NAME STATUS WORDS COMMAND...: exit status, and WORDS on stderr
  local name=$1 status=$2 words=$3; shift 3
  "$@" > step.out 2> step.err < /dev/null
  local got=$?
  if [ $got -eq "$status" ] && grep -qF -- "$words" step.err && [ ! -s step.out ]; then
    passed=$((passed + 1))
  else failed=$((failed + 1)); echo "FAILED: $name: status $got"; cat step.out step.err; fi
}
no() { ! "$@"; }

is "two landings" "$RIM" simulate lander --out a --runs 2 --seed 9
is "29 columns and the time" test "$(head -1 a/run_0001.csv | tr , '\n' | grep -c '^[us]\.')" = 29
is "time first" grep -q '^t_s,u.throttle_1,' a/run_0001.csv
rows=$(($(wc -l < a/run_0001.csv) - 1))
is "8200 to 8600 rows" test "$rows" -ge 8200 -a "$rows" -le 8600
is "nothing but logs and the record" test "$(ls a | tr '\n' ' ')" = "run_0001.csv run_0002.csv simulate.toml "
is "one run of it" "$RIM" simulate lander --out b --runs 1 --first 2 --seed 9
is "does not depend on the others" cmp a/run_0002.csv b/run_0002.csv
is "on one thread" env RIM_THREADS=1 "$RIM" simulate lander --out c --runs 2 --seed 9
is "same as on two" cmp a/run_0002.csv c/run_0002.csv
is "another seed" "$RIM" simulate lander --out d --seed 10
is "gives another run" no cmp -s a/run_0001.csv d/run_0001.csv
is "from its record" "$RIM" simulate lander --out e --seed 9 --params a/simulate.toml
is "the same run" cmp a/run_0001.csv e/run_0001.csv
is "few rows" "$RIM" simulate lander --out f --seed 9 --rows 10
is "the first ten" cmp f/run_0001.csv <(head -11 a/run_0001.csv)

is "a shipped effect, with truth" "$RIM" simulate lander --out g --seed 9 --runs 2 \
  --effect 10_radar_high --effect 04_doppler_scale --truth truth.csv
is "truth has every row" test "$(wc -l < truth.csv)" = \
  $(($(cat g/run_0001.csv g/run_0002.csv | wc -l) - 1))
is "and says where" grep -q '^g/run_0001.csv,1,0,1$' truth.csv
is "columns without effect are as before" cmp <(cut -d, -f1-13 a/run_0001.csv) <(cut -d, -f1-13 g/run_0001.csv)
is "the logs do not tell" no grep -riq 'radar_high\|effect ' g
is "no truth among the logs" test ! -e g/truth.csv
is "truth one a log" "$RIM" simulate lander --out g --seed 9 --effect 02_thrust_loss --truth truths/
is "acts while thrusting only" test "$(awk -F, 'NR > 1 && $4 == 1 && !first {first = $2} END {print (first > 6500 && first < 7000)}' truths/run_0001.csv)" = 1
cat > mine.toml <<'T'
name = "mass reads low below 5 km"
description = "Example of data/README.md."
[[term]]
target = "sensor"
sensor = "s.mass_kg"
kind = "bias"
gate = { altitude_m = [0.0, 5000.0] }
multiple = -6.0
dispersion = "bias_sd"
T
is "an effect of one's own" "$RIM" simulate lander --out h --seed 9 --effect mine.toml
is "acts on the mass" test "$(paste -d, <(tail -6 a/run_0001.csv | cut -d, -f25) <(tail -6 h/run_0001.csv | cut -d, -f25) |
  head -5 | awk -F, '{d += $1 - $2} END {printf "%.1f", d / 5}')" = 6.0

is "golf" "$RIM" simulate golf --out i --seed 3 --dims 12 --truth golf.csv
is "golf columns" test "$(head -1 i/run_0001.csv)" = \
  "t_s,$(printf 'x.f%03d,' 1 2 3 4 5 6 7 8 9 10 11 12)z.reward,m.reward,sd.reward"
is "thirty anomalous shots" test "$(grep -c ',1$' golf.csv)" = 30
is "golf without a bump" "$RIM" simulate golf --out j --no-bump --shots 77 --truth golf.csv
is "77 shots" test "$(wc -l < j/run_0001.csv)" = 78
is "none anomalous" test "$(grep -c ',1$' golf.csv)" = 0
is "binary golf" "$RIM" simulate golf --out k --variant binary
is "rewards 0 and 1" test "$(tail -n +2 k/run_0001.csv | cut -d, -f4 | sort -u | tr '\n' ' ')" = "0 1 "

is "a better region" "$RIM" simulate golf --out l --seed 3 --better --truth better.csv
is "rewards there are above what is expected" test 1 = "$(awk -F, 'NR == FNR { f[FNR] = $4; next }
  FNR > 1 && f[FNR] == 1 { d += $4 - $5; n++ } END { print (n > 9 && d / n > 0.1 && d / n < 0.3) }' better.csv l/run_0001.csv)"
is "shots at a goalie" "$RIM" simulate goalie --out m --runs 2 --seed 3 --goalie region --truth shots.csv
is "its columns" test "t_s,x.ball_m,u.aim_m,z.reward_m,m.reward_m,sd.reward_m" = "$(head -1 m/run_0001.csv)"
is "runs differ" no cmp -s m/run_0001.csv m/run_0002.csv
is "what the region concedes is the finding" test 1 = "$(awk -F, 'NR == FNR { f[FNR] = $4; next }
  FNR > 1 { d = $4 - $5; bad += (f[FNR] == 1) != (d > 0.2) } FNR > 1 { n += f[FNR] } END { print (bad == 0 && n > 3) }' <(head -101 shots.csv) m/run_0001.csv)"
is "from its record" "$RIM" simulate goalie --out n --seed 3 --runs 2 --params m/simulate.toml
is "the same shots" cmp -s m/run_0002.csv n/run_0002.csv
is "free kicks" "$RIM" simulate freekick --out o --seed 3 --rows 30 --defence angle
is "30 kicks" test 31 = "$(wc -l < o/run_0001.csv)"
is "another defence, its record" "$RIM" simulate freekick --out p --seed 3 --rows 30 --params o/simulate.toml
is "other goals, the same kicks" test 1 = "$(cut -d, -f1-4,6 o/run_0001.csv | cmp -s - <(cut -d, -f1-4,6 p/run_0001.csv) && ! cmp -s o/run_0001.csv p/run_0001.csv && echo 1)"
refuses "a goalie that is none" 2 "goalie 'lazy'" "$RIM" simulate goalie --out x --goalie lazy
refuses "a goalie's defence" 2 "--defence" "$RIM" simulate goalie --out x --defence time
refuses "a better region without a bump" 2 "--better" "$RIM" simulate golf --out x --no-bump --better
is "help" "$RIM" simulate --help
is "help ends in an example" test "$("$RIM" simulate --help | sed '/^$/d' | tail -1)" = \
  "  rim simulate golf --out golf --runs 1 --seed 7 --dims 10"
refuses "no world" 2 "WORLD" "$RIM" simulate --out x
refuses "unknown world" 2 "mars" "$RIM" simulate mars --out x
refuses "no folder" 2 "--out" "$RIM" simulate lander
refuses "no runs" 2 "--runs" "$RIM" simulate lander --out x --runs 0
refuses "runs that are no number" 2 "--runs" "$RIM" simulate lander --out x --runs two
refuses "negative seed" 2 "--seed" "$RIM" simulate lander --out x --seed -1
refuses "unknown option" 2 "--wind" "$RIM" simulate lander --out x --wind 3
refuses "golf option for the lander" 2 "--dims" "$RIM" simulate lander --out x --dims 3
refuses "effect for golf" 2 "--effect" "$RIM" simulate golf --out x --effect 01_rate_zeros
refuses "one dimension" 2 "--dims" "$RIM" simulate golf --out x --dims 1
touch file
refuses "out is a file" 3 "file" "$RIM" simulate lander --out file
refuses "effect is missing" 3 "nowhere.toml" "$RIM" simulate lander --out x --effect ./nowhere.toml
refuses "effect is a folder" 3 "a" "$RIM" simulate lander --out x --effect ./a
refuses "effect is no TOML" 3 "run_0001.csv" "$RIM" simulate lander --out x --effect a/run_0001.csv
echo 'kind = 3' > bad.toml
refuses "unknown key in an effect" 3 "bad.toml:line 1: unknown key 'kind'" \
  "$RIM" simulate lander --out x --effect bad.toml
printf '[engine]\nthrust = 3\n' > bad.toml
refuses "unknown key in parameters" 3 "bad.toml:line 2: unknown key 'engine.thrust'" \
  "$RIM" simulate lander --out x --params bad.toml
printf '[golf]\nmin_region_fraction = 0.99\n' > bad.toml
refuses "parameters that allow no bump" 3 "bad.toml" "$RIM" simulate golf --out x --params bad.toml
refuses "truth cannot be written" 3 "nodir/t.csv" "$RIM" simulate lander --out x --rows 5 --truth nodir/t.csv

# One record stands for all runs of a folder: it is said where others stay beside it.
said() { cp step.err said.err; grep -c "warning: f holds 2 runs of another world, seed, version or parameters" said.err; }
is "more of the same" "$RIM" simulate lander --out f --seed 9 --rows 10 --first 2 --runs 2
is "nothing to say of those" test "$(said)" = 0
for other in "lander --seed 8 --rows 10" "lander --seed 9 --rows 11" "golf --seed 9"; do
  is "a folder in use: $other" "$RIM" simulate $other --out f
  is "a folder in use: it is said" test "$(said)" = 1
done
rm f/simulate.toml
is "runs without a record" "$RIM" simulate lander --out f --seed 8 --rows 10
is "runs without a record: it is said" test "$(said)" = 1
is "all of them again" "$RIM" simulate lander --out f --seed 9 --rows 10 --runs 3
is "nothing to say then" test "$(said)" = 0
refuses "truth over its own logs" 2 "name the same file" "$RIM" simulate golf --out i2 --truth i2
refuses "truth over its own logs, with a slash" 2 "name the same file" "$RIM" simulate golf --out i2 --truth i2/
refuses "truth in the place of a log" 2 "--out i2 writes this file itself" \
  "$RIM" simulate golf --out i2 --truth ./i2/run_0001.csv
refuses "labels in the place of the record" 2 "--out i2/ writes this file itself" \
  "$RIM" simulate cobot --rows 5 --out i2/ --labels i2/simulate.toml
is "none of these wrote" test ! -e i2
is "truth beside the logs" "$RIM" simulate golf --out i3 --truth i3/run_0002.csv
is "nothing half written" test -z "$(find . -name '*.tmp.*')"

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
