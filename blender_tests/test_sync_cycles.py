# SPDX-License-Identifier: GPL-3.0-or-later
"""What sync hands to materials, against Cycles on the same scene: texture space, tangents, numbers of instances."""

import pytest
from bpy_process import run

TOLERANCE = 5e-3
CASES = {
    # name: (what happens to the object, the node case to show)
    "deformed": ("twist(ob)", "coordinate Generated"),
    "own texture space": (
        "ob.data.use_auto_texspace = False; ob.data.texspace_location = (1, 2, 3); ob.data.texspace_size = (2, 3, 1)",
        "coordinate Generated",
    ),
    "bump of deformed": ("twist(ob)", "bump generated"),
    "subdivided": ("ob.modifiers.new('s', 'SUBSURF').levels = 1", "coordinate Generated"),
    "flat tangents": ("ob.data.shade_flat()", "tangent uv"),
    "flat normal map": ("ob.data.shade_flat()", "normal map TANGENT"),
    "mirrored": ("ob.scale.x *= -1", "normal map TANGENT"),
    "mirrored map": ("turn_map(ob)", "normal map TANGENT"),
    "deformed normal map": ("twist(ob)", "normal map TANGENT"),
    "custom normals": (
        "ob.data.normals_split_custom_set_from_vertices([(0.1 * i % 1, 0.3, 1) for i in range(len(ob.data.vertices))])",
        "normal map TANGENT",
    ),
    "instances": ("copies(ob)", "object Random"),
    "instance index": ("copies(ob)", "object Object Index"),
    "instance location": ("copies(ob)", "object Location"),
    "instance color": ("copies(ob)", "object Color"),
}


@pytest.mark.parametrize("name", CASES)
def test_pictures_are_those_of_cycles(tmp_path, name):
    change, case = CASES[name]
    facts = run(
        f"""
        import node_board, node_inputs
        node_inputs.fill()
        ob = bpy.data.objects["torus"]
        def twist(ob):
            made = ob.modifiers.new("t", "SIMPLE_DEFORM")
            made.deform_method, made.angle, made.deform_axis = "TWIST", 1.5, "X"
        def turn_map(ob):
            uv = ob.data.uv_layers[0].data
            values = np.empty(len(uv) * 2, np.float32); uv.foreach_get("uv", values)
            values[::2] = np.abs(values[::2] - 0.5)
            uv.foreach_set("uv", values)
        def copies(ob):
            collection = bpy.data.collections.new("c")
            bpy.context.scene.collection.objects.unlink(ob); collection.objects.link(ob)
            for i in range(3):
                made = bpy.data.objects.new(f"e{{i}}", None)
                made.instance_type, made.instance_collection = "COLLECTION", collection
                made.location, made.scale, made.color = (i - 1, 0, 0.3 * i), (0.6,) * 3, (0.1, 0.3 * i, 0.9, 0.5)
                bpy.context.scene.collection.objects.link(made)
        cases = node_inputs.cases()
        {change}
        node_inputs.show(cases[{case!r}])
        theirs, ours = node_board.picture("CYCLES", tmp), node_board.picture("HEADWATER", tmp)
        seen = (theirs.sum(-1) != 0) & (ours.sum(-1) != 0)
        difference = np.abs(theirs - ours).max(-1)[seen]
        show(q=float(np.quantile(difference, 0.9)), seen=int(seen.sum()), values=len(np.unique(theirs[seen], axis=0)))
        """,
        tmp_path,
        fake=False,
        timeout=200,
    )
    assert facts["seen"] > 100
    assert facts["q"] < (0.03 if "bump" in case else TOLERANCE), facts
