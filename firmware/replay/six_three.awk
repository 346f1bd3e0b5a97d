# SPDX-License-Identifier: MIT
# six_three.awk: a log of 6 features and 3 outcomes with its own predictions, for the budget of a step. In a
# region of two features the first outcome is off by three standard deviations. Own random numbers, one seed.
function uniform() { seed = (seed * 16807) % 2147483647; return seed / 2147483647 }
function normal(  i, s) { s = -6; for (i = 0; i < 12; ++i) s += uniform(); return s }
BEGIN {
  seed = 20231
  printf "t_s"
  for (f = 1; f <= 6; ++f) printf ",x.f%d", f
  for (o = 1; o <= 3; ++o) printf ",z.o%d,m.o%d,sd.o%d", o, o, o
  print ""
  for (i = 0; i < 600; ++i) {
    printf "%.2f", i * 0.1
    for (f = 1; f <= 6; ++f) printf ",%.6f", x[f] = uniform()
    inside = ((x[2] - 0.4) / 0.2) ^ 2 + ((x[5] - 0.6) / 0.2) ^ 2 < 1
    for (o = 1; o <= 3; ++o) printf ",%.6f,%.6f,1", x[o] + normal() + (o == 1 && inside ? 3 : 0), x[o]
    print ""
  }
}
