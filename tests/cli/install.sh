#!/bin/bash
# SPDX-License-Identifier: MIT
# make install, then the README's program built against what was installed, by pkg-config where
# there is one.
. "$(dirname "$0")/check.inc"
skip_under_sanitizers "it builds by itself what it tests, without them"

# Another PREFIX links rim anew: in a copy, for other tests run what is in $BUILD.
mkdir "$here/build" && tar -C "$BUILD" --exclude=./tests --exclude=./can --exclude=./venv --exclude=./frameworks -cf - . | tar -C "$here/build" -xf -
make -s -C "$root" install BUILD="$here/build" DESTDIR="$here" PREFIX=/opt/rim > "$here/log" 2>&1
check "make install" 0 $? || cat "$here/log"
to=$here/opt/rim
for file in share/man/man1/rim.1 share/man/man1/rim-train.1 share/bash-completion/completions/rim share/zsh/site-functions/_rim \
  share/doc/rimwatch/LICENSE share/doc/rimwatch/README.md share/rimwatch/readers/__main__.py lib/cmake/rimwatch/rimwatch-config.cmake lib/cmake/rimwatch/rimwatch-config-version.cmake share/rimwatch/wire/rim_fd.dbc share/rimwatch/wire/rim_model_t.lcm bin/rim bin/rimd lib/librim.a lib/pkgconfig/rimwatch.pc include/rim/monitor.h share/rimwatch/falcon9.toml \
  share/rimwatch/rimd.conf share/rimwatch/rimd.service share/rimwatch/wire/rim.dbc share/rimwatch/wire/rim_alarm_t.lcm; do
  [ -f "$to/$file" ]; check "$file is installed" 0 $?
done
[ ! -e "$to/share/rimwatch/Dir.mk" ]; check "no make files in share" 0 $?
contains "the service runs what was installed" "$(cat "$to/share/rimwatch/rimd.service")" "^ExecStart=/opt/rim/bin/rimd "
"$to/bin/rimd" --check "$to/share/rimwatch/rimd.conf" > "$here/said" 2>&1; check "the example configuration wants its image" 3 $?
contains "and nothing else" "$(cat "$here/said")" "^rimd: lander.rim: No such file"
if command -v systemd-analyze > /dev/null; then
  sed -e "s|/opt/rim|$to|" "$to/share/rimwatch/rimd.service" > "$here/rimd.service"
  said=$(systemd-analyze verify "$here/rimd.service" 2>&1 | grep rimd.service); check "systemd takes the unit" "" "$said"
fi
contains "the version" "$("$to/bin/rim" --version)" "^rim $(sed -n 's/^Version: //p' "$to/lib/pkgconfig/rimwatch.pc")\( ([0-9a-f]*)\)*$"

awk '/^```c$/{on=1; next} /^```$/{on=0} on' "$root/README.md" > "$here/watch.c"
flags="-I$to/include -L$to/lib -lrim"
if command -v pkg-config > /dev/null; then
  flags=$(PKG_CONFIG_PATH=$to/lib/pkgconfig pkg-config --define-variable=prefix="$to" --cflags --libs rimwatch)
fi
gcc -std=c11 -Wall -Wextra -Werror "$here/watch.c" $flags -o "$here/watch"; check "the README's program builds" 0 $?
# By CMake, from a prefix that was moved.
if command -v cmake > /dev/null; then
  mkdir "$here/by_cmake" && cp -r "$to" "$here/moved" && cp "$here/watch.c" "$here/by_cmake/"
  project() { printf 'cmake_minimum_required(VERSION 3.16)\nproject(x C)\nfind_package(rimwatch %s REQUIRED)\nadd_executable(watch watch.c)\ntarget_link_libraries(watch rimwatch::rim)\n' "$1" > "$here/by_cmake/CMakeLists.txt"; }
  project 0.1
  cmake -S "$here/by_cmake" -B "$here/by_cmake/build" -D CMAKE_PREFIX_PATH="$here/moved" > "$here/said" 2>&1 && cmake --build "$here/by_cmake/build" >> "$here/said" 2>&1
  check "find_package(rimwatch)" 0 $? || cat "$here/said"
  [ -x "$here/by_cmake/build/watch" ]; check "and the program" 0 $?
  for version in 0.2 1.0; do
    project $version
    cmake -S "$here/by_cmake" -B "$here/by_cmake/$version" -D CMAKE_PREFIX_PATH="$here/moved" > "$here/said" 2>&1; check "version $version is not taken for it" 1 $?
  done
else
  skipped=$((skipped + 1))
fi
# Every piece of C in a README compiles against what was installed.
pieces=0
for readme in "$root"/README.md "$root"/*/README.md; do
  rm -f "$here"/piece_*.c
  awk -v to="$here/piece_" '/^```c$/{on=1; n++; next} /^```$/{on=0} on {print > (to n ".c")}' "$readme"
  for piece in "$here"/piece_*.c; do
    [ -e "$piece" ] || continue
    pieces=$((pieces + 1))
    gcc -std=c11 -Wall -Wextra -Werror -I"$to/include" -fsyntax-only "$piece"; check "C in ${readme#"$root"/}: $(basename "$piece")" 0 $?
  done
done
[ "$pieces" -ge 4 ]; check "there are such pieces" 0 $?
err=$(head -c 100 /dev/zero > "$here/zero.rim"; "$here/watch" "$here/zero.rim" 2>&1 < /dev/null)
check "and refuses what is no image" 3 $?
contains "with a reason" "$err" "zero.rim: ."
contains "a file that is missing is named" "$("$here/watch" "$here/none.rim" 2>&1)" "none.rim: No such file"
# The readers are found beside the installed program, and a project finds the library by CMake.
printf '{"t_s": 0, "s.a_m": 1}\n{"t_s": 1, "s.a_m": 2}\n' > "$here/log.jsonl"
python=python3; [ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
if has_packages $python numpy; then
  printf 'schema = "rim-schema/1"\n' > "$here/s.toml"
  contains "an installed reader" "$(cd "$here" && RIM_PYTHON=$python "$to/bin/rim" show log.jsonl --schema s.toml 2>&1)" "2 rows"
fi
cmake=cmake; [ -x "$BUILD/venv/bin/cmake" ] && cmake=$BUILD/venv/bin/cmake
if command -v $cmake > /dev/null; then
  mkdir "$here/project" && cp "$here/watch.c" "$here/project/"
  printf 'cmake_minimum_required(VERSION 3.13)\nproject(w C)\nfind_package(rimwatch 0.1 REQUIRED)\nadd_executable(w watch.c)\ntarget_link_libraries(w rimwatch::rim)\n' > "$here/project/CMakeLists.txt"
  { $cmake -S "$here/project" -B "$here/project/b" -DCMAKE_PREFIX_PATH="$to" && $cmake --build "$here/project/b"; } > "$here/cmake.txt" 2>&1
  check "find_package(rimwatch)" 0 $? || tail -5 "$here/cmake.txt"
  sed -i 's/rimwatch 0.1/rimwatch 0.9/' "$here/project/CMakeLists.txt"
  $cmake -S "$here/project" -B "$here/project/c" -DCMAKE_PREFIX_PATH="$to" > "$here/cmake.txt" 2>&1; check "another version is refused" 1 $?
else
  skipped=$((skipped + 1))
fi
touch "$to/share/mine.txt"
make -s -C "$root" uninstall BUILD="$here/build" DESTDIR="$here" PREFIX=/opt/rim > "$here/log" 2>&1; check "make uninstall" 0 $?
check "leaves what it did not install, nothing else" "$to/share/mine.txt" "$(find "$to" -type f)"
finish
