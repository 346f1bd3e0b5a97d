#!/bin/bash
# SPDX-License-Identifier: MIT
# SocketCAN for real: Debian's kernel in QEMU with two emulated controllers on one bus and virtual ones; rimd
# inside (tests/firmware/guest_init.sh). Also: the log of the wire by cantools, where Python has it.
# A machine without QEMU, busybox, can-utils or the kernel package skips it; `make test-can` installs them.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
skip_under_sanitizers "the guest system has not their libraries"
kernel=$(ls -t "$BUILD"/can/linux-image-*.deb 2> /dev/null | head -n 1)
for program in qemu-system-x86_64 busybox candump canplayer cpio; do
  command -v $program > /dev/null || missing="$missing $program"
done
if [ -n "$missing" ] || [ -z "$kernel" ]; then
  skip "no${missing:- kernel package}; make test-can installs what it needs"
fi
python=python3
[ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
cd "$here" || exit 1
toy_model plain.rim
toy biased.csv 102 1200 'if (x > 1) v += 0.5' # in a place, so that a plan may enter it
"$RIM" can-table --dbc "$root/tests/firmware/toy.dbc" --map "$root/tests/firmware/toy.toml" --model plain.rim --out toy.rim > said
check "can-table" 0 $?
python3 "$root/tests/firmware/toy_can.py" biased.csv > biased.candump || bad "candump"
awk -F, -v OFS=, 'NR == 1 || NR < 300 {if (NR > 1) $1 += 60; print}' biased.csv > later.csv
python3 "$root/tests/firmware/toy_can.py" later.csv > again.candump
gcc -std=gnu11 -Wall -Wextra -Werror "$root/tests/firmware/send_datagram.c" -o send_datagram || bad "send_datagram"
python3 - "$root" << 'END' || bad "plan"
import struct, sys
sys.path.insert(0, sys.argv[1] + "/tests/firmware")
from bus import MESSAGE, plan_message
poses = [(float(i), -20.0 + i, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0) for i in range(41)]
open("plan.datagram", "wb").write(struct.pack(">II", MESSAGE, 0) + b"RIM_PLAN\0" +
                                  plan_message(sys.argv[1] + "/lib/wire", 59950000, 3, poses))
END
"$root/tests/firmware/guest.sh" "$BUILD/can" "$kernel" "$BUILD/rim" "$BUILD/rimd" toy.rim biased.candump again.candump plan.datagram \
  send_datagram \
  "$root/tests/firmware/guest_init.sh" || { bad "the guest cannot be made"; finish; }
# The guest's clock counts its instructions and jumps where it sleeps (-icount): a machine that is busy elsewhere makes the
# test longer and changes nothing in it. It takes some 20 s on an idle one. What the kernel need not do is left out.
timeout 540 qemu-system-x86_64 -M q35 -m 512 -nodefaults -display none -serial stdio -no-reboot -icount shift=0,sleep=off -kernel "$BUILD/can/vmlinuz" -initrd "$BUILD/can/initramfs.cpio" \
  -append "console=ttyS0 quiet panic=-1 mitigations=off nokaslr audit=0 tsc=reliable no_timer_check cryptomgr.notests numa=off" -object can-bus,id=cb -device kvaser_pci,canbus=cb \
  -device kvaser_pci,canbus=cb < /dev/null 2>&1 | tr -d '\r' > console
cp console "$BUILD/can/console"
contains "the guest came to its end" "$(tail -n 30 console)" "^guest done"
passed=$((passed + $(grep -c '^ok ' console)))
failed=$((failed + $(grep -c '^FAILED ' console)))
grep '^FAILED ' console
for name in heard.jsonl wire.candump fd.jsonl fd.candump replay.jsonl; do awk -v n="== $name" '$0 == n {on=1; next} $0 == "== end" {on=0} on' console > "$name"; done

# What was heard is what the ground finds in the same frames.
"$RIM" replay --model toy.rim biased.candump --alarms ground.jsonl --candump ground.frames --node 5 > said 2>&1; check "the log replays" 0 $?
python3 "$root/tests/firmware/same_alarms.py" ground.jsonl heard.jsonl > said; check "the alarms of the ground" 0 $?
cat said
python3 "$root/tests/firmware/same_frames.py" 5 ground.frames wire.candump > said 2>&1; check "and their bytes" 0 $?
cat said
python3 "$root/tests/firmware/same_alarms.py" ground.jsonl replay.jsonl > said; check "the replay's alarms" 0 $?
# Someone else's program reads our frames by our DBC.
if has_packages $python cantools; then
  $python "$root/tests/firmware/decode_can.py" "$root/lib/wire" wire.candump heard.jsonl fd.candump fd.jsonl > said 2>&1; check "cantools" 0 $?
  cat said
else
  skipped=$((skipped + 1))
fi
finish
