#!/usr/bin/env bash
# Run by tests/deploy/package.sh as a service of a fresh Debian that was booted in a container of no network: the
# package's units at work.
# shellcheck disable=SC1091,SC2015,SC2154,SC2317  # files of the fresh Debian; functions that `check` calls
set -uo pipefail
source /root/test/checks.sh
export HOME=/root
work=$(mktemp -d)
cd "$work" || exit 1
scene=/usr/share/lightmill/scenes/cornell-spheres.pbrt
units=(lightmill-coordinator lightmill-worker)
show() { systemctl show -p "$2" --value "$1"; }

# Any free ports, in the files that an administrator edits.
sed -i -E 's/^(listen|http) = .*/\1 = "127.0.0.1:0"/' /etc/lightmill/coordinator.toml
ports() { [[ -s /run/lightmill-coordinator/ports ]] && source /run/lightmill-coordinator/ports; }
start() {
  systemctl start lightmill-coordinator && until_true 60 ports && ports || return 1
  sed -i "s/^coordinator = .*/coordinator = \"127.0.0.1:$rpc\"/" /etc/lightmill/worker.toml
  systemctl start lightmill-worker
}
submit() {
  ports
  rm -f farm.exr
  timeout 120 lightmill submit "$scene" --spp 1 --resolution 32x32 --quiet --coordinator "localhost:$rpc" --wait -o farm.exr "$@" && [[ -s farm.exr ]]
}
confined() {
  local unit status
  for unit in "${units[@]}"; do
    status=$(</proc/"$(show "$unit" MainPID)"/status)
    grep -q '^NoNewPrivs:.1' <<<"$status" && grep -q '^Seccomp:.2' <<<"$status" && grep -q '^CapEff:.0000000000000000' <<<"$status" &&
      ! grep -q '^Uid:.0' <<<"$status" || { echo "$unit: $status" | tr '\n' ' '; return 1; }
  done
}
# The process that reads scenes has a filter of its own, within the unit's.
browser_submits() {
  ports
  local digest size url=http://127.0.0.1:$http/api/v1
  size=$(stat -c %s "$scene")
  digest=$(sha256sum <"$scene" | cut -d' ' -f1)
  curl -sS -f -H 'X-Lightmill: 1' -T "$scene" "$url/blobs/$digest?size=$size&offset=0" &&
    curl -sS -f -H 'X-Lightmill: 1' "$url/scene/check" -d "{\"main\": \"a.pbrt\", \"files\": [{\"name\": \"a.pbrt\", \"digest\": \"$digest\", \"size\": $size}]}" >checked.json &&
    grep -q '"width"' checked.json || { tail -n 1 checked.json; return 1; }
}
state() { [[ -d /var/lib/lightmill-coordinator/data && -d /var/lib/lightmill-worker/blobs && $(stat -Lc %a /var/lib/lightmill-coordinator) == 700 ]]; }
another_worker() { local pid; pid=$(show lightmill-worker MainPID); [[ $pid != 0 && $pid != "$killed" ]]; }
restarts() { killed=$(show lightmill-worker MainPID); systemctl kill -s KILL lightmill-worker && until_true 60 another_worker && submit; }
wrong_option() {
  echo 'lease-seconds = -1' >>/etc/lightmill/coordinator.toml
  systemctl restart lightmill-coordinator
  until_true 20 is_failed || return 1
  sed -i '/lease-seconds/d' /etc/lightmill/coordinator.toml
  [[ $(show lightmill-coordinator NRestarts) == 0 ]] && systemctl restart lightmill-coordinator
}
is_failed() { systemctl is-failed -q lightmill-coordinator; }
# As docs/install.md says.
credentials() {
  local made=/var/lib/lightmill-coordinator/credentials copied=/etc/lightmill/credentials file
  systemd-run -q --wait --pipe -p DynamicUser=yes -p User=lightmill-coordinator -p StateDirectory=lightmill-coordinator \
    lightmill-coordinator init --dir "$made" --san localhost || return 1
  echo "credentials = \"$made/coordinator\"" >>/etc/lightmill/coordinator.toml
  install -d -m 700 "$copied" && install -m 600 -t "$copied" "$made"/worker/* || return 1
  mkdir -p /etc/systemd/system/lightmill-worker.service.d
  for file in ca.crt tls.crt tls.key token; do echo "LoadCredential=$file:$copied/$file"; done |
    sed '1i [Service]' >/etc/systemd/system/lightmill-worker.service.d/credentials.conf
  echo 'credentials = "/run/credentials/lightmill-worker.service"' >>/etc/lightmill/worker.toml
  systemctl daemon-reload
  start && sed -i 's/^coordinator = "127.0.0.1:/coordinator = "localhost:/' /etc/lightmill/worker.toml && systemctl restart lightmill-worker &&
    ! submit && submit --credentials "$made/client"
}
upgrade() {
  local before after
  systemctl enable -q lightmill-worker
  before=$(show lightmill-worker MainPID)
  dpkg -i /root/test/lightmill.deb
  after=$(show lightmill-worker MainPID)
  [[ $before != 0 && $after != 0 && $before != "$after" ]] && systemctl is-enabled lightmill-worker && ! systemctl is-enabled lightmill-coordinator
}
stop() {
  systemctl stop lightmill-worker lightmill-coordinator
  local unit
  for unit in "${units[@]}"; do [[ $(show "$unit" Result) == success && $(show "$unit" ExecMainStatus) == 0 ]] || { systemctl status --no-pager "$unit"; return 1; }; done
}
drained() { grep draining <<<"$(journalctl -u lightmill-worker --no-pager)"; }

check "both units start" start
check "a job is rendered" submit
check "they run as users of their own, without privileges" confined
check "state is in /var/lib" state
check "a scene from a browser is read in the sandbox" browser_submits
check "a worker that was killed is started again" restarts
check "stopped, they end well" stop
check "the worker drained" drained
check "with credentials, TLS and tokens" credentials
check "a new package restarts what runs, and enables nothing" upgrade
check "wrong options are not tried again" wrong_option
# What an administrator has added is no package's to remove.
rm -rf /etc/systemd/system/lightmill-worker.service.d /etc/lightmill/credentials
finish
