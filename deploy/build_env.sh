# shellcheck shell=bash disable=SC2154
# Sourced by the scripts that build. Expects the checkout's root in $root.

# build PRESET TESTS [cmake --build options...]: configures (ON or OFF for the tests) when that has not been
# done yet, or was done without tests that are wanted now, and compiles what is out of date.
build() {
  local preset=$1 tests=$2 cache=$root/build/$1/CMakeCache.txt
  shift 2
  if [[ ! -f $root/build/$preset/build.ninja ]] || { [[ $tests == ON ]] && ! grep -q '^LIGHTMILL_TESTS:BOOL=ON' "$cache"; }; then
    (cd "$root" && cmake --preset "$preset" -DLIGHTMILL_TESTS="$tests" --log-level=WARNING) || return 1
  fi
  (cd "$root" && cmake --build --preset "$preset" "$@")
}
