# SPDX-License-Identifier: Apache-2.0
"""core.ImageDecoder gives the pixels that Blender's readers give, or nothing; any bytes may come."""

import gc
import threading
import zlib

import numpy as np
import pytest
from bpy_process import run
from image_variants import jpeg, pixels, png, variants

import headwater._core as core


def _decode(file):
    decoder = core.ImageDecoder()
    return decoder.take(decoder.add(file))


def test_pixels_are_those_of_blender(tmp_path):
    facts = run(
        """
        import os
        from image_variants import variants
        from headwater_addon_name.nodes import images
        decoder = core.ImageDecoder()
        odd, unread, read = [], [], []
        for number, (name, (contents, plain)) in enumerate(variants().items()):
            path = os.path.join(tmp, f"{number:03d}.{name.split()[0].lower()}")
            with open(path, "wb") as file: file.write(contents)
            for packed in (False, True):
                image = bpy.data.images.load(path, check_existing=False)
                if packed: image.pack()
                for mode in ("STRAIGHT", "CHANNEL_PACKED", "NONE", "PREMUL"):
                    for space in ("sRGB", "Non-Color"):
                        image.alpha_mode, image.colorspace_settings.name = mode, space
                        image.reload()
                        request = images.ImageRequest(image)
                        file = images.plain_file(request)
                        assert isinstance(file, bytes if packed else str), (name, file)
                        assert not image.has_data, "asking for the file made Blender read it"
                        taken = decoder.take(decoder.add(file))
                        if (taken is not None) != plain: unread.append((name, mode, space))
                        ours = images.decoded(request, *taken) if taken else None
                        theirs = images.load_pixels(request)
                        assert theirs.pixels is not None, (name, theirs.notes)
                        if ours is None: continue
                        read.append(name)
                        same = np.array_equal(ours.pixels, theirs.pixels) and ours.pixels.dtype == theirs.pixels.dtype
                        same = same and (ours.srgb, ours.premultiplied) == (theirs.srgb, theirs.premultiplied)
                        if not same: odd.append((name, mode, space, packed))
                bpy.data.images.remove(image)
        show(odd=odd, unread=unread, read=len(set(read)), plain=sum(plain for _, plain in variants().values()))
        """.replace("headwater_addon_name", _module()),
        tmp_path,
        fake=False,
    )
    assert facts["odd"] == []
    assert facts["unread"] == [], "read by the wrong one of the two"
    assert facts["read"] == facts["plain"] > 60


def _module() -> str:
    import headwater.blender

    return headwater.blender.MODULE


def test_pixels_come_bottom_row_first_and_once():
    image = pixels(5, 7, 4)
    decoder = core.ImageDecoder()
    first, second = decoder.add(png(image, 6)), decoder.add(png(image[..., :3].copy(), 2))
    found, opaque = decoder.take(first)
    assert np.array_equal(found, image[::-1]) and not opaque
    found, opaque = decoder.take(second)
    assert np.array_equal(found[..., :3], image[::-1, :, :3]) and (found[..., 3] == 255).all() and opaque
    assert decoder.take(first) is None
    for number in (2, 10**6):
        with pytest.raises(IndexError):
            decoder.take(number)
    with pytest.raises(TypeError):
        decoder.add(7)


def test_files_that_cannot_be_read_give_nothing(tmp_path):
    for path in (tmp_path / "missing.png", tmp_path, "/dev/null", ""):
        assert _decode(str(path)) is None
    with pytest.raises(ValueError):
        core.ImageDecoder().add("\udcff")
    (tmp_path / "there.jpg").write_bytes(jpeg(pixels(4, 4, 3)))
    assert _decode(str(tmp_path / "there.jpg")) is not None


@pytest.mark.parametrize("contents", [b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\xff\xd8\xff\xd9", b"words"])
def test_stubs_give_nothing(contents):
    assert _decode(contents) is None


def test_every_truncated_file_gives_nothing():
    for file in (png(pixels(9, 8, 4), 6), jpeg(pixels(9, 8, 3)), jpeg(pixels(9, 8, 3), progressive=True)):
        decoder = core.ImageDecoder(threads=2)
        numbers = [decoder.add(file[:length]) for length in range(len(file))]
        # A JPEG's last two bytes say that it ends.
        assert [n for n in numbers if decoder.take(n) is not None] == []
        assert _decode(file) is not None


def test_damaged_files_never_crash():
    random = np.random.default_rng(5)
    files = [contents for name, (contents, plain) in variants().items() if plain and len(contents) < 6000]
    decoder, sizes = core.ImageDecoder(), []
    for _ in range(4000):
        damaged = bytearray(files[random.integers(len(files))])
        for _ in range(random.integers(1, 6)):
            damaged[random.integers(len(damaged))] = random.integers(256)
        sizes.append(decoder.add(bytes(damaged)))
    for number in sizes:
        taken = decoder.take(number)
        assert taken is None or (taken[0].ndim == 3 and taken[0].shape[2] == 4 and taken[0].dtype == np.uint8)


def test_sizes_that_a_file_cannot_hold_get_no_memory():
    file = bytearray(png(pixels(4, 4, 3), 2))
    file[16:24] = (16000).to_bytes(4, "big") * 2  # 768 MB from a hundred bytes
    file[29:33] = zlib.crc32(file[12:29]).to_bytes(4, "big")
    assert _decode(bytes(file)) is None
    file = bytearray(jpeg(pixels(8, 8, 3), progressive=True))
    frame = file.index(b"\xff\xc2")
    file[frame + 5 : frame + 9] = (16000).to_bytes(2, "big") * 2
    assert _decode(bytes(file)) is None


def test_a_decoder_may_go_with_work_left_and_be_used_by_many():
    file = jpeg(pixels(600, 800, 3))
    for _ in range(5):
        decoder = core.ImageDecoder(threads=3)
        for _ in range(20):
            decoder.add(file)
        del decoder
        gc.collect()
    decoder, found = core.ImageDecoder(threads=2), []

    def work():
        numbers = [decoder.add(file) for _ in range(8)]
        found.extend(decoder.take(number)[0] for number in numbers)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 32 and all(np.array_equal(image, found[0]) for image in found)
