#!/bin/sh
# SPDX-License-Identifier: MIT
# once.sh COMMAND...: runs it, but for a compiler's call on a source of the library outside of its room monitor/: the
# same sources, by the same options, are compiled for another framework already.
for last; do :; done
case $last in
*/lib/src/monitor/*.c) ;;
*/lib/src/*.c) exit 0 ;;
esac
exec "$@"
