"""Pictures and videos of arms as files: content, sizes, refusals, and interruption."""

from __future__ import annotations

import io
import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

import armblocks as ab
from armblocks.errors import ArmblocksError, FormatError, InputError, UnknownNameError
from armblocks.pictures import film
from armblocks.pictures.film import FILM_SUFFIXES, exact_rate, frame_times, write_film
from armblocks.pictures.png import picture_pixels
from armblocks.rendering.arm_film import ArmMotion, FilmView, resampled
from armblocks.robot import Free, Prismatic, Spherical
from armblocks.robot.geometry import link_frames
from mechanisms_for_tests import four_bar
from robots_for_tests import build_mixed_tree, build_random_tree

SIZE = (160, 120)


@pytest.fixture(scope="module")
def puma() -> ab.Arm:
    return ab.load_robot("puma560")


def opened(path: Path) -> Image.Image:
    return Image.open(io.BytesIO(path.read_bytes()))


def pixels_of(path: Path) -> np.ndarray:
    return np.asarray(opened(path).convert("RGB")).astype(int)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_picture_has_the_size_the_theme_and_the_arm(puma: ab.Arm, tmp_path: Path, theme: str) -> None:
    path = puma.plot([0.1, 0.4, -2.0, 0.3, 0.5, 0.0], save=tmp_path / "arm.PNG", theme=theme, size=SIZE)
    picture = pixels_of(path)
    assert picture.shape == (240, 320, 3)
    assert (picture[0, 0].mean() > 128) == (theme == "light")
    orange = (picture[..., 0] > 150) & (picture[..., 2] < 90)
    assert orange.mean() > 0.02
    again = puma.plot([0.1, 0.4, -2.0, 0.3, 0.5, 0.0], save=tmp_path / "b.png", theme=theme, size=SIZE)
    assert again.read_bytes() == path.read_bytes()


def test_svg_and_pdf_pictures_are_complete_documents(puma: ab.Arm, tmp_path: Path) -> None:
    svg = puma.plot(save=tmp_path / "arm.svg", size=SIZE).read_text()
    assert svg.startswith("<?xml") and svg.endswith("</svg>\n") and 'width="160" height="120"' in svg
    assert puma.plot(save=tmp_path / "arm.pdf", size=SIZE).read_bytes().startswith(b"%PDF")


def test_the_camera_turns_with_view(puma: ab.Arm, tmp_path: Path) -> None:
    pictures = {
        puma.plot(save=tmp_path / f"{k}.svg", size=SIZE, view=view).read_text()
        for k, view in enumerate([(-58, 20), (30, 20), (30, 60)])
    }
    assert len(pictures) == 3


def test_trees_with_all_kinds_of_joints_are_drawn(tmp_path: Path) -> None:
    for robot in (build_random_tree(1), build_mixed_tree(2, [Prismatic, Spherical, Free])):
        arm = ab.Arm(robot)
        q = [arm.neutral(), arm.integrate(arm.neutral(), np.ones(arm.n), 0.3)]
        assert arm.plot(q, save=tmp_path / "arm.svg", size=SIZE).stat().st_size > 2000


def test_closed_loops_are_drawn(tmp_path: Path) -> None:
    arm = ab.Arm(four_bar())
    assert arm.plot(arm.assemble().q, save=tmp_path / "bar.png", size=SIZE).stat().st_size > 1000


def test_a_motion_is_drawn_with_its_path(puma: ab.Arm, tmp_path: Path) -> None:
    motion = ab.jtraj(np.zeros(6), np.full(6, 0.5), 30)
    both = [
        puma.plot(motion.q, save=tmp_path / "a.svg", size=SIZE).read_text(),
        puma.animate(motion, save=tmp_path / "b.svg", size=SIZE).read_text(),
    ]
    assert both[0] == both[1] and "pale: the pose at the start" in both[0]
    assert "stroke" in both[0] and both[0].count("<circle") == 2


def test_a_gif_has_the_frames_of_the_motion(puma: ab.Arm, tmp_path: Path) -> None:
    q = ab.jtraj(np.zeros(6), np.full(6, 0.5), 11).q
    calls: list[tuple[int, int]] = []
    path = puma.animate(
        q, 0.05, save=tmp_path / "a.gif", size=SIZE, rate=10, progress=lambda *call: calls.append(call)
    )
    frames = opened(path)
    assert frames.n_frames == 6 and frames.size == SIZE and frames.info["duration"] == 100
    assert calls == [(k, 6) for k in range(1, 7)]
    times = frame_times(0.0, 0.5, 10, 1.0)
    rows = resampled(puma.robot, 0.05 * np.arange(11), q, times)
    motion = ArmMotion(robot=puma.robot, time=times, poses=puma.link_poses(rows))
    view = FilmView.of([motion], *SIZE)
    for k in (0, 3, 5):
        frames.seek(k)
        drawn = picture_pixels(view.frame(float(times[k])), scale=1.0).astype(int)
        shown = np.asarray(frames.convert("RGB")).astype(int)
        assert np.abs(drawn - shown).mean() < 2.0  # 256 colours


def test_an_mp4_film_has_the_frames_of_the_motion(puma: ab.Arm, tmp_path: Path) -> None:
    path = puma.animate(
        np.linspace(np.zeros(6), np.ones(6), 5), 0.1, save=tmp_path / "a.mp4", size=(161, 121), speed=2
    )
    raw = subprocess.run(
        [imageio_ffmpeg.get_ffmpeg_exe(), "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        check=True,
    )
    frames = np.frombuffer(raw.stdout, np.uint8).reshape(-1, 120, 160, 3)
    assert len(frames) == 6 and b"25 fps" in raw.stderr and b"h264" in raw.stderr
    last = puma.animate(
        np.linspace(np.zeros(6), np.ones(6), 5), 0.1, save=tmp_path / "a.gif", size=(161, 121), speed=2
    )
    gif = opened(last)
    gif.seek(gif.n_frames - 1)
    assert np.abs(np.asarray(gif.convert("RGB"))[:120, :160].astype(int) - frames[-1]).mean() < 6


def test_a_motion_without_movement_gives_a_film(puma: ab.Arm, tmp_path: Path) -> None:
    path = puma.animate(np.zeros((3, 6)), 0.1, save=tmp_path / "a.gif", size=SIZE, rate=10)
    assert opened(path).size == SIZE
    assert opened(puma.animate([np.zeros(6)], save=tmp_path / "b.gif", size=SIZE)).size == SIZE


@pytest.mark.parametrize("suffix", FILM_SUFFIXES)
def test_an_interrupted_film_leaves_the_old_file(puma: ab.Arm, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")

    def interrupt(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        puma.animate(np.zeros((5, 6)), 0.1, save=path, size=SIZE, progress=interrupt)
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_failing_encoder_is_an_error_with_its_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> object:
        raise OSError("no space left\nsecond line")

    monkeypatch.setattr(imageio_ffmpeg, "write_frames", lambda *a, **k: (broken() for _ in range(2)))
    with pytest.raises(FormatError, match=r"ffmpeg cannot write the video \(no space left\)"):
        write_film(tmp_path / "a.mp4", lambda k: np.zeros((8, 8, 3), np.uint8), 2, 25)
    assert not list(tmp_path.iterdir())


def test_quaternions_change_sign_where_this_is_nearer() -> None:
    robot = build_mixed_tree(0, [Spherical])
    arm = ab.Arm(robot)
    random = np.random.default_rng(3)
    q0 = arm.integrate(arm.neutral(), random.normal(size=arm.n), 1.0)
    q1 = arm.integrate(q0, 0.2 * random.normal(size=arm.n), 1.0)
    flipped = q1.copy()
    first = 0
    for joint in robot.joints:
        for motion in joint.motions:
            part = slice(first, first + len(motion.positions))
            first = part.stop
            if motion.speeds != motion.positions:
                flipped[part] *= -1
    times = np.linspace(0, 2, 9)
    near, far = (resampled(robot, np.array([0.0, 2.0]), np.stack([q0, q]), times) for q in (q1, flipped))
    assert np.allclose(near, far)
    poses = np.stack([link_frames(robot, q) for q in near.tolist()])
    exact = arm.link_poses(
        arm.integrate(np.tile(q0, (9, 1)), np.tile(arm.difference(q0, q1), (9, 1)), times / 2)
    )
    assert np.abs(poses - exact).max() < 0.05


def test_a_film_of_a_run_shows_its_arms(tmp_path: Path) -> None:
    diagram = ab.load_diagram("kr180model")
    result = ab.simulate(diagram, stop_time=0.4)
    path = ab.write_film(tmp_path / "run.gif", diagram, result, rate=5, size=SIZE, theme="dark")
    assert opened(path).n_frames == 3
    builder = ab.DiagramBuilder("bare")
    builder.add("sink", ab.blocks.Terminator(), builder.add("one", ab.blocks.Constant()))
    bare = builder.build()
    with pytest.raises(InputError, match="the run has no moving arm"):
        ab.write_film(tmp_path / "x.gif", bare, ab.simulate(bare, stop_time=1.0))


def test_too_many_arms_are_refused(tmp_path: Path) -> None:
    builder = ab.DiagramBuilder("five")
    puma = ab.load_robot("puma560").robot
    for k in range(5):
        q = builder.add(f"q{k}", ab.blocks.Constant(value=np.full(6, 0.1 * k)))
        builder.add(f"plot{k}", ab.blocks.RobotPlot(robot=puma), q)
    diagram = builder.build()
    result = ab.simulate(diagram, stop_time=0.1)
    with pytest.raises(InputError, match=r"the run has 5 arms.*at most 4 arms in a video"):
        ab.write_film(tmp_path / "x.gif", diagram, result)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"q": [0.0] * 5}, r"q has the shape \(5,\).*\(6,\) for a configuration, \(N, 6\) for a motion"),
        ({"q": np.zeros((0, 6))}, r"q has the shape \(0, 6\)"),
        ({"q": [[0.0] * 6, [np.nan] * 6]}, r"row 1 of q is not finite"),
        ({"q": np.zeros((200_001, 6))}, r"q has 200001 rows.*at most 200000 rows"),
        ({"q": "straight"}, "is not an array of numbers"),
        ({"theme": "blue"}, "there is no theme named 'blue'"),
        ({"size": (10, 10)}, r"size is 10 x 10 px.*64 to 1600 px on each side"),
        ({"size": 100}, r"size is 100.*two finite numbers"),
        ({"view": (0, 95)}, "the elevation of the camera is 95 degrees"),
        ({"save": "arm.bmp"}, r"there is no format of pictures named '\.bmp'"),
    ],
)
def test_invalid_arguments_of_pictures_are_refused(
    puma: ab.Arm, call: dict[str, object], message: str
) -> None:
    with pytest.raises(ArmblocksError, match=message):
        puma.plot(**{"save": "arm.svg", **call})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        ({"dt": 0}, r"dt = 0.*a positive number of s between two rows, or 3 ascending times"),
        ({"dt": [0.0, 0.2, 0.1]}, r"dt has the shape \(3,\)"),
        ({"dt": [0.0, 0.2]}, r"dt has the shape \(2,\)"),
        ({"rate": 100}, r"rate = 100.*0\.1 to 60 frames per second"),
        ({"speed": 0}, r"speed = 0.*2 plays the motion twice as fast"),
        ({"dt": 1000.0}, r"the video has \d+ frames.*at most 1500 frames in \.gif files"),
        ({"dt": 1000.0, "save": "a.mp4"}, r"at most 15000 frames in \.mp4 files"),
        ({"size": (2000, 100)}, "64 to 1920 px on each side"),
        ({"save": "a.avi"}, r"there is no format of pictures named '\.avi'.*\.gif"),
    ],
)
def test_invalid_arguments_of_videos_are_refused(puma: ab.Arm, call: dict[str, object], message: str) -> None:
    with pytest.raises(ArmblocksError, match=message):
        puma.animate(np.zeros((3, 6)), **{"save": "a.gif", **call})  # type: ignore[arg-type]


def test_quaternions_of_zeros_and_several_rows_for_sliders_are_refused() -> None:
    arm = ab.Arm(build_mixed_tree(0, [Spherical]))
    with pytest.raises(InputError, match="row 0 of q has a quaternion of zeros"):
        arm.plot(np.zeros((100, arm.nq)), save="a.svg")
    with pytest.raises(ArmblocksError, match="the quaternion of a joint is 0 0 0 0"):
        arm.plot(np.zeros(arm.nq), save="a.svg")
    with pytest.raises(InputError, match=r"q has 2 rows.*show a motion by arm\.animate"):
        arm.teach(np.zeros((2, arm.nq)))


def test_film_files_have_bounded_frames(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the frames have 5000 x 2 pixels"):
        write_film(tmp_path / "a.gif", lambda k: np.zeros((2, 5000, 3), np.uint8), 1, 25)
    with pytest.raises(UnknownNameError, match=r"there is no format of videos named '\.avi'"):
        write_film(tmp_path / "a.avi", lambda k: np.zeros((2, 2, 3), np.uint8), 1, 25)
    with pytest.raises(FormatError, match="does not exist"):
        write_film(tmp_path / "none" / "a.gif", lambda k: np.zeros((2, 2, 3), np.uint8), 1, 25)


def test_gif_frames_last_whole_hundredths_of_a_second() -> None:
    assert exact_rate("a.gif", 25) == 25 and exact_rate("a.gif", 30) == pytest.approx(100 / 3)
    assert exact_rate("a.gif", 60) == 50 and exact_rate("a.mp4", 60) == 60


def test_frames_of_a_gif_show_all_changes_of_random_pixels(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    frames = [np.zeros((9, 7, 3), np.uint8)]
    for _ in range(5):
        frame = frames[-1].copy()
        frame[random.integers(9), random.integers(7)] = random.integers(0, 256, 3)
        frames.append(frame)
    path = write_film(tmp_path / "a.gif", frames.__getitem__, 6, 20)
    shown = opened(path)
    for k, frame in enumerate(frames):
        shown.seek(k)
        # The palette of a GIF is chosen from every second pixel of some frames.
        assert ((np.asarray(shown.convert("RGB")) != 0).any(axis=2) == (frame != 0).any(axis=2)).mean() > 0.9
    assert film.MAX_FRAMES[".gif"] < film.MAX_FRAMES[".mp4"]
