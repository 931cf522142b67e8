# SPDX-License-Identifier: Apache-2.0
"""The extension's zip, where `./dev package` made one: contents, tags, symbols, Blender's own check."""

import importlib.util
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import package_extension as packing  # noqa: E402

ZIPS = sorted((ROOT / "out").glob("headwater-*-linux-x64.zip"))
needs_zip = pytest.mark.skipif(not ZIPS, reason="no extension in out/: ./dev package makes it")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """Folder of the zip's contents, and that of its wheel's."""
    extension = tmp_path_factory.mktemp("extension")
    zipfile.ZipFile(ZIPS[0]).extractall(extension)
    wheels = list((extension / "wheels").glob("*.whl"))
    assert len(wheels) == 1
    site = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheels[0]).extractall(site)
    return extension, site


@needs_zip
def test_manifest_names_what_is_there(unpacked):
    extension, _ = unpacked
    manifest = tomllib.loads((extension / "blender_manifest.toml").read_text())
    assert manifest["version"] == packing.version_of_sources()
    assert [(extension / wheel).is_file() for wheel in manifest["wheels"]] == [True]
    assert (extension / "farm_guard.py").is_file() and not list(extension.rglob("__pycache__"))


@needs_zip
def test_libraries_keep_the_promise_of_the_tag(unpacked):
    _, site = unpacked
    libraries = sorted(site.rglob("*.so"))
    assert len(libraries) == 4
    for library in libraries:
        packing.check_library(library)


@needs_zip
def test_nothing_can_meet_blenders_own_libraries(unpacked):
    _, site = unpacked
    for library in site.rglob("*.so"):
        names = packing.exported(library)
        if library.name.startswith("_core"):
            assert names == ["PyInit__core"]
        else:
            assert names and all(name.startswith(packing.PREFIX) for name in names)
        undefined = packing.run("nm", "-D", "--undefined-only", library)
        assert not re.search(r"\b(rtc[A-Z]\w*|_ZN3tbb\w*)", undefined)


@needs_zip
def test_blenders_packager_finds_it_valid():
    bpy = Path(importlib.util.find_spec("bpy").submodule_search_locations[0])
    (tool,) = bpy.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    done = subprocess.run([sys.executable, tool, "validate", ZIPS[0]], capture_output=True, text=True)
    assert done.returncode == 0 and "Success" in done.stdout, done.stdout + done.stderr


def test_a_library_that_asks_for_too_much_is_refused(tmp_path):
    source = tmp_path / "late.c"
    source.write_text("extern void *_dl_find_object(void*, void*); void *f(void) { return _dl_find_object(0, 0); }\n")
    library = tmp_path / "late.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    with pytest.raises(packing.PackageError, match="GLIBC_2.35"):
        packing.check_library(library)
