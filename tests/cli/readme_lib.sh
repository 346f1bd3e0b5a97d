#!/bin/bash
# SPDX-License-Identifier: MIT
# The program of lib/README.md with several regions on board finds two and mends the model. Random
# numbers: seed 20.
. "$(dirname "$0")/check.inc"
root=$(cd "$(dirname "$0")/../.." && pwd)
cd "$here" || exit 1
awk '/^```c$/{n++; on=1; next} /^```$/{on=0} on {print > ("block" n ".c")}' "$root/lib/README.md"
flags="-std=c11 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Wshadow -Werror -I$root/lib/include -I$root/lib/src"
mender=$(grep -l "mender_observe" block*.c)
cat > main.c <<END
#include "$mender"
#include <math.h>
#include <base/rng.h>
#include <stdio.h>

static mender m;

int main(void) {
  rim_rng rng;
  rimi_rng_seed(&rng, 20, 1);
  if (mender_init(&m) != RIM_OK)
    return 1;
  for (int i = 0; i < 400; ++i) { /* +2 sd in one ball, -2 in another; sd 0.5, nominal 10 */
    const double x[2] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    const double shift = hypot(x[0] - 0.75, x[1] - 0.3) < 0.2   ? 1.0
                         : hypot(x[0] - 0.25, x[1] - 0.7) < 0.2 ? -1.0
                                                                : 0.0;
    if (mender_observe(&m, x, 10.0, 0.5, 10.0 + shift + 0.5 * rimi_rng_normal(&rng)) != RIM_OK)
      return 2;
  }
  const double at[3][2] = {{0.75, 0.3}, {0.25, 0.7}, {0.05, 0.05}};
  printf("regions %u bytes %u\n", m.pool.found, (unsigned)sizeof m);
  for (int i = 0; i < 3; ++i) {
    double mean = 0.0, up = 0.0, down = 0.0;
    if (expected(&m, at[i], 10.0, &mean) != RIM_OK || likely(&m, at[i], 10.0, 0.5, 11.0, &up) != RIM_OK ||
        likely(&m, at[i], 10.0, 0.5, 9.0, &down) != RIM_OK)
      return 3;
    printf("mean %.3f likelier %s\n", mean, up > down ? "up" : up < down ? "down" : "neither");
  }
  return 0;
}
END
gcc $flags main.c "$BUILD/librim.a" -lm -o main ${SANITIZE:+-fsanitize=address,undefined}; check "links" 0 $?
out=$(./main); check "runs" 0 $?
echo "$out"
contains "two regions" "$out" "^regions 2 bytes"
# mean WHICH LOW HIGH
mean() {
  awk -v line="$1" -v low="$2" -v high="$3" '/^mean/ && ++n == line {exit !($2 >= low && $2 <= high)}' <<< "$out"
  check "mean $1 in $2..$3" 0 $?
}
mean 1 10.7 11.2
mean 2 8.8 9.3
mean 3 10 10
contains "density up" "$(sed -n 2p <<< "$out")" "likelier up"
contains "density down" "$(sed -n 3p <<< "$out")" "likelier down"
contains "density outside" "$(sed -n 4p <<< "$out")" "likelier neither"
finish
