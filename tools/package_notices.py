# SPDX-License-Identifier: Apache-2.0
"""Licence notices of what others wrote: of the libraries in the extension's wheel, of what is compiled into the core.

Taken, when the package is made, from where each came: Debian's copyright file of the package that owns a file, and
nanobind's own wheel. docs/decisions/0011-extension-package.md.
"""

import importlib.metadata
import importlib.util
import subprocess
from pathlib import Path

# PyPI's pyoidn carries its libraries without their licences.
DENOISER = """\
Open Image Denoise and its weights (libOpenImageDenoise*, libheadwater-oidn-core.so), Copyright Intel Corporation, and
oneTBB (libheadwater-oidn-tbb.so), Copyright Intel Corporation, from PyPI's pyoidn, with symbols and file names changed
(tools/collect_oidn.py of Headwater), are under the Apache License, Version 2.0: Apache-2.0.txt beside this file.
"""
DOCUMENTS = Path("/usr/share/doc")
# SPDX expression of the wheel: ours, Embree and oneTBB; nanobind; robin_map, volk, GLM and libdeflate; libjpeg-turbo.
EXPRESSION = "Apache-2.0 AND BSD-3-Clause AND MIT AND IJG AND Zlib"


class NoticeError(Exception):
    """A notice can't be found; the text says whose."""


def of_debian(file: Path) -> bytes:
    """The copyright file of the Debian package that owns a file."""
    done = subprocess.run(["dpkg-query", "-S", str(file.resolve())], capture_output=True, text=True)
    package = done.stdout.split(":")[0]
    notice = DOCUMENTS / package / "copyright"
    if done.returncode or not notice.is_file():
        raise NoticeError(f"no Debian package with a copyright file owns {file}")
    return notice.read_bytes()


def of_nanobind() -> bytes:
    """The licence in nanobind's wheel."""
    found = [f for f in importlib.metadata.files("nanobind") or () if f.name.startswith("LICENSE")]
    if len(found) != 1:
        raise NoticeError("nanobind's wheel has no licence, or several")
    return found[0].locate().read_bytes()


def of_robin_map() -> bytes:
    """The comment that robin_map's header, which nanobind carries, begins with."""
    (nanobind,) = importlib.util.find_spec("nanobind").submodule_search_locations
    text = (Path(nanobind) / "ext/robin_map/include/tsl/robin_map.h").read_text()
    comment, end, _ = text.partition("*/")
    if not end or "Copyright" not in comment:
        raise NoticeError("robin_map's header does not begin with its licence")
    lines = (line.strip().lstrip("/*").strip() for line in comment.splitlines())
    return ("\n".join(lines).strip() + "\n").encode()


def notices(embree: Path, tbb: Path, glm: Path, volk: Path, jpeg: Path, deflate: Path) -> dict[str, bytes]:
    """Name → text of each notice. The paths: libraries, but of GLM and volk the folders of glm/glm.hpp and volk.h."""
    return {
        "Embree": of_debian(embree),
        "oneTBB": of_debian(tbb),
        "Open Image Denoise": DENOISER.encode(),
        "GLM": of_debian(glm / "glm" / "glm.hpp"),
        "volk": of_debian(volk / "volk.h"),
        "libjpeg-turbo": of_debian(jpeg),
        "libdeflate": of_debian(deflate),
        "nanobind": of_nanobind(),
        "robin_map": of_robin_map(),
    }
