#!/usr/bin/env bash
# Formatting and lint of what is in git; needs a configured build/release. One check to a tool and folder.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh
deploy/install_packages.sh lint || exit 1

formatted() { git ls-files -z "$1/*.cc" "$1/*.h" | xargs -0 clang-format --dry-run -Werror; }
tidy() { git ls-files -z "$1/*.cc" | xargs -0 -P "$(nproc)" -n 4 clang-tidy -p build/release --quiet --warnings-as-errors='*'; }

for folder in common coordinator worker client tests; do check "clang-format $folder" formatted "$folder"; done
for folder in common coordinator worker client; do check "clang-tidy $folder" tidy "$folder"; done
finish
