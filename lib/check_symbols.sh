#!/bin/sh
# SPDX-License-Identifier: MIT
# check_symbols.sh NM ARCHIVE [cross] [names]: exit 1 when the archive needs anything that a bare
# target has not got, or keeps mutable globals; with 'names' also when it exports a name that might
# clash with an application's: public ones begin with rim_, private ones with rimi_; with 'cross'
# also when it needs 64-bit integer division (LEON3's helper traps). Helpers for floating point,
# shifts and multiplication come with every compiler and are allowed.
nm=$1 archive=$2
cross= names=
for option in $3 $4; do eval "$option=$option"; done
symbols=$($nm -p "$archive") || exit 1
defined=$(printf '%s\n' "$symbols" | awk 'NF==3 && $2 ~ /^[TRDBVW]$/ {print $3}' | sort -u)
needed=$(printf '%s\n' "$symbols" | awk 'NF==2 && $1=="U" {print $2}' | sort -u)
fail=0

unknown=$(printf '%s\n' "$needed" | grep -vxF "$defined" |
  grep -vxE 'mem(cpy|set|move|cmp)|_GLOBAL_OFFSET_TABLE_|\.TOC\.|__aeabi_(d|f|i|u|l|ui|ul|mem).*' |
  grep -vxE '__(add|sub|mul|div|neg|eq|ne|lt|le|gt|ge|unord|fix|fixuns|float|floatun|extend|trunc|cmp|ucmp|clz|ctz|ashl|ashr|lshr|bswap|popcount|udiv|umod|mod)([sdt][fi]){1,2}[0-9]?')
[ -n "$unknown" ] && { echo "$archive: forbidden symbols:" $unknown >&2; fail=1; }

if [ "$cross" = cross ]; then
  divides=$(printf '%s\n' "$needed" | grep -xE '__(u?div|u?mod|u?divmod)[dt]i[34]|__aeabi_u?ldivmod')
  [ -n "$divides" ] && { echo "$archive: 64-bit integer division:" $divides >&2; fail=1; }
fi

mutable=$(printf '%s\n' "$symbols" | awk 'NF==3 && $2 ~ /^[DdBbCGgSs]$/ && $3 !~ /\.rel\.ro|__compound_literal/ {print $3}')
[ -n "$mutable" ] && { echo "$archive: mutable globals:" $mutable >&2; fail=1; }

foreign=$(printf '%s\n' "$defined" | grep -v -e '^rimi\{0,1\}_' -e '^__x86')
[ "$names" = names ] && [ -n "$foreign" ] && { echo "$archive: names must begin with rim_ (public) or rimi_ (private):" $foreign >&2; fail=1; }
exit $fail
