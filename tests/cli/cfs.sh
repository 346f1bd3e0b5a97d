#!/bin/bash
# SPDX-License-Identifier: MIT
# The monitor as an application of NASA's core Flight System (firmware/integration/cfs), built and run with cFE:
# the same rows give the digest and the alarms of `rim replay`; its table is validated; its commands are
# obeyed or refused. Skipped where cFS's sources, cmake or a message queue of its own are not. cFE is built
# once, in $BUILD/frameworks.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
archive=${FRAMEWORKS:-$root/../shared/frameworks}/cfs.tar.xz
skip_under_sanitizers "it builds by itself what it tests, without them"
[ -r "$archive" ] || skip "no sources of cFS: $archive"
command -v cmake > /dev/null || skip "no cmake"
# cFE's pipes want longer queues than Linux's default: in an IPC namespace of our own.
own="unshare -i sh -c"
$own 'echo 1024 > /proc/sys/fs/mqueue/msg_max' 2> /dev/null || own="unshare -r -i sh -c"
if ! $own 'echo 1024 > /proc/sys/fs/mqueue/msg_max' 2> /dev/null; then
  skip "no longer message queues (unshare -i)"
fi
cd "$here" || exit 1
toy_model toy.rim 2> /dev/null
toy log.csv 50 900 'if (i > 400) a += 0.6'
wanted=$("$RIM" replay --model toy.rim log.csv --alarms alarms.jsonl | tail -n 1)
gcc -std=c11 -O2 -I"$root/firmware" -I"$root/lib/include" -I"$root/lib/src" "$root/firmware/replay/record.c" -o record "$BUILD/librim.a" &&
  ./record toy.rim log.csv toy.rec; check "a recording" 0 $?

mission=$BUILD/frameworks/cfs
# Without its own tests and the stubs for them, which are a third of what it compiles.
if [ ! -e "$mission/without_tests" ]; then
  rm -rf "$mission"; mkdir -p "$mission/apps" && tar xJf "$archive" -C "$mission" && cp "$mission/cfe/cmake/Makefile.sample" "$mission/Makefile" &&
    cp -r "$mission/cfe/cmake/sample_defs" "$mission" &&
    sed -i -e 's/^list(APPEND MISSION_GLOBAL_APPLIST.*/list(APPEND MISSION_GLOBAL_APPLIST rim_app rim_player)/' \
      -e 's/^SET(cpu[12]_APPLIST .*/SET(cpu1_APPLIST )/' "$mission/sample_defs/targets.cmake" &&
    sed -i '/^list(APPEND MISSION_GLOBAL_APPLIST cfe_assert cfe_testcase)/d' "$mission/cfe/cmake/mission_defaults.cmake" &&
    sed -i -E 's/^add_subdirectory\((ut_assert|src\/ut-stubs ut-stubs)\)/add_subdirectory(\1 EXCLUDE_FROM_ALL)/' "$mission/osal/CMakeLists.txt" &&
    touch "$mission/without_tests"
fi
ln -sfn "$root/firmware/integration/cfs" "$mission/apps/rim_app"
ln -sfn "$root/tests/firmware/cfs" "$mission/apps/rim_player"
cat > "$mission/sample_defs/cpu1_cfe_es_startup.scr" << 'END'
CFE_APP, rim_app,    RIM_APP_Main,    RIM_APP,    50, 65536, 0x0, 0;
CFE_APP, rim_player, RIM_PLAYER_Main, RIM_PLAYER, 60, 65536, 0x0, 0;
!
END
cp toy.rim "$mission/toy.rim"
# CMake takes CC for one word; a compiler behind a launcher is still that compiler.
(cd "$mission" && export RIM_IMAGE=$mission/toy.rim CC=${CC##* } && unset MAKEFLAGS MFLAGS MAKELEVEL &&
  make SIMULATION=native prep && make -j2 && make install) > built 2>&1
status=$?; check "cFE and the application build" 0 $status
[ $status = 0 ] || { grep -i -A5 "error" built | head -n 40; finish; }
cp -r "$mission/build/exe/cpu1" cpu1 && cp toy.rec cpu1/cf/
python3 - cpu1/cf << 'END'
import sys
whole = bytearray(open(sys.argv[1] + "/rim_image.tbl", "rb").read())
whole[3000] ^= 1
open(sys.argv[1] + "/rim_bad.tbl", "wb").write(whole)
END
(cd cpu1 && timeout 200 $own 'echo 1024 > /proc/sys/fs/mqueue/msg_max; exec ./core-cpu1') > said 2>&1 < /dev/null
said=$(tr -d '\r' < said)
line() { printf '%s\n' "$said" | grep "^player $1: " | sed -n "${2:-1}p"; }
contains "it comes to its end" "$said" "^player done"
contains "every row" "$(line played)" "rows 900 refused 0 records $(wc -l < alarms.jsonl) level 2"
check "the digest of rim replay" "$wanted" "$(line played | grep -o 'digest .*')"
contains "the event has words" "$said" "RIM_APP 4: RIM: raised ERROR: .* s.position_a_m .* m (sd "
contains "rows of another length are refused" "$(line 'wrong rows')" "rows 900 refused 2"
contains "commands: one obeyed, two refused" "$(line commands)" "commands 1 errors 2"
contains "an alarm that does not stand is not cleared" "$(line 'clear another')" "level 2 commands 1 errors 3"
contains "the alarm is cleared" "$(line clear)" "level 0 commands 2 errors 3"
contains "and says so" "$said" "RIM_APP 5: RIM: cleared OK"
contains "a damaged image is refused by the validation" "$(line 'damaged table')" "images 1 refused_images 1 loaded 1"
contains "and by cFE" "$said" "validation failed for RIM_APP.Image"
contains "a good one takes its place" "$(line 'new table')" "rows 0 refused 0 records 0 level 3 .*images 2 refused_images 1 loaded 1"
check "and decides the same" "$wanted" "$(line played 2 | grep -o 'digest .*')"
contains "rows that are all refused are a silence" "$(line 'old rows')" "level 3 "
printf '%s\n' "$said" | python3 - alarms.jsonl said << 'END'; check "the packets are the alarms of rim replay" 0 $?
import json, sys
alarms = [json.loads(line) for line in open(sys.argv[1])]
packets = [line.split()[2:] for line in open(sys.argv[2], errors="replace") if line.startswith("player record")]
states, levels, kinds = ["", "raised", "updated", "cleared"], ["OK", "WARN", "ERROR", "STALE"], ["shift", "gain", "variance", "drift"]
outcomes = ["s.position_a_m", "s.position_b_m", "s.speed_mps"]
assert alarms
for a, p in zip(alarms, packets):
    name = a["channels"][0]
    want = [a["seq"], a["state"], a["level"], a["kind"], name, a["t_s"], a["since_s"], a["shift"][name], a["shift_sd"][name]]
    have = [int(p[0]), states[int(p[1])], levels[int(p[2])], kinds[int(p[3])], outcomes[int(p[4])]] + [float(x) for x in p[5:]]
    assert want == have, (want, have)
END
[ "$failed" = 0 ] || tail -n 60 said
finish
