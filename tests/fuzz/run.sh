#!/usr/bin/env bash
# Fuzzes each target with libFuzzer under ASan and UBSan, from its corpus: tests/fuzz/run.sh [SECONDS [TARGET...]]
# New inputs stay in build/fuzz/corpus/TARGET, what crashes in build/fuzz/crashes. `MERGE=1` then adds to tests/fuzz/corpus
# what reaches code that it does not reach yet, inputs of at most 4 KiB. Needs the packages of the group "fuzz".
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh
seconds=${1:-30}
[[ $# -gt 0 ]] && shift
targets=("$@")
[[ $# == 0 ]] && targets=(pbrt gltf texture_graph webp qoi ply nanovdb openvdb measured partial checkpoint messages streams)
command -v clang++ >/dev/null || skip_all "clang is not installed"

build=$root/build/fuzz
cmake --preset fuzz >/dev/null && cmake --build "$build" --target "${targets[@]/#/fuzz_}" >"$build/build.log" 2>&1 ||
  { tail -n 20 "$build/build.log"; echo "0 passed, 1 failed"; exit 1; }
mkdir -p "$build/crashes"

fuzz() {
  local target=$1 new=$build/corpus/$1 status=0
  mkdir -p "$new"
  # Libraries are not instrumented, so containers that cross them confuse ASan's container checks.
  ASAN_OPTIONS=detect_container_overflow=0 UBSAN_OPTIONS=print_stacktrace=1 "$build/bin/fuzz_$target" \
    -max_total_time="$seconds" -timeout=20 -rss_limit_mb=3000 -max_len=32768 -print_final_stats=1 \
    -artifact_prefix="$build/crashes/$target-" "$new" "tests/fuzz/corpus/$target" >"$build/$target.log" 2>&1 || status=1
  grep -E 'number_of_executed_units|SUMMARY|ERROR:' "$build/$target.log" | tail -n 2
  return $status
}

for target in "${targets[@]}"; do
  check "fuzz $target for $seconds s" fuzz "$target"
  grep -m 1 number_of_executed_units "$build/$target.log"
  if [[ -n ${MERGE:-} ]]; then
    "$build/bin/fuzz_$target" -merge=1 -max_len=4096 "tests/fuzz/corpus/$target" "$build/corpus/$target" >/dev/null 2>&1
  fi
done
finish
