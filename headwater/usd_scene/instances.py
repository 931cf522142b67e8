# SPDX-License-Identifier: Apache-2.0
"""UsdGeomPointInstancer: copies of prototypes, nested to any sensible depth, as groups of matrices."""

from dataclasses import dataclass

import numpy as np

from headwater.errors import first_line
from headwater.usd_scene.stage import matrix_to_numpy

MAX_DEPTH = 16
MAX_COPIES = 1 << 26  # of one prototype mesh in one instancer; ids and memory end there


@dataclass
class Copies:
    """Copies of one mesh prim: `matrices` (N, 4, 4) float64 to stage space, column vectors."""

    prim: object
    matrices: np.ndarray
    key: str  # instancer path and prototype path, for ids


def expand_instancer(prim, time, xforms, visible, report, chain=()) -> list:
    """All copies that the instancer `prim` makes, in its own space (its local-to-world is left to the caller).

    `visible(prim)`: whether a prim below a prototype counts. Broken instancers are left out with a warning.
    """
    from pxr import UsdGeom

    path = prim.GetPath()
    if path in chain or len(chain) >= MAX_DEPTH:
        report.warn(path, "a point instancer is its own prototype, or prototypes are nested too deep; it is left out")
        return []
    instancer = UsdGeom.PointInstancer(prim)
    prototypes = instancer.GetPrototypesRel().GetForwardedTargets()
    indices = np.array(instancer.GetProtoIndicesAttr().Get(time) or [], np.int64)
    if not len(indices):
        return []
    transforms = _transforms(instancer, time, len(indices), report)
    if transforms is None:
        return []
    mask = np.array(instancer.ComputeMaskAtTime(time) or [], bool)
    keep = np.isfinite(transforms).all(axis=(1, 2)) & (indices >= 0) & (indices < len(prototypes))
    if not keep.all():
        report.warn(
            path, f"{int((~keep).sum())} of {len(keep)} copies have a bad transform or prototype; they are left out"
        )
    if len(mask) == len(keep):
        keep &= mask
    result = []
    for number, target in enumerate(prototypes):
        chosen = transforms[keep & (indices == number)]
        root = prim.GetStage().GetPrimAtPath(target)
        if not len(chosen):
            continue
        if not root:
            report.warn(path, f"prototype {target} does not exist")
            continue
        for copies in _prototype(root, time, xforms, visible, report, (*chain, path)):
            count = len(chosen) * len(copies.matrices)
            if count > MAX_COPIES:
                report.warn(
                    path, f"{count} copies of {copies.prim.GetPath()} are more than {MAX_COPIES}; they are left out"
                )
                continue
            matrices = np.einsum("aij,bjk->abik", chosen, copies.matrices).reshape(-1, 4, 4)
            result.append(Copies(copies.prim, matrices, f"{path}|{number}|{copies.key}"))
    return result


def _transforms(instancer, time, count, report):
    """(N, 4, 4) for column vectors, without the prototypes' own; None with a warning when they are broken."""
    from pxr import Usd, UsdGeom

    try:
        matrices = instancer.ComputeInstanceTransformsAtTime(
            time, Usd.TimeCode(time), UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
    except Exception as error:
        report.warn(instancer.GetPath(), f"its transforms can't be computed ({first_line(error)}); it is left out")
        return None
    if matrices is None or len(matrices) != count:
        got = 0 if matrices is None else len(matrices)
        report.warn(instancer.GetPath(), f"it has {count} prototype indices and {got} transforms; it is left out")
        return None
    return np.array(matrices, np.float64).reshape(-1, 4, 4).transpose(0, 2, 1)


def _prototype(root, time, xforms, visible, report, chain) -> list:
    """Meshes below a prototype's root, in the space of the root's parent: its own transform counts."""
    from pxr import Usd, UsdGeom

    own = matrix_to_numpy(xforms.GetLocalTransformation(root)[0])
    base = own @ np.linalg.pinv(matrix_to_numpy(xforms.GetLocalToWorldTransform(root)))
    result = []
    prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
    for prim in prims:
        if not visible(prim):
            prims.PruneChildren()
            continue
        local = base @ matrix_to_numpy(xforms.GetLocalToWorldTransform(prim))
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
            for copies in expand_instancer(prim, time, xforms, visible, report, chain):
                result.append(Copies(copies.prim, local @ copies.matrices, copies.key))
        elif prim.IsA(UsdGeom.Gprim):
            result.append(Copies(prim, local[None], str(prim.GetPath())))
    return result
