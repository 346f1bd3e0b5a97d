#!/bin/bash
# SPDX-License-Identifier: MIT
# The planning program of lib/README.md, run in a world in which the nominal model is wrong: it finds
# the region where rewards are better, and never does what is not safe. Random numbers: seed 21.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1
awk '/^```c$/{n++; on=1; next} /^```$/{on=0} on {print > ("block" n ".c")}' "$root/lib/README.md"
example=$(grep -l "ball_position" block*.c)
check "one such program" 1 "$(wc -w <<< "$example")"
cat > main.c <<END
#include <base/rng.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include "$example"

enum { TURNS = 150, LATE = 50 };
static rim_rng rng;
static double state;
static int turn, unsafe;
static double gained;

double expected_reward(double s, double a) { return 0.2 - 0.02 * s - 0.1 * (a > 0.0 ? a : -a); }
bool is_safe(double s, double a) { return a < 0.35 || s > 3.9; }
double ball_position(void) {
  if (turn == 0)
    rimi_rng_seed(&rng, 21, 1);
  state = 4.0 * rimi_rng_uniform(&rng);
  return state;
}
/* Better than expected by 0.3 where s is 1 to 3 and a is above 0.1. */
double shoot(double a) {
  const double better = state > 1.0 && state < 3.0 && a > 0.1 ? 0.3 : 0.0;
  unsafe += !is_safe(state, a);
  if (++turn > TURNS - LATE)
    gained += better;
  if (turn == TURNS) {
    printf("unsafe %d gained %.3f\n", unsafe, gained / LATE);
    exit(0);
  }
  return expected_reward(state, a) + better + 0.02 * rimi_rng_normal(&rng);
}
END
gcc -std=c11 -O2 -ffp-contract=off -Wall -Wextra -Wconversion -Wshadow -Werror -I"$root/lib/include" -I"$root/lib/src" main.c \
  "$BUILD/librim.a" -o main ${SANITIZE:+-fsanitize=address,undefined}
check "compiles and links" 0 $?
out=$(./main); check "runs" 0 $?
echo "$out"
contains "never what is not safe" "$out" "^unsafe 0 "
# 0.15 is all there is: half of the states, 0.3 each.
awk '{exit !($4 > 0.10)}' <<< "$out"; check "the better region is found and used" 0 $?
finish
