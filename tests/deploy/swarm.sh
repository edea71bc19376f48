#!/usr/bin/env bash
# The Swarm stack, really run on one node: secrets, deploy, a scale from 1 to 2 workers and the death of the
# coordinator in mid-job, a scale to 0 that drains, fetch, and the same pixels as a local render.
# Skips with its reason where there is no root or the kernel runs no containers.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/docker_daemon.sh
swarm=false
# The stack's network gets a number of its own: Swarm's first one may be in use by another daemon, or be held by an
# interface which one that was killed left behind.
vni=$((0x100000 + RANDOM * 32 + $$ % 32))
cleanup() {
  if $swarm; then
    docker stack rm farm >/dev/null 2>&1
    docker swarm leave --force >/dev/null 2>&1
  fi
  stop_docker "$dir"
  # An interface that a daemon leaves behind would be in the way of the next network of its number.
  ip -o link show type vxlan | grep -oE "vx-$(printf %06x "$vni")-[^:@]+" | xargs -rn 1 ip link delete
}
begin swarm 160
farm_images "$dir" prebuilt

docker swarm init --advertise-addr 127.0.0.1 --listen-addr "127.0.0.1:$(free_port)" >"$dir/swarm.log" 2>&1 ||
  skip_all "no Swarm on this kernel: $(tail -n 1 "$dir/swarm.log" | cut -c1-200)"
swarm=true

# --- up -----------------------------------------------------------------------------------------------------
LIGHTMILL_RPC_PORT=$(free_port) LIGHTMILL_HTTP_PORT=$(free_port)
export LIGHTMILL_RPC_PORT LIGHTMILL_HTTP_PORT LIGHTMILL_COORDINATOR=127.0.0.1:$LIGHTMILL_RPC_PORT
export LIGHTMILL_CREDENTIALS=$dir/credentials/client
"$bin/lightmill-coordinator" init --dir "$dir/credentials" --san coordinator --san localhost >/dev/null
no_credentials() { deploy/swarm/secrets.sh "$dir/nowhere"; [[ $? == 2 ]]; }
check "secrets.sh names a folder that is not there" no_credentials
check "secrets are made" deploy/swarm/secrets.sh "$dir/credentials"
check "a second time does nothing" deploy/swarm/secrets.sh "$dir/credentials"
docker node update --label-add lightmill.coordinator=true "$(docker info -f '{{.Swarm.NodeID}}')" >/dev/null
cat >"$dir/number.yaml" <<YAML
version: "3.8"
networks:
  farm: {driver_opts: {com.docker.network.driver.overlay.vxlanid_list: "$vni"}}
YAML
check "stack deploy" docker stack deploy --resolve-image never -c deploy/swarm/stack.yaml -c "$dir/number.yaml" farm
container() { docker ps -q --filter "label=com.docker.swarm.service.name=farm_$1" | head -n 1; }
healthy() { [[ $(docker inspect -f '{{.State.Health.Status}}' "$(container coordinator)") == healthy ]]; }
check "the coordinator turns healthy" until_true 90 healthy
check "a worker registers" until_true 60 has_workers 1
if [[ $failed != 0 ]]; then
  docker service ps --no-trunc farm_coordinator farm_worker; docker service logs --tail 20 farm_coordinator; docker service logs --tail 20 farm_worker
  finish
fi
for service in coordinator worker; do
  read_only() { ! docker exec "$(container "$service")" touch /etc/x /usr/bin/x /run/credentials/x 2>/dev/null; }
  check "$service has a read-only root" read_only
  not_root() { [[ $(docker exec "$(container "$service")" id -u) != 0 ]]; }
  check "$service does not run as root" not_root
  limited() { [[ $(docker inspect -f '{{.HostConfig.NanoCpus}} {{.HostConfig.Memory}}' "$(container "$service")") =~ ^[1-9][0-9]*\ [1-9] ]]; }
  check "$service has CPU and memory limits" limited
done
own_secrets() { [[ $(docker exec "$(container worker)" ls /run/credentials | tr '\n' ' ') == "ca.crt tls.crt tls.key token " ]]; }
check "a worker has its own secrets and no others" own_secrets

# --- a job, while the farm changes under it -------------------------------------------------------------------
job=$("$bin/lightmill" submit "$scene" "${settings[@]}" --quiet)
check "one worker makes progress" until_true 60 progress "$job" 0
check "scale to two workers" timeout 120 docker service scale -d farm_worker=2
check "two workers are registered" until_true 60 has_workers 2
first=$(container coordinator)
kill -9 "$(docker inspect -f '{{.State.Pid}}' "$first")"
replaced() { local now; now=$(container coordinator); [[ -n $now && $now != "$first" ]] && healthy; }
check "a killed coordinator is replaced by another container on the same volume" until_true 60 replaced
check "the job finishes" timeout 300 "$bin/lightmill" watch "$job"
check "fetch" "$bin/lightmill" fetch "$job" -o "$dir/farm.exr"
check "local render" render_locally
check "farm and local give the same pixels" same_pixels "$dir/farm.exr"
scaled=$(date +%s)
check "scale to none" timeout 120 docker service scale -d farm_worker=0
drained() { [[ -z $(container worker) ]]; }
check "the workers leave" until_true 90 drained
# By the daemon's events: Swarm may already have removed the containers.
exits() {
  local codes
  codes=$(docker events --since "$scaled" --until "$(date +%s)" --filter event=die \
    --filter label=com.docker.swarm.service.name=farm_worker --format '{{.Actor.Attributes.exitCode}}')
  [[ $codes == $'0\n0' ]]
}
check "both drained, with exit code 0" until_true 10 exits
[[ $failed == 0 ]] || { docker service logs --tail 30 farm_coordinator; docker service logs --tail 30 farm_worker; }
finish
