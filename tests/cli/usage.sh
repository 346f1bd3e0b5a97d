#!/bin/bash
# SPDX-License-Identifier: MIT
# The dispatcher: help, version, exit codes, and that every command's help ends in an example.
. "$(dirname "$0")/check.inc"

out=$("$RIM" 2>&1 >/dev/null); check "no command is a usage error" 2 $?
contains "no command lists the commands" "$out" "usage: rim COMMAND"
out=$("$RIM" --help); check "help" 0 $?
contains "help lists merge" "$("$RIM_THESIS" --help)" "merge "
out=$("$RIM" --version); check "version" 0 $?
contains "version" "$out" "rim [0-9]"
out=$("$RIM" frobnicate 2>&1 >/dev/null); check "unknown command" 2 $?
contains "unknown command is named" "$out" "no command 'frobnicate'"
for command in $("$RIM" --help | awk '/^  [a-z]+ /{print $1}'); do
  out=$("$RIM" "$command" --help 2>/dev/null); check "$command --help" 0 $?
  contains "$command --help ends in an example" "$out" "[Ee]xample"
  err=$("$RIM" "$command" --no-such-option 2>&1 >/dev/null); check "$command with a wrong option" 2 $?
  contains "$command says whose usage" "$err" "^rim: "
done
"$RIM" --help > /dev/full 2>/dev/null; check "a full standard output" 3 $?
finish
