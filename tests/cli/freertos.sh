#!/bin/bash
# SPDX-License-Identifier: MIT
# The monitor as a FreeRTOS task (firmware/integration/freertos), without a heap: on the kernel's POSIX
# port, and on its Cortex-M7 port in QEMU. The same rows give the digest and the alarms of `rim replay`.
# Skipped where the kernel's sources are not; the Cortex-M7 also where its compiler or QEMU is not.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
archive=${FRAMEWORKS:-$root/../shared/frameworks}/freertos.tar.xz
skip_under_sanitizers "it builds by itself what it tests, without them"
[ -r "$archive" ] || skip "no sources of FreeRTOS: $archive"
cd "$here" || exit 1
tar xJf "$archive" FreeRTOS-Kernel/tasks.c FreeRTOS-Kernel/list.c FreeRTOS-Kernel/queue.c FreeRTOS-Kernel/include \
  FreeRTOS-Kernel/portable/ThirdParty/GCC/Posix FreeRTOS-Kernel/portable/GCC/ARM_CM7 || bad "the sources"
kernel=$here/FreeRTOS-Kernel
toy_model toy.rim
toy log.csv 50 900 'if (i > 400) a += 0.6'
wanted=$("$RIM" replay --model toy.rim log.csv --alarms alarms.jsonl | tail -n 1)
gcc -std=c11 -O2 -I"$root/firmware" -I"$root/lib/include" -I"$root/lib/src" "$root/firmware/replay/record.c" -o record "$BUILD/librim.a" &&
  ./record toy.rim log.csv toy.rec; check "a recording" 0 $?

task="$root/tests/firmware/freertos/main.c $root/firmware/integration/freertos/rim_task.c $root/firmware/integration/watch/rim_watch.c"
flags="-O2 -ffp-contract=off -Wall -Wextra -Wconversion -Wshadow -Werror -DRECORDING=\"$here/toy.rec\" -I$root/tests/firmware/freertos -I$root/firmware/integration/watch -I$root/firmware/integration/freertos -I$root/firmware -I$root/lib/include -I$root/lib/src -isystem $kernel/include"
shared="$kernel/tasks.c $kernel/list.c $kernel/queue.c"

# equal NAME SAID: what a run printed against the ground
equal() {
  contains "$1: every row" "$2" "^rows 900$"
  contains "$1: a damaged image is refused" "$2" "^not data of this kind: a damaged image$"
  contains "$1: a row too long is refused" "$2" "^refused 1$"
  contains "$1: a command for no alarm is refused" "$2" "^commands_refused 1$"
  contains "$1: no record is lost" "$2" "^dropped 0$"
  contains "$1: the level" "$2" "^level 2$"
  contains "$1: rows that are all refused are a silence" "$2" "^level of refused rows 3$"
  check "$1: the digest of rim replay" "$wanted" "$(printf '%s\n' "$2" | grep '^digest ')"
  printf '%s\n' "$2" | sed -n 's/^record //p' > records
  python3 - alarms.jsonl records << 'END'; check "$1: its alarms" 0 $?
import json, sys
alarms = [json.loads(line) for line in open(sys.argv[1])]
lines = open(sys.argv[2]).read().splitlines()
def words(a):
    name = a["channels"][0]
    return "%s %s: %s %s %+.4f m (sd %.4f) since %.4f s" % (
        a["state"], a["level"], a["kind"], name, a["shift"][name], a["shift_sd"][name], a["since_s"])
assert alarms and lines == [words(a) for a in alarms], (lines, [words(a) for a in alarms])
END
}

posix=$kernel/portable/ThirdParty/GCC/Posix
# The kernel itself is compiled with its own warnings, not ours.
objects=
for source in $task; do
  gcc -std=c11 $flags -isystem "$posix" -c "$source" -o "$(basename "$source" .c).o" || bad "$source does not compile"
  objects="$objects $(basename "$source" .c).o"
done
gcc -O2 -w -DRECORDING="\"$here/toy.rec\"" -I"$root/tests/firmware/freertos" -I"$root/firmware" -I"$root/lib/include" -I"$kernel/include" -I"$posix" -I"$posix/utils" \
  $objects $shared "$posix/port.c" "$posix/utils/wait_for_event.c" "$root/firmware/port/linux/port.c" "$root/firmware/replay/recording.S" \
  "$BUILD/librim.a" -Wl,-Map=map.txt -lpthread -o posix; check "the POSIX port builds" 0 $?
said=$(timeout 120 ./posix); check "the POSIX port runs" 0 $?
equal "POSIX" "$said"
nm posix | grep -w -e pvPortMalloc > said; check "no heap of the kernel" 1 $?

for program in arm-none-eabi-gcc qemu-system-arm; do command -v $program > /dev/null || missing="$missing $program"; done
if [ -n "$missing" ]; then skip "no$missing: the Cortex-M7 is left out"; fi
board=$root/firmware/port/mps2-an500
core="-mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-d16 -ffreestanding -isystem $root/firmware/port/bare -isystem $root/tests/firmware/freertos/bare"
arm7=$kernel/portable/GCC/ARM_CM7/r0p1
# What of the library the POSIX port was linked from: no more of it is compiled again.
library=
for member in $(sed -n 's|.*librim\.a(\(.*\)\.o)$|\1|p' map.txt | sort -u); do library="$library $(echo "$root"/lib/src/*/"$member.c")"; done
objects=
for source in $task "$board/port.c"; do
  arm-none-eabi-gcc -std=c11 $core $flags -isystem "$arm7" -c "$source" -o "m7_$(basename "$source" .c).o" || bad "$source does not compile for the Cortex-M7"
  objects="$objects m7_$(basename "$source" .c).o"
done
arm-none-eabi-gcc $core -O2 -w -ffp-contract=off -fno-math-errno -fno-tree-slp-vectorize -fno-tree-loop-distribute-patterns -DRECORDING="\"$here/toy.rec\"" \
  -I"$root/tests/firmware/freertos" -I"$root/lib/include" -I"$root/lib/src" -I"$root/firmware" -I"$kernel/include" -I"$arm7" -nostdlib -static -T "$board/link.ld" \
  $objects $shared "$arm7/port.c" "$root/firmware/port/bare/memory.c" "$root/firmware/replay/recording.S" $library \
  -lgcc -o m7.elf; check "the Cortex-M7 port builds" 0 $?
said=$(timeout 300 qemu-system-arm -M mps2-an500 -display none -monitor none -serial stdio -semihosting-config enable=on,target=native -kernel m7.elf < /dev/null | tr -d '\r')
equal "Cortex-M7" "$said"
finish
