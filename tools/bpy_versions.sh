# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154
# The add-on in other releases of PyPI's bpy for ./dev test --bpy, sourced by it.

other_bpys=("4.5.15 3.11" "5.2.3 3.13") # release, and the Python that it is made for; ours is in requirements/

# python_of 3.N: an interpreter of that version, also pyenv's.
python_of() {
  local candidate
  for candidate in "python$1" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$1".*/bin/python; do
    candidate=$(command -v "$candidate") || continue
    "$candidate" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$1')" 2>/dev/null && printf '%s\n' "$candidate" &&
      return 0
  done
  return 1
}

# get_bpy RELEASE PYTHON-VERSION: a virtual environment with it, .deps/bpy/RELEASE.
get_bpy() {
  local python log="$root/build/logs/bpy-$1.log" place="$root/.deps/bpy/$1" start=$SECONDS
  [ ! -f "$place/.whole" ] || return 0
  step="get bpy $1"
  mkdir -p build/logs
  if ! python=$(python_of "$2"); then
    say "NO Python $2 here: bpy $1 is SKIPPED"
    return 1
  fi
  printf '%s …\n' "$step"
  if "$python" -m venv --clear "$place" >"$log" 2>&1 && "$place/bin/pip" install --retries 5 "bpy==$1" >>"$log" 2>&1; then
    touch "$place/.whole"
    printf '%s: %d s\n' "$step" $((SECONDS - start))
    return 0
  fi
  tail -n 3 "$log"
  say "NO bpy $1 ($log): it is SKIPPED"
  return 1
}

# Pictures by each beside ours, and what the add-on's tests with a double of the core say of its scenes.
bpy_sessions() {
  local entry release version command lines=""
  local -A commands
  setup test
  build_stable_abi
  for entry in "${other_bpys[@]}"; do
    read -r release version <<<"$entry"
    get_bpy "$release" "$version" || continue
    command="$root/.deps/bpy/$release/bin/python"
    [ "$version" = 3.11 ] || command="env HEADWATER_MODULE_DIR=$root/build/release/abi3 $command"
    commands[$release]=$command
    lines+="$release $command"$'\n'
  done
  [ -n "$lines" ] || die "no other bpy could be had"
  checked "pictures of other bpys" env "${ray_query_env[@]}" HEADWATER_BPYS="$lines" \
    "$py" -m pytest blender_tests/test_bpy_versions.py
  for release in "${!commands[@]}"; do
    checked "the add-on's syncs, bpy $release" env HEADWATER_BPY="${commands[$release]}" \
      "$py" -m pytest blender_tests/test_addon_moves.py blender_tests/test_addon_sync.py
  done
  [ "${#failures[@]}" -eq 0 ] || die "failed: ${failures[*]}"
}
