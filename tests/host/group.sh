#!/bin/bash
# SPDX-License-Identifier: MIT
# group.sh TEST.cpp...: prints one source that holds these tests, each in a namespace of its own, and a
# main() that runs the one by whose name the program is called. What they include comes first, once,
# so that no header is read inside a namespace.
awk '
  /^extern "C" \{/ {block = 1}
  block {text = text $0 "\n"; if (/^\}/) {block = 0; if (!(text in seen)) {seen[text]; late = late text} text = ""} next}
  /^#include / && !($0 in seen) {
    seen[$0]
    if (/</) first = first $0 "\n"; else if (/"check.hpp"/) check = $0 "\n"; else own = own $0 "\n"
  }
  END {printf "%s%s%s%s", first, check, own, late}' "$@"
for test in "$@"; do
  printf 'namespace %s {\n#include "%s"\n}\n' "$(basename "$test" .cpp)" "$(basename "$test")"
done
echo 'int main([[maybe_unused]] int argc, char **argv) {'
echo '  const std::string path = argv[0], name = path.substr(path.rfind(char(47)) + 1);'
for test in "$@"; do
  name=$(basename "$test" .cpp)
  given=$(grep -q '^int main(int argc' "$test" && echo 'argc, argv')
  printf '  if (name == "%s")\n    return %s::main(%s);\n' "$name" "$name" "$given"
done
echo '  return 2;'
echo '}'
