# SPDX-License-Identifier: Apache-2.0
"""What `headwater render` was asked for, after parsing: the same for .blend and USD."""

from dataclasses import asdict, dataclass, fields

from headwater.errors import EXIT_USAGE, UserError
from headwater.output import check_output, frame_path
from headwater.render_reuse import given as given_reuse

# option --NAME-bounces, the core's setting, Cycles' property
BOUNCES = (
    ("max", "max_bounces", "max_bounces"),
    ("diffuse", "diffuse_bounces", "diffuse_bounces"),
    ("glossy", "glossy_bounces", "glossy_bounces"),
    ("transmission", "transmission_bounces", "transmission_bounces"),
    ("transparent", "transparent_bounces", "transparent_max_bounces"),
)


@dataclass
class Request:
    """None where nothing was asked for, so that the file decides."""

    file: str
    output: str
    exr_depth: str
    passes: list | None
    size: tuple | None
    region: tuple | None
    camera: str | None
    frames: range | None
    samples: int | None
    time_limit: float | None
    noise_threshold: float | bool | None  # False: no adaptive sampling
    seed: int | None
    integrator: str | None
    estimator: str | None
    lights: str | None
    bounces: dict  # the core's setting -> limit, only those given
    reuse: dict  # parameters of reservoir integrators: the core's setting -> value, only those given
    no_clamp: bool
    device: str
    tracer: str
    threads: int
    memory_limit: int  # MiB of device memory, 0: none
    engine: str
    autoexec: bool
    denoise: bool

    @classmethod
    def from_args(cls, args, output: str) -> "Request":
        """From the parsed command line."""
        passes = None
        if args.passes is not None:
            passes = list(dict.fromkeys(name.strip() for name in args.passes.split(",") if name.strip()))
            if not passes:
                raise UserError("--passes names no pass", EXIT_USAGE)
        bounces = {
            setting: getattr(args, f"{name}_bounces")
            for name, setting, _ in BOUNCES
            if getattr(args, f"{name}_bounces") is not None
        }
        names = (
            "file",
            "exr_depth",
            "size",
            "region",
            "camera",
            "frames",
            "samples",
            "time_limit",
            "noise_threshold",
            "seed",
            "integrator",
        )
        names += (
            "estimator",
            "lights",
            "no_clamp",
            "device",
            "tracer",
            "threads",
            "memory_limit",
            "engine",
            "autoexec",
            "denoise",
        )
        values = {name: getattr(args, name) for name in names}
        return cls(output=output, passes=passes, bounces=bounces, reuse=given_reuse(args), **values)

    @classmethod
    def blank(cls, file: str, **values) -> "Request":
        """A request that leaves to the file what `values` do not name."""
        given = dict.fromkeys(field.name for field in fields(cls))
        given |= {"output": "", "exr_depth": "float", "bounces": {}, "reuse": {}, "no_clamp": False}
        given |= {"device": "", "tracer": "auto", "threads": 0, "engine": "headwater", "autoexec": False}
        given |= {"denoise": False}
        return cls(**(given | {"file": file} | values))

    @property
    def adaptive(self) -> dict | None:
        """The core's settings of adaptive sampling; None where nothing was asked for."""
        if self.noise_threshold is None:
            return None
        return {
            "adaptive_sampling": self.noise_threshold is not False,
            "noise_threshold": float(self.noise_threshold),
        }

    @property
    def is_png(self) -> bool:
        """Whether the output is a display picture rather than an EXR."""
        return self.output.lower().endswith(".png")

    def frame_output(self, frame: int) -> str:
        """Path of a frame's picture, checked again to be writable."""
        return check_output(frame_path(self.output, frame, animated=self.frames is not None))

    def check_region(self, width: int, height: int):
        """The region in a picture of this size, or None. Raises UserError when it reaches outside."""
        if self.region is None:
            return None
        if self.region[2] > width or self.region[3] > height:
            raise UserError(f"--region {','.join(map(str, self.region))} reaches outside {width}x{height}", EXIT_USAGE)
        return self.region

    def as_dict(self) -> dict:
        """JSON-ready."""
        values = asdict(self) | {"frames": str(self.frames)}
        if self.frames is not None:
            values["frames"] = [self.frames[0], self.frames[-1], self.frames.step]
        else:
            values["frames"] = None
        return values
