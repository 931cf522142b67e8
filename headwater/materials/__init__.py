# SPDX-License-Identifier: Apache-2.0
"""Material programs: an assembler of expression graphs for the engine's register machine.

expression.py  graphs of operations, folded where constant      assembler.py  closures and graphs → words, constants
closures.py    rows of the shader nodes                         arithmetic.py, color.py, textures.py  Blender's nodes
spectrum.py    blackbody and wavelength tables                  preview_surface.py  UsdPreviewSurface
"""

from headwater.materials.assembler import CompiledMaterial, ProgramError, Surface, Unsupported, compile_background
from headwater.materials.expression import Expr, Graph, attribute_hash

__all__ = [
    "CompiledMaterial",
    "Expr",
    "Graph",
    "ProgramError",
    "Surface",
    "Unsupported",
    "attribute_hash",
    "compile_background",
]
