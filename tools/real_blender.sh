#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Unpacks Debian's Blender and what it needs, of other suites than the machine's, into roots of their own: executables to
# test the extension in, as PyPI's bpy has no window. Nothing on the system is installed or changed. Wants root, for
# chroot; some 650 MB of downloads and 2.3 GB of disk for two.
#
#   tools/real_blender.sh FOLDER SUITE…     → FOLDER/SUITE (a root), FOLDER/blender-SUITE (runs tools/real_blender_run.sh)
#
# What is there stays: remove FOLDER/SUITE to have it anew. `sid` changes daily and may not resolve on some days: that is
# a message; any other suite that fails is an error.
set -euo pipefail
mkdir -p "${1:?folder}"
: "${2:?suite}"
target=$(cd "$1" && pwd -P)
shift
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P)
# shellcheck source=tools/private_apt.sh
. "$here/private_apt.sh"
packages=(blender python3 python3-numpy python3-requests libgl1-mesa-dri libegl1 libgl1 libglx-mesa0 mesa-vulkan-drivers
  xvfb base-files libc-bin bash dash coreutils sed grep findutils)
packages_sid=(python3-cattr) # Blender 5 imports it at start

# names_of_debs PACKAGE…: file names (as patterns) of all that apt would install for them.
names_of_debs() { apt-get -s -y install "$@" | awk '/^Inst/ { gsub(/[()]/, "", $3); gsub(/:/, "%3a", $3); print $2 "_" $3 "_*.deb" }'; }

# unpack ROOT DEB…: what dpkg would do without maintainer scripts, plus what of those Blender depends on.
unpack() {
  local root=$1 deb directory libraries=usr/lib/x86_64-linux-gnu pair
  shift
  mkdir -p "$root"/{usr/{bin,sbin,lib,lib64},proc,sys,dev,tmp,root,run,etc}
  chmod 1777 "$root/tmp"
  for directory in bin sbin lib lib64; do ln -s "usr/$directory" "$root/$directory"; done
  for deb in "$@"; do
    dpkg-deb --fsys-tarfile "$deb" | tar -x -C "$root" --keep-directory-symlink --no-same-owner --exclude=./usr/share/doc \
      --exclude=./usr/share/man --exclude=./usr/share/locale --exclude=./usr/share/blender/datafiles/locale
  done
  for pair in blas/libblas.so.3 lapack/liblapack.so.3; do # alternatives
    [ ! -e "$root/$libraries/$pair" ] || ln -sf "$pair" "$root/$libraries/$(basename "$pair")"
  done
  printf 'root:x:0:0:root:/root:/bin/bash\n' >"$root/etc/passwd"
  printf 'root:x:0:\n' >"$root/etc/group"
  ln -sf /proc/self/mounts "$root/etc/mtab"
  chroot "$root" /sbin/ldconfig
}

# get SUITE: the root, which appears at once when it is whole. Downloads are kept until then.
get() {
  local suite=$1 work wanted=("${packages[@]}") debs="$target/debs-$1" name key found=()
  [ "$suite" != sid ] || wanted+=("${packages_sid[@]}")
  key=$(printf '%s\n' "${wanted[@]}" | cat - "${BASH_SOURCE[0]}" | sha256sum)
  if [ "$(cat "$target/$suite/.made-of" 2>/dev/null)" != "$key" ]; then
    work=$(mktemp -d)
    # shellcheck disable=SC2064
    trap "rm -rf '$work'" EXIT
    mkdir -p "$debs/partial" "$work/cache"
    ln -s "$debs" "$work/cache/archives"
    private_apt "$work" /dev/null "$suite"
    apt-get -q -y --download-only install "${wanted[@]}"
    for name in $(names_of_debs "${wanted[@]}"); do found+=("$(find "$debs" -maxdepth 1 -name "$name" -print -quit)"); done
    rm -rf "$target/$suite.new"
    unpack "$target/$suite.new" "${found[@]}"
    printf '%s\n' "$key" >"$target/$suite.new/.made-of"
    rm -rf "${target:?}/$suite"
    mv "$target/$suite.new" "$target/$suite"
    rm -rf "$debs"
  fi
  printf '#!/bin/sh\nexec "%s" "%s" "$@"\n' "$here/real_blender_run.sh" "$target/$suite" >"$target/blender-$suite"
  chmod +x "$target/blender-$suite"
  "$target/blender-$suite" --version
}

[ "$(id -u)" -eq 0 ] || { echo "real Blenders need root, for chroot" >&2; exit 1; }
if [ "$1" = --one ]; then
  get "$2"
  exit
fi
for suite in "$@"; do
  bash "${BASH_SOURCE[0]}" "$target" --one "$suite" && continue
  rm -f "$target/blender-$suite"
  [ "$suite" = sid ] || { echo "no Blender of Debian $suite" >&2; exit 1; }
  echo "NO Blender of Debian sid today: skipped"
done
