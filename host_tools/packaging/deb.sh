#!/bin/bash
# SPDX-License-Identifier: MIT
# deb.sh FOLDER: makes FOLDER/*.deb of FOLDER/root, which `make install DESTDIR=FOLDER/root PREFIX=/usr` filled.
# MAINTAINER, VERSION, BUILD (with the objects of the Python package) and PYPI (what builds it) come from
# the makefile.
set -eu
folder=$1 root=$1/root
source=$(cd "$(dirname "$0")/../.." && pwd)
architecture=$(dpkg --print-architecture)
revision=$VERSION-1
SOURCE_DATE_EPOCH=$(git -C "$source" log -1 --format=%ct 2> /dev/null || date +%s)
export SOURCE_DATE_EPOCH
commit=$(git -C "$source" rev-parse --short HEAD 2> /dev/null || echo unknown)
rm -f "$folder"/*.deb
rm -rf "$folder"/rimwatch "$folder"/librim-dev "$folder"/python3-rimwatch

# take PACKAGE PATH...: moves these, relative to /usr, from the root into the package
take() {
  local package=$1 path
  shift
  for path in "$@"; do
    mkdir -p "$folder/$package/usr/$(dirname "$path")"
    mv "$root/usr/$path" "$folder/$package/usr/$path"
  done
}

# A page for rimd, whose help is its whole manual.
rimd_page() {
  printf '.TH rimd 1 "" "rimwatch %s"\n.SH NAME\nrimd \\- the onboard monitor between LCM and CAN, as a daemon\n' "$VERSION"
  printf '.SH SYNOPSIS\n.B rimd\n[--check] [--state FILE] CONFIG\n.SH DESCRIPTION\n.nf\n'
  "$root/usr/bin/rimd" --help | sed -e 's/\\/\\\\/g' -e 's/-/\\-/g' -e "s/^[.']/\\\\\\&&/"
  printf '.fi\n.SH FILES\n.I /usr/share/rimwatch/rimd.conf\nis an example with every key.\n'
}

# What every package says of itself.
documents() {
  local doc=$folder/$1/usr/share/doc/$1
  mkdir -p "$doc"
  {
    printf 'Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\nUpstream-Name: rimwatch\n\n'
    printf 'Files: *\nCopyright: %s\nLicense: Expat\n' "$(sed -n 's/^Copyright (c) //p' "$source/LICENSE")"
    sed -e '1,/^Copyright/d' "$source/LICENSE" | sed -e '/./,$!d' -e 's/^$/./' -e 's/^/ /'
  } > "$doc/copyright"
  printf 'rimwatch (%s) unstable; urgency=medium\n\n  * Made by "make deb" at commit %s; changelog.gz says what changed.\n\n -- %s  %s\n' \
    "$revision" "$commit" "$MAINTAINER" "$(date -u -R -d "@$SOURCE_DATE_EPOCH")" | gzip -9n > "$doc/changelog.Debian.gz"
  gzip -9n < "$source/CHANGELOG.md" > "$doc/changelog.gz"
}

# needs PACKAGE FILE...: the packages of the shared libraries that the files are linked to
needs() {
  mkdir -p "$folder/scratch/debian" "$folder/$1/DEBIAN"
  printf 'Source: rimwatch\n\nPackage: %s\nArchitecture: any\n' "$1" > "$folder/scratch/debian/control"
  shift
  (cd "$folder/scratch" && dpkg-shlibdeps -O "$@") | sed -n 's/^shlibs:Depends=//p'
}

# control PACKAGE SECTION DEPENDS EXTRA_FIELDS < description
control() {
  mkdir -p "$folder/$1/DEBIAN"
  {
    printf 'Package: %s\nSource: rimwatch\nVersion: %s\nArchitecture: %s\nMaintainer: %s\n' "$1" "$revision" "$architecture" "$MAINTAINER"
    printf 'Installed-Size: %s\nSection: %s\nPriority: optional\n' "$(du -k -s --apparent-size "$folder/$1/usr" | cut -f1)" "$2"
    [ -z "$3" ] || printf 'Depends: %s\n' "$3"
    [ -z "$4" ] || printf '%s\n' "$4"
    cat
  } > "$folder/$1/DEBIAN/control"
}

finish() {
  local tree=$folder/$1
  find "$tree/usr" -type d -exec chmod 755 {} +
  find "$tree/usr" -type f ! -path '*/bin/*' -exec chmod 644 {} +
  find "$tree/usr/share/man" -type f -exec gzip -9n {} + 2> /dev/null || true
  (cd "$tree" && find usr -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum) > "$tree/DEBIAN/md5sums"
  find "$tree" -print0 | xargs -0 touch -h -d "@$SOURCE_DATE_EPOCH"
  dpkg-deb --root-owner-group --build "$tree" "$folder/$1_${revision}_$architecture.deb" > /dev/null
  echo "$folder/$1_${revision}_$architecture.deb"
}

make_rimwatch() {
  rimd_page > "$root/usr/share/man/man1/rimd.1"
  rm -f "$root/usr/share/rimwatch/installed.txt" "$root/usr/share/doc/rimwatch/LICENSE" "$root/usr/share/doc/rimwatch/CHANGELOG.md"
  strip --strip-unneeded --remove-section=.comment --remove-section=.note "$root/usr/bin/rim" "$root/usr/bin/rimd"
  mkdir -p "$root/usr/share/zsh/vendor-completions" # where Debian's zsh looks
  mv "$root/usr/share/zsh/site-functions/_rim" "$root/usr/share/zsh/vendor-completions/_rim"
  rmdir "$root/usr/share/zsh/site-functions"
  take rimwatch bin share
  documents rimwatch
  control rimwatch science "$(needs rimwatch "$folder/rimwatch/usr/bin/rim" "$folder/rimwatch/usr/bin/rimd")" \
    "Recommends: gnuplot-nox, libjs-dygraphs, python3
Suggests: librim-dev, python3-rimwatch" << EOF
Description: onboard monitor that finds where a vehicle's model is wrong
 It finds connected regions of a vehicle's operating conditions in which what
 happens deviates, collectively, from what its model predicts, and says where,
 how much and how surely, while the vehicle still moves.
 .
 This package holds rim, which learns from healthy logs, replays, diagnoses and
 listens, and rimd, the monitor as a daemon between LCM and CAN.
EOF
}

make_dev() {
  strip --strip-debug --enable-deterministic-archives "$root/usr/lib/librim.a"
  take librim-dev lib/librim.a lib/pkgconfig lib/cmake include
  documents librim-dev
  control librim-dev libdevel "" "Suggests: rimwatch, pkg-config" << EOF
Description: onboard monitor of model errors, library and headers
 librim is the part of rimwatch that flies: plain C11 without heap, operating
 system or libm. This package holds the static library, its headers, and its
 descriptions for pkg-config and CMake.
EOF
}

# By Debian's own interpreter; its build tools come from PyPI, since Debian 12 has no nanobind.
make_python() {
  local to=$folder/python3-rimwatch/usr/lib/python3/dist-packages made=$folder/venv/.made
  if ! [ -f "$made" ] || [ "$(cat "$made")" != "$PYPI" ]; then
    rm -rf "$folder/venv"
    /usr/bin/python3 -m venv "$folder/venv"
    # shellcheck disable=SC2086
    "$folder/venv/bin/pip" install --quiet --disable-pip-version-check $PYPI ||
      { echo "deb: python3-rimwatch is built by packages from PyPI, which could not be had: $PYPI" >&2; exit 1; }
    printf '%s' "$PYPI" > "$made"
  fi
  rm -rf "$folder/wheel"
  PATH=$folder/venv/bin:$PATH RIMWATCH_BUILD=$BUILD "$folder/venv/bin/pip" wheel --quiet --no-deps --no-build-isolation \
    --disable-pip-version-check --config-settings=build-dir="$folder/python" -w "$folder/wheel" "$source/host_tools/python"
  mkdir -p "$to"
  /usr/bin/python3 -m zipfile -e "$folder"/wheel/rimwatch-*.whl "$to"
  rm -rf "$to"/rimwatch-*.dist-info/{RECORD,licenses}
  local module=("$to"/rimwatch/_core*.so)
  strip --strip-unneeded --remove-section=.comment "${module[0]}"
  documents python3-rimwatch
  mkdir -p "$folder/python3-rimwatch/DEBIAN"
  printf '#!/bin/sh\nset -e\nif [ "$1" = configure ] && command -v py3compile > /dev/null; then py3compile -p python3-rimwatch; fi\n' \
    > "$folder/python3-rimwatch/DEBIAN/postinst"
  printf '#!/bin/sh\nset -e\nif command -v py3clean > /dev/null; then py3clean -p python3-rimwatch; fi\n' > "$folder/python3-rimwatch/DEBIAN/prerm"
  chmod 755 "$folder/python3-rimwatch/DEBIAN/"{postinst,prerm}
  local minor
  minor=$(/usr/bin/python3 -c 'import sys; print(sys.version_info[1])')
  control python3-rimwatch python "$(needs python3-rimwatch "${module[0]}"), python3 (>= 3.$minor), python3 (<< 3.$((minor + 1))), python3-numpy, python3-pandas" \
    "Suggests: rimwatch, python3-h5py, python3-scipy, python3-sklearn" << EOF
Description: onboard monitor of model errors, for Python
 Trains, runs and diagnoses the onboard monitors of rimwatch from tables of
 pandas, with the same objects as the program rim: the same images, digests,
 alarms and findings.
EOF
}

make_dev
make_rimwatch
make_python
rm -rf "$folder/scratch"
left=$(find "$root" -type f)
[ -z "$left" ] || { echo "deb: in no package: $left" >&2; exit 1; }
for package in rimwatch librim-dev python3-rimwatch; do finish $package; done
