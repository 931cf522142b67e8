# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154,SC2034,SC2016
# Set-up for ./dev, sourced by it: Debian packages, .venv, a private ray-query Vulkan driver, the CMake build.
# Package sources are the machine's own: apt's and pip's configuration decide, no host is written down here.

apt_build=(g++ cmake ninja-build ccache glslang-tools spirv-tools libvulkan-dev libvulkan-volk-dev libembree-dev
  libjpeg62-turbo-dev libdeflate-dev libglm-dev doctest-dev python3-venv python3-dev)
# What the shared libraries of PyPI's bpy ask for.
apt_blender=(libx11-6 libxrender1 libxfixes3 libxi6 libxxf86vm1 libxkbcommon0 libxext6 libxt6 libsm6 libice6 libgl1 libegl1)
apt_test=(vulkan-validationlayers)

say() { printf '%s\n' "$*"; }

die() {
  trap - ERR
  printf 'dev: %s\n' "$*" >&2
  exit 1
}

# run_step NAME COMMAND…: runs it quietly, the output in build/logs; shows the end of the log if it fails.
run_step() {
  step=$1
  shift
  local log start rc=0
  mkdir -p build/logs
  log="build/logs/$(printf '%s' "$step" | tr -c 'a-zA-Z0-9' '-').log"
  start=$SECONDS
  printf '%s …\n' "$step"
  "$@" >"$log" 2>&1 </dev/null || rc=$?
  if [ "$rc" -ne 0 ]; then
    tail -n 60 "$log" >&2
    die "failed: $step (status $rc, whole output in $log)"
  fi
  printf '%s: %d s\n' "$step" $((SECONDS - start))
}

missing_packages() {
  local p
  for p in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null || true)" = installed ] || printf '%s ' "$p"
  done
}

apt_quiet() { apt-get -y -q -o Acquire::Retries=3 -o DPkg::Lock::Timeout=300 -o Dpkg::Use-Pty=0 "$@"; }

apt_install() {
  # Lists may be absent or stale: refresh them when a package is unknown, and once more when a download fails.
  if ! apt-get -s -q install --no-install-recommends --no-remove "$@" >/dev/null 2>&1; then
    apt_quiet update
  fi
  apt_quiet install --no-install-recommends --no-remove "$@" ||
    { apt_quiet update && apt_quiet install --no-install-recommends --no-remove "$@"; }
}

# need_packages NAME PACKAGE…: installs those that are missing; never touches what is there.
need_packages() {
  local name=$1 missing
  shift
  command -v dpkg-query >/dev/null ||
    { say "not a Debian system: these packages (or your system's like) are taken to be there: $*"; return 0; }
  read -r -a missing <<<"$(missing_packages "$@")"
  [ "${#missing[@]}" -eq 0 ] && return 0
  if [ "$(id -u)" -ne 0 ]; then
    die "missing Debian packages; as root run:
  apt-get install --no-install-recommends ${missing[*]}"
  fi
  run_step "install $name" apt_install "${missing[@]}"
}

find_python() {
  local p
  for p in python3.11 python3; do
    if command -v "$p" >/dev/null && "$p" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
      command -v "$p"
      return 0
    fi
  done
  die "Python 3.11 is needed (bpy 5.0 has wheels for no other); $(python3 --version 2>&1) found"
}

# venv_with FILE…: .venv holding the pinned requirements of these files; a stamp keeps it from being done twice.
venv_with() {
  local python stamp key f
  if [ ! -x "$py" ] || ! "$py" -m pip --version >/dev/null 2>&1; then
    python=$(find_python)
    run_step "create .venv" "$python" -m venv --clear "$root/.venv"
  fi
  for f in "$@"; do
    stamp="$root/.venv/.headwater-$(basename "$f" .txt)"
    key=$(cat "$f" requirements/constraints.txt | sha256sum)
    if [ "$(cat "$stamp" 2>/dev/null)" != "$key" ]; then
      run_step "install $f" "$py" -m pip install --retries 5 -r "$f" -c requirements/constraints.txt
      printf '%s\n' "$key" >"$stamp"
    fi
  done
  # The package is used in place: the module that CMake builds lands in headwater/.
  local site
  site=$("$py" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
  if [ "$(cat "$site/headwater-checkout.pth" 2>/dev/null)" != "$root" ]; then
    printf '%s\n' "$root" >"$site/headwater-checkout.pth"
  fi
  if [ ! -x .venv/bin/headwater ]; then
    printf '#!/bin/sh\nexec "$(dirname "$(readlink -f "$0")")/python" -m headwater "$@"\n' >.venv/bin/headwater
    chmod +x .venv/bin/headwater
  fi
}

setup_lint() { # no compiler and no Vulkan needed: fit for a bare CI job
  need_packages "python3-venv" python3-venv
  venv_with requirements/lint.txt
}

# probe [--ray-query]: true when some Vulkan device (with ray query) starts.
probe() { python3 "$root/tools/vulkan_probe.py" --quiet "$@"; }

setup_vulkan_device() { # a machine with a usable Vulkan device is used as it is
  probe && return 0
  need_packages "software Vulkan driver" mesa-vulkan-drivers
  probe || die "no Vulkan device starts, not even Mesa's lavapipe; see: python3 tools/vulkan_probe.py"
}

setup() {
  case "$1" in
    demo | test) ;;
    *) die "setup: demo or test, not \"$1\"" ;;
  esac
  step="set-up"
  local packages=("${apt_build[@]}" "${apt_blender[@]}")
  [ "$1" = demo ] || packages+=("${apt_test[@]}")
  need_packages "Debian packages" "${packages[@]}"
  setup_vulkan_device
  if [ "$1" = demo ]; then
    venv_with requirements/run.txt
  else
    venv_with requirements/run.txt requirements/lint.txt requirements/test.txt
    setup_ray_query
  fi
}

# A device with ray query for the tests: the machine's own, or Mesa's lavapipe from Debian backports in .deps/mesa.
# Sets ray_query_env, the environment that reaches it (empty: the machine's own), and ray_query (yes or no).
setup_ray_query() {
  ray_query=yes
  ray_query_env=()
  probe --ray-query && return 0
  local mesa="$root/.deps/mesa"
  ray_query_env=("VK_DRIVER_FILES=$mesa/lvp_icd.json" "VK_ICD_FILENAMES=$mesa/lvp_icd.json"
    "LD_LIBRARY_PATH=$mesa/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}")
  env "${ray_query_env[@]}" python3 tools/vulkan_probe.py --quiet --ray-query && return 0
  step="fetch a ray-query driver"
  mkdir -p build/logs
  local log="build/logs/private-mesa.log" start=$SECONDS
  printf '%s …\n' "$step"
  if bash tools/private_mesa.sh "$mesa" >"$log" 2>&1 </dev/null &&
    env "${ray_query_env[@]}" python3 tools/vulkan_probe.py --quiet --ray-query; then
    printf '%s: %d s (in .deps/mesa; the system is as it was)\n' "$step" $((SECONDS - start))
    return 0
  fi
  tail -n 20 "$log" >&2
  ray_query=no
  ray_query_env=()
  [ "${CI:-}" != true ] || die "no Vulkan device with ray query, and none could be fetched ($log)"
  say "NO Vulkan device with ray query ($log): tests that need one are skipped"
}

# build PRESET: configures when needed (new checkout place, new presets or requirements), then builds.
build() {
  local preset=$1 dir="build/$1" key cached kernels=()
  shift
  if [ "$preset" != release ]; then # kernels are the same
    build release --target kernels
    kernels=("-DHEADWATER_KERNELS=$root/build/release/generated")
  fi
  [ -n "$(ls core/*/*.cpp 2>/dev/null)" ] || die "nothing to build"
  key=$(cat CMakePresets.json requirements/constraints.txt | sha256sum)
  cached=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$dir/CMakeCache.txt" 2>/dev/null || true)
  if [ "$cached" != "$root" ] || [ ! -f "$dir/build.ninja" ] || [ "$(cat "$dir/.configured" 2>/dev/null)" != "$key" ]; then
    rm -rf "$dir"
    run_step "configure $preset" cmake --preset "$preset" "${kernels[@]}"
    printf '%s\n' "$key" >"$dir/.configured"
  fi
  run_step "build $preset" cmake --build "$dir" -j "$jobs" "$@"
}
