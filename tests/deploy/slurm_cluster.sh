# shellcheck shell=bash disable=SC2034
# Sourced by tests that need Slurm: a cluster of the test's own, two nodes n1 and n2 of two processors each that are
# both this machine, with a partition "main" and one, "urgent", whose jobs preempt those of "main".
#
#   start_slurm DIR      exports SLURM_CONF; returns 1 with the reason in $slurm_reason where it can't be
#   stop_slurm           cancels what runs, ends the daemons
slurm_pids=() slurm_reason=''
export PATH=/usr/bin:/usr/sbin:/sbin:$PATH

# free_ports N: that many different free ports, on a line.
free_ports() {
  /usr/bin/python3 -c 'import socket, sys
held = [socket.create_server(("127.0.0.1", 0)) for _ in range(int(sys.argv[1]))]
print(*[s.getsockname()[1] for s in held])' "$1"
}

start_slurm() {
  local dir=$1 ports i
  [[ $(id -u) == 0 ]] || { slurm_reason="the daemons of Slurm need root"; return 1; }
  mkdir -p "$dir"/{munge,ctld/state,d/spool.n1,d/spool.n2}
  chmod 755 "$dir" "$dir/munge"
  dd if=/dev/urandom of="$dir/munge/key" bs=1024 count=1 status=none
  chmod 600 "$dir/munge/key"
  munged -F --key-file="$dir/munge/key" --socket="$dir/munge/sock" --pid-file="$dir/munge/pid" \
    --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" >"$dir/munged.log" 2>&1 &
  slurm_pids+=($!)
  read -ra ports <<<"$(free_ports 3)"
  export SLURM_CONF=$dir/slurm.conf
  cat >"$SLURM_CONF" <<C
ClusterName=farm
SlurmctldHost=localhost
AuthType=auth/munge
AuthInfo=socket=$dir/munge/sock,cred_expire=5
SlurmUser=root
SlurmctldPort=${ports[0]}
SlurmctldPidFile=$dir/ctld/pid
StateSaveLocation=$dir/ctld/state
SlurmdPidFile=$dir/d/pid.%n
SlurmdSpoolDir=$dir/d/spool.%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
ReturnToService=2
KillWait=30
SchedulerParameters=batch_sched_delay=0,sched_interval=5,sched_min_interval=100000
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
NodeName=n1 NodeHostname=localhost NodeAddr=127.0.0.1 Port=${ports[1]} CPUs=2 RealMemory=1000
NodeName=n2 NodeHostname=localhost NodeAddr=127.0.0.1 Port=${ports[2]} CPUs=2 RealMemory=1000
PartitionName=main Nodes=ALL Default=YES State=UP PriorityTier=1 PreemptMode=REQUEUE
PartitionName=urgent Nodes=ALL State=UP PriorityTier=10
C
  for ((i = 0; i < 100; ++i)); do [[ -S $dir/munge/sock ]] && break; sleep 0.1; done
  slurmctld -D -c >"$dir/slurmctld.log" 2>&1 &
  slurm_pids+=($!)
  slurmd -D -N n1 >"$dir/slurmd.n1.log" 2>&1 &
  slurm_pids+=($!)
  slurmd -D -N n2 >"$dir/slurmd.n2.log" 2>&1 &
  slurm_pids+=($!)
  for ((i = 0; i < 300; ++i)); do
    [[ $(sinfo -h -p main -t idle -o %D 2>/dev/null) == 2 ]] && return 0
    sleep 0.1
  done
  slurm_reason="Slurm does not start here: $(grep -hE 'error|fatal' "$dir"/*.log | tail -n 1 | cut -c1-200)"
  return 1
}

stop_slurm() {
  local i pid
  if [[ ${#slurm_pids[@]} -gt 0 ]]; then
    scancel --me --full --signal=KILL >/dev/null 2>&1
    scancel --me >/dev/null 2>&1
    for ((i = 0; i < 100; ++i)); do [[ -z $(squeue -h 2>/dev/null) ]] && break; sleep 0.1; done
    for pid in "${slurm_pids[@]}"; do kill "$pid" 2>/dev/null; done
    wait "${slurm_pids[@]}" 2>/dev/null
  fi
}
