#!/bin/sh
# Makes Python classes of the protocol: generate.sh [FOLDER], default client/python/generated.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here/generated}
mkdir -p "$out"
protoc -I "$here/../../proto" --python_out="$out" --grpc_python_out="$out" \
  --plugin=protoc-gen-grpc_python="$(command -v grpc_python_plugin)" \
  lightmill/v1/types.proto lightmill/v1/client.proto
