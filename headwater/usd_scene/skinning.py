# SPDX-License-Identifier: Apache-2.0
"""UsdSkel: positions of skinned meshes and blend shapes at a time, computed by usd-core's own queries."""

from dataclasses import dataclass

import numpy as np

from headwater.errors import first_line
from headwater.usd_scene.mesh import MeshError, read_points
from headwater.usd_scene.stage import matrix_to_numpy


@dataclass
class Skinned:
    """`points` (V, 3) replace the mesh's own; `matrix` (4, 4), skeleton to stage space, replaces its transform.

    For rigid bindings `points` is None and `matrix` places the mesh.
    """

    points: np.ndarray | None
    matrix: np.ndarray


class Skeletons:
    """All skeleton bindings of a stage."""

    def __init__(self, stage):
        from pxr import Usd, UsdSkel

        self._cache = UsdSkel.Cache()
        self._skeletons = {}  # mesh path -> (skeleton prim, skinning query)
        predicate = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
        for prim in stage.Traverse(predicate):
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, predicate)
            for binding in self._cache.ComputeSkelBindings(root, predicate):
                for query in binding.GetSkinningTargets():
                    self._skeletons[query.GetPrim().GetPath()] = (binding.GetSkeleton().GetPrim(), query)

    def __bool__(self):
        return bool(self._skeletons)

    def binds(self, prim) -> bool:
        """Whether `prim` follows a skeleton or has blend shapes driven by one."""
        return prim.GetPath() in self._skeletons

    def deform(self, prim, time, xforms) -> Skinned:
        """The mesh `prim` at `time`; `xforms`: the UsdGeom.XformCache of that time. Raises MeshError."""
        from pxr import UsdGeom, UsdSkel

        skeleton, query = self._skeletons[prim.GetPath()]
        skeleton_query = self._cache.GetSkelQuery(UsdSkel.Skeleton(skeleton))
        points = UsdGeom.PointBased(prim).GetPointsAttr().Get(time)
        read_points(points)
        try:
            points = self._blend(prim, query, skeleton_query, time, points)
            if not query.HasJointInfluences():
                return Skinned(np.array(points, np.float32), matrix_to_numpy(xforms.GetLocalToWorldTransform(prim)))
            transforms = skeleton_query.ComputeSkinningTransforms(time)
            if transforms is None:
                raise MeshError("its skeleton has no pose")
            to_stage = matrix_to_numpy(xforms.GetLocalToWorldTransform(skeleton))
            if query.IsRigidlyDeformed():
                rigid = matrix_to_numpy(query.ComputeSkinnedTransform(transforms, time))
                return Skinned(np.array(points, np.float32), to_stage @ rigid)
            if not query.ComputeSkinnedPoints(transforms, points, time):
                raise MeshError("its joint indices or weights do not fit its points or its skeleton")
        except MeshError:
            raise
        except Exception as error:  # the binding reports broken data as Tf errors and ValueErrors
            raise MeshError(f"skinning failed: {first_line(error)}") from error
        return Skinned(read_points(points), to_stage)

    def _blend(self, prim, query, skeleton_query, time, points):
        from pxr import UsdSkel

        animation = skeleton_query.GetAnimQuery()
        if not query.HasBlendShapes() or not animation:
            return points
        weights = animation.ComputeBlendShapeWeights(time)
        mapper = query.GetBlendShapeMapper()
        if weights is None:
            return points
        if mapper is not None:
            weights = mapper.Remap(weights)
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        sub_weights, shape_indices, sub_indices = shapes.ComputeSubShapeWeights(weights)
        if not shapes.ComputeDeformedPoints(
            sub_weights,
            shape_indices,
            sub_indices,
            shapes.ComputeBlendShapePointIndices(),
            shapes.ComputeSubShapePointOffsets(),
            points,
        ):
            raise MeshError("its blend shapes do not fit its points")
        return points
