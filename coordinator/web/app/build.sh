#!/usr/bin/env bash
# Builds the dashboard and turns it into a C++ source.
#   build.sh WORK_FOLDER OUTPUT.cc
# Nothing is written beside the sources: they are copied to the work folder, where the npm packages are kept too.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$1 output=$2

fail() {
  echo "dashboard: $1; or leave it out: cmake -DLIGHTMILL_DASHBOARD=OFF" >&2
  exit 1
}

mkdir -p "$work"
for part in package.json package-lock.json tsconfig.json vite.config.js index.html; do cp "$here/$part" "$work/"; done
rm -rf "$work/src" "$work/public"
cp -r "$here/src" "$here/public" "$work/"
cd "$work"
# Installed anew only when the lock file is another: the marker is written last.
if ! cmp -s package-lock.json .installed; then
  rm -f .installed
  # No package's own scripts run; what they would compile comes built, as packages.
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error >npm.log 2>&1 ||
    fail "npm ci failed ($(grep -m 1 -E 'npm (ERR!|error)' npm.log || tail -n 1 npm.log)); does npm reach its registry?"
  cp package-lock.json .installed
fi
npm run --silent build >build.log 2>&1 || { cat build.log >&2; fail "it does not build"; }
node "$here/embed.mjs" dist "$output"
