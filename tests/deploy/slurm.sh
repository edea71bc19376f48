#!/usr/bin/env bash
# The Slurm scripts, really run on a cluster of two virtual nodes: workers that join a coordinator and are cancelled,
# preempted and sent off by their time limit while they render; a farm inside one allocation that is interrupted and
# goes on. Both images have the pixels of a local render.
# Skips with its reason where there is no root or Slurm does not start.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/slurm_cluster.sh

coordinator=''
cleanup() {
  stop_slurm
  if [[ -n $coordinator ]]; then kill "$coordinator" 2>/dev/null; wait "$coordinator"; fi
  rm -rf "$dir"
}
begin slurm 256
require_programs
[[ $(id -u) == 0 ]] || skip_all "the daemons of Slurm need root"
deploy/install_packages.sh slurm || skip_all "Slurm's packages could not be installed"
start_slurm "$dir" || skip_all "$slurm_reason"

# --- a coordinator outside of Slurm ---------------------------------------------------------------------------
"$bin/lightmill-coordinator" init --dir "$dir/credentials" --san localhost >/dev/null
"$bin/lightmill-coordinator" --listen 127.0.0.1:0 --http 127.0.0.1:0 --data "$dir/data" --port-file "$dir/ports" \
  --credentials "$dir/credentials/coordinator" 2>"$dir/coordinator.log" &
coordinator=$!
ready() { [[ -s $dir/ports ]]; }
check "the coordinator starts" until_true 20 ready
LIGHTMILL_COORDINATOR=localhost:$(sed -n 's/^rpc=//p' "$dir/ports")
export LIGHTMILL_COORDINATOR LIGHTMILL_BIN=$bin LIGHTMILL_CREDENTIALS=$dir/credentials/client TMPDIR=$dir
check "local render" render_locally

# slurm_job ID FIELD: of scontrol's words about it.
slurm_job() { scontrol -o show job "$1" | tr ' ' '\n' | sed -n "s/^$2=//p" | head -n 1; }
in_state() { [[ $(slurm_job "$1" JobState) == "$2" ]]; }
says() { grep -q "$2" "$dir/$1"; }
# documented SCRIPT: docs/slurm.md's own line that submits it, for nodes as small as these.
documented() { grep "^sbatch .*$1" docs/slurm.md | sed -E 's/(--array)=1-8/\1=1-2/; s/(--cpus-per-task)=16/\1=1/; s/(--nodes)=4/\1=2/'; }
submit_workers() { LIGHTMILL_CREDENTIALS=$dir/credentials/worker bash -c "${1/sbatch/sbatch --parsable}"; }

# --- workers that come and go under a job ---------------------------------------------------------------------
no_coordinator() { env -u LIGHTMILL_COORDINATOR bash deploy/slurm/workers.sbatch; [[ $? == 2 ]]; }
check "workers without a coordinator's address are refused" no_coordinator
workers_line=$(documented workers.sbatch)
array=$(submit_workers "${workers_line/sbatch/sbatch -w n1 --output=$dir/worker-%a.log}")
limited=$(submit_workers "sbatch -w n2 --output=$dir/limited.log --time=1 --signal=B:TERM@20 deploy/slurm/workers.sbatch")
check "sbatch takes an array of workers" test -n "$array"
check "three workers register" until_true 60 has_workers 3
job=$("$bin/lightmill" submit "$scene" "${settings[@]}" --quiet)
check "they make progress" until_true 30 progress "$job" 0
if [[ $failed != 0 ]]; then
  tail -n 5 "$dir"/worker-*.log "$dir/limited.log" "$dir/coordinator.log"
  finish
fi

scancel "${array}_1"
check "a cancelled worker drains" until_true 40 says worker-1.log "draining"
check "and leaves" until_true 40 says worker-1.log "done: [0-9]* tiles committed"

before=$(key "$job" packets_done)
urgent=$(sbatch --parsable -p urgent -w n1 --exclusive --output=/dev/null --wrap 'sleep 2')
check "an urgent job preempts a worker, which drains" until_true 40 says worker-2.log "draining"
check "the urgent job ends" until_true 40 in_state "$urgent" COMPLETED
restarted() { [[ $(slurm_job "${array}_2" Restarts) -ge 1 ]] && in_state "${array}_2" RUNNING; }
check "the preempted worker is queued again and starts" until_true 60 restarted
check "the job is still running" unfinished "$job"
check "it goes on" until_true 60 progress "$job" "$before"

check "the time limit makes a worker drain" until_true 90 says limited.log "draining"
check "which ends in time, as completed" until_true 40 in_state "$limited" COMPLETED
check "the job finishes" timeout 300 "$bin/lightmill" watch "$job"
tidy() { [[ $(key "$job" leases_reassigned) == 0 ]]; }
check "no lease had to run out: all were finished or handed back" tidy
check "fetch" "$bin/lightmill" fetch "$job" -o "$dir/farm.exr"
check "the array's image has the pixels of the local render" same_pixels "$dir/farm.exr"
scancel "$array"

# --- a farm inside one allocation -------------------------------------------------------------------------------
usage() { SLURM_JOB_ID=1 bash deploy/slurm/farm.sbatch only-one; [[ $? == 2 ]]; }
check "farm.sbatch explains itself" usage
farm_line=$(documented farm.sbatch | sed "s|spheres.exr.*|$dir/inside.exr $scene ${settings[*]}|")
inside=$(env -u LIGHTMILL_COORDINATOR -u LIGHTMILL_CREDENTIALS LIGHTMILL_FARM_DIR="$dir/inside" \
  bash -c "${farm_line/sbatch/sbatch --parsable --output=$dir/inside.log}")
rendering() {
  local rpc
  rpc=$(sed -n 's/^rpc=//p' "$dir/inside/ports") && [[ -s $dir/inside/job ]] &&
    LIGHTMILL_COORDINATOR=localhost:$rpc LIGHTMILL_CREDENTIALS=$dir/inside/credentials/client progress "$(cat "$dir/inside/job")" 0
}
check "coordinator and workers start on two nodes" until_true 60 rendering
scancel --batch --signal=USR1 "$inside"  # as the time limit does
again() { [[ $(slurm_job "$inside" Restarts) -ge 1 ]] && in_state "$inside" RUNNING; }
check "near its time limit it is queued again" until_true 90 again
check "and completes" until_true 180 in_state "$inside" COMPLETED
no_second_job() { ! says inside.log 'j2'; }
check "going on with the same job" no_second_job
check "its image has the pixels of the local render" same_pixels "$dir/inside.exr"
gone() { [[ ! -e $dir/inside ]]; }
check "its folder is gone" gone

if [[ $failed != 0 ]]; then
  tail -n 15 "$dir"/worker-*.log "$dir/limited.log" "$dir/inside.log" "$dir/coordinator.log"
  grep -hE 'error|fatal' "$dir"/slurm*.log | tail -n 10
fi
finish
