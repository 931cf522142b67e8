# SPDX-License-Identifier: Apache-2.0
# Types of headwater._core, made by nanobind.stubgen from core/python: python -m nanobind.stubgen -m headwater._core

"""
Headwater's core: scene edits, rendering on a Vulkan device, pixels out.

World space is right-handed, Z up, metres; matrices are row-major 3x4, object to world; colours are linear
Rec. 709. Images and pixels have their bottom row first. Arrays are C-contiguous and are not converted.
"""

from collections.abc import Sequence

class SceneError(ValueError):
    """
    Scene data was refused; the message names the object and the reason, and the scene is as it was.
    """

class DeviceError(RuntimeError):
    """The device can't do what was asked."""

class DeviceLost(DeviceError):
    """The device stopped working; make a new Context."""

class OutOfMemory(DeviceError):
    """Device or host memory does not suffice."""

flags: dict = ...

material_ops: dict = ...

class Scene:
    """
    Scene data under ids that the caller chooses. An edit takes effect whole or raises SceneError (or TypeError for
    an argument of the wrong type) and changes nothing. Not for use from several threads at once.
    """

    def __init__(self) -> None: ...
    def upsert_mesh(
        self,
        id: int,
        name: str,
        positions: object,
        tri_vertices: object,
        *,
        tri_corners: object | None = None,
        normals: object | None = None,
        tri_slots: object | None = None,
        attributes: object | None = None,
        tangents: Sequence[tuple[str, int]] = [],
        default_uv: int = -1,
        lend: bool = False,
    ) -> None:
        """
        Sets a mesh, in object space.

        positions: (V, 3) float32, metres; NaN and infinity are refused.
        tri_vertices: (T, 3) uint32 into positions; T may be 0.
        tri_corners: (T, 3) uint32 into normals and corner attributes; None: as tri_vertices.
        normals: (C, 3) float32, unit, one a corner; None: flat. One that is not finite or is zero becomes the
            geometric normal of its triangle.
        tri_slots: (T,) uint8, material slot of each triangle; None: slot 0.
        attributes: [(name, "vertex" | "corner" | "face", (N,) or (N, 1..4) float32)], at most 8; N is V, C or T.
            Values that are not finite become 0.
        tangents: [(name, index of a UV map among attributes)], each one more attribute: of corners, (C, 4), unit
            vectors along u in object space and the sign of the bitangent, as MikkTSpace averages them. Made at the next
            sync. Without tri_corners a vertex has those of its last triangle.
        default_uv: index of the UV map among attributes, -1: none.
        lend: the arrays are not copied: nobody may write to them afterwards. The scene lets go of them when the mesh is
            on a device that shares the host's memory, or is set or removed.
        """

    def keep_lent(self) -> None:
        """
        Copies the arrays that meshes were lent and that are not on a device yet: they may then be written to and freed.
        """

    def remove_mesh(self, id: int) -> None:
        """Removes a mesh. SceneError while an instance uses it."""

    def has_mesh(self, id: int) -> bool:
        """Whether there is a mesh of this id."""

    def upsert_instance(
        self,
        id: int,
        mesh: int,
        matrix: object,
        *,
        name: str = "",
        materials: Sequence[int] = [],
        visibility: int | None = None,
        object_index: int = 0,
        random_id: int = 0,
        flags: int = 0,
        color: Sequence[float] = [1.0, 1.0, 1.0],
        shadow_terminator_offset: float = 0.10000000149011612,
        moves: bool = False,
    ) -> None:
        """
        Sets an instance of a mesh.

        matrix: (3, 4) float32 or float64, object to world. One without volume is allowed: an object flattened along one
            axis is seen as a sheet, one flattened along more is not seen.
        materials: ids by slot, 0: the default material; slots past the end take the last.
        visibility: HW_MASK_* bits. flags: HW_INSTANCE_*. object_index: for the Object Index pass.
        random_id: 32-bit hash for Object Info > Random. color: the object's colour.
        moves: a hint that it moves between frames. Its last frame's place is kept for motion vectors.
        """

    def upsert_instances(
        self,
        first_id: int,
        mesh: int,
        matrices: object,
        *,
        random_ids: object | None = None,
        name: str = "",
        materials: Sequence[int] = [],
        visibility: int | None = None,
        object_index: int = 0,
        random_id: int = 0,
        flags: int = 0,
        color: Sequence[float] = [1.0, 1.0, 1.0],
        shadow_terminator_offset: float = 0.10000000149011612,
        moves: bool = False,
    ) -> None:
        """
        Sets instances first_id, first_id + 1, ... of one mesh, alike but for matrix and random number.

        matrices: (N, 3, 4) float32. random_ids: (N,) uint32, None: random_id for all. The rest as upsert_instance.
        """

    def remove_instance(self, id: int) -> None:
        """Removes one instance."""

    def remove_instances(self, first_id: int, count: int) -> None:
        """
        Removes instances first_id, first_id + 1, ...; SceneError when one of them does not exist.
        """

    def upsert_light(
        self,
        id: int,
        name: str,
        kind: str,
        matrix: object,
        *,
        color: Sequence[float] = [1.0, 1.0, 1.0],
        power: float = 1.0,
        flags: int | None = None,
        normalize: bool = True,
        radius: float = 0.0,
        angle: float = 0.0,
        size_x: float = 1.0,
        size_y: float = 1.0,
        ellipse: bool = False,
        spread: float = 3.1415927410125732,
        spot_size: float = 0.785398006439209,
        spot_blend: float = 0.15000000596046448,
    ) -> None:
        """
        Sets a lamp; units and conventions are Blender's.

        kind: "point", "spot", "sun" or "area". matrix: (3, 4), it shines along its -Z.
        color: linear, times the strength of its nodes. power: W, for a sun W/m^2.
        flags: HW_LIGHT_* bits. normalize: power does not grow with size.
        radius: metres (point, spot). angle: full angle, radians (sun). size_x, size_y: metres; ellipse; spread: full
        angle, radians (area). spot_size: full cone angle, radians; spot_blend: 0 to 1 (spot).
        """

    def upsert_lights(
        self,
        ids: object,
        name: str,
        kind: str,
        matrices: object,
        *,
        color: Sequence[float] = [1.0, 1.0, 1.0],
        power: float = 1.0,
        flags: int | None = None,
        normalize: bool = True,
        radius: float = 0.0,
        angle: float = 0.0,
        size_x: float = 1.0,
        size_y: float = 1.0,
        ellipse: bool = False,
        spread: float = 3.1415927410125732,
        spot_size: float = 0.785398006439209,
        spot_blend: float = 0.15000000596046448,
    ) -> None:
        """
        Sets lamps that are alike but for their place.

        ids: (N,) uint64, quickest in rising order. matrices: (N, 3, 4) float32. The rest as upsert_light.
        """

    def remove_light(self, id: int) -> None:
        """Removes a lamp."""

    def remove_lights(self, ids: object) -> None:
        """
        Removes lamps. ids: (N,) uint64; SceneError when one of them does not exist.
        """

    def upsert_material(
        self,
        id: int,
        name: str,
        program: object,
        constants: object,
        images: Sequence[int] = [],
        flags: int = 0,
        emission: Sequence[float] = [0.0, 0.0, 0.0],
        pass_index: int = 0,
    ) -> None:
        """
        Sets a material. SceneError when the program is malformed.

        id: above 0. program: (W,) uint32, constants: (K, 4) float32, as shaders/shared/material_program.h describes.
        images: ids that the program's image operands index, 0: a missing image. flags: HW_MATERIAL_*.
        emission: radiance when it is constant, else an estimate of it, for choosing lights.
        pass_index: for the Material Index pass.
        """

    def remove_material(self, id: int) -> None:
        """Removes a material. SceneError while an instance or the world uses it."""

    def upsert_image(
        self,
        id: int,
        name: str,
        pixels: object | None,
        *,
        srgb: bool = False,
        premultiplied: bool = False,
        lend: bool = False,
    ) -> None:
        """
        Sets an image.

        id: above 0. pixels: (H, W), (H, W, 1), (H, W, 3) or (H, W, 4), bottom row first; uint8 (0..255 is 0..1),
            float16 or float32; None: a missing image, which reads as magenta. One and three channels get alpha 1.
        srgb: colours are sRGB-encoded. premultiplied: colours are already multiplied by alpha. lend: as in upsert_mesh.
        """

    def remove_image(self, id: int) -> None:
        """Removes an image. SceneError while a material uses it."""

    def set_world(
        self,
        name: str = "",
        color: Sequence[float] = [0.0, 0.0, 0.0],
        material: int = 0,
        importance_width: int = 0,
        sample: bool = True,
        flags: int | None = None,
    ) -> None:
        """
        Sets the world.

        color: constant radiance, when material is 0. material: id of one whose program ends in a background.
        importance_width: resolution of its importance map, 0: by its images. sample: sample it as a light.
        flags: HW_LIGHT_* bits, which rays see it.
        """

    def set_camera(
        self,
        kind: str,
        matrix: object,
        plane: tuple[float, float, float, float],
        *,
        clip: tuple[float, float] = (0.10000000149011612, 1000.0),
        aperture_radius: float = 0.0,
        focus_distance: float = 10.0,
        blades: int = 0,
        rotation: float = 0.0,
        ratio: float = 1.0,
        panorama: str = "equirectangular",
        range: tuple[float, float, float, float] = ...,
        lens: tuple[float, float, float, float] = (0, 0, 0, 0),
    ) -> None:
        """
        Sets the camera.

        kind: "perspective", "orthographic" or "panoramic". matrix: (3, 4), it looks along its -Z, Y is up.
        plane: (left, right, bottom, top) of the full frame, in camera space at distance 1 (perspective) or in metres
            (orthographic) or as a part of the whole panorama, which is (0, 1, 0, 1). clip: (start, end), metres
            along the
            viewing direction.
        aperture_radius: metres, 0: everything in focus. focus_distance: metres. blades: below 3: round.
        rotation: radians. ratio: of the aperture, 1: round.
        panorama: "equirectangular", range: longitude from, to, latitude from, to, radians;
            "fisheye_equidistant": field of view, radians; "fisheye_equisolid": focal length, field of view, width and
            height of the sensor; "mirror_ball"; "cube_face" (equiangular); "cylindrical": longitude from, to, height
            from, to over the radius; "fisheye_polynomial": field of view, constant term, width and height of the
            sensor, and lens: coefficients of the distance from its middle, of its square, cube and fourth power. What a
            kind does not say is not looked at.
        """

    def clear(self) -> None:
        """Removes everything."""

class Context:
    """
    A Vulkan device and its kernels. Expensive to make: keep it. One of its sessions renders at a time.
    """

    def __init__(self, device: str = "", tracer: str = "auto", threads: int = 0, validation: bool = False) -> None:
        """
        device: empty for the best, a part of a device's name, its index, or "gpu", "discrete", "integrated",
            "cpu". tracer: "auto", "embree", "ray_query" or "ray_pipeline". threads: of the host, 0: all.
        validation: turn on Vulkan's validation layers.
        DeviceError when there is no such device, or it can't do what is needed; the message says why.
        """

    @property
    def device(self) -> dict:
        """The device in use: as devices() has it."""

    @property
    def tracer(self) -> str:
        """ "embree", "ray_query" or "ray_pipeline"."""

    @property
    def shared_memory(self) -> bool:
        """
        Whether the device shares the host's memory: meshes then lie in its buffers alone.
        """

    @property
    def validation_messages(self) -> int:
        """Messages of the validation layers so far; they are printed to stderr."""

    @property
    def memory(self) -> int:
        """Bytes of device buffers in use."""

    @property
    def peak_memory(self) -> int:
        """The most there were."""

    def set_memory_limit(self, bytes: int) -> None:
        """
        Buffers that would go past this many bytes raise OutOfMemory; 0: no limit.
        """

class Session:
    """
    A scene being rendered on a device. Keeps the scene's tables on the device from frame to frame.

    progress(), read(), wait() and cancel() may be called from any thread while a render is under way;
    scene edits may be made then too, sync() may not.
    """

    def __init__(self, context: Context, scene: Scene) -> None: ...
    def sync(self) -> dict:
        """
        Brings the device in step with the scene: uploads and builds what changed since the last sync. Not while
        rendering.

        Returns seconds (commit_seconds, upload_seconds, build_seconds, lights_seconds), what the scene holds (meshes,
        instances, lights, triangles, materials, images) and what was sent (meshes_uploaded, instances_uploaded,
        bytes_uploaded).
        """

    def start(self, settings: dict) -> None:
        """
        Begins rendering on the core's own thread. `settings`: the members of RenderSettings (docs/architecture.md);
        only
        width and height must be there. ValueError or TypeError names a bad one.
        """

    def wait(self, milliseconds: int) -> bool:
        """Waits; True when the render has ended."""

    def progress(self) -> dict:
        """
        sample, samples, rays, mrays (million a second), seconds, remaining (below 0: not known), memory (bytes), stage,
        finished, cancelled, error.
        """

    def cancel(self) -> None:
        """Asks the render to end soon; what was accumulated stays readable."""

    def finish(self) -> None:
        """Waits for the end; raises what ended the render, if an error did."""

    def passes(self) -> list[tuple[str, int]]:
        """[(name, channels)] of the render, in the order asked for."""

    def read(self, name: str, out: object | None = None) -> object:
        """
        Pixels of a pass, averaged over the samples so far: (H, W, C) float32, bottom row first, scene-linear.

        out: an array of this shape to fill and return; None: a new one. May be called while rendering.
        """

    def stats(self) -> object:
        """Seconds by stage, rays, Mrays/s, memory: a dictionary."""

def devices() -> list:
    """
    All Vulkan devices, best first: name, driver, kind, api, memory (bytes), usable, why_not, ray_query, ray_pipeline,
    ray_query_why_not, ray_pipeline_why_not (sentences; empty where it is there).
    Empty when there is no Vulkan loader or driver; Context then says why.
    """

def all_passes() -> list[tuple[str, int]]:
    """
    [(name, channels)] of every pass that can be asked for, by Cycles' names.
    """

def integrators() -> list[str]:
    """Names of the integrators."""

def integrator_table() -> list:
    """
    Every integrator: name, label, description, and parameters with their defaults (those it reads).
    """

def reservoir_bytes(settings: dict) -> int:
    """
    Bytes that the reservoirs of these settings take (a dictionary as for Session.start). ValueError as there.
    """

class ImageDecoder:
    """
    Decodes image files on threads of its own, in order: 8-bit JPEG and PNG, grey, RGB or RGBA.
    """

    def __init__(self, threads: int = 0) -> None:
        """threads: at most that many, 0: by the machine's."""

    def add(self, file: object) -> int:
        """
        Begins to decode a file: its contents (bytes) or its path (str). Returns its number: 0, 1, 2, ...
        """

    def done(self, number: int) -> bool:
        """Whether take() would not wait."""

    def take(self, number: int) -> object:
        """
        Waits for a file's pixels: ((H, W, 4) uint8, bottom row first; whether the file has no alpha). None for a
        file that is damaged, can't be read, or is not one that is read exactly as Blender reads it, and when called
        again. IndexError when there is no such file.
        """

def versions() -> dict:
    """
    What the module was built with: Embree, Vulkan headers, compiler, build (CMake's build type).
    """

def tracer_benchmark(
    triangles: int, rays: int, repeats: int, device: str = "", tracer: str = "auto", threads: int = 0
) -> list:
    """
    Rays a second of a Tracer beside a plain Embree loop on the same rays, triangles and threads.

    One dict for camera rays, one for random rays. Figures are medians of `repeats` turns in Mrays/s: 'closest' and
    'any' of the Tracer, 'plain' of a loop over one robust scene, 'fast' of the same without the robust flag.
    """
