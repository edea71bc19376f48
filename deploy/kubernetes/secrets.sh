#!/usr/bin/env bash
# Prints the farm's credentials as Kubernetes secrets, each program's in one of its own.
#   lightmill-coordinator init --dir farm-credentials --san lightmill-coordinator --san farm.example.org
#   deploy/kubernetes/secrets.sh farm-credentials | kubectl apply -n lightmill -f -
# After `init --renew`, `grant` or `revoke` the same again: the programs read changed files without a restart.
# Exit codes: 0 printed, 2 no such folder.
set -euo pipefail
folder=${1:-farm-credentials}
for holder in coordinator worker observer; do
  files=(ca.crt tls.crt tls.key token)
  [[ $holder == coordinator ]] && files[3]=tokens
  for file in "${files[@]}"; do
    [[ -r $folder/$holder/$file ]] || { echo "secrets.sh: can't read $folder/$holder/$file; make it by lightmill-coordinator init --dir $folder" >&2; exit 2; }
  done
  printf -- '---\napiVersion: v1\nkind: Secret\nmetadata:\n  name: lightmill-%s\ntype: Opaque\ndata:\n' "$holder"
  for file in "${files[@]}"; do printf '  %s: %s\n' "$file" "$(base64 -w 0 "$folder/$holder/$file")"; done
done
