#!/bin/bash
# SPDX-License-Identifier: MIT
# What a hostile or broken sender on rimd's bus can do, while an alarm stands: tests/firmware/attack_test.py tries.
# Whether rimd keeps to its interface is tried in a network of its own, where this machine lets us.
# Mostly waits.
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
[ -x "$BUILD/rimd" ] || { bad "no $BUILD/rimd"; finish; }
cd "$here" || exit 1
toy_model toy.rim
toy long.csv 102 9000 'if (x > 1) v += 0.5'
take() { # NAME: the checks of a Python test
  sed '$d' "$1"
  read -r p f s < <(awk 'END {if (match($0, /^[0-9]+ passed, [0-9]+ failed/)) print $1+0, $3+0, (NF > 4 ? $5 : 0); else print 0, 1, 0}' "$1")
  [ "$p" = 0 ] && cat "$1"
  passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
}
attack="python3 $root/tests/firmware/attack_test.py $BUILD/rimd $root/lib/wire ."
$attack > attack.txt 2>&1; take attack.txt
network='ip link set lo up && ip link add rim0 type veth peer name rim1 && ip addr add 10.9.9.1/24 dev rim0 && ip link set rim1 up && ip link set rim0 up multicast on'
if command -v ip unshare > /dev/null && unshare -n sh -c "$network" 2> /dev/null; then
  unshare -n sh -c "$network && exec $attack 10.9.9.1" > confined.txt 2>&1; take confined.txt
else
  echo "not here: a network of its own (unshare -n, ip link add type veth)"; skipped=$((skipped + 1))
fi
finish
