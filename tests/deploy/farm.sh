# shellcheck shell=bash disable=SC2034
# Sourced by the tests that run a farm, at the root of the checkout:
#
#   begin NAME SPP            a temporary folder $dir; the script's own `cleanup` is called at its end; $scene and
#                             $settings are what is rendered
#   require_programs          ends the script as failed if the release preset is not built
#   free_port                 prints one
#   key JOB KEY               one value of what the farm says of a job
#   progress JOB PACKETS      it has more than so many
#   unfinished JOB
#   workers STATE...          how many are in one of these states
#   render_locally FILE       the same scene and settings without a farm; same_pixels FILE compares with that
source tests/deploy/checks.sh
bin=$PWD/build/release/bin

begin() {
  dir=$(mktemp -d "${TMPDIR:-/tmp}/lightmill-$1.XXXXXX")
  scene=scenes/cornell-spheres.pbrt
  settings=(--integrator bdpt --spp "$2" --seed 3)
  trap cleanup EXIT
  trap 'exit 143' TERM INT
}

require_programs() {
  local program
  for program in lightmill lightmill-coordinator lightmill-worker; do
    [[ -x $bin/$program ]] || { echo "FAIL  $bin/$program is not there; build the release preset first"; failed=1; finish; }
  done
}

free_port() { /usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

key() { "$bin/lightmill" job "$1" --json | json 'value[sys.argv[2]]' "$2"; }
progress() { [[ $(key "$1" packets_done) -gt $2 ]]; }
unfinished() { [[ $(key "$1" packets_done) -lt $(key "$1" packets_total) ]]; }
workers() { "$bin/lightmill" workers --json | json 'sum(w["state"] in sys.argv[2:] for w in value)' "$@"; }
has_workers() { [[ $(workers idle rendering) == "$1" ]]; }

render_locally() { "$bin/lightmill" render "$scene" "${settings[@]}" --quiet -o "$dir/local.exr"; }
same_pixels() { /usr/bin/python3 tests/deploy/same_pixels.py "$1" "$dir/local.exr"; }
