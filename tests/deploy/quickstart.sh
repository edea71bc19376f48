#!/usr/bin/env bash
# deploy/quickstart.sh on a checkout that is built already: it must not build again, and leave what it says.
# (tests/run.sh in a clean clone has just done the install and the build, by the same functions.)
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

run() { bash deploy/quickstart.sh "$dir/out" >"$dir/log" 2>&1 </dev/null || { tail -n 3 "$dir/log"; return 1; }; }
png() { [[ $(head -c 8 "$dir/out/cornell-spheres.png" | od -An -tx1 | tr -d ' ') == 89504e470d0a1a0a ]]; }
pixels() { /usr/bin/python3 tests/deploy/same_pixels.py "$dir/out/cornell-spheres.exr" "$dir/out/cornell-spheres.exr"; }
curve() { [[ $(wc -l <"$dir/out/report/error.csv") -ge 3 ]] && grep -q '<svg' "$dir/out/report/error.svg" && grep -qi '<html' "$dir/out/report/report.html"; }
says_where() { local file; for file in cornell-spheres.exr cornell-spheres.png report/report.html; do grep -qF "$dir/out/$file" "$dir/log" || { echo "does not name $file"; return 1; }; done; }
unknown() { bash deploy/quickstart.sh --nonsense >/dev/null 2>&1; [[ $? == 2 ]]; }

check "runs" run
check "does not build again" grep -q 'no work to do' "$dir/log"
check "shows progress" grep -q '[0-9] %.*spp' "$dir/log"
check "EXR with finite pixels" pixels
check "PNG" png
check "report" curve
check "says where the files are" says_where
check "says what to try next" grep -q 'lightmill submit' "$dir/log"
check "an unknown option is refused" unknown
finish
