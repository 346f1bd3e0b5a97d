#!/bin/bash
# SPDX-License-Identifier: MIT
# The dispatcher: help, version, exit codes, and that every command's help ends in an example.
. "$(dirname "$0")/check.inc"
cd "$here" || exit 1

out=$("$RIM" 2>&1 >/dev/null); check "no command is a usage error" 2 $?
contains "no command lists the commands" "$out" "usage: rim COMMAND"
out=$("$RIM" --help); check "help" 0 $?
contains "help: the status of an interruption" "$out" "128 and its number: 130 for Ctrl-C"
contains "help lists merge" "$("$RIM_THESIS" --help)" "merge "
check "in the order in which a user meets them" "schema train diagnose replay check" "$("$RIM" --help | awk '/^  [a-z-]+ /{print $1}' | head -5 | xargs)"
out=$("$RIM" --version); check "version" 0 $?
contains "version" "$out" "rim [0-9]"
out=$("$RIM" frobnicate 2>&1 >/dev/null); check "unknown command" 2 $?
contains "unknown command is named" "$out" "no command 'frobnicate'"
for command in $("$RIM" --help | awk '/^  [a-z-]+ /{print $1}'); do
  out=$("$RIM" "$command" --help 2>/dev/null); check "$command --help" 0 $?
  contains "$command --help ends in an example" "$out" "[Ee]xample"
  err=$("$RIM" "$command" --no-such-option 2>&1 >/dev/null); check "$command with a wrong option" 2 $?
  contains "$command says whose usage" "$err" "^rim: "
done
# --- numbers: what is refused is said in words, and none that is not finite is taken
: > log.csv
number() { # number OPTION VALUE REASON COMMAND...
  local option=$1 value=$2 reason=$3 err; shift 3
  err=$(timeout 60 "$RIM" "$@" "$option" "$value" 2>&1 >/dev/null); check "$option $value: status" 2 $?
  contains "$option $value" "$err" "$option: $reason: $value"
  check "$option $value: no endless line" 0 "$(printf '%s\n' "$err" | awk 'length($0) > 120' | wc -l)"
}
number --seed -5 "must not be negative" simulate golf --out x
number --seconds -1 "must not be negative" listen
number --horizon 0 "must be above zero" diagnose log.csv --out x
number --horizon -2 "must not be negative" diagnose log.csv --out x
for value in nan inf -inf; do
  number --block-seconds "$value" "must be a finite number" train log.csv --out x
  number --false-alarm "$value" "must be a finite number" replay log.csv
  number --beta "$value" "must be a finite number" plan --state 0:1 --action -1:1:3
  number --seconds "$value" "must be a finite number" listen
done
check "nothing was made" "" "$(ls -d x 2> /dev/null)"

# --- help COMMAND, the nearest word, and what is made from the same text
check "help COMMAND" "$("$RIM" train --help)" "$("$RIM" help train)"
contains "the nearest command" "$("$RIM" trian 2>&1 >/dev/null)" "no command 'trian'; did you mean 'train'?"
contains "no nearest command" "$("$RIM" frobnicate 2>&1 >/dev/null)" "no command 'frobnicate'$"
err=$("$RIM" train --hepl 2>&1 >/dev/null); check "a wrong option is a usage error" 2 $?
contains "the nearest option" "$err" "unknown option '--hepl'; did you mean '--help'?"
contains "also after its argument" "$("$RIM" train a.csv --out x --false-alrm=0.1 2>&1 >/dev/null)" "unknown option '--false-alrm'; did you mean '--false-alarm'?"
err=$("$RIM" help trian 2>&1 >/dev/null); check "help of no command" 2 $?
contains "help of no command: said" "$err" "did you mean 'train'?"
contains "plain metavariables" "$("$RIM" simulate --help)" "--runs N "
check "no raw types" 0 "$(for c in train replay simulate plan bench; do "$RIM" help $c; done | grep -c -e 'UINT' -e ' in \[[0-9]' -e 'TEXT:')"
for command in $("$RIM" --help | awk '/^  [a-z-]+ /{print $1}'); do
  "$RIM" help --man "$command" > page.1; check "man page of $command" 0 $?
  if command -v man > /dev/null; then
    check "$command: troff is sound" "" "$(man --warnings -E UTF-8 -l -Tutf8 page.1 2>&1 > /dev/null)"
  fi
  contains "$command: its options" "$(cat page.1)" '^\\fB\\-\\-'
done
"$RIM" help --bash > rim.bash; bash -n rim.bash; check "bash completion" 0 $?
complete_words() { # what bash offers for the words given
  bash -c '. ./rim.bash; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _rim; printf "%s\n" "${COMPREPLY[@]}"' _ "$@"
}
contains "completes commands" "$(complete_words rim tra)" "^train$"
contains "completes options" "$(complete_words rim train --fal)" "^--false-alarm$"
contains "completes help" "$(complete_words rim help re)" "^replay$"
if command -v zsh > /dev/null; then
  "$RIM" help --zsh > _rim; zsh -n _rim; check "zsh completion" 0 $?
else
  contains "zsh completion" "$("$RIM" help --zsh)" "^#compdef rim"
fi

"$RIM" --help > /dev/full 2>/dev/null; check "a full standard output" 3 $?
finish
