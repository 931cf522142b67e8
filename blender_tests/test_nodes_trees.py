# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees: groups, muted nodes, reroutes, conversions, loops, depth, and what is listed as unsupported."""

from bpy_process import run

_START = """
import sys
nodes = sys.modules[hb.addon().__name__ + ".nodes"]
from headwater.materials import opcodes as op

def material(build):
    m = bpy.data.materials.new("M")
    m.use_nodes = True
    tree = m.node_tree
    tree.nodes.clear()
    out = tree.nodes.new("ShaderNodeOutputMaterial")
    build(tree, out)
    return nodes.compile_material(m)

def emit(tree, out, socket):
    e = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(socket, e.inputs[0])
    tree.links.new(e.outputs[0], out.inputs[0])

def value(tree, number):
    v = tree.nodes.new("ShaderNodeValue")
    v.outputs[0].default_value = number
    return v.outputs[0]
"""


def check(code, tmp_path):
    return run(_START + code, tmp_path, fake=False, timeout=120)


def test_groups_mutes_reroutes_and_conversions(tmp_path):
    facts = check(
        """
def grouped(tree, out):
    inner = bpy.data.node_groups.new("Double", "ShaderNodeTree")
    inner.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketFloat").default_value = 3.0
    inner.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketFloat")
    gi, go = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    double = inner.nodes.new("ShaderNodeMath"); double.operation = "MULTIPLY"
    inner.links.new(gi.outputs[0], double.inputs[0]); double.inputs[1].default_value = 2.0
    inner.links.new(double.outputs[0], go.inputs[0])
    a, b = (tree.nodes.new("ShaderNodeGroup") for _ in range(2))
    a.node_tree = b.node_tree = inner
    a.inputs[0].default_value = 3.0
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(a.outputs[0], reroute.inputs[0]); tree.links.new(reroute.outputs[0], b.inputs[0])
    emit(tree, out, b.outputs[0])
show(grouped=material(grouped).emission)

def muted(tree, out):
    math = tree.nodes.new("ShaderNodeMath"); math.operation = "MULTIPLY"; math.mute = True
    tree.links.new(value(tree, 5.0), math.inputs[0])
    emit(tree, out, math.outputs[0])
show(muted=material(muted).emission)

def luminance(tree, out):
    rgb = tree.nodes.new("ShaderNodeRGB"); rgb.outputs[0].default_value = (0.2, 0.4, 0.8, 1)
    math = tree.nodes.new("ShaderNodeMath"); math.operation = "ADD"; math.inputs[1].default_value = 0
    tree.links.new(rgb.outputs[0], math.inputs[0])
    emit(tree, out, math.outputs[0])
show(luminance=material(luminance).emission)
""",
        tmp_path,
    )
    assert facts["grouped"] == [12.0] * 3
    assert facts["muted"] == [5.0] * 3
    expected = 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.8
    assert all(abs(v - expected) < 1e-4 for v in facts["luminance"])


def test_loops_deep_chains_and_unknown_nodes(tmp_path):
    facts = check(
        """
def loop(tree, out):
    a, b = (tree.nodes.new("ShaderNodeMath") for _ in range(2))
    tree.links.new(a.outputs[0], b.inputs[0]); tree.links.new(b.outputs[0], a.inputs[0])
    emit(tree, out, a.outputs[0])
show(loop=material(loop).notes)

def deep(tree, out):
    made = [tree.nodes.new("ShaderNodeMath") for _ in range(1200)]  # past Python's recursion limit
    made[0].inputs[0].default_value = 0.0
    for n in made:
        n.inputs[1].default_value = 1.0
    for a, b in zip(made, made[1:]):
        tree.links.new(a.outputs[0], b.inputs[0])
    emit(tree, out, made[-1].outputs[0])
show(deep=material(deep).emission[0])

def doubling(tree, out):
    e = tree.nodes.new("ShaderNodeEmission"); socket = e.outputs[0]
    e.inputs[1].default_value = 1e-6
    for _ in range(20):
        add = tree.nodes.new("ShaderNodeAddShader")
        tree.links.new(socket, add.inputs[0]); tree.links.new(socket, add.inputs[1]); socket = add.outputs[0]
    tree.links.new(socket, out.inputs[0])
show(doubling=material(doubling).emission[0])

def unknown(tree, out):
    w = tree.nodes.new("ShaderNodeWireframe"); w.name = "Wires"
    a = tree.nodes.new("ShaderNodeMath")
    tree.links.new(w.outputs[0], a.inputs[0]); tree.links.new(w.outputs[0], a.inputs[1])
    emit(tree, out, a.outputs[0])
show(unknown=material(unknown).notes)
m = bpy.data.materials.new("N"); m.use_nodes = True; m.node_tree.nodes.clear()
show(empty=len(nodes.compile_material(m).program))
""",
        tmp_path,
    )
    assert all("loop" in note for note in facts["loop"])  # Blender itself marks one link as not valid
    assert facts["deep"] == 1200.0
    assert abs(facts["doubling"] / (2**20 * 1e-6) - 1) < 1e-5
    assert len(facts["unknown"]) == 1 and "Wires" in facts["unknown"][0] and "'M" in facts["unknown"][0]
    assert facts["empty"] == 0


def test_flags_and_worlds_and_lamps(tmp_path):
    facts = check(
        """
def glow(tree, out):
    e = tree.nodes.new("ShaderNodeEmission"); e.inputs[1].default_value = 4.0
    t = tree.nodes.new("ShaderNodeBsdfTransparent"); mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = 0.25
    tree.links.new(t.outputs[0], mix.inputs[1]); tree.links.new(e.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], out.inputs[0])
c = material(glow)
show(emission=c.emission, transparent=bool(c.flags & op.MATERIAL_TRANSPARENT))
show(shader=bool(c.flags & op.MATERIAL_EMISSION_SHADER))
w = bpy.data.worlds.new("W"); w.use_nodes = True
w.node_tree.nodes["Background"].inputs[1].default_value = 2.0
w.node_tree.nodes["Background"].inputs[0].default_value = (0.1, 0.2, 0.3, 1)
show(world=nodes.compile_world(w).emission)
light = bpy.data.lights.new("L", "POINT"); light.use_nodes = True
emission = next(n for n in light.node_tree.nodes if n.bl_idname == "ShaderNodeEmission")
emission.inputs[0].default_value = (1, 0.5, 0, 1); emission.inputs[1].default_value = 3.0
show(lamp=[float(x) for x in nodes.compile_lamp(light)])
""",
        tmp_path,
    )
    assert facts["emission"] == [1.0] * 3 and facts["transparent"] and not facts["shader"]
    assert [round(x, 5) for x in facts["world"]] == [0.2, 0.4, 0.6]
    assert facts["lamp"] == [3.0, 1.5, 0.0]


def test_what_displacement_leaves_out_is_listed(tmp_path):
    facts = check(
        """
def displaced(kind, sideways=False, method="BUMP"):
    def build(tree, out):
        tree.links.new(tree.nodes.new("ShaderNodeBsdfDiffuse").outputs[0], out.inputs[0])
        node = tree.nodes.new(kind)
        tree.links.new(node.outputs[0], out.inputs["Displacement"])
        if sideways:
            tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[1], node.inputs["Normal"])
    return [str(problem) for problem in material(build).unsupported]
show(plain=displaced("ShaderNodeDisplacement"), sideways=displaced("ShaderNodeDisplacement", True),
     vector=displaced("ShaderNodeVectorDisplacement"))
""",
        tmp_path,
    )
    assert facts["plain"] == []
    assert any("along the normal" in text for text in facts["sideways"])
    assert len(facts["vector"]) == 2
