#!/bin/bash
# SPDX-License-Identifier: MIT
# The bills of materials: each names what its program asks for and nothing else, as the SPDX group's own reader takes it.
. "$(dirname "$0")/check.inc"
for program in readelf ldd dpkg-query; do command -v $program > /dev/null || missing="$missing $program"; done
[ -z "$missing" ] || skip "no$missing"
cd "$root" || exit 1
SOURCE_DATE_EPOCH=0 tests/assurance/sbom.py "$BUILD" 1.2.3 "$here" > "$here/said" 2>&1; check "made" 0 $? || cat "$here/said"
names() { python3 -c 'import json, sys
for p in json.load(open(sys.argv[1]))["packages"]: print(p["comment"] if "dynamically" in p["comment"] else "")' "$1" | sed -n 's/linked dynamically: //p' | tr ' ' '\n' | sort; }
asked() { readelf -d "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | sort; }
check "all that rimd asks for" "$(asked "$BUILD/rimd")" "$(names "$here/board.spdx.json")"
check "all that rim asks for" "$(asked "$BUILD/rim")" "$(names "$here/ground.spdx.json")"
check "and links nothing" 0 "$(grep -A1 '"spdxElementId": "SPDXRef-librim.a"' "$here/board.spdx.json" | grep -c LINK)"
contains "the version asked for" "$(cat "$here/board.spdx.json")" '"name": "rimwatch-1.2.3-board"'
contains "the date asked for" "$(cat "$here/ground.spdx.json")" '"created": "1970-01-01T00:00:00Z"'
contains "what is in it" "$(cat "$here/board.spdx.json")" "$(sha256sum "$BUILD/librim.a" | cut -c1-64)"
SOURCE_DATE_EPOCH=0 tests/assurance/sbom.py "$BUILD" 1.2.3 "$here/again" > /dev/null; cmp -s "$here/ground.spdx.json" "$here/again/ground.spdx.json"; check "again the same" 0 $?
python=python3
[ -x "$BUILD/venv/bin/python3" ] && python=$BUILD/venv/bin/python3
if has_packages $python spdx_tools; then
  for name in board ground; do
    $python - "$here/$name.spdx.json" > "$here/said" 2>&1 << 'END'
import sys
from spdx_tools.spdx.parser.parse_anything import parse_file
from spdx_tools.spdx.validation.document_validator import validate_full_spdx_document
document = parse_file(sys.argv[1])
wrong = validate_full_spdx_document(document)
print(len(document.packages), *[m.validation_message for m in wrong], sep="\n")
sys.exit(len(wrong) > 0)
END
    check "$name: valid SPDX 2.3" 0 $? || cat "$here/said"
  done
else
  echo "not here: spdx-tools"; skipped=$((skipped + 1))
fi
finish
