# SPDX-License-Identifier: Apache-2.0
"""Renders of one .blend by both engines, each in a process that lives as long as it works."""

import os
import tempfile

from headwater import denoiser, interrupt
from headwater.bench.contestants import CYCLES, Contestant
from headwater.bench.process import Failed, Worker
from headwater.compare import load_colour
from headwater.errors import UserError
from headwater.image_io import read_exr
from headwater.output import frame_path
from headwater.progress import format_seconds
from headwater.render_request import BOUNCES

WORKER = "headwater.bench.worker"
GUIDES = denoiser.GUIDES["RGB_ALBEDO_NORMAL"]


class Stopped(Exception):
    """The user pressed Ctrl-C."""


class Engines:
    """Context manager. Renders on demand; an engine that died is started anew for the next one."""

    def __init__(self, file: str, args, frames, progress):
        self.file, self._args, self.frames, self._progress = file, args, frames, progress
        self._workers, self.blender, self._warm = {}, None, set()
        self.part = 0.0  # of all the work that is done, for the progress line
        self._folder = tempfile.TemporaryDirectory(prefix="headwater-bench-")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for engine in list(self._workers):
            self._drop(engine)
        self._folder.cleanup()
        return False

    def render(
        self, contestant: Contestant, seed: int, samples: int, label: str, reference: bool = False
    ) -> tuple[list, list]:
        """(pictures, costs) of every frame: (H, W, 3) float32 linear, top row first; what worker.py tells.

        The first render of a contestant is preceded by one that is not measured: it compiles kernels. For a `reference`
        frames stand alone and stay noisy. Raises UserError with the engine's reason, Stopped.
        """
        if contestant.text not in self._warm:
            self._ask(contestant, 1, 1, f"{label}, getting ready", [])
            self._warm.add(contestant.text)
        lead = [] if reference else self._args.lead
        costs = self._ask(contestant, seed, samples, label, lead)["renders"]
        read = load_colour if reference or not self._args.denoise else _denoised
        return [read(self._picture(contestant.engine, frame)) for frame in self._frames()], costs

    def _frames(self):
        return list(self.frames) if self.frames is not None else [self._current]

    def _picture(self, engine: str, frame: int) -> str:
        return frame_path(os.path.join(self._folder.name, f"{engine}-####.exr"), frame, animated=True)

    def _ask(self, contestant, seed, samples, label, lead) -> dict:
        if contestant.engine not in self._workers:
            self._start(contestant.engine)
        question = {"contestant": contestant.settings(), "seed": seed, "samples": samples, "frames": self._frames()}
        # Ours learns from every frame before, of as many samples. Cycles keeps nothing but the scene as it was last.
        keeps = contestant.engine != CYCLES
        question |= {"lead": lead if keeps else lead[-1:], "lead_samples": samples if keeps else 1}
        question["output"] = os.path.join(self._folder.name, f"{contestant.engine}-####.exr")
        for frame in self._frames():
            if os.path.exists(self._picture(contestant.engine, frame)):
                os.unlink(self._picture(contestant.engine, frame))
        return self._answer(contestant.engine, question, label)

    def _start(self, engine: str) -> None:
        args = self._args
        limits = [setting for _, setting, _ in BOUNCES if setting != "transparent_bounces"]
        job = {
            "file": os.path.abspath(self.file),
            "engine": engine,
            "size": args.size,
            "bounces": dict.fromkeys(limits, args.max_bounces),
            "threads": args.threads,
            "device": args.device,
            "tracer": args.tracer,
            "persistent": self.frames is not None,
            "passes": ["Combined", *(GUIDES if args.denoise else ())],
        }
        self._workers[engine] = Worker(WORKER, engine, args.threads)
        said = self._answer(engine, job, f"{engine}: opening the file")
        self.blender, self._current = said["blender"], said["frame"]

    def _answer(self, engine: str, question: dict, label: str) -> dict:
        def waiting(seconds):
            if interrupt.requested():
                raise Stopped
            self._progress.update_text(label, self.part, format_seconds(seconds))

        try:
            return self._workers[engine].ask(question, self._args.timeout, waiting)
        except Failed as error:
            self._drop(engine)
            raise UserError(f"'{os.path.basename(self.file)}' by {error}") from error
        except BaseException:
            self._drop(engine)  # it still works on what nobody wants any more
            raise

    def _drop(self, engine: str) -> None:
        self._workers.pop(engine).close()
        self._warm = {text for text in self._warm if (engine == CYCLES) != text.startswith(CYCLES)}


def _denoised(path: str):
    """The colour of an EXR that holds the guides too, denoised by them."""
    layers = read_exr(path).layers
    combined, albedo, normal = (
        next(pixels for name, pixels in layers.items() if name.endswith(wanted)) for wanted in ("Combined", *GUIDES)
    )
    return denoiser.denoise(combined, albedo[..., :3], normal[..., :3])[..., :3]
