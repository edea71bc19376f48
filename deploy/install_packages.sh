#!/usr/bin/env bash
# Installs the Debian packages of the named groups of packages.txt, only those that are missing.
#   deploy/install_packages.sh [GROUP...]     default: build
# Runs as root or through sudo. Exit codes: 0 all there, 1 they could not be installed, 2 wrong usage.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
list=$here/packages.txt

fail() { echo "install_packages.sh: $2" >&2; exit "$1"; }

wanted=()
for group in "${@:-build}"; do
  found=false
  while read -r package command; do
    found=true
    [[ -n $command ]] && command -v "$command" >/dev/null && continue
    wanted+=("$package")
  done < <(awk -v group="$group" '$1 == group { print $2, $3 }' "$list")
  $found || fail 2 "no group \"$group\" in $list; its head names the groups"
done

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  fail 1 "needs Debian 12 (apt-get was not found); elsewhere install the packages of $list by hand"
fi
installed=$(dpkg-query -W -f '${db:Status-Status} ${Package}\n' 2>/dev/null | sed -n 's/^installed //p')
missing=()
for package in "${wanted[@]}"; do
  grep -qxF "$package" <<<"$installed" || missing+=("$package")
done
[[ ${#missing[@]} -gt 0 ]] || exit 0

as_root=()
if [[ $(id -u) != 0 ]]; then
  command -v sudo >/dev/null || fail 1 "as root, run: apt-get install --no-install-recommends ${missing[*]}"
  as_root=(sudo)
fi

log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  # 0</dev/null and noninteractive: a package that asks would wait for ever.
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -y -q -o DPkg::Lock::Timeout=300 "$@" </dev/null >>"$log" 2>&1
}

echo "installing ${#missing[@]} packages: ${missing[*]}" >&2
# The package lists are fetched only when what is there does not do: absent, or too old to download from.
if ! apt install --no-install-recommends "${missing[@]}"; then
  apt update || fail 1 "apt-get update failed: $(grep -E '^(E|Err)' "$log" | tail -n 1)"
  apt install --no-install-recommends "${missing[@]}" ||
    fail 1 "apt-get install failed: $(grep '^E' "$log" | tail -n 1)"
fi
