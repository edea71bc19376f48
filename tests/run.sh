#!/usr/bin/env bash
# Sets up, builds and runs tests, fast ones first. The last line is "N passed, N failed, N skipped" over all of them.
#   tests/run.sh           what a change must pass: unit tests, statistics, farms of real processes, the command line,
#                          the dashboard in Chromium, the quickstart; 25 minutes on 2 cores
#   tests/run.sh --fast    unit tests and what the tree promises of itself; 10 minutes on 2 cores
#   tests/run.sh --all     also the largest farms, more chaos, benches, Blender, containers (Compose, Swarm), Kubernetes,
#                          Slurm, the package, sanitizers, half a minute of each fuzzer, formatting and lint
#   --no-install           packages are there already (no root needed)
# Logs stay in build/test-logs. Exit codes: 0 all passed, 1 some failed or the build did, 2 wrong usage.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root" || exit 1
source deploy/build_env.sh

tier=middle install=true
for argument in "$@"; do
  case $argument in
    --fast) tier=fast ;;
    --all) tier=all ;;
    --no-install) install=false ;;
    *) sed -n '2,9s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; [[ $argument == --help ]] && exit 0 || exit 2 ;;
  esac
done

cores=$(nproc)
logs=$root/build/test-logs
mkdir -p "$logs"
passed=0 failed=0 skipped=0
summary=()

# count NAME PASSED FAILED SKIPPED [NOTE]: adds a part's figures.
count() {
  passed=$((passed + $2)) failed=$((failed + $3)) skipped=$((skipped + $4))
  summary+=("$(printf '%-24s %5d passed %4d failed %4d skipped  %s' "$1" "$2" "$3" "$4" "${5:-}")")
}

finish() {
  echo
  printf '%s\n' "${summary[@]}"
  echo "$passed passed, $failed failed, $skipped skipped"
  [[ $failed == 0 ]]
  exit
}

part() { printf '\n== %s (%ds)\n' "$1" "$SECONDS"; }

# ctest_part NAME PRESET CTEST-OPTIONS...: counts from the JUnit file that ctest writes.
ctest_part() {
  local name=$1 preset=$2 junit=$logs/${1// /-}.xml figures
  shift 2
  part "$name"
  rm -f "$junit"
  # A line to a test is enough, and parametrised names are long: no "Start" lines, no dot leaders.
  ctest --test-dir "build/$preset" --output-on-failure --no-tests=ignore --output-junit "$junit" "$@" |
    sed -uE '/^ +Start +[0-9]+:/d; s/ +(# GetParam\(\).*)?\.{3,} */ ... /'
  local status=${PIPESTATUS[0]}
  # A test "not run" for another reason than its own skip (a missing program, a failed fixture) has failed.
  figures=$(/usr/bin/python3 - "$junit" <<'P'
import sys, xml.etree.ElementTree as tree
counts = {"passed": 0, "failed": 0, "skipped": 0}
for case in tree.parse(sys.argv[1]).getroot().iter("testcase"):
    skip = case.find("skipped")
    skipped = case.get("status") == "disabled" or (skip is not None and skip.get("message", "").startswith("SKIP_"))
    counts["passed" if case.get("status") == "run" else "skipped" if skipped else "failed"] += 1
print(*counts.values())
P
  ) || figures=
  if [[ -z $figures ]]; then
    count "$name" 0 1 0 "ctest ended with $status and left no result"
    return
  fi
  # shellcheck disable=SC2086
  count "$name" $figures
}

# script_part NAME COMMAND...: a script whose last line is "N passed, N failed[, N skipped]".
script_part() {
  local name=$1 log=$logs/${1// /-}.log line
  shift
  part "$name"
  "$@" 2>&1 </dev/null | tee "$log"
  local status=${PIPESTATUS[0]}
  line=$(grep -E '^[0-9]+ passed, [0-9]+ failed(, [0-9]+ skipped)?$' "$log" | tail -n 1)
  if [[ -z $line ]]; then
    count "$name" 0 1 0 "ended with $status and no count: $(tail -n 1 "$log" | cut -c1-80)"
    return
  fi
  local figures
  read -ra figures <<<"$(tr -dc '0-9 ' <<<"$line")"
  # A script that counts no failure and yet fails has failed.
  [[ $status != 0 && ${figures[1]} == 0 ]] && figures[1]=1
  count "$name" "${figures[0]}" "${figures[1]}" "${figures[2]:-0}" "$(grep -m 1 '^skipped: ' "$log")"
}

# build_part PRESET TARGETS...: compiles; a build that fails ends the run when it is the release build.
build_part() {
  local preset=$1
  part "build $preset"
  build "$@" >"$logs/build-$preset.log" 2>&1 && { tail -n 1 "$logs/build-$preset.log"; return 0; }
  grep -E -A5 -m 8 'FAILED|error|Error' "$logs/build-$preset.log" || tail -n 20 "$logs/build-$preset.log"
  count "build $preset" 0 1 0 "see build/test-logs/build-$preset.log"
  return 1
}

if $install; then
  part "packages"
  groups=(build test)
  [[ $tier != fast ]] && groups+=(browser)
  [[ $tier == all ]] && groups+=(blender fuzz lint)
  deploy/install_packages.sh "${groups[@]}" || { count packages 0 1 0; finish; }
fi

# unbuilt PRESET: a pattern of the tests whose programs have not been built, which would count as failed.
unbuilt() {
  local names
  names=$(ctest --test-dir "build/$1" --show-only=json-v1 | /usr/bin/python3 -c '
import json, sys
print("|".join(test["name"] for test in json.load(sys.stdin)["tests"] if "command" not in test))')
  echo "^(${names:-none})\$"
}

script_part "layout" bash tests/deploy/layout.sh
build_part release ON -j "$cores" --target fast_tests lightmill lightmill-coordinator lightmill-worker || finish
ctest_part "fast tests" release -LE 'slow|extreme|farm|bench|long' -E "$(unbuilt release)" -j "$cores" --timeout 300
[[ $tier == fast ]] && finish

build_part release ON -j "$cores" || finish
ctest_part "slow tests" release -L 'slow|extreme' -j "$cores" --timeout 3600
if [[ $tier == middle ]]; then farm=(-L farm -LE long); else farm=(-L 'farm|long'); fi
ctest_part "farm tests" release "${farm[@]}" -j "$cores" --timeout 1800
if [[ -f ../shared/contract/check.sh ]]; then
  script_part "contract" bash tests/deploy/contract.sh ../shared/contract/check.sh
fi
script_part "dashboard" bash tests/dashboard/run.sh
script_part "quickstart" bash tests/deploy/quickstart.sh
[[ $tier == middle ]] && finish

build_part release ON -j "$cores" --target benches && ctest_part "benches" release -L bench --timeout 1800
script_part "containers" bash tests/deploy/containers.sh
script_part "kubernetes" bash tests/deploy/kubernetes.sh
script_part "slurm" bash tests/deploy/slurm.sh
script_part "package" bash tests/deploy/package.sh

# sanitizer_part PRESET TARGETS...: those test binaries alone; the others of the preset are not built.
sanitizer_part() {
  local preset=$1
  shift
  build_part "$preset" ON -j "$cores" --target "$@" || return
  # LeakSanitizer 12 follows what it has noted of thread-local storage of loaded libraries, and crashes there.
  ASAN_OPTIONS=intercept_tls_get_addr=0 ctest_part "$preset" "$preset" -E "$(unbuilt "$preset")" -LE 'slow|farm|bench|long' -j "$cores" --timeout 1200
}

# What reads bytes from outside, what shares state between threads, and what renders on its own account.
# Libraries are not instrumented, so ThreadSanitizer sees the parts without gRPC and Embree.
sanitizer_part asan base_test job_test film_test error_test image_test farm_types_test scene_test gltf_test \
  reader_fuzz_test rpc_test agent_test coordinator_store_test coordinator_farm_test coordinator_service_test \
  coordinator_web_test render_plan_test render_guiding_test render_pipeline_test
sanitizer_part tsan agent_test coordinator_plan_test coordinator_farm_test
# Divisions by zero and casts that overflow, where the numbers are at their most extreme. GCC checks scalars, not
# vector lanes.
sanitizer_part ubsan extreme_suite
script_part "fuzz" bash tests/fuzz/run.sh 30
script_part "lint" bash tests/deploy/lint.sh
finish
