#!/usr/bin/env bash
# The dashboard in a real browser (Debian's chromium, driven by playwright-core) against a real farm.
#   tests/dashboard/run.sh [--screenshots FOLDER] [--only PART-OF-A-NAME]
# Needs the release build, node, npm and chromium (deploy/install_packages.sh build browser). The last line is
# "N passed, N failed".
set -uo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(cd "$here/../.." && pwd)
work=$root/build/dashboard-test

skip() {
  echo "skipped: $1"
  echo "0 passed, 0 failed, 1 skipped"
  exit 0
}
fail() {
  echo "dashboard tests: $1" >&2
  echo "0 passed, 1 failed"
  exit 1
}

[[ -x $root/build/release/bin/lightmill-coordinator ]] || fail "build first: cmake --build --preset release"
grep -q '^LIGHTMILL_DASHBOARD:BOOL=ON' "$root/build/release/CMakeCache.txt" ||
  skip "the dashboard was left out of this build (LIGHTMILL_DASHBOARD=OFF)"
command -v chromium >/dev/null || fail "chromium was not found: deploy/install_packages.sh browser"
mkdir -p "$work"
cp "$here"/package.json "$here"/package-lock.json "$here"/*.mjs "$work/"
if ! cmp -s "$work/package-lock.json" "$work/.installed"; then
  (cd "$work" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error >npm.log 2>&1) ||
    fail "npm ci failed: $(tail -n 1 "$work/npm.log")"
  cp "$work/package-lock.json" "$work/.installed"
fi
cd "$work" && exec node dashboard_test.mjs "$root" "$@"
