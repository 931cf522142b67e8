# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash disable=SC2154,SC2034
# The Blender extension for ./dev, sourced by it: both modules, private libraries, the zip in out/.

apt_package=(binutils)


package() {
  local headers="$root/.deps/python" bpy embree tbb
  setup demo
  need_packages "packaging tools" "${apt_package[@]}"
  venv_with requirements/package.txt
  [ -f "$headers/include/python3.13/Python.h" ] ||
    run_step "fetch Python 3.13's headers" bash tools/python_headers.sh "$headers"
  build release
  run_step "configure the module for Python 3.12 on" cmake -B build/release -DHEADWATER_STABLE_ABI_HEADERS="$headers/include"
  build release --target _core_abi3
  embree=$(sed -n 's/^EMBREE_LIBRARY:FILEPATH=//p' build/release/CMakeCache.txt)
  tbb=$(ldd "$embree" | awk '$1 ~ /^libtbb\.so/ { print $3; exit }')
  bpy=$("$py" -c 'import importlib.util; print(importlib.util.find_spec("bpy").submodule_search_locations[0])')
  step="package"
  "$py" tools/package_extension.py --core311 "$(ls headwater/_core.cpython-311-*.so)" \
    --core312 build/release/abi3/_core.abi3.so --embree "$embree" --tbb "$tbb" \
    --blender-ext "$(ls "$bpy"/*/scripts/addons_core/bl_pkg/cli/blender_ext.py)" --out out
}
