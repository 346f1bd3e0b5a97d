#!/bin/bash
# SPDX-License-Identifier: MIT
# debian.sh FOLDER: the packages that `make deb` left in FOLDER are installed into a Debian 12 that has nothing
# else, used there as their users would, and removed. Needs root, a network and debootstrap: some 5
# minutes. `make test-deb` runs it; `make test` does not. DEBIAN_MIRROR names another mirror.
. "$(dirname "$0")/../cli/check.inc"
source=$(cd "$(dirname "$0")/../.." && pwd)
packages=$(cd "$1" && pwd) root=$here/debian
if [ "$(id -u)" != 0 ]; then echo "debian.sh: needs root, for chroot" >&2; exit 3; fi
trap 'umount "$root/proc" 2> /dev/null; rm -rf --one-file-system "$here"' EXIT

if command -v lintian > /dev/null; then
  # The first upload of a package to Debian closes a wish of someone there: these were not uploaded.
  said=$(lintian --fail-on error,warning --suppress-tags initial-upload-closes-no-bugs,pkg-config-unavailable-for-cross-compilation \
    "$packages"/*.deb 2>&1); check "lintian: no error and no warning" 0 $?
  printf '%s\n' "$said" | grep '^[EW]:'
fi
debootstrap --variant=minbase bookworm "$root" "${DEBIAN_MIRROR:-http://deb.debian.org/debian}" > "$here/debootstrap.txt" 2>&1 ||
  { tail -n 3 "$here/debootstrap.txt" >&2; echo "debian.sh: no fresh Debian" >&2; exit 3; }
mount -t proc proc "$root/proc" 2> /dev/null
cp /etc/resolv.conf "$root/etc/resolv.conf" 2> /dev/null
[ ! -e "$root/usr/bin/python3" ] && [ ! -e "$root/usr/bin/gcc" ]; check "the fresh Debian is bare" 0 $?
mkdir "$root/debs" "$root/try" && cp "$packages"/*.deb "$root/debs/"
inside() { chroot "$root" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
  ${http_proxy:+http_proxy="$http_proxy"} sh -c "cd /try && $1"; }

inside 'find / -xdev -path /debs -prune -o -path /var -prune -o -print' | LC_ALL=C sort > "$here/before"
inside 'apt-get install -y -q --no-install-recommends /debs/rimwatch_*.deb' > "$here/apt.txt" 2>&1; check "rimwatch is installed, with what it needs" 0 $? || tail -5 "$here/apt.txt"
contains "its version" "$(inside 'rim --version')" '^rim [0-9]'
contains "rimd's" "$(inside 'rimd --version')" '^rimd [0-9]'
contains "rimd reads its example" "$(inside 'rimd --check /usr/share/rimwatch/rimd.conf' 2>&1)" 'lander.rim: No such file'
[ -f "$root/usr/share/bash-completion/completions/rim" ] && [ -f "$root/usr/share/man/man1/rim-train.1.gz" ]; check "pages and completion" 0 $?

# The tutorial's rover, without python and gcc: simulate, train, replay, diagnose.
cat > "$root/try/use.sh" << 'EOF'
set -e
rim simulate cobot --out rover --runs 8 --seed 1 --rows 1200
rim train rover/run_000[1-7].csv --out rover.rim --quick
awk -F, -v OFS=, 'NR == 1 {for (i = 1; i <= NF; i++) {if ($i ~ /^z\./ && !z) z = i; if ($i ~ /^m\./ && !m) m = i}} NR > 600 {$z = $z + .2} {print}' rover/run_0008.csv > faulty.csv
rim check faulty.csv --model rover.rim
rim replay rover/run_0008.csv --model rover.rim --fail-on-alarm
rim replay faulty.csv --model rover.rim --alarms alarms.jsonl --report flight.html
rim schema faulty.csv > proposal.toml
rim show rover.rim > shown.txt
EOF
out=$(inside 'sh use.sh' 2>&1); check "simulate, train, check, replay" 0 $? || printf '%s\n' "$out" | tail -5
contains "a fault is found" "$out" 'faulty.csv: '
[ -s "$root/try/alarms.jsonl" ]; check "with alarms" 0 $?
[ -s "$root/try/flight.html" ]; check "and a report" 0 $?
digest=$(printf '%s\n' "$out" | grep '^digest' | tail -n 1)
check "the digest of the build" "$digest" "$("$BUILD/rim" replay "$root/try/faulty.csv" --model "$root/try/rover.rim" | tail -n 1)"

inside 'apt-get install -y -q --no-install-recommends /debs/python3-rimwatch_*.deb /debs/librim-dev_*.deb gcc libc6-dev pkg-config cmake make' > "$here/apt.txt" 2>&1
check "python3-rimwatch and librim-dev are installed" 0 $? || tail -5 "$here/apt.txt"
cat > "$root/try/use.py" << 'EOF'
import rimwatch
print("digest", rimwatch.replay("faulty.csv", "rover.rim").digest)
image = rimwatch.train(rimwatch.example_logs(4))
print(image.features, len(rimwatch.diagnose(["faulty.csv"]).findings) > 0)
EOF
out=$(inside 'python3 use.py' 2>&1); check "from Python" 0 $?
check "the same digest" "$digest" "$(printf '%s\n' "$out" | grep '^digest')"
contains "train and diagnose" "$out" "s.current_A'\] True"
awk '/^```c$/{on=1; next} /^```$/{on=0} on' "$source/README.md" > "$root/try/watch.c"
inside 'gcc -std=c11 -Wall -Wextra -Werror watch.c $(pkg-config --cflags --libs rimwatch) -o watch'; check "the README's program, by pkg-config" 0 $?
contains "refuses what is no image" "$(inside './watch faulty.csv < /dev/null' 2>&1)" '.'
mkdir "$root/try/project" && cp "$root/try/watch.c" "$root/try/project/"
printf 'cmake_minimum_required(VERSION 3.16)\nproject(w C)\nfind_package(rimwatch REQUIRED)\nadd_executable(w watch.c)\ntarget_link_libraries(w rimwatch::rim)\n' > "$root/try/project/CMakeLists.txt"
inside 'cmake -S project -B built > cmake.txt 2>&1 && cmake --build built >> cmake.txt 2>&1'; check "and by CMake" 0 $? || tail -3 "$root/try/cmake.txt"

inside 'apt-get purge -y -q rimwatch librim-dev python3-rimwatch' > "$here/apt.txt" 2>&1; check "removed" 0 $? || tail -5 "$here/apt.txt"
inside 'find / -xdev -path /debs -prune -o -path /try -prune -o -path /var -prune -o -print' | LC_ALL=C sort | comm -13 "$here/before" - | grep -i -e rimwatch -e 'librim' -e '/rimd*$' > "$here/left"
check "nothing of them stays" "" "$(cat "$here/left")"
finish
