# shellcheck shell=bash
# Sourced by the test scripts: one line to a check, counted.
#
#   check "name" command...     ok when the command succeeds; its last line of output explains a failure
#   finish                      prints "N passed, N failed" and exits accordingly
passed=0 failed=0 skipped=0

check() {
  local name=$1 output
  shift
  if output=$("$@" 2>&1); then
    passed=$((passed + 1))
    echo "ok    $name"
  else
    failed=$((failed + 1))
    echo "FAIL  $name: $(tail -n 1 <<<"$output" | cut -c1-300)"
  fi
}

# The whole script can't run here: counted as one, with the reason.
skip_all() {
  echo "skipped: $1"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
}

finish() {
  echo "$passed passed, $failed failed$([[ $skipped == 0 ]] || echo ", $skipped skipped")"
  [[ $failed == 0 ]]
  exit
}

# until_true SECONDS COMMAND...: polls it; what it says at last explains a failure.
until_true() {
  local end=$((SECONDS + $1))
  shift
  while ! "$@" >/dev/null 2>&1; do
    [[ $SECONDS -lt $end ]] || { "$@"; return 1; }
    sleep 0.2
  done
}

# json EXPRESSION ARGUMENTS...: of the JSON on stdin, which is `value`; the arguments are sys.argv[2:].
json() { /usr/bin/python3 -c 'import json, sys; value = json.load(sys.stdin); print(eval(sys.argv[1]))' "$@"; }
