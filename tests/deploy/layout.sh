#!/usr/bin/env bash
# What the documents and the tree promise about themselves.
# shellcheck disable=SC2317  # functions that `check` calls
set -uo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root" || exit 1
source tests/deploy/checks.sh

sources() { git ls-files '*.cc' '*.h' '*.proto' '*.py' '*.sh'; }
# The list of offenders is the message.
none() { local found; found=$("$@"); [[ -z $found ]] || { tr '\n' ' ' <<<"$found"; return 1; }; }

long_files() { sources | xargs wc -l | awk '$2 != "total" && $1 > 800 { print $2 ":" $1 }'; }
code_pages() { git ls-files README.md ARCHITECTURE.md '*/README.md'; }
# shellcheck disable=SC2016  # backquotes of Markdown
missing_names() { # every `path` that a page about the code names, from the root or from the page's folder
  local page path
  code_pages | while read -r page; do
    grep -ohE '`[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)+/?`' "$page" | tr -d '`' | sort -u | while read -r path; do
      [[ -e $path || $path == build/* || -e $(dirname "$page")/$path || -n $(git ls-files "*/$path") ]] || echo "$page:$path"
    done
  done
}
missing_links() { # every relative link of every page
  local page path
  git ls-files '*.md' | while read -r page; do
    grep -ohE '\]\([^)#:]+(#[^)]*)?\)' "$page" | sed -E 's/^\]\(([^)#]+).*/\1/' | sort -u | while read -r path; do
      [[ -e $(dirname "$page")/$path ]] || echo "$page:$path"
    done
  done
}
not_executable() { git ls-files -s 'deploy/*.sh' 'tests/run.sh' '.ci/run' | awk '$1 != "100755" && $4 !~ /build_env/ { print $4 }'; }
broken_scripts() { git ls-files '*.sh' .ci/run | while read -r script; do bash -n "$script" 2>&1; done; }
unknown_packages() {
  local names
  names=$(awk '/^[a-z]/ { print $2 }' deploy/packages.txt | sort -u)
  # shellcheck disable=SC2086
  comm -23 <(echo "$names") <(apt-cache show --no-all-versions $names 2>/dev/null | sed -n 's/^Package: //p' | sort -u)
}
unfinished() { git grep -nE '\b(TODO|FIXME|XXX)\b|#if 0|DISABLED_' -- '*.cc' '*.h' '*.proto' '*.py' | cut -d: -f1,2; }
missing_folders() {
  local folder
  for folder in proto/lightmill/v1 common/{base,job,film,error,image,farm,rpc} common/scene/{pbrt,gltf,mesh} worker/agent \
    worker/render/{scene,accel,bsdf,light,camera,sampling,math,plan,guiding,pipeline} \
    coordinator/{farm,core,merge,store,service,access,http,web} client/{verbs,terminal,connection} deploy docs tests scenes; do
    [[ -d $folder ]] || echo "$folder"
  done
}
# About 25: a folder that has more holds more than one subject.
crowded_folders() { sources | sed 's#/[^/]*$##' | sort | uniq -c | awk '$1 > 28 { print $2 ":" $1 }'; }
long_pages() { local page; for page in README.md:150 ARCHITECTURE.md:250; do (( $(wc -l <"${page%:*}") <= ${page#*:} )) || echo "$page"; done; }
stages() { local stage; for stage in producer caster bouncer shadow_caster film; do [[ -f worker/render/pipeline/$stage.cc || -f worker/render/pipeline/$stage.h ]] || echo "$stage"; done; }

check "folders of the layout" none missing_folders
check "folders of one subject" none crowded_folders
check "pages that are read" none long_pages
check "the five stages are files" none stages
check "no file over 800 lines" none long_files
check "documents name only what is there" none missing_names
check "links of the documents" none missing_links
check "no unfinished marks" none unfinished
check "scripts are executable" none not_executable
check "scripts parse" none broken_scripts
check "packages exist" none unknown_packages
check "licence" grep -q 'Apache License' LICENSE
finish
