# SPDX-License-Identifier: Apache-2.0
"""Noise and time of light whose emission an image gives, beside the same light made of small squares: the table of
docs/measurements/textured_emission.md.

    python blender_tests/measure_textured_emission.py [PICTURE.png]

The scenes are those of test_textured_emission.py. The picture: the room by `path`, eight samples.
"""

import sys
import time

import numpy as np
import reuse_scenes as rs
import test_textured_emission as scenes

import headwater._core as core


def main() -> None:
    """A row a way of sampling: variance relative to the mean squared, and processor milliseconds a sample."""
    context = core.Context(tracer="embree")
    sessions = [core.Session(context, make(core)) for make in (scenes.sign_room, scenes.squares_room)]
    for way, settings in scenes.WAYS.items():
        row = []
        for session in sessions:
            rs.render(core, session, samples=8, **settings)  # kernels are there
            began = time.process_time()
            noise = scenes.noise(core, session, **settings)
            row += [noise, (time.process_time() - began) * 1000 / 128]
        print("%-8s sign %.4f, %.2f ms; squares %.4f, %.2f ms" % (way, *row), flush=True)
    if len(sys.argv) > 1:
        from PIL import Image

        pixels = rs.render(core, sessions[0], samples=8, width=320, height=180)[::-1]
        Image.fromarray((np.clip(pixels, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)).save(sys.argv[1])


if __name__ == "__main__":
    main()
