#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Unpacks Mesa's software Vulkan driver from Debian backports into a folder of its own, for tests that need ray query
# (lavapipe has it since Mesa 24; Debian 12 ships 22.3). Nothing on the system is installed or changed.
#
#   tools/private_mesa.sh FOLDER     → FOLDER/lib (shared libraries), FOLDER/lvp_icd.json (for VK_DRIVER_FILES)
#
# apt itself resolves and verifies the packages, against the machine's own package status, with sources derived from the
# machine's own: the Debian archive it uses for its release, once as it is and once with "-backports" added to the suite.
set -euo pipefail
# shellcheck disable=SC2016
target=${1:?folder}
if ! command -v apt-get dpkg-deb >/dev/null; then
  echo "no apt on this system" >&2
  exit 1
fi
codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
[ "$(. /etc/os-release && echo "${ID:-}")" = debian ] || { echo "not Debian: install a driver with ray query" >&2; exit 1; }

# URI, signing key and trust of the first source that carries this release's main component.
source_line=$(apt-get indextargets --format '$(REPO_URI)|$(RELEASE)|$(COMPONENT)|$(SIGNED_BY)|$(TRUSTED)' 'Created-By: Packages' |
  awk -F'|' -v c="$codename" '($2 == c || $2 == "stable") && $3 == "main" { print; exit }')
if [ -z "$source_line" ]; then # no lists yet: apt names index targets only for lists it has
  source_line=$(apt-get indextargets --no-release-info --format '$(REPO_URI)|$(RELEASE)|$(COMPONENT)|$(SIGNED_BY)|no' \
    'Created-By: Packages' | awk -F'|' -v c="$codename" '($2 == c || $2 == "stable") && $3 == "main" { print; exit }')
fi
[ -n "$source_line" ] || { echo "apt has no source for $codename main" >&2; exit 1; }
IFS='|' read -r uri _ _ signed_by _ <<<"$source_line"
options=""
case "$signed_by" in
  /*) options=" [signed-by=$signed_by]" ;;
esac

# A finished folder appears at once: work goes on beside it. apt wants paths without spaces in its configuration.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/root"
cp /var/lib/dpkg/status "$work/status"
printf 'deb%s %s %s main\n' "$options" "$uri" "$codename" "$options" "$uri" "$codename-backports" >"$work/sources.list"
cat >"$work/apt.conf" <<CONF
#clear APT::Update::Post-Invoke;
#clear APT::Update::Post-Invoke-Success;
Dir::State "$work";
Dir::State::lists "$work/lists";
Dir::State::status "$work/status";
Dir::State::extended_states "$work/extended_states";
Dir::Cache "$work/cache";
Dir::Cache::archives "$work/cache/archives";
Dir::Etc::sourcelist "$work/sources.list";
Dir::Etc::sourceparts "-";
Dir::Etc::preferences "-";
Dir::Etc::preferencesparts "-";
APT::Install-Recommends "false";
APT::Sandbox::User "$(id -un)";
Acquire::Languages "none";
Acquire::Retries "3";
Binary::apt-get::APT::Keep-Downloaded-Packages "true";
CONF
export APT_CONFIG="$work/apt.conf"
apt-get -q update
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
