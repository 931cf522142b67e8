#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs Blender in a root that tools/real_blender.sh made, with software drivers, seeing this checkout, /tmp and the
# folders of BLENDER_BIND (separated by spaces) at their own places. BL_HOME is its home folder.
#
#   real_blender_run.sh ROOT ARGUMENTS…                    Blender with these arguments
#   real_blender_run.sh ROOT --gui WIDTHxHEIGHT ARGUMENTS…  in a window, on an X server of its own; XVFB_FB: the folder that
#                                                         the server keeps its screen in, Xvfb_screen0, an XWD file
#   real_blender_run.sh ROOT --sh COMMAND…                  any command
#
# It ends with everything it started, also when it is killed: a process namespace of its own.
set -euo pipefail
self=$(readlink -f "${BASH_SOURCE[0]}")
checkout=$(dirname "$(dirname "$self")")

# On the machine → in namespaces of our own → in the root: the script calls itself on.
case "${1:-}" in
  --mount)
    root=$2
    shift 2
    mount -t proc proc "$root/proc"
    # shellcheck disable=SC2086
    for folder in /dev /sys /tmp "$checkout" ${BLENDER_BIND:-}; do
      mkdir -p "$root$folder"
      mount --rbind "$folder" "$root$folder"
    done
    exec chroot "$root" /usr/bin/env -u VK_DRIVER_FILES -u LD_LIBRARY_PATH -u LD_PRELOAD HOME="${BL_HOME:-/root}" \
      LANG=C.UTF-8 LC_ALL=C.UTF-8 PATH=/usr/sbin:/usr/bin XDG_RUNTIME_DIR=/tmp LIBGL_ALWAYS_SOFTWARE=1 \
      /bin/bash "$self" --inside "$PWD" "$@"
    ;;
  --inside) ;;
  *)
    # A number that no other server has: /tmp is shared, process numbers inside are not.
    export SCREEN_NUMBER=$((100 + $$ % 50000))
    exec unshare --mount --pid --fork --kill-child=KILL --propagation private bash "$self" --mount "$@"
    ;;
esac

cd "$2" 2>/dev/null || cd /
shift 2
VK_ICD_FILENAMES=$(echo /usr/share/vulkan/icd.d/lvp_icd*.json)
export VK_ICD_FILENAMES
case "${1:-}" in
  --sh)
    shift
    exec "$@"
    ;;
  --gui)
    size=$2
    shift 2
    XVFB_FB=$(mktemp -d)
    export XVFB_FB DISPLAY=":$SCREEN_NUMBER"
    Xvfb "$DISPLAY" -screen 0 "${size}x24" -nolisten tcp -fbdir "$XVFB_FB" >"$XVFB_FB/log" 2>&1 &
    server=$!
    until [ -S "/tmp/.X11-unix/X$SCREEN_NUMBER" ]; do
      kill -0 "$server" 2>/dev/null || { cat "$XVFB_FB/log" >&2; exit 99; }
      sleep 0.05
    done
    rc=0
    blender "$@" || rc=$?
    kill "$server"
    wait "$server" || true
    rm -rf "$XVFB_FB"
    exit "$rc"
    ;;
  *) exec blender "$@" ;;
esac
