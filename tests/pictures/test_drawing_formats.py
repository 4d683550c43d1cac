"""Pictures as SVG and PNG: valid, escaped, themed, reproducible."""

import struct
import xml.etree.ElementTree as ET
import zlib

import numpy as np
import pytest

from armblocks.pictures.painter import resampled
from armblocks.pictures.picture import Curve, Disc, Group, Picture, Polyline, Raster, Rectangle, Text, moved
from armblocks.pictures.png import picture_png
from armblocks.pictures.png_file import png_bytes
from armblocks.pictures.style import PALETTE, Tone
from armblocks.pictures.svg import escape, number, page_rules, svg_file, svg_inline

SVG = "{http://www.w3.org/2000/svg}"
SPECIAL_TEXT = "<script>alert('x')</script>&\"\x00\x0b"


def one_of_each() -> Picture:
    picture = Picture(width=120, height=80, title=SPECIAL_TEXT, description=SPECIAL_TEXT)
    pixels = np.zeros((4, 4, 4), dtype=np.uint8)
    pixels[..., 0], pixels[..., 3] = 255, 128
    picture.add(
        Polyline([(0, 0), (10, 10), (np.nan, np.nan), (20, 5), (30, 30)], dash=(2, 2)),
        Polyline([(40, 0), (50, 0), (45, 8)], stroke=None, fill=Tone.ERROR, closed=True),
        Curve((("M", 5, 40), ("L", 20, 40), ("Q", 25, 40, 25, 45), ("C", 25, 50, 30, 50, 30, 60), ("Z",))),
        Rectangle(60, 10, 30, 20, radius=4, fill=Tone.SUNKEN, stroke=Tone.HAIRLINE),
        Disc(100, 20, 6, fill=Tone.TRACE_0),
        Raster(60, 40, 16, 16, pixels),
        Group((Text(5, 70, SPECIAL_TEXT, mono=True),), title=SPECIAL_TEXT),
        Text(110, 70, "up", rotation=90, anchor="end", bold=True, italic=True),
    )
    return picture


def png_pixels(data: bytes) -> np.ndarray:
    """Decode a PNG written by this package, according to the specification."""
    width, height, depth, kind = struct.unpack(">IIBB", data[16:26])
    assert depth == 8
    channels = {2: 3, 6: 4}[kind]
    start = data.index(b"IDAT")
    (length,) = struct.unpack(">I", data[start - 4 : start])
    raw = np.frombuffer(zlib.decompress(data[start + 4 : start + 4 + length]), dtype=np.uint8)
    rows = raw.reshape(height, 1 + width * channels)
    assert (rows[:, 0] == 0).all()
    return rows[:, 1:].reshape(height, width, channels)


def test_a_file_is_valid_xml_and_its_text_is_escaped() -> None:
    text = svg_file(one_of_each())
    root = ET.fromstring(text)
    assert root.tag == f"{SVG}svg"
    assert "<script" not in text
    assert root.find(f"{SVG}title").text == "<script>alert('x')</script>&\""  # pyright: ignore
    assert not root.findall(f".//{SVG}script")


def test_svg_files_refer_to_no_external_resources() -> None:
    for element in ET.fromstring(svg_file(one_of_each())).iter():
        for name, value in element.attrib.items():
            if name.rpartition("}")[2] in ("href", "src"):
                assert value.startswith("data:image/png;base64,")
            assert "url(" not in value


def test_a_file_contains_both_themes_unless_one_is_fixed() -> None:
    both, dark = svg_file(one_of_each()), svg_file(one_of_each(), theme="dark")
    assert PALETTE[Tone.INK].light in both and PALETTE[Tone.INK].dark in both
    assert "prefers-color-scheme" in both and "prefers-color-scheme" not in dark
    assert PALETTE[Tone.INK].light not in dark


def test_inline_pictures_use_the_colours_of_the_page_and_have_a_name() -> None:
    text = svg_inline(one_of_each(), "figure-1")
    root = ET.fromstring(text)
    assert root.get("aria-labelledby") == "figure-1-t"
    assert "#" not in text.partition(">")[2].replace("&#39;", "")
    assert all(f"var(--{tone.value})" in page_rules() for tone in PALETTE)


def test_the_same_picture_gives_the_same_bytes() -> None:
    assert svg_file(one_of_each()) == svg_file(one_of_each())
    assert picture_png(one_of_each()) == picture_png(one_of_each())


def test_png_marks_are_at_their_positions() -> None:
    pixels = png_pixels(picture_png(one_of_each(), scale=2.0))
    assert pixels.shape == (160, 240, 3)
    assert tuple(pixels[158, 2]) == (255, 255, 255)
    assert tuple(pixels[40, 200]) == (0x00, 0x72, 0xB2)  # the disc
    red = pixels[90, 130].astype(int)
    assert red[0] > 250 and 120 < red[1] < 135  # the raster, half transparent on white
    # The text with special characters is drawn upright and not clipped.
    assert (pixels[120:150, 8:120].min(axis=2) < 100).sum() > 200


def test_png_files_contain_their_pixels() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 4)).astype(np.uint8)
    assert (png_pixels(png_bytes(pixels)) == pixels).all()
    assert resampled(pixels, 14, 10).shape == (14, 10, 4)
    assert resampled(pixels, 7, 5) is pixels


def test_moving_a_picture_moves_every_mark() -> None:
    marks = one_of_each().marks
    restored_marks = [moved(moved(mark, 7, -3), -7, 3) for mark in marks]
    before, after = Picture(width=1, height=1, title="a"), Picture(width=1, height=1, title="a")
    before.extend(marks)
    after.extend(restored_marks)
    assert svg_file(before) == svg_file(after)


@pytest.mark.parametrize(("value", "text"), [(1.0, "1"), (-0.001, "0"), (2.5, "2.5"), (3.14159, "3.14")])
def test_coordinates_are_short(value: float, text: str) -> None:
    assert number(value) == text


def test_characters_that_xml_forbids_are_dropped() -> None:
    assert escape("a\x00b\ud800c\ufffe<") == "abc&lt;"
