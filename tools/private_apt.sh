# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2016
# Sourced: apt in a folder of its own, for packages of another Debian suite than the machine's. Nothing on the system is
# installed or changed; apt itself resolves and verifies, with sources derived from the machine's own.

# private_apt WORK STATUS SUITE…: sets APT_CONFIG to a configuration whose state lies in WORK, with main of these suites
# from the archive the machine uses for its own release, and reads their lists. STATUS is a dpkg status file: the
# machine's own resolves against what is installed here, an empty one against nothing.
private_apt() {
  local work=$1 status=$2 codename source_line uri signed_by options="" suite
  shift 2
  command -v apt-get dpkg-deb >/dev/null || { echo "no apt on this system" >&2; return 1; }
  codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
  [ "$(. /etc/os-release && echo "${ID:-}")" = debian ] || { echo "not Debian" >&2; return 1; }

  # URI and signing key of the first source that carries this release's main component.
  source_line=$(apt-get indextargets --format '$(REPO_URI)|$(RELEASE)|$(COMPONENT)|$(SIGNED_BY)' 'Created-By: Packages' |
    awk -F'|' -v c="$codename" '($2 == c || $2 == "stable") && $3 == "main" { print; exit }')
  if [ -z "$source_line" ]; then # no lists yet: apt names index targets only for lists it has
    source_line=$(apt-get indextargets --no-release-info --format '$(REPO_URI)|$(RELEASE)|$(COMPONENT)|$(SIGNED_BY)' \
      'Created-By: Packages' | awk -F'|' -v c="$codename" '($2 == c || $2 == "stable") && $3 == "main" { print; exit }')
  fi
  [ -n "$source_line" ] || { echo "apt has no source for $codename main" >&2; return 1; }
  IFS='|' read -r uri _ _ signed_by <<<"$source_line"
  case "$signed_by" in
    /*) options=" [signed-by=$signed_by]" ;;
  esac

  # apt wants paths without spaces in its configuration.
  mkdir -p "$work/lists/partial" "$work/cache/archives/partial"
  cp "$status" "$work/status"
  for suite in "$@"; do printf 'deb%s %s %s main\n' "$options" "$uri" "$suite"; done >"$work/sources.list"
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
Acquire::IndexTargets::deb::DEP-11::DefaultEnabled "false";
Binary::apt-get::APT::Keep-Downloaded-Packages "true";
CONF
  export APT_CONFIG="$work/apt.conf"
  apt-get -q update
}
