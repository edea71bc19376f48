#!/usr/bin/env bash
# Run by tests/deploy/package.sh within a fresh Debian where the package was installed, without systemd. What it starts
# ends with its namespace.
# shellcheck disable=SC1091,SC2317  # files of the fresh Debian; functions that `check` calls
set -uo pipefail
source /root/test/checks.sh
work=$(mktemp -d)
cd "$work" || exit 1
scene=/usr/share/lightmill/scenes/cornell-spheres.pbrt
settings=(--spp 1 --resolution 32x32 --seed 3 --quiet)

disabled() { [[ $(find /etc/systemd/system -name 'lightmill-*' ! -name lightmill-test.service) == '' ]]; }
version() { [[ $(lightmill --version) == 'lightmill '[0-9]* ]]; }
render() { lightmill render "$scene" "${settings[@]}" -o local.exr && lightmill render "$scene" "${settings[@]}" -o local.png && [[ -s local.exr && -s local.png ]]; }
ports() { [[ -s ports ]]; }
farm() {
  lightmill-coordinator --listen 127.0.0.1:0 --http 127.0.0.1:0 --data data --port-file ports >coordinator.log 2>&1 &
  until_true 60 ports || { tail -n 1 coordinator.log; return 1; }
  source ./ports
  lightmill-worker --coordinator "127.0.0.1:${rpc:?}" --cache-dir cache --threads 1 >worker.log 2>&1 &
  timeout 120 lightmill submit "$scene" "${settings[@]}" --coordinator "127.0.0.1:$rpc" --wait -o farm.exr || { tail -n 1 worker.log; return 1; }
}
same() { lightmill compare farm.exr local.exr --json | grep -E '"mse": *0(\.0*)?[,}]?$' || { lightmill compare farm.exr local.exr --json; return 1; }; }

check "the units are disabled" disabled
check "lightmill --version" version
check "renders" render
check "coordinator, worker and submit" farm
check "the farm's image is the local one" same
finish
