#!/usr/bin/env bash
# Formatting and lint of what is in git; each file of the programs is compiled alone, without the
# others of its folder. One check to a tool and folder.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh
source deploy/build_env.sh
deploy/install_packages.sh lint || exit 1

formatted() { git ls-files -z "$1/*.cc" "$1/*.h" | xargs -0 clang-format --dry-run -Werror; }
tidy() { git ls-files -z "$1/*.cc" | xargs -0 -P "$(nproc)" -n 4 clang-tidy -p build/dev --quiet --warnings-as-errors='*'; }

alone() { build dev OFF -j "$(nproc)"; }

check "files compile alone" alone
for folder in common coordinator worker client tests; do check "clang-format $folder" formatted "$folder"; done
for folder in common coordinator worker client; do check "clang-tidy $folder" tidy "$folder"; done
finish
