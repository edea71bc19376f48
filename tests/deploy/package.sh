#!/usr/bin/env bash
# What cmake --install and cpack make of the release build: a prefix that was moved, its manual pages, completions and
# units, and the Debian package in a fresh Debian 12: a farm there (package/farm.sh), and the units under a systemd that
# was booted there (package/units.sh). What can't be had on this machine is skipped, with the reason.
# Downloaded packages stay in build/package-cache.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/farm.sh
source tests/deploy/docker_daemon.sh  # for debian_sources
nspawn_pid=''
cleanup() {
  # nspawn takes its container along.
  if [[ -n $nspawn_pid ]]; then kill "$nspawn_pid" 2>/dev/null && wait "$nspawn_pid"; fi
  rm -rf --one-file-system "$dir"
}
mkdir -p build/package-cache
TMPDIR=$root/build begin package 1
require_programs
deploy/install_packages.sh package test || skip_all "the tools to make and look at packages could not be installed"

skip() { echo "skipped: $1"; skipped=$((skipped + 1)); }

# A prefix, moved after the installation.
prefix=$dir/moved
share=$prefix/share
install_and_move() { cmake --install build/release --prefix "$dir/prefix" >"$dir/install.log" && mv "$dir/prefix" "$prefix"; }
renders_elsewhere() {
  render_locally && ln -s "$prefix/bin/lightmill" "$dir/link" && mkdir "$dir/elsewhere" && cd "$dir/elsewhere" &&
    "$dir/link" render "$share/lightmill/$scene" "${settings[@]}" --quiet -o moved.exr && cd "$root" && same_pixels "$dir/elsewhere/moved.exr"
}
starts() { local program; for program in "$prefix"/bin/*; do "$program" --version || return 1; done; }
python_finds_it() {
  local version
  version=$(sed -n 's/^project(lightmill VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
  [[ $(PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$prefix/lib/python3/dist-packages /usr/bin/python3 -c 'import lightmill; print(lightmill.__version__)') == "$version" ]] &&
    [[ -e $prefix/lib/python3/dist-packages/lightmill/py.typed ]]
}
has_addon() { /usr/bin/python3 -m zipfile -l "$share/lightmill/lightmill-blender.zip" | grep -q "^lightmill/api/farm.py "; }
no_build_path() { ! grep -rlF "$root/build" "$prefix/bin" "$prefix/lib"; }

# The pages, and every option that --help has.
pages() { printf '%s\n' "$share"/man/man1/lightmill{,-coordinator,-worker}.1; }
clean_roff() { local page said; for page in $(pages); do said=$(groff -man -Tutf8 -ww "$page" 2>&1 >/dev/null; man -l --warnings=w "$page" 2>&1 >/dev/null); [[ -z $said ]] || { echo "$page: $said"; return 1; }; done; }
options_of() { "$@" --help | grep -oE '^ +(-[A-Za-z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+'; }
in_page() {  # in_page PROGRAM [VERB]
  local option count=0 page
  page=$(sed 's/\\-/-/g' "$share/man/man1/$1.1")
  while read -r option; do
    count=$((count + 1))
    grep -qF "\\fB$option\\fR" <<<"$page" || { echo "$* $option is not in the page"; return 1; }
  done < <(options_of "$prefix/bin/$1" "${@:2}")
  [[ $count -ge 2 ]] || { echo "$*: only $count options found"; return 1; }
}
every_option() {
  in_page lightmill-worker && in_page lightmill-coordinator && in_page lightmill-coordinator init && in_page lightmill-coordinator grant &&
    in_page lightmill-coordinator revoke && in_page lightmill render && in_page lightmill submit
}

bash_completes() {
  local script=$share/bash-completion/completions/lightmill
  # shellcheck disable=SC2016  # the inner shell's variables
  bash -n "$script" && [[ $(bash -uc '. "$1"; COMP_WORDS=(lightmill rend) COMP_CWORD=1; _lightmill; echo "${COMPREPLY[@]}"' - "$script") == render ]]
}
zsh_completes() {
  zsh -n "$share/zsh/vendor-completions/_lightmill" &&
    [[ $(zsh -fc "fpath=('$share/zsh/vendor-completions' \$fpath); autoload -Uz compinit; compinit -D -u; print \$_comps[lightmill]") == _lightmill ]]
}
fish_completes() { grep -q '^render' <<<"$(PATH=$prefix/bin:$PATH XDG_DATA_DIRS=$share HOME=$dir XDG_CONFIG_HOME=$dir fish -c 'complete -C "lightmill rend"')"; }

# The check needs programs where the units look for them; no folder of the machine is touched.
units_verify() {
  local unit said
  mkdir -p "$dir/units"
  for unit in coordinator worker; do
    sed "s|^ExecStart=|&$prefix/bin/|" "$prefix/lib/systemd/system/lightmill-$unit.service" >"$dir/units/lightmill-$unit.service"
  done
  said=$(systemd-analyze verify --man=no "$dir"/units/*.service 2>&1 | grep -F lightmill-)
  [[ -z $said ]] || { echo "$said"; return 1; }
}

make_package() { cpack --config build/release/CPackConfig.cmake -B "$dir/deb" >"$dir/cpack.log" 2>&1 || { tail -n 3 "$dir/cpack.log"; return 1; }; mv "$dir"/deb/*.deb "$dir/lightmill.deb"; }
field() { dpkg-deb -f "$dir/lightmill.deb" "$1"; }
has_version() { [[ $(field Version) == "$("$bin/lightmill" --version | cut -d' ' -f2)" ]]; }
depends() { local library; for library in libopenimageio2.4 libembree3-3 libgrpc++1.51 libseccomp2; do grep -qF "$library (" <<<"$(field Depends)" || { echo "does not depend on $library"; return 1; }; done; }
lints() { local said; said=$(lintian --fail-on none "$dir/lightmill.deb" 2>"$dir/lintian.log") || { cat "$dir/lintian.log"; return 1; }; [[ -z $said ]] || { tr '\n' ' ' <<<"$said"; return 1; }; }

check "installs to a prefix" install_and_move
check "the moved programs start" starts
check "Python finds its package" python_finds_it
check "the add-on for Blender has the package, too" has_addon
check "a moved program renders from another folder, by a link" renders_elsewhere
check "nothing installed names the build folder" no_build_path
check "manual pages are clean roff" clean_roff
check "manual pages have every option of --help" every_option
check "bash completes" bash_completes
check "zsh finds its completion" zsh_completes
check "fish completes" fish_completes
check "systemd finds no fault in the units" units_verify
check "cpack makes a package" make_package
check "the package has the project's version" has_version
check "the package depends on the libraries, the module's too" depends
check "lintian finds no fault" lints

[[ $failed == 0 ]] || finish
[[ $(id -u) == 0 ]] || { skip "a fresh Debian needs root"; finish; }

# A fresh Debian 12. Mounts and processes are those of a namespace, and go with it.
fresh=$dir/fresh
mirror=$(debian_sources | awk '$3 == "bookworm" { print $2; exit }')
[[ -n $mirror ]] || { skip "no Debian 12 source in the apt configuration"; finish; }
unshare --mount true 2>"$dir/unshare.log" || { skip "no namespaces here: $(tail -n 1 "$dir/unshare.log")"; finish; }
unshare --mount debootstrap --variant=minbase --include=systemd,systemd-sysv,dbus,curl --cache-dir="$root/build/package-cache" \
  bookworm "$fresh" "$mirror" >"$dir/debootstrap.log" 2>&1 ||
  { skip "debootstrap failed: $(tail -n 1 "$dir/debootstrap.log" | cut -c1-200)"; finish; }
debian_sources >"$fresh/etc/apt/sources.list"
echo '127.0.0.1 localhost' >"$fresh/etc/hosts"
mkdir -p "$fresh"/root/{test,cache}
cp "$dir/lightmill.deb" tests/deploy/checks.sh tests/deploy/package/*.sh "$fresh/root/test"

# in_fresh COMMAND...: as root of that Debian.
in_fresh() {
  # shellcheck disable=SC2016  # the inner shell's variables
  unshare --mount --pid --fork --kill-child bash -c '
    mount -t proc proc "$1/proc" && mount --bind "$2" "$1/root/cache" && exec chroot "$1" "${@:3}"' - "$fresh" "$root/build/package-cache" \
    env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"
}
apt_in_fresh() { in_fresh apt-get -y -q -o Dir::Cache::Archives=/root/cache -o APT::Sandbox::User=root "$@" >>"$dir/apt.log" 2>&1 </dev/null || { grep '^E:' "$dir/apt.log" | tail -n 1; return 1; }; }
# add_counts FILE: prints the part's lines and adds its last one's figures.
add_counts() {
  grep -vE '^[0-9]+ passed, ' "$1"
  local part_passed part_failed
  read -r part_passed _ part_failed _ <<<"$(grep -E '^[0-9]+ passed, [0-9]+ failed$' "$1" | tail -n 1)"
  [[ -n ${part_failed:-} ]] || { echo "FAIL  $1 has no count: $(tail -n 1 "$1")"; part_passed=0 part_failed=1; }
  passed=$((passed + part_passed)) failed=$((failed + part_failed))
}

apt_in_fresh update || { skip "apt has no package lists: $(tail -n 1 "$dir/apt.log" | cut -c1-200)"; finish; }
check "apt installs it in a fresh Debian 12" apt_in_fresh install --no-install-recommends /root/test/lightmill.deb
[[ $failed == 0 ]] || finish
in_fresh bash /root/test/farm.sh >"$dir/farm.log" 2>&1 </dev/null
add_counts "$dir/farm.log"

# The units, under a systemd of their own, which ends by itself.
cat >"$fresh/etc/systemd/system/lightmill-test.service" <<'UNIT'
[Service]
Type=oneshot
ExecStart=bash /root/test/units.sh
ExecStopPost=systemctl poweroff --no-block
StandardOutput=file:/root/test/units.log
StandardError=inherit
UNIT
ln -s ../lightmill-test.service "$fresh/etc/systemd/system/multi-user.target.wants/"
# nspawn's own folders, too, are a namespace's.
unshare --mount bash -c 'mkdir -p /run/systemd && mount -t tmpfs tmpfs /run/systemd && exec "$@"' - \
  timeout -k 20 300 systemd-nspawn -q -D "$fresh" --register=no --keep-unit --private-network --boot >"$dir/nspawn.log" 2>&1 </dev/null &
nspawn_pid=$!
wait "$nspawn_pid"
nspawn_pid=''
if [[ -s $fresh/root/test/units.log ]]; then
  add_counts "$fresh/root/test/units.log"
else
  skip "systemd does not boot in a container here: $(tail -n 1 "$dir/nspawn.log" | tr -d '\r' | cut -c1-200)"
fi

check "apt removes it" apt_in_fresh purge lightmill
leftovers() { local found; found=$(find "$fresh"/{etc,usr,var/lib/systemd,var/cache} -name '*lightmill*' ! -name lightmill-test.service); [[ -z $found ]] || { tr '\n' ' ' <<<"$found"; return 1; }; }
check "purged, nothing but the coordinator's jobs is left" leftovers
finish
