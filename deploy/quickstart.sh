#!/usr/bin/env bash
# From a fresh Debian 12 to a first picture: installs packages, builds the release preset, renders
# scenes/cornell-spheres.pbrt on this machine.
#   deploy/quickstart.sh [FOLDER]     default: deploy/out
# Leaves cornell-spheres.exr, cornell-spheres.png and report/ (error against time) in FOLDER. A second run
# builds only what has changed.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -le 1 && ${1:-} != -* ]] || { sed -n '2,6s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"; [[ $1 == --help ]] && exit 0 || exit 2; }
mkdir -p "${1:-$root/deploy/out}"
out=$(cd "${1:-$root/deploy/out}" && pwd)
cd "$root"
source deploy/build_env.sh

if ! grep -qw avx2 /proc/cpuinfo || ! grep -qw fma /proc/cpuinfo; then
  echo "quickstart.sh: this processor lacks AVX2 or FMA, which Lightmill is built for" >&2
  exit 1
fi

echo "1/3  packages"
deploy/install_packages.sh build
echo "2/3  build (some minutes the first time)"
build release OFF --target lightmill lightmill-coordinator lightmill-worker
echo "3/3  render"
bin=build/release/bin
scene=scenes/cornell-spheres.pbrt
$bin/lightmill render $scene --report "$out/report" -o "$out/cornell-spheres.exr"
# The same seed gives the same pixels.
$bin/lightmill render $scene --quiet -o "$out/cornell-spheres.png"

cat <<END

Done:
  $out/cornell-spheres.png     to look at
  $out/cornell-spheres.exr     the float image
  $out/report/report.html      error against run time (error.csv, error.svg beside it)

What to try next, from $root:
  more samples, or a target:   $bin/lightmill render $scene --target-error 0.002 -o better.exr
  what a scene can't do yet:   $bin/lightmill check SCENE.pbrt
  a farm, in three terminals:  $bin/lightmill-coordinator --listen 127.0.0.1:7070 --http 127.0.0.1:8080 --data farm-data
                               $bin/lightmill-worker --coordinator 127.0.0.1:7070        (as many as you like)
                               $bin/lightmill submit $scene --spp 1024 --wait -o farm.exr
  the farm in containers:      docker compose -f deploy/compose.yaml up -d --build --scale worker=3
END
