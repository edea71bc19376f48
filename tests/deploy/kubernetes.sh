#!/usr/bin/env bash
# deploy/kubernetes, checked without a cluster: every object of every kustomization against its schema and its type
# (which knows no other fields), selectors, secrets, probes; the options and metrics that it names are real ones.
# Skips with its reason where npm or its packages are not to be had.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh
bin=$root/build/release/bin

command -v npm >/dev/null || deploy/install_packages.sh build || skip_all "npm could not be installed"
dir=$(mktemp -d "${TMPDIR:-/tmp}/lightmill-kubernetes.XXXXXX")
trap 'rm -rf "$dir"' EXIT
cp tests/deploy/kubernetes/* "$dir"
(cd "$dir" && timeout 300 npm ci --ignore-scripts --no-audit --no-fund >npm.log 2>&1) ||
  skip_all "the schemas could not be installed by npm: $(grep -m 1 'ERR' "$dir/npm.log" | cut -c1-150)"
objects() { (cd "$dir" && node check.mjs "$root" "$@"); }

check "all objects are valid" objects
# The check itself: it must find what is wrong.
for breakage in field enum type required label drain kind claim replicas; do
  finds() { ! objects --break "$breakage"; }
  check "a wrong $breakage is found" finds
done

"$bin/lightmill-coordinator" init --dir "$dir/credentials" --san lightmill-coordinator >/dev/null
secrets() { LIGHTMILL_STORE=postgresql://lightmill:ge%2Fheim@lightmill-database/farm deploy/kubernetes/secrets.sh "$dir/credentials"; }
check "secrets.sh prints the credentials" secrets
secrets >"$dir/secrets.yaml"
same_secrets() {
  local name key
  objects --secrets | while read -r name key; do
    awk -v name="$name" -v key="${key:-}:" '/^  name: / { found = $2 == name } found && (key == ":" || $1 == key) { ok = 1 } END { exit !ok }' "$dir/secrets.yaml" ||
      { echo "secrets.sh has no $name $key"; exit 1; }
  done
}
check "the secrets that the objects name are those" same_secrets
decodes() { [[ $(sed -n 's/^  token: //p' "$dir/secrets.yaml" | head -n 1 | base64 -d) == "$(cat "$dir/credentials/worker/token")" ]]; }
check "a secret holds the file" decodes
of_database() { [[ $(awk -v key="$1:" '/name: lightmill-database/ { on = 1 } on && $1 == key { print $2; exit }' "$dir/secrets.yaml" | base64 -d) == "$2" ]]; }
check "the database's has its password" of_database password ge/heim
check "and its address" of_database store postgresql://lightmill:ge%2Fheim@lightmill-database/farm
no_password() { LIGHTMILL_STORE=postgresql://lightmill@db/farm deploy/kubernetes/secrets.sh "$dir/credentials" >/dev/null; [[ $? == 2 ]]; }
check "an address without a password is refused" no_password
no_folder() { deploy/kubernetes/secrets.sh "$dir/nowhere"; [[ $? == 2 ]]; }
check "secrets.sh names a folder that is not there" no_folder

# known PROGRAM FILE: every option in the arguments of the file's containers of that program is one that it has.
known() {
  local help option
  help=$("$bin/$1" --help)
  awk -v image="name: ${1/lightmill-/}$" '/- name: / { on = $0 ~ image } on && !/^ *#/' "deploy/kubernetes/$2" |
    grep -oE -- '--[a-z][a-z-]+' | sort -u | while read -r option; do
    grep -qE -- "(^|[ ,])$option( |$|=)" <<<"$help" || { echo "$1 has no $option"; exit 1; }
  done
}
check "the coordinator knows its options" known lightmill-coordinator base/coordinator.yaml
check "the worker knows its options" known lightmill-worker base/worker.yaml
for program in coordinator worker; do
  check "the $program knows its options of the overlay standby" known "lightmill-$program" overlays/standby/kustomization.yaml
done
metrics() {
  local name
  grep -rhoE 'lightmill_[a-z_]+' deploy/kubernetes/overlays | sort -u | while read -r name; do
    grep -qF "\"$name\"" coordinator/http/metrics.cc || { echo "no metric $name"; exit 1; }
  done
}
check "autoscalers ask for metrics that exist" metrics
finish
