#!/usr/bin/env bash
# Turns the farm's credentials into the Docker secrets that deploy/swarm/stack.yaml names. Run it on a manager.
#   lightmill-coordinator init --dir farm-credentials --san coordinator --san farm.example.org
#   deploy/swarm/secrets.sh [FOLDER]      default: farm-credentials
# Secrets never change; after `init --renew`, `grant` or `revoke` make others and deploy again with them:
#   export LIGHTMILL_SECRETS=v2; deploy/swarm/secrets.sh; docker stack deploy -c deploy/swarm/stack.yaml farm
# Exit codes: 0 made, or there already; 1 they could not be made; 2 no such folder.
set -euo pipefail
folder=${1:-farm-credentials} version=${LIGHTMILL_SECRETS:-v1}

secret() { # NAME FILE
  local name=lightmill-$1-$version file=$folder/$2
  [[ -r $file ]] || { echo "secrets.sh: can't read $file; make it by lightmill-coordinator init --dir $folder" >&2; exit 2; }
  if docker secret inspect "$name" >/dev/null 2>&1; then
    echo "$name is there already"
  else
    docker secret create "$name" "$file" >/dev/null
    echo "$name"
  fi
}

secret ca coordinator/ca.crt
secret tokens coordinator/tokens
secret coordinator-cert coordinator/tls.crt
secret coordinator-key coordinator/tls.key
secret worker-cert worker/tls.crt
secret worker-key worker/tls.key
secret worker-token worker/token
