#!/bin/sh
# SPDX-License-Identifier: MIT
# make_library.sh FOLDER: writes the Arduino library RimWatch into FOLDER, with librim's sources in it: the Arduino
# builder compiles everything below src/ and has no other include folder. Then: Sketch, Include Library, Add .ZIP.
set -e
[ $# = 1 ] && [ ! -e "$1" ] || { echo "make_library.sh FOLDER: a folder that is not there yet" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
root=$here/../../..
mkdir -p "$1/src"
cp -r "$here/library.properties" "$here/examples" "$1/"
cp "$here"/src/* "$root"/firmware/integration/watch/rim_watch.[ch] "$1/src/"
cp -r "$root/lib/include/rim" "$1/src/"
for room in "$root"/lib/src/*/; do
  mkdir -p "$1/src/$(basename "$room")"
  cp "$room"*.[ch] "$1/src/$(basename "$room")/"
done
cp "$root/LICENSE" "$1/"
