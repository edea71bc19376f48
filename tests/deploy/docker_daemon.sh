# shellcheck shell=bash disable=SC2034,SC2154
# Sourced, after farm.sh, by tests that need Docker: a daemon of the test's own in a temporary folder, and debian:bookworm-slim
# made from Debian packages, so that no image registry is needed.
#
#   start_docker DIR      exports DOCKER_HOST; returns 1 with the reason in $docker_reason where it can't be
#   make_base_image DIR   likewise
#   stop_docker DIR       ends the daemon and frees the folder
#   farm_images DIR MODE  all of that, and the three images of the farm, from the programs in build/release/bin (MODE
#                         prebuilt) or compiling the checkout themselves (--source), as checks; DIR/context is what
#                         they were built from. Skips the script with the reason where that can't be. With
#                         LIGHTMILL_DOCKER_DIR, the DIR of another script whose daemon runs, that one's are taken.
#
# Debian's client and builder: another docker on the PATH may lack the classic builder.
export PATH=/usr/bin:/usr/sbin:/sbin:$PATH DOCKER_BUILDKIT=0 COMPOSE_DOCKER_CLI_BUILD=0

docker_pid='' docker_reason=''

start_docker() {
  local dir=$1
  [[ $(id -u) == 0 ]] || { docker_reason="a Docker daemon of its own needs root"; return 1; }
  mkdir -p "$dir"/{data,exec}
  # No firewall rules and no default bridge: the test leaves the machine's network alone.
  dockerd --data-root "$dir/data" --exec-root "$dir/exec" -p "$dir/pid" -H "unix://$dir/socket" \
    --iptables=false --bridge=none >"$dir/log" 2>&1 &
  docker_pid=$!
  export DOCKER_HOST=unix://$dir/socket
  local i
  for ((i = 0; i < 300; ++i)); do
    docker version >/dev/null 2>&1 && return 0
    kill -0 "$docker_pid" 2>/dev/null || break
    sleep 0.1
  done
  docker_reason="dockerd does not start here: $(grep -v 'level=info' "$dir/log" | tail -n 1 | cut -c1-200)"
  return 1
}

stop_docker() {
  local dir=$1 mount
  if [[ -n $docker_pid ]]; then
    kill "$docker_pid" 2>/dev/null
    wait "$docker_pid" 2>/dev/null
  fi
  # What a daemon that was killed or hung may have left mounted, innermost first.
  while read -r mount; do umount -l "$mount"; done < <(awk -v dir="$dir/" 'index($2, dir) == 1 { print $2 }' /proc/self/mounts | sort -r)
  rm -rf --one-file-system "$dir"
}

# The machine's own Debian sources: URI, release and components, as sources.list lines.
debian_sources() {
  # shellcheck disable=SC2016
  apt-get indextargets --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' 'Origin: Debian' 'Created-By: Packages' |
    grep -E ' bookworm(-[a-z]+)? main$' | sort -u
}

make_base_image() {
  local dir=$1 mirror
  mirror=$(debian_sources | awk '$3 == "bookworm" { print $2; exit }')
  [[ -n $mirror ]] || { docker_reason="no Debian 12 source in the apt configuration"; return 1; }
  debootstrap --variant=minbase bookworm "$dir/base" "$mirror" >"$dir/debootstrap.log" 2>&1 ||
    { docker_reason="debootstrap failed: $(tail -n 1 "$dir/debootstrap.log" | cut -c1-200)"; return 1; }
  debian_sources >"$dir/base/etc/apt/sources.list"
  rm -rf "$dir/base/var/cache/apt/archives/"*.deb
  tar -C "$dir/base" --one-file-system -c . | docker import - debian:bookworm-slim >/dev/null ||
    { docker_reason="docker import failed"; return 1; }
  rm -rf --one-file-system "${dir:?}/base"
  docker run --rm --pull never --network none debian:bookworm-slim true 2>"$dir/run.log" ||
    { docker_reason="this kernel does not run containers: $(tail -n 1 "$dir/run.log" | cut -c1-200)"; return 1; }
}

farm_image() {
  docker build --network host --build-arg BINARIES="$2" --target "$3" -t "lightmill-$3" -f "$1/context/deploy/Dockerfile" "$1/context"
}
# shellcheck disable=SC2317
no_embree() { ! docker run --rm --pull never --network none --entrypoint ls lightmill-coordinator /usr/lib/x86_64-linux-gnu | grep embree; }

farm_images() {
  local dir=$1 binaries=source target
  require_programs
  if [[ -n ${LIGHTMILL_DOCKER_DIR:-} ]]; then
    export DOCKER_HOST=unix://$LIGHTMILL_DOCKER_DIR/socket
    ln -s "$LIGHTMILL_DOCKER_DIR/context" "$dir/context"
    return
  fi
  [[ $(id -u) == 0 ]] || skip_all "a Docker daemon of its own needs root"
  deploy/install_packages.sh docker test || skip_all "Docker's packages could not be installed"
  start_docker "$dir" || skip_all "$docker_reason"
  make_base_image "$dir" || skip_all "$docker_reason"
  mkdir "$dir/context"
  git ls-files -z --cached --others --exclude-standard | xargs -0 cp --parents -t "$dir/context" 2>/dev/null
  if [[ $2 != --source ]]; then
    binaries=prebuilt
    rm "$dir/context/.dockerignore"
    mkdir -p "$dir/context/build/release"
    cp -r "$bin" "$dir/context/build/release/"
  fi
  for target in coordinator worker cli; do check "image $target ($binaries)" farm_image "$dir" "$binaries" "$target"; done
  check "no Embree in the coordinator's image" no_embree
  [[ $failed == 0 ]] || finish
  docker images --format '{{.Repository}} {{.Size}}' | grep ^lightmill
}
