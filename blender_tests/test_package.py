# SPDX-License-Identifier: Apache-2.0
"""The extension's zip, where `./dev package` made one of this tree: contents, tags, symbols, Blender's own check."""

import importlib.util
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from headwater import denoiser

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))
import package_extension as packing  # noqa: E402
import package_notices  # noqa: E402


@pytest.fixture(scope="module")
def made():
    """The zip, where it is of this tree; else the tests are skipped, or fail where HEADWATER_REQUIRE_PACKAGE is set."""
    if why := packing.why_stale(ROOT / "out"):
        (pytest.fail if os.environ.get("HEADWATER_REQUIRE_PACKAGE") else pytest.skip)(why)
    return ROOT / "out" / packing.extension_name()


@pytest.fixture(scope="module")
def unpacked(made, tmp_path_factory):
    """Folder of the zip's contents, and that of its wheel's."""
    extension = tmp_path_factory.mktemp("extension")
    zipfile.ZipFile(made).extractall(extension)
    wheels = list((extension / "wheels").glob("*.whl"))
    assert len(wheels) == 1
    site = tmp_path_factory.mktemp("site")
    zipfile.ZipFile(wheels[0]).extractall(site)
    return extension, site


def test_manifest_names_what_is_there(unpacked):
    extension, _ = unpacked
    manifest = tomllib.loads((extension / "blender_manifest.toml").read_text())
    assert manifest["version"] == packing.version_of_sources()
    assert [(extension / wheel).is_file() for wheel in manifest["wheels"]] == [True]
    assert (extension / "farm_guard.py").is_file() and not list(extension.rglob("__pycache__"))


def test_libraries_keep_the_promise_of_the_tag(unpacked):
    _, site = unpacked
    libraries = sorted(path for path in site.rglob("*.so*") if path.parent.name != "lib")
    assert len(libraries) == 4
    for library in libraries:
        packing.check_library(library)


def test_open_image_denoise_is_whole(unpacked):
    _, site = unpacked
    folder = site / "headwater" / "oidn" / "lib"
    assert {path.name for path in folder.iterdir()} == {path.name for path in packing.OIDN.iterdir()}
    assert (folder / denoiser.SONAME).is_file()
    libraries = sorted(folder.glob("*.so*"))
    for library in libraries:
        packing.check_library(library, {other.name for other in libraries})
        meets = [name for name in packing.exported(library) if re.match(r"_ZN?K?(3tbb|4oidn)", name)]
        assert not meets, library.name


def test_nothing_can_meet_blenders_own_libraries(unpacked):
    _, site = unpacked
    for library in [*site.glob("headwater/*.so"), *site.glob("headwater/libs/*.so")]:
        names = packing.exported(library)
        if library.name.startswith("_core"):
            assert names == ["PyInit__core"]
        else:
            assert names and all(name.startswith(packing.PREFIX) for name in names)
        undefined = packing.run("nm", "-D", "--undefined-only", library)
        assert not re.search(r"\b(rtc[A-Z]\w*|_ZN3tbb\w*)", undefined)


def test_wheel_carries_the_notices_of_what_is_in_it(unpacked):
    _, site = unpacked
    (info,) = site.glob("headwater-*.dist-info")
    expected = {
        "Apache-2.0": "Apache License",
        "Embree": "Upstream-Name: embree",
        "oneTBB": "Upstream-Name: oneTBB",
        "Open Image Denoise": "Intel Corporation",
        "GLM": "G-Truc",
        "volk": "Arseny Kapoulkine",
        "libjpeg-turbo": "D. R. Commander",
        "libdeflate": "Eric Biggers",
        "nanobind": "Wenzel Jakob",
        "robin_map": "Goetghebuer-Planchon",
    }
    metadata = (info / "METADATA").read_text()
    for name, words in expected.items():
        text = (info / "licenses" / f"{name}.txt").read_text()
        assert words in text and "Copyright" in text, name
        assert f"License-File: {name}.txt\n" in metadata
    assert len(list((info / "licenses").iterdir())) == len(expected)


def test_a_file_without_a_notice_is_refused(tmp_path):
    with pytest.raises(package_notices.NoticeError, match="stranger.so"):
        package_notices.of_debian(tmp_path / "stranger.so")


def test_blenders_packager_finds_it_valid(made):
    bpy = Path(importlib.util.find_spec("bpy").submodule_search_locations[0])
    (tool,) = bpy.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    done = subprocess.run([sys.executable, tool, "validate", made], capture_output=True, text=True)
    assert done.returncode == 0 and "Success" in done.stdout, done.stdout + done.stderr


def test_another_source_makes_the_zip_stale(made, monkeypatch, tmp_path):
    files = packing.package_files()
    (tmp_path / made.name).write_bytes(made.read_bytes())
    assert packing.why_stale(tmp_path) == ""
    monkeypatch.setattr(packing, "package_files", lambda: files | {"headwater/__init__.py": b"# another\n"})
    assert "older than" in packing.why_stale(tmp_path)
    (tmp_path / made.name).unlink()
    assert "./dev package" in packing.why_stale(tmp_path)


def test_a_library_that_asks_for_too_much_is_refused(tmp_path):
    source = tmp_path / "late.c"
    source.write_text("extern void *_dl_find_object(void*, void*); void *f(void) { return _dl_find_object(0, 0); }\n")
    library = tmp_path / "late.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    with pytest.raises(packing.PackageError, match="GLIBC_2.35"):
        packing.check_library(library)
