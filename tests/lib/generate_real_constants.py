#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints the constants of lib/src/real.c as hex floats (needs mpmath).

mills: Chebyshev coefficients of (x + 1) M(x), M the Mills ratio, in t = (x - 5) / (x + 5), from 80 nodes
at 60 digits; the 24 kept leave a sum of 2e-17. ln 2 is split so that k * ln2_high is exact, |k| < 2^20.
"""
from mpmath import mp, mpf, erfc, exp, sqrt, pi, cos, log, floor

mp.dps = 60


def mills(x):
    if x > 3000:
        return 1 / x - 1 / x**3 + 3 / x**5
    return erfc(x / sqrt(2)) * sqrt(pi / 2) * exp(x * x / 2)


def main():
    nodes = [(mpf(2 * j + 1) / 160) * pi for j in range(80)]
    at = [5 * (1 + cos(a)) / (1 - cos(a)) for a in nodes]
    g = [(x + 1) * mills(x) for x in at]
    c = [sum(v * cos(i * a) for v, a in zip(g, nodes)) / 40 for i in range(24)]
    print("mills:", ", ".join(float(v).hex() for v in [c[0] / 2] + c[1:]))
    high = floor(log(2) * 2**32) / 2**32
    print("ln2_high:", float(high).hex(), " ln2_low:", float(log(2) - high).hex())
    print("1/ln2:", float(1 / log(2)).hex(), " sqrt(2):", float(sqrt(2)).hex())
    print("sqrt(2 pi):", float(sqrt(2 * pi)).hex(), " pi:", float(pi).hex())
    print("1/sqrt(2 pi):", float(1 / sqrt(2 * pi)).hex(), " sqrt(1/2):", float(sqrt(mpf(1) / 2)).hex())
    factorial = mpf(1)
    for n in range(2, 14):
        factorial *= n
        print("1/%d!:" % n, float(1 / factorial).hex())
    for j in range(1, 11):
        print("2/%d:" % (2 * j + 1), (2.0 / (2 * j + 1)).hex())


if __name__ == "__main__":
    main()
