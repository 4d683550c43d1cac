"""Meshes of URDF files: where they are found, and how STL becomes triangles."""

from __future__ import annotations

import struct
import time
from pathlib import Path

import numpy as np
import pytest

from armblocks.errors import FormatError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.meshes.mesh_file import MAX_TRIANGLES, drawn_mesh, mesh_corners
from armblocks.formats.referenced_files import package_folder, resolved
from armblocks.formats.urdf.reader import read_urdf
from armblocks.robot import Robot
from armblocks.robot.geometry import robot_bodies
from armblocks.robot.shapes import IDENTITY, Material, Mesh

TETRAHEDRON = np.array(
    [
        [[0, 0, 0], [0, 1, 0], [1, 0, 0]],
        [[0, 0, 0], [1, 0, 0], [0, 0, 1]],
        [[0, 0, 0], [0, 0, 1], [0, 1, 0]],
        [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ],
    dtype=float,
)


def binary(corners: np.ndarray) -> bytes:
    rows = (struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in corners)
    return b"solid binary".ljust(80) + struct.pack("<I", len(corners)) + b"".join(rows)


def ascii_text(corners: np.ndarray) -> bytes:
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {x} {y} {z}\n" for x, y, z in triangle)
        + "endloop\nendfacet\n"
        for triangle in corners
    )
    return f"solid name\n{facets}endsolid name\n".encode()


def mesh_of(data: bytes, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    return drawn_mesh(mesh_corners(data, "a.stl", scale), Material.PAINT, IDENTITY)


def volume(mesh: Mesh) -> float:
    corners = np.array(mesh.vertices)[np.array(mesh.faces)]
    return float(np.linalg.det(corners).sum() / 6)


@pytest.mark.parametrize("data", [binary(TETRAHEDRON), ascii_text(TETRAHEDRON)], ids=["binary", "ascii"])
def test_an_stl_file_gives_its_triangles(data: bytes) -> None:
    mesh = mesh_of(data)
    assert (len(mesh.vertices), len(mesh.faces)) == (4, 4)
    assert volume(mesh) == pytest.approx(1 / 6)
    assert volume(mesh_of(data, (2.0, 2.0, 2.0))) == pytest.approx(8 / 6)
    assert volume(mesh_of(data, (-1.0, 1.0, 1.0))) == pytest.approx(1 / 6)  # outside stays outside


def test_large_meshes_are_reduced_and_keep_their_volume() -> None:
    angle = np.linspace(0, 2 * np.pi, 201)
    height = np.linspace(-np.pi / 2, np.pi / 2, 101)
    points = np.stack(
        [
            np.outer(np.cos(height), np.cos(angle)),
            np.outer(np.cos(height), np.sin(angle)),
            np.outer(np.sin(height), np.ones(201)),
        ],
        axis=-1,
    )
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, 1:], points[1:, :-1]
    corners = np.concatenate([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3, 3)
    assert len(corners) == 40_000
    mesh = mesh_of(binary(corners))
    assert 500 < len(mesh.faces) <= MAX_TRIANGLES
    assert volume(mesh) == pytest.approx(4 / 3 * np.pi, rel=0.1)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "this is not an STL mesh. Allowed: binary or ASCII STL"),
        (b"x" * 200, "this is not an STL mesh"),
        (b"solid a\nvertex 1 2 x", "this is not an STL mesh"),
        (b"solid a\nvertex 1 2 3", "this is not an STL mesh"),
        (b"solid a\nendsolid a", "the mesh has no triangles, or points that are not finite"),
        (binary(TETRAHEDRON * np.nan), "the mesh has no triangles, or points that are not finite"),
        (binary(TETRAHEDRON)[:-1], "the mesh has no triangles"),
    ],
)
def test_invalid_meshes_are_refused(data: bytes, words: str) -> None:
    with pytest.raises(FormatError) as refused:
        mesh_of(data)
    assert words in str(refused.value)


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """Two packages beside each other; the folder of the second has another name."""
    (tmp_path / "arm_description" / "urdf").mkdir(parents=True)
    (tmp_path / "arm_description" / "meshes").mkdir()
    (tmp_path / "arm_description" / "meshes" / "a.stl").write_bytes(binary(TETRAHEDRON))
    (tmp_path / "arm_description" / "package.xml").write_text(
        "<package><name> renamed_arm </name></package>", encoding="utf-8"
    )
    (tmp_path / "gripper").mkdir()
    return tmp_path


def test_packages_are_found_by_the_map_above_the_file_and_by_their_manifest(workspace: Path) -> None:
    context = FileContext(folder=workspace / "arm_description" / "urdf")
    assert package_folder("arm_description", context) == workspace / "arm_description"
    assert package_folder("renamed_arm", context) == workspace / "arm_description"
    assert package_folder("gripper", context) == workspace / "gripper"
    assert package_folder("hand", context) is None
    assert package_folder("..", context) is None
    context.packages = {"hand": workspace}
    assert package_folder("hand", context) == workspace
    inside = FileContext(folder=context.folder, root=workspace / "arm_description")
    assert package_folder("gripper", inside) is None


def test_references_give_a_file_or_the_reason_why_there_is_none(workspace: Path) -> None:
    context = FileContext(folder=workspace / "arm_description" / "urdf")
    mesh = workspace / "arm_description" / "meshes" / "a.stl"
    for reference in (
        "package://arm_description/meshes/a.stl",
        "../meshes/a.stl",
        f"file://{mesh}",
        str(mesh),
    ):
        assert resolved(reference, context) == mesh.resolve()
    assert resolved("model://arm_description/meshes/a.stl", context) == mesh.resolve()
    assert resolved("package://hand/a.stl", context) == "the package 'hand' is not found"
    assert resolved("https://example.com/a.stl", context) == "files with 'https://' are not read"
    assert resolved("b.stl", context) == "there is no such file"
    assert resolved("..", context) == "there is no such file"
    assert resolved("a\0b", context) == "the path is not valid"
    assert resolved("a.stl", FileContext()) == "the folder of the robot file is unknown"
    context.root = workspace / "arm_description" / "urdf"
    assert resolved("../meshes/a.stl", context) == "the file is outside of the project folder"


def test_meshes_are_drawn_and_missing_ones_are_named(workspace: Path) -> None:
    def read(reference: str, scale: str = "0.001 0.001 0.001") -> tuple[Robot, list[str]]:
        context = FileContext(folder=workspace / "arm_description" / "urdf")
        text = f"""<robot name="r"><link name="a"><visual><origin xyz="0 0 1"/><geometry>
            <mesh filename="{reference}" scale="{scale}"/></geometry></visual></link></robot>"""
        robot = read_urdf(text.encode(), "r.urdf", context)
        return robot, [finding.what for finding in context.findings]

    robot, findings = read("package://arm_description/meshes/a.stl")
    assert findings == []
    (body,) = (body for body in robot_bodies(robot) if body.row == 1)
    assert body.mesh.corners[..., 2].min() == pytest.approx(1.0)
    assert body.mesh.corners[..., 2].max() == pytest.approx(1.001)
    _, findings = read("package://other/meshes/a.stl")
    assert findings == [
        "the mesh 'package://other/meshes/a.stl' is not shown: the package 'other' is not found"
    ]
    (workspace / "arm_description" / "meshes" / "a.stl").write_bytes(b"")
    _, findings = read("package://arm_description/meshes/a.stl")
    assert findings[0].endswith("is not shown: this is not an STL mesh")
    _, findings = read("a.stl", scale="1 1 1 1")
    assert findings == ["it is not shown: the attribute 'scale' has 4 values: '1 1 1 1'"]


def test_pipes_are_not_opened(tmp_path: Path) -> None:
    import os

    if not hasattr(os, "mkfifo"):
        pytest.skip("no named pipes on this system")
    os.mkfifo(tmp_path / "pipe.stl")
    began = time.process_time()
    assert resolved("pipe.stl", FileContext(folder=tmp_path)) == "there is no such file"
    assert time.process_time() - began < 5
