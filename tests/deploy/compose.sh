#!/usr/bin/env bash
# The Compose farm, really run: images, submit, a scale from 1 to 3 workers and the death of the coordinator in
# mid-job, fetch, and the same pixels as a local render.
#   tests/deploy/compose.sh             images from the programs in build/release/bin
#   tests/deploy/compose.sh --source    images that compile the checkout themselves, as a user's do
# Skips with its reason where there is no root or the kernel runs no containers.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/docker_daemon.sh

export COMPOSE_PROJECT_NAME=lightmilltest
compose() { docker-compose -f "$dir/context/deploy/compose.yaml" "$@"; }
cleanup() {
  [[ -n ${DOCKER_HOST:-} ]] && timeout 120 docker-compose -f "$dir/context/deploy/compose.yaml" -f "$dir/context/deploy/compose.monitoring.yaml" down -v -t 5 >/dev/null 2>&1
  stop_docker "$dir"
}
begin compose 256
farm_images "$dir" "${1:-prebuilt}"

# --- up -----------------------------------------------------------------------------------------------------
LIGHTMILL_RPC_PORT=$(free_port) LIGHTMILL_HTTP_PORT=$(free_port)
export LIGHTMILL_RPC_PORT LIGHTMILL_HTTP_PORT LIGHTMILL_COORDINATOR=127.0.0.1:$LIGHTMILL_RPC_PORT
container() { compose ps -q "$1" | head -n 1; }
healthy() { [[ $(docker inspect -f '{{.State.Health.Status}}' "$(container coordinator)") == healthy ]]; }
limited() { [[ $(docker inspect -f '{{.HostConfig.NanoCpus}} {{.HostConfig.Memory}}' "$(container "$1")") =~ ^[1-9][0-9]*\ [1-9] ]]; }
not_root() { [[ $(compose exec -T "$1" id -u) != 0 ]]; }

check "compose.yaml is valid" compose config -q
check "up with one worker" timeout 180 docker-compose -f "$dir/context/deploy/compose.yaml" up -d --no-build
check "the coordinator turns healthy" until_true 60 healthy
if [[ $failed != 0 ]]; then
  compose ps -a; compose logs --no-color --tail 20
  finish
fi
for service in coordinator worker; do
  check "$service has CPU and memory limits" limited $service
  check "$service does not run as root" not_root $service
done
# The credentials that init made, for the client on the host: the line of docs/compose.md.
export LIGHTMILL_CREDENTIALS=$dir/credentials/client
mkdir "$dir/credentials"
take_credentials() { compose run --rm -T --no-deps --entrypoint tar init -C /var/lib/lightmill/credentials -c client ca/ca.crt coordinator/tokens | tar -x -C "$dir/credentials"; }
check "the client's credentials come out of the volume" take_credentials
page() { curl -fsS --cacert "$LIGHTMILL_CREDENTIALS/ca.crt" -o /dev/null "$@"; }
check "the dashboard answers on the published port" page "https://127.0.0.1:$LIGHTMILL_HTTP_PORT/healthz"
with_token() { page -u "me:$(cat "$LIGHTMILL_CREDENTIALS/token")" "https://127.0.0.1:$LIGHTMILL_HTTP_PORT/"; }
check "the dashboard takes the token" with_token
without_token() { [[ $(page -w '%{http_code}' "https://127.0.0.1:$LIGHTMILL_HTTP_PORT/") == 401 ]]; }
check "and nobody without" without_token
no_plain_text() { local said; said=$(env -u LIGHTMILL_CREDENTIALS "$bin/lightmill" jobs 2>&1); [[ $? == 3 && $said == *"it speaks TLS; give --credentials"* ]]; }
check "plain text is refused with advice" no_plain_text
hashes_only() { ! grep -qF "$(cat "$LIGHTMILL_CREDENTIALS/token")" "$dir/credentials/coordinator/tokens"; }
check "tokens are hashed at rest" hashes_only
no_keys() { ! compose exec -T worker find / -name ca.key -o -name tokens 2>/dev/null | grep -q .; }
check "a worker sees neither the authority's key nor the tokens" no_keys
read_only() { ! compose exec -T "$1" touch /etc/x /usr/bin/x /var/lib/lightmill/x 2>/dev/null; }
for service in coordinator worker; do check "$service has a read-only root" read_only $service; done

# --- a job, while the farm changes under it -------------------------------------------------------------------
job=$("$bin/lightmill" submit "$scene" "${settings[@]}" 2>"$dir/submit.log" | tail -n 1)
check "submit prints a job id" test -n "$job"
[[ -n $job ]] || { cat "$dir/submit.log"; finish; }
check "one worker makes progress" until_true 60 progress "$job" 0
check "scale to three workers" timeout 120 docker-compose -f "$dir/context/deploy/compose.yaml" up -d --no-build --scale worker=3
check "three workers are registered" until_true 60 has_workers 3
check "the job is still running" unfinished "$job"

coordinator=$(container coordinator)
kill -9 "$(docker inspect -f '{{.State.Pid}}' "$coordinator")"
restarted() { [[ $(docker inspect -f '{{.RestartCount}}' "$coordinator") -ge 1 ]] && healthy; }
check "the killed coordinator is restarted and healthy" until_true 60 restarted
check "the job finishes" timeout 600 "$bin/lightmill" watch "$job"
"$bin/lightmill" job "$job" --json || true
check "fetch" "$bin/lightmill" fetch "$job" -o "$dir/farm.exr"

# --- the same bits --------------------------------------------------------------------------------------------
check "local render" render_locally
check "farm and local give the same pixels" same_pixels "$dir/farm.exr"

# --- the rest of the file ---------------------------------------------------------------------------------------
cli_sees_job() { compose run --rm -T cli jobs --json | grep -q "$job"; }
check "the cli service reaches the coordinator" cli_sees_job
worker=$(container worker)
drains() { timeout 100 docker stop -t 70 "$worker" && [[ $(docker inspect -f '{{.State.ExitCode}}' "$worker") == 0 ]]; }
check "a stopped worker drains and exits with 0" drains
recreate() { compose rm -sf coordinator && compose up -d --no-build --no-deps coordinator && until_true 60 healthy; }
check "a new coordinator container comes up on the old volume" recreate
check "the job is still there" key "$job" id

# --- monitoring, but for the images of others -----------------------------------------------------------------
monitored() { compose -f "$dir/context/deploy/compose.monitoring.yaml" "$@"; }
check "compose.monitoring.yaml fits on top" monitored config -q
check "up with metrics of the workers" timeout 180 docker-compose -f "$dir/context/deploy/compose.yaml" \
  -f "$dir/context/deploy/compose.monitoring.yaml" up -d --no-build coordinator worker
check "the coordinator is healthy" until_true 60 healthy
worker_metrics() {
  compose exec -T coordinator bash -c 'exec 3<>/dev/tcp/worker/9100 && printf "GET /metrics HTTP/1.0\r\n\r\n" >&3 && cat <&3' |
    grep '^lightmill_worker_tiles_total'  # not -q: who writes must not find the pipe closed
}
check "a worker serves its metrics within the network" until_true 60 worker_metrics
observer() { monitored run --rm -T --no-deps --entrypoint cat init /var/lib/lightmill/credentials/observer/token; }
scraped() { curl -fsS --cacert "$LIGHTMILL_CREDENTIALS/ca.crt" -H "Authorization: Bearer $(observer)" "https://127.0.0.1:$LIGHTMILL_HTTP_PORT/metrics" | grep '^lightmill_workers_wanted'; }
check "the token for Prometheus shows the coordinator's" scraped
owned() { [[ $(monitored run --rm -T --no-deps --entrypoint stat init -c %u /var/lib/lightmill/data /var/lib/lightmill/cache | sort -u) == 1000 ]]; }
check "volumes of Prometheus and Grafana belong to their user" owned

if [[ $failed != 0 ]]; then compose logs --no-color --tail 30; fi
finish
