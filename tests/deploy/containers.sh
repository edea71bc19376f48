#!/usr/bin/env bash
# What runs in containers: one Docker daemon and one set of images for tests/deploy/compose.sh, compose_standby.sh
# and swarm.sh, which also run alone, each with its own.
#   tests/deploy/containers.sh [--source]
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/docker_daemon.sh
# shellcheck disable=SC2317  # begin calls it
cleanup() { stop_docker "$dir"; }
begin containers 1
farm_images "$dir" "${1:-prebuilt}"
export LIGHTMILL_DOCKER_DIR=$dir
for script in compose compose_standby swarm; do
  echo "-- $script (${SECONDS}s)"
  bash "tests/deploy/$script.sh" | tee "$dir/$script.log"
  figures=$(grep -E '^[0-9]+ passed, [0-9]+ failed' "$dir/$script.log" | tail -n 1)
  read -r script_passed _ script_failed _ script_skipped _ <<<"${figures:-0 passed, 1 failed}, 0 skipped"
  passed=$((passed + script_passed)) failed=$((failed + ${script_failed%,})) skipped=$((skipped + script_skipped))
done
finish
