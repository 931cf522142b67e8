# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154,SC2206
# The extension in real Blenders for ./dev test --blender, sourced by it.

# In every launcher of HEADWATER_BLENDERS, or those that tools/real_blender.sh makes in .deps/blender: the extension's life
# by blender_tests/real/{install,update}.py, then, in a window of a profile with the extension, quit.py and each *_session.py
# beside it. What they leave is in out/real.
blender_sessions() {
  local launcher life session place zip launchers=(${HEADWATER_BLENDERS:-})
  package
  zip=$(ls -t "$root"/out/headwater-*-linux-x64.zip | head -n 1)
  if [ "${#launchers[@]}" -eq 0 ]; then
    run_step "get real Blenders" bash tools/real_blender.sh .deps/blender trixie sid
    sed -n '/^NO /p' build/logs/get-real-Blenders.log
    launchers=("$root"/.deps/blender/blender-*)
  fi
  for launcher in "${launchers[@]}"; do
    place="$root/out/real/$(basename "$launcher")"
    rm -rf "$place"
    for life in install update; do
      checked "$life, $(basename "$launcher")" "$py" "blender_tests/real/$life.py" "$launcher" "$zip" "$place/$life"
    done
    checked "profile, $(basename "$launcher")" blender_profile "$launcher" "$place/home" "$zip"
    checked "quit, $(basename "$launcher")" "$py" blender_tests/real/quit.py "$launcher" "$place/home" "$place/quit"
    for session in blender_tests/real/*_session.py; do
      mkdir -p "$place/$(basename "$session" .py)"
      checked "$(basename "$session" .py), $(basename "$launcher")" \
        blender_session "$launcher" "$place/home" "$session" "$place/$(basename "$session" .py)"
    done
  done
  [ "${#failures[@]}" -eq 0 ] || die "failed: ${failures[*]}"
}

# blender_profile LAUNCHER HOME ZIP: a home folder for Blender with the extension.
blender_profile() {
  mkdir -p "$2"
  BL_HOME="$2" "$1" --command extension install-file -r user_default -e "$3"
}

# For every ./dev test: Debian 13's Blender in .deps/blender, if it can be had here.
fetch_blender() {
  local log="$root/build/logs/real-blender.log" start=$SECONDS
  step="fetch a real Blender"
  mkdir -p build/logs
  printf '%s …\n' "$step"
  if bash tools/real_blender.sh .deps/blender trixie >"$log" 2>&1 </dev/null; then
    printf '%s: %d s (in .deps/blender; the system is as it was)\n' "$step" $((SECONDS - start))
    return 0
  fi
  tail -n 5 "$log"
  say "NO REAL BLENDER could be had ($log): its session in a window is SKIPPED"
  return 1
}

# brief_blender ZIP: a short session of it in a window, and three of the states in which it is quit. Left in out/real/brief.
brief_blender() {
  local launcher="$root/.deps/blender/blender-trixie" place="$root/out/real/brief"
  rm -rf "$place"
  mkdir -p "$place/session"
  blender_profile "$launcher" "$place/home" "$1" &&
    blender_session "$launcher" "$place/home" blender_tests/real/brief.py "$place/session" &&
    "$py" blender_tests/real/quit.py "$launcher" "$place/home" "$place/quit" 1 viewport viewport_build final
}

# blender_session LAUNCHER HOME SESSION FOLDER: fails as Blender does, and when Python said anything went wrong: errors in an
# engine's or a panel's callbacks do not end Blender.
blender_session() {
  local log="$4/log.txt" status=0
  BL_HOME="$2" timeout --kill-after=10 900 "$1" --gui 640x480 --python "$root/$3" -- "$4" >"$log" 2>&1 || status=$?
  tail -n 5 "$log"
  if grep -n -A 12 'Traceback (most recent call last)\|Python script error' "$log"; then return 1; fi
  return "$status"
}
