#!/usr/bin/env bash
# compose.standby.yaml on top of compose.yaml, really run: two coordinators of one PostgreSQL, of which the one that
# leads is killed in mid-job, and the same pixels as a local render.
#   tests/deploy/compose_standby.sh [--source]
# Skips with its reason where there is no root or the kernel runs no containers.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/docker_daemon.sh

export COMPOSE_PROJECT_NAME=lightmillstandby
compose() { docker-compose -f "$dir/context/deploy/compose.yaml" -f "$dir/context/deploy/compose.standby.yaml" "$@"; }
cleanup() {
  [[ -n ${DOCKER_HOST:-} ]] && (compose down -v -t 5) >/dev/null 2>&1
  stop_docker "$dir"
}
begin standby 256
farm_images "$dir" "${1:-prebuilt}"
export LIGHTMILL_POSTGRES_IMAGE=lightmill-test-postgresql
database_image() { docker build --network host -t "$LIGHTMILL_POSTGRES_IMAGE" tests/deploy/postgresql; }
check "an image of Debian's PostgreSQL" database_image

# --- up -----------------------------------------------------------------------------------------------------
LIGHTMILL_RPC_PORT=$(free_port) LIGHTMILL_HTTP_PORT=$(free_port)
LIGHTMILL_STANDBY_RPC_PORT=$(free_port) LIGHTMILL_STANDBY_HTTP_PORT=$(free_port)
export LIGHTMILL_RPC_PORT LIGHTMILL_HTTP_PORT LIGHTMILL_STANDBY_RPC_PORT LIGHTMILL_STANDBY_HTTP_PORT
export LIGHTMILL_COORDINATOR=127.0.0.1:$LIGHTMILL_RPC_PORT,127.0.0.1:$LIGHTMILL_STANDBY_RPC_PORT
container() { compose ps -q "$1" | head -n 1; }
inspect() { docker inspect -f "$2" "$(container "$1")"; }
healthy() { [[ $(inspect "$1" '{{.State.Health.Status}}') == healthy ]]; }
check "the overlay fits on top" compose config -q
up() { (compose up -d --no-build --scale worker=2); }
check "up" up
for service in database coordinator standby; do check "$service turns healthy" until_true 60 healthy "$service"; done
if [[ $failed != 0 ]]; then
  compose ps -a
  compose logs --no-color --tail 20
  finish
fi

export LIGHTMILL_CREDENTIALS=$dir/credentials/client
mkdir "$dir/credentials"
take_credentials() { compose run --rm -T --no-deps --entrypoint tar init -C /var/lib/lightmill/credentials -c client | tar -x -C "$dir/credentials"; }
check "the client's credentials come out of the volume" take_credentials
# status SERVICE PAGE: of its published HTTP port.
status() {
  local port=$LIGHTMILL_HTTP_PORT
  [[ $1 == coordinator ]] || port=$LIGHTMILL_STANDBY_HTTP_PORT
  curl -sS --cacert "$LIGHTMILL_CREDENTIALS/ca.crt" -o /dev/null -w '%{http_code}' "https://127.0.0.1:$port$2"
}
leader() {
  local service
  for service in coordinator standby; do [[ $(status "$service" /healthz) == 200 ]] && echo "$service"; done
}
one_leads() { [[ $(leader | wc -l) == 1 ]]; }
check "one of the two leads" until_true 30 one_leads
first=$(leader)
second=$(printf 'coordinator\nstandby\n' | grep -vx "$first")
stands_by() { [[ $(status "$1" /healthz) == 503 && $(status "$1" /livez) == 200 ]]; }
check "the other one stands by, and is healthy" stands_by "$second"
check "two workers register" until_true 60 has_workers 2
passwords() { [[ $(compose exec -T "$1" find /var/lib/lightmill/credentials/database /run -name pgpass -o -name password 2>/dev/null | wc -l) == "$2" ]]; }
check "a coordinator has the password of the database" passwords standby 2
check "a worker does not" passwords worker 0
no_way() { ! compose exec -T worker bash -c 'exec 3<>/dev/tcp/database/5432' 2>/dev/null; }
check "nor a way there" no_way
read_only() { ! compose exec -T "$1" touch /etc/x /usr/bin/x 2>/dev/null; }
limited() { [[ $(inspect "$1" '{{.HostConfig.NanoCpus}} {{.HostConfig.Memory}}') =~ ^[1-9][0-9]*\ [1-9] ]]; }
not_root() { [[ $(compose exec -T "$1" id -u) != 0 ]]; }
for service in database standby; do
  check "$service has a read-only root" read_only $service
  check "$service has CPU and memory limits" limited $service
  check "$service does not run as root" not_root $service
done

# --- a job, while the one that leads dies ---------------------------------------------------------------------
job=$("$bin/lightmill" submit "$scene" "${settings[@]}" --quiet)
check "the workers make progress" until_true 60 progress "$job" 0
# Started again at once, it could be the one that takes over: it is to stay away until the other one has.
docker update --restart no "$(inspect "$first" '{{.Id}}')" >/dev/null
kill -9 "$(inspect "$first" '{{.State.Pid}}')"
leads() { [[ $(leader) == "$1" ]]; }
check "the other one takes over" until_true 30 leads "$second"
check "with the job, which is still running" unfinished "$job"
check "and both workers" until_true 60 has_workers 2
comes_back() { compose start "$first" && until_true 60 stands_by "$first"; }
check "the one that was killed is started again, and stands by" comes_back
check "the job finishes" timeout 600 "$bin/lightmill" watch "$job"
check "fetch" "$bin/lightmill" fetch "$job" -o "$dir/farm.exr"
check "local render" render_locally
check "farm and local give the same pixels" same_pixels "$dir/farm.exr"

# --- everything again on the old volumes ------------------------------------------------------------------------
sees_job() { compose run --rm -T --no-deps cli jobs --json | grep -q "$job"; }
check "the cli service finds the one that leads" sees_job
again() { (compose stop -t 40 && compose up -d --no-build) && until_true 60 one_leads; }
check "stopped and started, one leads" again
check "and has the job" key "$job" id

if [[ $failed != 0 ]]; then compose logs --no-color --tail 30; fi
finish
