#!/usr/bin/env bash
# Prints the farm's credentials as Kubernetes secrets, each program's in one of its own.
#   lightmill-coordinator init --dir farm-credentials --san lightmill-coordinator --san farm.example.org
#   deploy/kubernetes/secrets.sh farm-credentials | kubectl apply -n lightmill -f -
# After `init --renew`, `grant` or `revoke` the same again: the programs read changed files without a restart.
# With LIGHTMILL_STORE=postgresql://lightmill:PASSWORD@HOST/farm in the environment also that address, for the overlays
# standby and standby-database. A password of other characters than letters, digits and "-._~" is percent-encoded.
# Exit codes: 0 printed, 2 no such folder, or no such address.
set -euo pipefail
# secret NAME KEY VALUE...: the values in base64.
secret() {
  printf -- '---\napiVersion: v1\nkind: Secret\nmetadata:\n  name: lightmill-%s\ntype: Opaque\ndata:\n' "$1"
  shift
  while [[ $# -gt 0 ]]; do
    printf '  %s: %s\n' "$1" "$2"
    shift 2
  done
}
folder=${1:-farm-credentials}
for holder in coordinator worker observer; do
  files=(ca.crt tls.crt tls.key token)
  [[ $holder == coordinator ]] && files[3]=tokens
  for file in "${files[@]}"; do
    [[ -r $folder/$holder/$file ]] || { echo "secrets.sh: can't read $folder/$holder/$file; make it by lightmill-coordinator init --dir $folder" >&2; exit 2; }
  done
  values=()
  for file in "${files[@]}"; do values+=("$file" "$(base64 -w 0 "$folder/$holder/$file")"); done
  secret "$holder" "${values[@]}"
done
[[ -n ${LIGHTMILL_STORE:-} ]] || exit 0
[[ $LIGHTMILL_STORE =~ ^postgres(ql)?://[^:@/]+:([^:@/]+)@ ]] ||
  { echo "secrets.sh: LIGHTMILL_STORE is not of the form postgresql://USER:PASSWORD@HOST/DATABASE" >&2; exit 2; }
password=$(printf '%b' "${BASH_REMATCH[2]//%/\\x}")
secret database store "$(printf %s "$LIGHTMILL_STORE" | base64 -w 0)" password "$(printf %s "$password" | base64 -w 0)"
