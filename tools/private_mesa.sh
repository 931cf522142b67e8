#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Unpacks Mesa's software Vulkan driver from Debian backports into a folder of its own, for tests that need ray query
# (lavapipe has it since Mesa 24; Debian 12 ships 22.3). Nothing on the system is installed or changed.
#
#   tools/private_mesa.sh FOLDER     → FOLDER/lib (shared libraries), FOLDER/lvp_icd.json (for VK_DRIVER_FILES)
#
# apt resolves them against the machine's own package status: tools/private_apt.sh.
set -euo pipefail
target=${1:?folder}
# shellcheck source=tools/private_apt.sh
. "$(dirname "${BASH_SOURCE[0]}")/private_apt.sh"
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")

work=$(mktemp -d) # a finished folder appears at once: work goes on beside it
trap 'rm -rf "$work"' EXIT
mkdir "$work/root"
private_apt "$work" /var/lib/dpkg/status "$codename" "$codename-backports"
apt-get -q -y --download-only --reinstall -t "$codename-backports" install mesa-vulkan-drivers

for deb in "$work"/cache/archives/*.deb; do
  dpkg-deb -x "$deb" "$work/root"
done
driver=$(find "$work/root" -name libvulkan_lvp.so -print -quit)
[ -n "$driver" ] || { echo "the package holds no lavapipe" >&2; exit 1; }
rm -rf "$target"
mkdir -p "$target"
cp -a "$(dirname "$driver")" "$target/lib"
rm -rf "$target/lib/dri" "$target/lib/pkgconfig"
api=$(sed -n 's/.*"api_version": *"\([0-9.]*\)".*/\1/p' "$(find "$work/root" -name 'lvp_icd*.json' -print -quit)")
printf '{"file_format_version": "1.0.0", "ICD": {"library_path": "%s", "api_version": "%s"}}\n' \
  "$(cd "$target" && pwd -P)/lib/libvulkan_lvp.so" "$api" >"$target/lvp_icd.json"
(cd "$work/cache/archives" && ls -- *.deb) >"$target/packages.txt"
cat "$target/packages.txt"
