#!/bin/bash
# SPDX-License-Identifier: MIT
# Zephyr, PX4, F Prime and ROS 2: firmware/integration/X is compiled, by its own CMakeLists.txt, against declarations
# that follow the framework's documented API (tests/firmware/frameworks). None is run in its framework; that rows
# which are all refused are a silence is tried with stand-ins for it (frameworks/run). The Arduino library is
# put together, compiled and run on this machine. What its text files name exists. Skipped without cmake.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
skip_under_sanitizers "it builds by itself what it tests, without them"
cd "$here" || exit 1
check "lib/sources.txt is every source" "$(cd "$root" && LC_ALL=C ls lib/src/*/*.c)" "$(grep -v '^#' "$root/lib/sources.txt")"

if command -v cmake > /dev/null; then
  for what in zephyr px4 fprime ros2; do
    cmake -S "$root/tests/firmware/frameworks/cmake" -B $what -D WHAT=$what -D ROOT="$root" > $what.log 2>&1; check "$what: its CMakeLists.txt" 0 $?
    cmake --build $what -j2 >> $what.log 2>&1; status=$?; check "$what compiles" 0 $status
    [ $status = 0 ] || grep -A3 -i "error" $what.log | head -n 30
  done
  # The declarations are looked at: a call that the framework has not got does not compile.
  grep -v k_msgq_get "$root/tests/firmware/frameworks/zephyr/zephyr/kernel.h" > without.h
  mkdir -p other/zephyr && cp without.h other/zephyr/kernel.h
  gcc -std=c11 -Werror=implicit-function-declaration -fsyntax-only -Iother -I"$root/lib/include" -I"$root/firmware/integration/watch" -DCONFIG_RIMWATCH_MAX_VALUES=4 \
    -DCONFIG_RIMWATCH_QUEUE=4 -DCONFIG_RIMWATCH_STACK_BYTES=64 -DCONFIG_RIMWATCH_MONITOR_BYTES=64 -DCONFIG_RIMWATCH_IDLE_MS=1 -DCONFIG_RIMWATCH_PRIORITY=1 \
    "$root/firmware/integration/zephyr/rim_zephyr.c" > said 2>&1; check "a missing declaration is an error" 1 $?
  # A minute of rows that are refused, one each 50 ms: no integration may take them for news of the vehicle.
  awk 'BEGIN {printf "t_s"; for (k = 0; k < 9; k++) printf ",x.f%d", k; print ",z.o,m.o,sd.o"
    for (i = 0; i < 200; i++) {printf "%.2f", i / 20; for (k = 0; k < 10; k++) printf ",%.6f", sin(0.37 * (k + 1) * i); print ",0,1"}}' > twelve.csv
  "$RIM" replay twelve.csv --calibration-runs 19 --save-model twelve.rim > /dev/null; check "an image of rows of twelve values" 0 $?
  stubs=$root/tests/firmware/frameworks of=$root/firmware/integration
  flags="-O1 -Wall -Wextra -Werror -Wno-unused-parameter -I$stubs/run -I$root/lib/include -I$of/watch"
  sizes=$(awk '/^config RIMWATCH_/ {name = $2} /default [0-9]/ {print "-DCONFIG_" name "=" $2}' "$of/zephyr/Kconfig")
  gcc -std=c11 $flags -c "$of/watch/rim_watch.c" -o zephyr/watch.o
  gcc -std=c11 $flags $sizes -I"$stubs/zephyr" -I"$of/zephyr" "$stubs/run/zephyr.c" zephyr/watch.o "$BUILD/librim.a" -lm -o run_zephyr
  g++ -std=c++17 $flags -I"$stubs/px4" -Ipx4/generated -I"$of/px4" "$stubs/run/px4.cpp" "$of/px4/RimWatch.cpp" zephyr/watch.o "$BUILD/librim.a" -o run_px4
  g++ -std=c++17 $flags -I"$stubs/fprime" -I"$of/fprime" "$stubs/run/fprime.cpp" "$of/fprime/RimWatch.cpp" zephyr/watch.o "$BUILD/librim.a" -o run_fprime
  g++ -std=c++17 $flags -I"$stubs/ros2" -I"$of/ros2/src" "$stubs/run/ros2.cpp" zephyr/watch.o "$BUILD/librim.a" -o run_ros2
  for what in zephyr px4 fprime ros2; do
    said=$(timeout 60 ./run_$what twelve.rim | tr '\n' ' '); contains "$what: rows that are all refused are a silence" "$said" "^level [01] level 3 $"
  done
else
  echo "not here: cmake"; skipped=$((skipped + 1))
fi
python3 - "$root/firmware/integration" << 'END'; check "package.xml, module.yml and library.properties" 0 $?
import sys, xml.etree.ElementTree as tree
top = sys.argv[1]
package = tree.parse(top + "/ros2/package.xml").getroot()
depends = {d.text for d in package.findall("depend")}
text = open(top + "/ros2/CMakeLists.txt").read()
assert package.get("format") == "3" and depends == {"rclcpp", "diagnostic_msgs", "std_msgs", "std_srvs"}, depends
assert all("find_package(%s REQUIRED)" % d in text for d in depends | {"ament_cmake"})
module = dict(line.strip().split(": ") for line in open(top + "/zephyr/module.yml") if ": " in line and line[0] != "#")
assert module == {"name": "rimwatch", "cmake": "zephyr", "kconfig": "zephyr/Kconfig"}, module
properties = dict(line.strip().split("=", 1) for line in open(top + "/arduino/library.properties"))
assert properties["includes"] == "RimWatch.h" and properties["name"] == "RimWatch"
END

# Each of them lets rim_watch_tick count the silence, whichever rows are refused, and has no count of its own.
for file in arduino/src/RimWatch.h cfs/fsw/src/rim_app.c fprime/RimWatch.cpp freertos/rim_task.c px4/RimWatch.cpp ros2/src/rim_node.cpp zephyr/rim_zephyr.c; do
  grep -q 'rim_watch_tick(' "$root/firmware/integration/$file"; check "$file tells the time" 0 $?
  grep 'rim_watch_idle(' "$root/firmware/integration/$file"; check "$file counts no silence" 1 $?
done

# Arduino: rows of a recording through the sketch, on this machine.
"$root/firmware/integration/arduino/make_library.sh" library; check "the Arduino library" 0 $?
"$root/firmware/integration/arduino/make_library.sh" library 2> /dev/null; check "is not written over" 2 $?
toy_model model.rim 2> /dev/null
toy log.csv 50 900 'if (i > 400) a += 0.6'
wanted=$("$RIM" replay --model model.rim log.csv | tail -n 1)
gcc -std=c11 -I"$root/firmware" -I"$root/lib/include" -I"$root/lib/src" "$root/firmware/replay/record.c" -o record "$BUILD/librim.a" &&
  ./record model.rim log.csv toy.rec; check "a recording" 0 $?
{ echo 'alignas(8) const unsigned char model_rim[] = {'; od -An -v -tu1 model.rim | sed 's/  */,/g; s/^,//; s/$/,/'; echo '};'
  echo "const unsigned int model_rim_len = $(stat -c %s model.rim);"; } > model.h
cp library/examples/RimWatch/RimWatch.ino RimWatch.ino.cpp
flags="-Wall -Wextra -Werror -ffp-contract=off -fno-math-errno"
for source in library/src/*.c library/src/*/*.c; do echo "$source"; done | xargs -P2 -n 8 gcc -std=c11 $flags -Ilibrary/src -c; check "its C compiles" 0 $?
g++ -std=c++17 $flags -I. -Ilibrary/src -I"$root/tests/firmware/frameworks/arduino" -I"$root/firmware" -DRECORDING="\"$here/toy.rec\"" \
  "$root/tests/firmware/frameworks/arduino/board.cpp" "$root/firmware/replay/recording.S" ./*.o -o sketch > built 2>&1; check "the sketch compiles" 0 $?
head -n 20 built
said=$(timeout 60 ./sketch); check "and runs" 0 $?
contains "every row" "$said" "^rows 900$"
contains "it tells the alarm" "$said" "^raised ERROR: .* s.position_a_m "
contains "rows that are all refused for their time are a silence" "$said" "^refused for their time: level 3$"
contains "whose clock began again is used when that is told" "$said" "^told that it began again: level 0$"
contains "rows that are all too short are a silence" "$said" "^refused for their length: level 3$"
check "with the digest of rim replay" "$wanted" "$(printf '%s\n' "$said" | tail -n 1)"
finish
