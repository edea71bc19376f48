#!/usr/bin/env bash
# The contract's own checks, run as they are: tests/deploy/contract.sh CHECK-SCRIPT
#
# One of them expects a wrong line: it puts a typo on line 16 of its scene and wants it named on line 17. That one
# counts as skipped, with this reason, as long as the script says so and `lightmill check` names line 16.
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
script=$(realpath "$1") || exit 1
cd "$root" || exit 1
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

bash "$script" | tee "$dir/log"
read -r passed failed < <(sed -nE 's/^([0-9]+) passed, ([0-9]+) failed.*/\1 \2/p' "$dir/log" | tail -n 1)
[[ -n ${failed:-} ]] || exit 1

skipped=0
if grep -q '^FAIL  typo names its line' "$dir/log" && grep -qF "typo.pbrt:17:2[0-9]" "$script"; then
  # The script's scene and its typo, as the script makes them.
  sed -n "/^cat >\"\$T\/box.pbrt\"/,/^P\$/p" "$script" | sed '1d;$d' |
    sed 's/"diffuse" "rgb reflectance" \[0.63/"diffuse" "rgb reflectence" [0.63/' >"$dir/typo.pbrt"
  line=$(grep -n reflectence "$dir/typo.pbrt" | cut -d: -f1)
  if [[ $line == 16 && $(build/release/bin/lightmill check "$dir/typo.pbrt" 2>&1) == *"typo.pbrt:16:20:"* ]]; then
    echo "skipped: \"typo names its line\" expects line 17 of a typo on line 16; lightmill check names 16:20"
    failed=$((failed - 1)) skipped=1
  fi
fi
echo "$passed passed, $failed failed, $skipped skipped"
[[ $failed == 0 ]]
