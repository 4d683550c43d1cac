"""The renderer: hidden surfaces, projection, shadows, layers."""

import math

import numpy as np
import pytest

from armblocks.pictures.picture import Polyline, Raster, text_marks
from armblocks.rendering.arm_drawing import arm_picture, arm_picture_svg, pose_sequence_picture
from armblocks.rendering.camera import Camera
from armblocks.rendering.render import composite, crop, render, shadow, with_opacity
from armblocks.robot import Robot
from armblocks.robot.geometry import link_frames
from armblocks.robot.shapes import Box, Material, Sphere
from armblocks.robot.triangles import triangles

WIDTH = HEIGHT = 200.0


def camera() -> Camera:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    return Camera.framing(corners, WIDTH, HEIGHT, margin=10.0)


def test_framed_points_fill_the_panel_up_to_its_margin() -> None:
    points = np.random.default_rng(5).normal(size=(100, 3))
    view = Camera.framing(points, 300, 200, margin=12)
    x, y, inverse_depth = view.project(points)
    assert x.min() >= 12 - 1e-9 and x.max() <= 288 + 1e-9 and y.min() >= 12 - 1e-9 and y.max() <= 188 + 1e-9
    assert np.ptp(x) == pytest.approx(276) or np.ptp(y) == pytest.approx(176)
    assert (inverse_depth > 0).all()


def test_the_z_axis_points_up_in_the_picture() -> None:
    _, y, _ = camera().project(np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0)]))
    assert y[1] < y[0]


def test_a_ball_covers_a_disc() -> None:
    view = camera()
    ball = render([triangles(Sphere(radius=0.5))], view, WIDTH, HEIGHT, 2.0)
    x, _, inverse_depth = view.project(np.array([(0.0, 0.0, 0.0)]))
    radius = 0.5 * view.scale * float(inverse_depth[0]) * 2.0
    covered = float((ball.pixels[..., 3] / 255).sum())
    # The facets of the outline reduce the area by 1 %; perspective adds less.
    assert covered == pytest.approx(math.pi * radius**2, rel=0.03)
    assert x.shape == (1,)


def test_the_nearer_body_hides_the_farther_one() -> None:
    view = camera()
    towards = view.axes[2]
    near = triangles(Sphere(radius=0.2, material=Material.PAINT)).moved(_shift(0.6 * towards))
    far = triangles(Sphere(radius=0.2, material=Material.JOINT)).moved(_shift(-0.6 * towards))
    for order in ([near, far], [far, near]):
        picture = render(order, view, WIDTH, HEIGHT, 1.0)
        middle = picture.pixels[100 - picture.top, 100 - picture.left].astype(int)
        assert middle[0] > middle[2] + 60  # orange, not graphite
        assert picture.inverse_depth_at(np.array([100.0]), np.array([100.0]))[0] > 0
        assert picture.inverse_depth_at(np.array([1.0, -50.0]), np.array([1.0, 1e4])).tolist() == [0.0, 0.0]


def test_rendering_is_repeatable() -> None:
    box = [triangles(Box(size=(1.0, 0.6, 0.4)))]
    first, second = (render(box, camera(), WIDTH, HEIGHT, 1.5) for _ in range(2))
    assert (first.pixels == second.pixels).all()


def test_a_body_outside_the_panel_is_clipped() -> None:
    big = triangles(Sphere(radius=30.0)).moved(_shift(-40.0 * camera().axes[2]))
    assert render([big], camera(), WIDTH, HEIGHT, 1.0).pixels.shape[:2] == (200, 200)


def test_a_shadow_is_black_and_soft() -> None:
    dark = shadow([triangles(Sphere(radius=0.4))], camera(), -1.0, WIDTH, HEIGHT, 1.0)
    assert not dark[..., :3].any()
    assert 0 < dark[..., 3].max() < 128
    assert len(np.unique(dark[..., 3])) > 10


def test_layers_are_composited_with_their_opacity() -> None:
    red = np.array([[[255, 0, 0, 255]]], dtype=np.uint8)
    blue = np.array([[[0, 0, 255, 255]]], dtype=np.uint8)
    assert composite(red, blue).tolist() == red.tolist()
    assert composite(with_opacity(red, 0.0), blue).tolist() == blue.tolist()
    assert composite(with_opacity(red, 0.5), blue)[0, 0, 3] == 255


def test_cropping_keeps_all_drawn_pixels() -> None:
    pixels = np.zeros((10, 12, 4), dtype=np.uint8)
    pixels[3:5, 6:9, 3] = 9
    part, left, top = crop(pixels)
    assert (part.shape, left, top) == ((2, 3, 4), 6, 3)
    assert crop(np.zeros((4, 4, 4), dtype=np.uint8))[0].shape == (1, 1, 4)


def test_every_robot_can_be_drawn(robot: Robot) -> None:
    picture = arm_picture(robot, [0.2] * robot.nq, width=160, height=140)
    (raster,) = (mark for mark in picture.marks if isinstance(mark, Raster))
    assert (raster.pixels[..., 3] == 255).mean() > 0.005
    assert raster.x >= 0 and raster.x + raster.width <= 160 and raster.y + raster.height <= 140


def test_a_picture_for_notebooks_is_one_svg(puma560: Robot) -> None:
    text = arm_picture_svg(puma560, [0.0] * 6, (200, 150), theme="dark")
    assert text.startswith("<?xml") and text.count("<svg") == 1


def test_snapshots_show_their_times_and_tool_positions(kr180: Robot) -> None:
    time = np.linspace(0, 10, 41)
    q = np.outer(time / 10, [3.14, 0, 1.57, 0])
    poses = np.stack([link_frames(kr180, row) for row in q.tolist()])
    picture = pose_sequence_picture(kr180, time, poses)
    texts = [mark.text for mark in text_marks(picture)]
    assert [t for t in texts if t.startswith("t =")] == [f"t = {k} s" for k in (0, 2, 4, 6, 8, 10)]
    assert "x 1.95  y −1.25  z −1.85 m" in texts
    assert any("floor at z = −2 m" in t for t in texts)
    # The grid ends at each panel's edge.
    for mark in picture.marks:
        if isinstance(mark, Polyline):
            points = np.asarray(mark.points)
            assert points.min() >= 0 and points[:, 0].max() <= picture.width


def _shift(vector: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = vector
    return T
