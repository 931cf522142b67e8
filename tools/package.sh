# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154,SC2034
# The Blender extension for ./dev, sourced by it: both modules, private libraries, the zip in out/.

apt_package=(binutils)

# cached NAME: what the release build's CMake cache holds under that name.
cached() { sed -n "s/^$1:[A-Z]*=//p" build/release/CMakeCache.txt; }

python_headers="$root/.deps/python"

fetch_python_headers() {
  [ -f "$python_headers/include/python3.13/Python.h" ] ||
    run_step "fetch Python 3.13's headers" bash tools/python_headers.sh "$python_headers"
}

# Open Image Denoise for the wheel, in .deps/oidn.
collect_oidn() {
  local key collected="$root/.deps/oidn"
  key=$(cat tools/collect_oidn.py requirements/constraints.txt | sha256sum)
  [ "$(cat "$collected.made-of" 2>/dev/null)" != "$key" ] || return 0
  run_step "collect Open Image Denoise" "$py" tools/collect_oidn.py --out "$collected"
  printf '%s\n' "$key" >"$collected.made-of"
}

# The module for Python 3.12 on, in build/release/abi3.
build_stable_abi() {
  fetch_python_headers
  build release
  run_step "configure the module for Python 3.12 on" \
    cmake -B build/release -DHEADWATER_STABLE_ABI_HEADERS="$python_headers/include"
  build release --target _core_abi3
}

package() {
  local bpy
  setup demo
  need_packages "packaging tools" "${apt_package[@]}"
  venv_with requirements/package.txt
  build_stable_abi
  collect_oidn
  bpy=$("$py" -c 'import importlib.util; print(importlib.util.find_spec("bpy").submodule_search_locations[0])')
  step="package"
  "$py" tools/package_extension.py --core311 "$(ls headwater/_core.cpython-311-*.so)" \
    --core312 build/release/abi3/_core.abi3.so --glm "$(cached GLM_INCLUDE)" --volk "$(cached VOLK_INCLUDE)" \
    --jpeg "$(cached JPEG_LIBRARY)" --deflate "$(cached DEFLATE_LIBRARY)" \
    --blender-ext "$(ls "$bpy"/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)" --out out
}
