# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154,SC2034
# Lint and tests for ./dev, sourced by it.

cxx_files() { git ls-files -z --cached --others --exclude-standard -- 'core/*.h' 'core/*.cpp' 'shaders/*.h' 'tools/*.cpp'; }

# One line a file: the whole difference is what ./dev format makes.
clang_format_check() {
  local found
  found=$(cxx_files | xargs -0 -r "$root/.venv/bin/clang-format" --dry-run --style=file 2>&1 |
    sed -n 's/^\([^ :]*\):[0-9]*:[0-9]*: .*/\1: clang-format would change it/p' | sort -u) || return 1
  [ -z "$found" ] || { printf '%s\n' "$found"; return 1; }
}

lint() {
  local failed=0
  step="lint"
  clang_format_check || failed=1
  "$py" -m ruff check . || failed=1
  "$py" -m ruff format --check --output-format concise . || failed=1
  "$py" tools/check_tree.py || failed=1
  if [ "$failed" -ne 0 ]; then
    say "lint: FAILED (./dev format mends what can be mended)"
    return 1
  fi
  say "lint: clean"
}

format() {
  step="format"
  cxx_files | xargs -0 -r "$root/.venv/bin/clang-format" -i --style=file
  "$py" -m ruff check --fix . || true
  "$py" -m ruff format .
}

failures=()

# checked NAME COMMAND…: runs it with its output shown; a failure is noted and the run goes on.
checked() {
  local name=$1 start=$SECONDS rc=0
  shift
  step=$name
  printf '\n== %s\n' "$name"
  "$@" </dev/null || rc=$?
  printf '== %s: %s, %d s\n' "$name" "$([ "$rc" -eq 0 ] && echo passed || echo "FAILED (status $rc)")" $((SECONDS - start))
  [ "$rc" -eq 0 ] || failures+=("$name")
}

run_tests() {
  local quick=no only_pytest=no
  while [ $# -gt 0 ]; do
    case "$1" in
      --quick) quick=yes ;;
      --pytest) only_pytest=yes ;;
      --blender)
        blender_sessions
        return
        ;;
      --bpy)
        bpy_sessions
        return
        ;;
      *) break ;;
    esac
    shift
  done
  setup test
  local fetching= # downloads, while compilers run
  if [ "$only_pytest$quick" = nono ]; then
    (trap - ERR; fetch_blender) &
    fetching=$!
  fi
  build release

  local validation=(HEADWATER_VALIDATION=1)
  if [ "$only_pytest" = no ]; then
    checked "lint" lint
    checked "C++ tests, this machine's device" validated cxx_tests build/release/headwater_tests "${validation[@]}"
    if [ "${#ray_query_env[@]}" -gt 0 ]; then
      checked "C++ tests, ray-query device" \
        validated cxx_tests build/release/headwater_tests "${validation[@]}" "${ray_query_env[@]}"
    fi
    if [ "$quick" = no ]; then
      build asan --target headwater_tests
      checked "C++ tests, address and undefined-behaviour sanitizers" sanitized
    fi
  fi

  if [ "$only_pytest$quick" = nono ]; then
    if [ "${CI:-}" = true ] || (fetch_python_headers); then
      checked "the extension" package_apart
      validation+=(HEADWATER_REQUIRE_PACKAGE=1)
      if wait "$fetching"; then
        checked "a real Blender" brief_blender "$(ls -t out/headwater-*-linux-x64.zip | head -n 1)"
      fi
    else
      say "NO headers of Python 3.13: the extension is not made, its tests are skipped"
    fi
  fi

  local args=() rc=0
  [ "$quick" = no ] || args+=(-m "not slow")
  # Side by side, but where arguments ask for some of them. Tests marked alone stay so: blender_tests/alone.py.
  [ $# -gt 0 ] || [ "$jobs" -lt 2 ] || args+=(-n 2 --dist worksteal)
  [ "$ray_query" = no ] || validation+=(HEADWATER_REQUIRE_RAY_QUERY=1)
  step="pytest"
  printf '\n== pytest, after %d s\n' "$SECONDS"
  if [ "${#failures[@]}" -gt 0 ]; then printf 'failed before pytest: %s\n' "${failures[@]}"; fi
  env "${validation[@]}" "${ray_query_env[@]}" "$py" -m pytest "${args[@]}" "$@" </dev/null || rc=$?
  if [ "${#failures[@]}" -gt 0 ]; then
    printf 'FAILED: %s\n' "${failures[@]}" >&2
    [ "$rc" -ne 0 ] || rc=1
  fi
  trap - ERR
  exit "$rc"
}

# A shell of its own: where it can't be made, the other tests run still.
package_apart() { (package); }

# cxx_tests BINARY VARIABLE=VALUE…: all C++ tests in that environment, as many at a time as there are processors. Their
# pictures are small: lavapipe is the quicker without threads of its own. doctest shows failures and messages alone.
cxx_tests() {
  local binary=$1 count at_once=8
  shift
  count=$("$binary" --count | sed -n 's/.*filters: //p')
  [ "${count:-0}" -gt 0 ] || return 1
  say "$count tests"
  seq 1 "$at_once" "$count" | LP_NUM_THREADS=0 env "$@" xargs -P "$jobs" -I '{}' bash -c \
    '"$1" --minimal --first="$2" --last="$(($2 + $3 - 1))"' cxx_tests "$binary" '{}' "$at_once"
}

# validated COMMAND…: fails also where the validation layers spoke while it ran.
validated() {
  local log="$root/build/logs/validation.log" rc=0
  rm -f "$log"
  HEADWATER_VALIDATION_LOG="$log" "$@" || rc=$?
  if [ -s "$log" ]; then
    say "the validation layers spoke:"
    head -n 20 "$log"
    rc=1
  fi
  return "$rc"
}

# The driver is not instrumented: what it leaks is its own affair, named in tools/lsan.supp.
sanitized() { # from the root: the option takes no path with a space
  cxx_tests build/asan/headwater_tests "${ray_query_env[@]}" \
    ASAN_OPTIONS=detect_leaks=1:detect_stack_use_after_return=1:strict_init_order=1 \
    UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 LSAN_OPTIONS=suppressions=tools/lsan.supp:print_suppressions=0
}
