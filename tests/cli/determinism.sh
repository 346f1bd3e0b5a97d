#!/bin/bash
# SPDX-License-Identifier: MIT
# One log, one digest: by `rim replay` twice, and by a small C program on a library built at -O0 and -O2 (`make test-long`: and -O3).
. "$(dirname "$0")/check.inc"
. "$(dirname "$0")/toy.inc"
skip_under_sanitizers "it builds by itself what it tests, without them"
cd "$here" || exit 1
toy_few 8 800
toy log.csv 50 1200 'if (i > 400) a += 0.6'
out=$("$RIM" replay --model toy.rim log.csv); digest=$(printf '%s\n' "$out" | tail -1)
contains "a digest" "$digest" "^digest [0-9a-f]\{16\}$"
contains "the log holds an alarm" "$out" "FOUND"
check "two replays" "$digest" "$("$RIM" replay --model toy.rim log.csv | tail -1)"

cat > fly.c << 'END'
#include <base/crc.h>
#include <rim/image.h>
#include <rim/monitor.h>
#include <stdio.h>
static _Alignas(8) unsigned char image[1 << 20], memory[1 << 20];
int main(int argc, char **argv) {
  FILE *model = fopen(argv[argc - 1], "rb");
  size_t bytes = fread(image, 1, sizeof image, model);
  rim_monitor *monitor;
  if (rim_monitor_init(&monitor, memory, sizeof memory, image, bytes) != RIM_OK) return 3;
  double row[64];
  unsigned n = 1 + rim_monitor_config(monitor, RIM_CONFIG_FEATURES), at = 0;
  unsigned long long digest = RIM_DIGEST_START;
  while (scanf("%lf", &row[at]) == 1) {
    if (++at < n) continue;
    at = 0;
    rim_observation now = {.t_s = row[0], .context = row + 1};
    rim_verdict verdict;
    if (rim_monitor_step(monitor, &now, &verdict) != RIM_OK) return 4;
    digest = rim_verdict_digest(digest, &verdict);
  }
  printf("digest %016llx\n", digest);
  return 0;
}
END
# What of the library a monitor is linked from: no more of it is compiled again.
gcc -std=c11 -I"$root/lib/include" -I"$root/lib/src" fly.c -o fly "$BUILD/librim.a" -Wl,-Map=map.txt || bad "link"
members=$(sed -n 's|.*librim\.a(\(.*\)\.o)$|\1|p' map.txt | sort -u)
levels="-O0 -O2"
is_long && levels="$levels -O3"
for level in $levels; do
  library=$BUILD/librim.a # of the build that is tested: -O2
  if [ $level != -O2 ]; then
    library=$(cd "$root" && for m in $members; do echo lib/src/*/"$m.c"; done | sed "s|^|$here/build$level/|; s|c$|o|")
    make -s -C "$root" $library BUILD="$here/build$level" OPT=$level LIB_STACK= > make.log 2>&1 ||
      bad "build at $level: $(tail -5 make.log)"
  fi
  gcc -std=c11 $level -ffp-contract=off -I"$root/lib/include" -I"$root/lib/src" fly.c -o fly $library || bad "link at $level"
  check "at $level" "$digest" "$(tail -n +2 log.csv | tr , ' ' | ./fly toy.rim)"
done
changed=$(tail -n +2 log.csv | awk -F, -v OFS=, 'NR == 300 {$3 += 0.02} {print}' | tr , ' ' | ./fly toy.rim)
! [ "$changed" = "$digest" ]; check "two centimetres in one row, another digest" 0 $?
finish
