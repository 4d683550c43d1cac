"""OBJ, COLLADA and GLB meshes: closed forms of volume and centre under node transforms, and damaged files."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mesh_files import QUADS, dae, glb, glb_box, obj_box
from numpy.testing import assert_allclose

from armblocks.errors import FormatError
from armblocks.formats.meshes.mesh_file import mesh_corners
from armblocks.formats.meshes.polygons import MAX_READ

INSTANCE = '<instance_geometry url="#box"/>'


def corners(data: str | bytes, suffix: str) -> np.ndarray:
    return mesh_corners(data.encode() if isinstance(data, str) else data, f"a{suffix}", np.ones(3))


def solid(triangles: np.ndarray) -> tuple[float, np.ndarray]:
    """Volume and centroid by the divergence theorem; the volume is positive if the corners are
    counter-clockwise seen from outside."""
    volumes = np.linalg.det(triangles) / 6
    volume = float(volumes.sum())
    return volume, (volumes[:, None] * triangles.sum(axis=1) / 4).sum(axis=0) / volume


def check(triangles: np.ndarray, volume: float, centre: tuple[float, float, float]) -> None:
    actual, at = solid(triangles)
    assert actual == pytest.approx(volume, rel=1e-12)
    assert_allclose(at, centre, atol=1e-12)


def test_an_obj_file_gives_the_triangles_of_its_polygons() -> None:
    triangles = corners(obj_box(), ".obj")
    assert triangles.shape == (12, 3, 3)
    check(triangles, 6.0, (0.5, 1.0, 1.5))


def test_obj_indices_may_count_backwards_and_lines_may_continue() -> None:
    vertices = obj_box().partition("f")[0]
    faces = "".join("f " + " ".join(str(k - 8) for k in quad) + "\n" for quad in QUADS)
    check(corners(vertices + faces + "v 9 9 9\n", ".obj"), 6.0, (0.5, 1.0, 1.5))
    check(corners(obj_box().replace("//1 ", "/2/1 \\\n"), ".obj"), 6.0, (0.5, 1.0, 1.5))
    colours = obj_box().replace("v 0.0 0.0 0.0", "v 0.0 0.0 0.0 1 0.5 0.5")
    check(corners(f"# box\nmtllib a.mtl\ng side\n{colours}", ".obj"), 6.0, (0.5, 1.0, 1.5))


def test_dae_nodes_place_their_geometries() -> None:
    turned = (
        f"<node><translate>0 0 5</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>{INSTANCE}</node>"
    )
    check(corners(dae(turned), ".dae"), 12.0, (-1.0, 1.0, 6.5))
    matrix = "<matrix>0 -1 0 1  1 0 0 2  0 0 1 3  0 0 0 1</matrix>"
    check(corners(dae(f"<node>{matrix}{INSTANCE}</node>"), ".dae"), 6.0, (0.0, 2.5, 4.5))
    nested = f"<node>{matrix}<node><translate>1 0 0</translate>{INSTANCE}</node></node>"
    check(corners(dae(nested), ".dae"), 6.0, (0.0, 3.5, 4.5))
    check(corners(dae(f"<node><scale>-1 1 1</scale>{INSTANCE}</node>"), ".dae"), 6.0, (-0.5, 1.0, 1.5))
    library = f'<library_nodes><node id="n"><translate>1 1 1</translate>{INSTANCE}</node></library_nodes>'
    twice = '<node><instance_node url="#n"/></node><node><scale>2 2 2</scale><instance_node url="#n"/></node>'
    check(corners(dae(twice, libraries=library), ".dae"), 54.0, (17 / 6, 34 / 9, 85 / 18))


def test_dae_units_are_applied_and_up_axis_is_not() -> None:
    text = dae(f"<node>{INSTANCE}</node>", unit='<unit name="cm" meter="0.01"/>')
    check(corners(text, ".dae"), 6e-6, (0.005, 0.01, 0.015))
    assert "Y_UP" in text


def test_dae_geometries_without_a_scene_are_read() -> None:
    text = dae("").replace('<scene><instance_visual_scene url="#s"/></scene>', "")
    check(corners(text, ".dae"), 6.0, (0.5, 1.0, 1.5))


@pytest.mark.parametrize(
    "polygons",
    [
        "<triangles><input semantic='VERTEX' source='#v'/><p>"
        + " ".join(f"{a} {b} {c} {a} {c} {d}" for a, b, c, d in QUADS)
        + "</p></triangles>",
        "<polygons><input semantic='VERTEX' source='#v'/>"
        + "".join(f"<p>{a} {b} {c} {d}</p>" for a, b, c, d in QUADS)
        + "</polygons>",
        "<trifans><input semantic='VERTEX' source='#v'/>"
        + "".join(f"<p>{a} {b} {c} {d}</p>" for a, b, c, d in QUADS)
        + "</trifans>",
        "<tristrips><input semantic='VERTEX' source='#v'/>"
        + "".join(f"<p>{b} {c} {a} {d}</p>" for a, b, c, d in QUADS)
        + "</tristrips>",
    ],
    ids=["triangles", "polygons", "trifans", "tristrips"],
)
def test_every_kind_of_dae_polygons_gives_the_same_box(polygons: str) -> None:
    check(corners(dae(f"<node>{INSTANCE}</node>", polygons), ".dae"), 6.0, (0.5, 1.0, 1.5))


def test_a_dae_skin_is_drawn_in_the_pose_of_its_binding() -> None:
    controller = (
        '<library_controllers><controller id="c"><skin source="#box"><bind_shape_matrix>'
        "1 0 0 7  0 1 0 0  0 0 1 0  0 0 0 1</bind_shape_matrix></skin></controller></library_controllers>"
    )
    text = dae('<node><instance_controller url="#c"/></node>', libraries=controller)
    check(corners(text, ".dae"), 6.0, (7.5, 1.0, 1.5))


def test_glb_nodes_place_their_meshes_and_y_becomes_z() -> None:
    check(corners(glb_box([{"mesh": 0}]), ".glb"), 6.0, (0.5, -1.5, 1.0))
    half = np.sqrt(0.5)
    nodes = [
        {"children": [1], "translation": [0, 10, 0]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 1, 1], "translation": [1, 0, 0]},
    ]  # in glTF: centre (0.5, 1, 1.5) -> (1, 1, 1.5) -> (-1, 1, 1.5) -> (0, 11, 1.5)
    check(corners(glb_box(nodes), ".glb"), 12.0, (0.0, -1.5, 11.0))
    by_columns = [2, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 5, 6, 7, 1]
    check(corners(glb_box([{"mesh": 0, "matrix": by_columns}]), ".glb"), 12.0, (6.0, -5.5, 7.0))
    unused = glb_box([{"mesh": 0}, {"mesh": 0}], scenes=[])
    check(corners(unused, ".glb"), 12.0, (0.5, -1.5, 1.0))


@pytest.mark.parametrize("mode", [5, 6])
def test_glb_strips_and_fans_give_triangles(mode: int) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]] if mode == 5 else
                      [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f4").tobytes()  # fmt: skip
    document = {
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": mode}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}],
        "buffers": [{"byteLength": 48}],
    }
    triangles = corners(glb(document, points), ".glb")
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    assert_allclose(normals, [[0, -1, 0], [0, -1, 0]], atol=1e-15)


BOX = dae(f"<node>{INSTANCE}</node>")
GLB_BOX = glb_box([{"mesh": 0}])
ACCESSOR = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
INVALID = [
    (".obj", "", "this is not an OBJ mesh: it has no vertices"),
    (".obj", "v 1 2 3\n", "the mesh has no triangles, or points that are not finite"),
    (".obj", "v 1 2\n", "a.obj:1: 'v 1 2' is not a vertex or face"),
    (".obj", "v 1 2 x\n", "a.obj:1: 'v 1 2 x' is not a vertex or face"),
    (".obj", "v 1 2 3\nf 1 1 x\n", "a.obj:2: 'f 1 1 x' is not a vertex or face"),
    (".obj", "v 1 2 3\nf 1 1 2\n", "a triangle refers to point 1; the mesh has 1 point"),
    (".obj", f"v 1 2 3\nf 1 1 {'9' * 4000}\n", "a triangle refers to point"),
    (".obj", f"v 1 2 3\nf 1 1 {'9' * 5000}\n", "is not a vertex or face"),
    (".obj", "v 1 2 3\nf 1 1 -2\n", "a triangle refers to point -1"),
    (".obj", "v 1 2 3\nf 0 1 1\n", "a triangle refers to point -1"),
    (".obj", "v 1 nan 3\nf 1 1 1\n", "points that are not finite"),
    (
        ".obj",
        "v 1 1e300 3\nf 1 1 1\n",
        "points that are not finite or too far away. Allowed: triangles within 1000 km",
    ),
    (".obj", f"v 0 0 0\nf{' 1' * (MAX_READ * 3 + 9)}", f"Allowed: at most {MAX_READ}"),
    (".dae", "", "this is not well-formed XML"),
    (".dae", "<robot/>", "the root element is <robot>"),
    (".dae", "<COLLADA/>", "the mesh has no triangles"),
    (".dae", BOX[:-20], "this is not well-formed XML"),
    (".dae", BOX.replace("#box", "#ball"), "there is no geometry '#ball' in this file"),
    (".dae", BOX.replace("#box", "other.dae#box"), "there is no geometry 'other.dae#box' in this file"),
    (".dae", BOX.replace('url="#s"', ""), "the attribute 'url' is missing or empty"),
    (".dae", BOX.replace('source="#a"', 'source="#p"'), "there is no float_array '#p'"),
    (
        ".dae",
        BOX.replace('count="8"', 'count="9"'),
        "9 points with 3 numbers each cannot be read from 24 numbers",
    ),
    (".dae", BOX.replace('count="8"', 'count="1e17"'), "the attribute 'count' is 1e+17"),
    (".dae", BOX.replace('count="8" stride="3"', 'count="-8" stride="3"'), "the attribute 'count' is -8"),
    (".dae", BOX.replace('stride="3"', 'stride="2"'), "8 points with 2 numbers each"),
    (".dae", BOX.replace('offset="1"', 'offset="70"'), "the offset is 70. Allowed: less than 64"),
    (".dae", BOX.replace('offset="1"', 'offset="2"'), "<vcount> does not agree with the 16 corners"),
    (".dae", BOX.replace('offset="1"', 'offset="4"'), "48 indices are given. Allowed: a multiple of 5"),
    (".dae", BOX.replace("<vcount>4 4", "<vcount>-4 12"), "<vcount> does not agree with the 24 corners"),
    (".dae", BOX.replace("<vcount>4", "<vcount>99999999999999999999"), "something that is not a number"),
    (".dae", BOX.replace("<p>0 0", "<p>8 0"), "a triangle refers to point 8; the mesh has 8 points"),
    (".dae", BOX.replace("<p>0 0", "<p>-1 0"), "a triangle refers to point -1"),
    (".dae", BOX.replace("<p>0 0", "<p>x 0"), "<p> contains something that is not a number"),
    (".dae", BOX.replace('count="24">0.0', 'count="24">nan'), "points that are not finite"),
    (".dae", BOX.replace('semantic="POSITION"', 'semantic="X"'), "the vertices have no positions"),
    (".dae", BOX.replace("technique_common", "technique"), "the source has no accessor"),
    (".dae", dae(f"<node><matrix>1 2</matrix>{INSTANCE}</node>"), "<matrix> has 2 numbers"),
    (".dae", dae(f"<node><matrix>{'inf ' * 16}</matrix>{INSTANCE}</node>"), "points that are not finite"),
    (".dae", dae(f"<node><skew>1</skew>{INSTANCE}</node>"), "<skew> is not supported"),
    (
        ".dae",
        dae('<node id="n"><instance_node url="#n"/></node>'),
        "they are nested too deeply, or they refer to themselves",
    ),
    (".glb", b"", "this is not a binary glTF file. Allowed: GLB, version 2"),
    (".glb", b"glTF" + b"\0" * 30, "the GLB file of version 0 is damaged or incomplete"),
    (".glb", GLB_BOX[:-1], "the GLB file of version 2 is damaged or incomplete"),
    (".glb", glb({"nodes": 3}), "the value is the number 3. Allowed: an array"),
    (".glb", glb({}), "the mesh has no triangles"),
    (".glb", glb_box([{"mesh": 1}]), "there is no mesh number 1; the file has 1"),
    (".glb", glb_box([{"mesh": -1}]), "the value is not a whole number of zero or more"),
    (".glb", glb_box([{"mesh": 0, "children": [0]}]), "or they refer to themselves"),
    (".glb", glb_box([{"children": [1] * 30_000}, {}]), "the mesh has too many nodes"),
    (".glb", glb_box([{"mesh": 0, "matrix": [1]}]), "1 number is given"),
    (".glb", glb_box([{"mesh": 0, "translation": [1e300, 0, 0]}]), "points that are not finite"),
    (
        ".glb",
        glb_box([{"mesh": 0}], extensionsRequired=["KHR_draco_mesh_compression"]),
        "requires the extension 'KHR_draco_mesh_compression', which is not supported",
    ),
    (".glb", glb_box([{"mesh": 0}], buffers=[{"uri": "a.bin"}]), "the buffer is outside of the GLB file"),
    (".glb", glb_box([{"mesh": 0}], bufferViews=[{"byteLength": 9}] * 2), "the bufferView has no buffer"),
    (".glb", glb_box([{"mesh": 0}], accessors=[ACCESSOR | {"count": 2**50}]), "the accessor needs"),
    (
        ".glb",
        glb_box([{"mesh": 0}], accessors=[ACCESSOR | {"byteOffset": 4}]),
        "the accessor needs 100 bytes",
    ),
    (".glb", glb_box([{"mesh": 0}], accessors=[ACCESSOR, ACCESSOR]), "the accessor has another type"),
    (".glb", glb_box([{"mesh": 0}], accessors=[ACCESSOR | {"sparse": {}}]), "the accessor is sparse"),
]


@pytest.mark.parametrize(
    ("suffix", "data", "words"), INVALID, ids=[f"{s}{k}" for k, (s, _, _) in enumerate(INVALID)]
)
def test_invalid_meshes_are_refused(suffix: str, data: str | bytes, words: str) -> None:
    began = time.process_time()
    with pytest.raises(FormatError) as refused:
        corners(data, suffix)
    assert words in str(refused.value)
    assert time.process_time() - began < 10


def test_nodes_that_multiply_are_refused_in_bounded_time() -> None:
    """Each node refers twice to the next one: 2^40 boxes."""
    nodes = "".join(
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>'
        for k in range(40)
    )
    library = f'<library_nodes>{nodes}<node id="n40">{INSTANCE}</node></library_nodes>'
    began = time.process_time()
    with pytest.raises(FormatError, match="too many nodes"):
        corners(dae('<node><instance_node url="#n0"/></node>', libraries=library), ".dae")
    with pytest.raises(FormatError, match="too many nodes"):
        corners(glb_box([*({"children": [k + 1, k + 1]} for k in range(40)), {"mesh": 0}]), ".glb")
    assert time.process_time() - began < 10


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from([(".obj", obj_box().encode()), (".dae", BOX.encode()), (".glb", GLB_BOX)]),
    st.floats(0, 1),
    st.integers(0, 12),
    st.binary(max_size=8),
)
def test_damaged_files_are_read_or_refused(
    file: tuple[str, bytes], place: float, length: int, inserted: bytes
) -> None:
    suffix, data = file
    start = int(place * len(data))
    try:
        corners(data[:start] + inserted + data[start + length :], suffix)
    except FormatError as error:
        assert str(error)
