# SPDX-License-Identifier: GPL-3.0-or-later
"""Which images the add-on gives to the core's decoder, which to Blender, and what is kept between renders."""

from bpy_process import run

# Two materials with a PNG each; the decoder counts its files, Blender's way counts its images.
_TWO_FILES = """
import importlib, os
from image_variants import pixels, png, jpeg
module = lambda name: importlib.import_module(hb.MODULE + name)
node_images, image_sync, decoded_files = module(".nodes.images"), module(".sync.image"), module(".sync.decoded_files")
def write(name, contents):
    with open(os.path.join(tmp, name), "wb") as file: file.write(contents)
    return os.path.join(tmp, name)
def material(name, image, slot):
    made = bpy.data.materials.new(name); made.use_nodes = True
    texture = made.node_tree.nodes.new("ShaderNodeTexImage"); texture.image = image
    made.node_tree.links.new(texture.outputs[0], made.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.mesh.primitive_plane_add(size=2, location=(slot, 0, 1))
    bpy.context.object.data.materials.append(made)
first, second = pixels(8, 8, 3), pixels(8, 8, 4, seed=1)
a = bpy.data.images.load(write("a.png", png(first, 2)))
b = bpy.data.images.load(write("b.png", png(second, 6))); b.pack()
material("A", a, 0); material("B", b, 3)
files, asked = [], []
class Decoder(core.ImageDecoder):
    def add(self, file):
        files.append(file if isinstance(file, str) else "packed")
        return super().add(file)
core.ImageDecoder = Decoder
load = node_images.load_pixels
node_images.load_pixels = lambda request: asked.append(request.image.name) or load(request)
sent = {}
class Scene(core.Scene):
    def upsert_image(self, number, name, found, **settings):
        if found is not None: sent[name] = np.array(found)
        return super().upsert_image(number, name, found, **settings)
core.Scene = Scene
def render():
    files.clear(); asked.clear(); sent.clear()
    bpy.ops.render.render()
    return sorted(os.path.basename(f) for f in files), sorted(asked), sorted(sent)
"""


def test_plain_files_go_to_the_decoder_and_are_kept(tmp_path):
    facts = run(
        _TWO_FILES
        + """
once = render()
right = bool(np.array_equal(sent["a.png"][..., :3], first[::-1])) and sent["b.png"].shape == (8, 8, 4)
opacity = second[::-1, :, 3:].astype(int)
multiplied = bool(np.array_equal(sent["b.png"][..., :3], second[::-1, :, :3] * opacity // 255))
loaded = [a.has_data, b.has_data]
again = render()
still = bool(np.array_equal(sent["a.png"][..., :3], first[::-1]))
write("a.png", png(pixels(8, 8, 3, seed=7), 2)); os.utime(os.path.join(tmp, "a.png"), (1, 1))
changed = render()
other = bool(np.array_equal(sent["a.png"][..., :3], pixels(8, 8, 3, seed=7)[::-1]))
a.pixels[0]  # Blender has the pixels: an artist may have edited them
memory = render()
decoded_files.forget_all()
bpy.data.images.remove(bpy.data.images["b.png"])
gone = render()
show(once=once, right=right, multiplied=multiplied, loaded=loaded, again=again, still=still, changed=changed,
     other=other, memory=memory, gone=gone)
""",
        tmp_path,
        fake=False,
    )
    assert facts["once"] == [["a.png", "packed"], [], ["a.png", "b.png"]] and facts["right"] and facts["multiplied"]
    assert facts["loaded"] == [False, False], "Blender decoded them too"
    assert facts["again"] == [[], [], ["a.png", "b.png"]] and facts["still"], "kept from the first render"
    assert facts["changed"] == [["a.png"], [], ["a.png", "b.png"]] and facts["other"], "the file is another"
    assert facts["memory"][:2] == [[], ["a.png"]], "what Blender's memory has counts"
    assert facts["gone"][2] == ["a.png"]


def test_what_is_not_plain_goes_to_blender(tmp_path):
    facts = run(
        _TWO_FILES
        + """
grey_alpha = bpy.data.images.load(write("c.png", png(pixels(8, 8, 2), 4)))
broken = bpy.data.images.load(write("d.jpg", jpeg(pixels(64, 64, 3))[:900]))
missing = bpy.data.images.load(write("e.png", png(first, 2))); os.remove(os.path.join(tmp, "e.png"))
made = bpy.data.images.new("made", 4, 4)
for slot, image in enumerate((grey_alpha, broken, missing, made)): material(image.name, image, 6 + slot)
found = render()
show(found=found)
""",
        tmp_path,
        fake=False,
    )
    files, asked, sent = facts["found"]
    assert files == ["a.png", "c.png", "d.jpg", "packed"]
    assert asked == ["c.png", "d.jpg", "e.png", "made"]
    assert sent == ["a.png", "b.png", "c.png", "d.jpg", "made"]


def test_images_are_kept_up_to_a_limit_and_with_their_file(tmp_path):
    facts = run(
        """
        import importlib
        module = lambda name: importlib.import_module(hb.MODULE + name)
        kept, images = module(".sync.decoded_files"), module(".nodes.images")
        kept.MOST_BYTES = 1000
        def image(size): return images.LoadedImage("i", np.zeros(size, np.uint8))
        for number in range(5): kept.keep((number,), b"x", image(300))
        have = [number for number in range(5) if kept.find((number,), b"x", "n")]
        kept.keep((9,), b"x", image(1001))
        large = kept.find((9,), b"x", "n")
        again = image(400); kept.keep((4,), b"y", again)
        states = [kept.find((4,), b"x", "n") is None, kept.find((4,), b"y", "n").pixels is again.pixels]
        name = kept.find((4,), b"y", "other").name
        kept.forget_all()
        show(have=have, large=large is None, states=states, name=name, left=kept._bytes, empty=len(kept._kept))
        """,
        tmp_path,
    )
    assert facts["have"] == [2, 3, 4] and facts["large"] and facts["states"] == [True, True]
    assert facts["name"] == "other" and facts["left"] == facts["empty"] == 0
