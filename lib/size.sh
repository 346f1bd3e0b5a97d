#!/bin/sh
# size.sh SIZE BUILD: code and static RAM per module of librim, and the deepest single frames.
size=$1 build=$2
echo "librim: code and constants, static RAM (bytes)"
$size "$build"/lib/src/*.o | awk 'NR>1 {n=$6; sub(".*/", "", n); sub("\\.o$", "", n);
  printf "  %-16s %8d %8d\n", n, $1, $2+$3; c+=$1; r+=$2+$3}
  END {printf "  %-16s %8d %8d\n", "total", c, r}'
echo "stack: the ten largest frames (bytes; one function each, -fstack-usage)"
cat "$build"/lib/src/*.su | awk -F'\t' '{n=split($1, p, ":"); print $2, p[n], p[1]}' | sort -rn |
  head -10 | awk '{f=$3; sub(".*/", "", f); printf "  %8d %-36s %s\n", $1, $2, f}'
