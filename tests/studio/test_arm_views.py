"""Views of arms from Python, without a browser: the server of pages, its access control, sliders, widgets."""

from __future__ import annotations

import json
import sys
import threading
import time
import urllib.error
import urllib.request
import webbrowser
from collections.abc import Iterator

import numpy as np
import pytest

import armblocks as ab
from armblocks.errors import InputError
from armblocks.robot import Free, Prismatic, Revolute, Spherical
from armblocks.studio import arm_views, view_server
from armblocks.studio.view_content import arm_content, motion_content, moved
from armblocks.studio.view_server import ArmPage
from mechanisms_for_tests import four_bar
from robots_for_tests import build_mixed_tree

Q = [0.1, 0.4, -2.0, 0.3, 0.5, 0.0]


@pytest.fixture
def links(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The links that the browser was asked to open."""
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda link: not opened.append(link))
    monkeypatch.setattr(view_server, "BEAT", 0.05)
    monkeypatch.setattr(view_server, "ABSENCE", 0.2)
    yield opened
    view_server._server().awaited.clear()


def fetched(link: str, body: object = None, **headers: str) -> bytes:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(link, data, headers)
    with urllib.request.urlopen(request, timeout=10) as reply:
        return reply.read()


def status(link: str, body: object = None, **headers: str) -> int:
    try:
        fetched(link, body, **headers)
    except urllib.error.HTTPError as error:
        error.close()
        return error.code
    return 200


def test_a_page_has_the_arm_and_its_sliders(links: list[str]) -> None:
    arm = ab.load_robot("puma560")
    page = arm.plot(Q, theme="dark")
    assert links == [page.link] and isinstance(page, ArmPage) and not page.open
    assert b"<title>Robot Puma 560</title>" in fetched(page.link)
    assert b'data-jp-theme-light="false"' in fetched(page.link)
    content = json.loads(fetched(page.link + "content"))
    assert content["shown"]["joints"]["q"] == Q and len(content["shown"]["joints"]["sliders"]) == 6
    assert np.allclose(content["shown"]["arm"]["rest"], arm.link_poses(Q))
    assert fetched(page.link + "view_page.js") and fetched(page.link + "frame.js")


def test_sliders_move_the_arm(links: list[str]) -> None:
    arm = ab.load_robot("puma560")
    page = arm.teach()
    q = [0.5, *Q[1:]]
    reply = json.loads(fetched(page.link + "joints", q))
    assert reply["q"] == q and np.allclose(reply["poses"], arm.link_poses(q))
    assert page.q.tolist() == q
    page.q = Q
    assert page.q.tolist() == Q
    with pytest.raises(InputError, match=r"q has the shape \(5,\)"):
        page.q = Q[1:]
    for body in ([0.0] * 5, [float("nan")] * 6, "text", {"q": 1}, [[0.0] * 6]):
        assert status(page.link + "joints", body) == 400
    assert page.q.tolist() == Q


def test_a_stream_of_events_reports_changes_and_the_end(links: list[str]) -> None:
    page = ab.load_robot("puma560").teach(Q)
    stream = urllib.request.urlopen(page.link + "events", timeout=10)
    assert stream.readline() == b": \n"
    assert page.open
    page.q = np.zeros(6)
    lines = iter(stream.readline, b"")
    event = json.loads(next(line for line in lines if line.startswith(b"data: ")).removeprefix(b"data: "))
    assert event["q"] == [0.0] * 6 and len(event["poses"]) == 8
    assert json.loads(fetched(page.link + "joints", Q))["number"] > event["number"]
    waiting = threading.Thread(target=page.wait)
    waiting.start()
    page.close()
    waiting.join(10)
    assert not waiting.is_alive() and not page.open
    assert b'"closed": true' in next(line for line in lines if b"closed" in line)
    stream.close()


def test_waiting_ends_when_the_page_is_closed(links: list[str]) -> None:
    page = ab.load_robot("puma560").plot(Q)
    begin = time.monotonic()
    page.wait(0.3)  # not open yet
    assert time.monotonic() - begin >= 0.3
    urllib.request.urlopen(page.link + "events", timeout=10).close()
    page.wait(20)
    assert not page.open and time.monotonic() - begin < 15


def test_other_programs_and_sites_have_no_access(links: list[str]) -> None:
    page = ab.load_robot("puma560").plot(Q)
    base, _, key = page.link.rstrip("/").rpartition("/")
    host = base.split("/")[2]
    assert status(f"http://{host}/guess/{key}/") == 404
    assert status(f"http://{host}/") == 404
    assert status(f"{base}/p999/") == 404
    assert status(f"{page.link}../../etc") in (403, 404)
    assert status(page.link + "other.js") == 404
    assert status(page.link, Host="rebound.example") == 403
    assert status(page.link + "joints", Q, Origin="http://other.example") == 403
    assert status(page.link + "joints", Q, Origin=f"http://{host}") == 200
    assert status(page.link + "content", Q) == 400
    assert status(page.link + "joints", [0.0] * 40_000) == 400
    with urllib.request.urlopen(page.link, timeout=10) as reply:
        assert "default-src 'none'" in reply.headers["Content-Security-Policy"]
        assert reply.headers["Referrer-Policy"] == "no-referrer"


def test_old_pages_are_forgotten(links: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(view_server, "MAX_PAGES", 2)
    arm = ab.load_robot("puma560")
    first, *rest = [arm.plot(Q) for _ in range(3)]
    assert status(first.link) == 404 and all(status(page.link) == 200 for page in rest)


def test_without_a_browser_the_link_is_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda link: False)
    page = ab.load_robot("puma560").plot(Q)
    assert capsys.readouterr().err == f"Robot Puma 560: {page.link}\n" and page.link in repr(page)


def test_the_end_of_a_program_waits_for_the_page(links: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    page = ab.load_robot("puma560").plot(Q)
    monkeypatch.setattr(view_server, "LOADING_TIME", 0.2)
    server = view_server._server()
    begin = time.monotonic()
    server.wait_for_pages()
    assert time.monotonic() - begin >= 0.2
    urllib.request.urlopen(page.link + "events", timeout=10).close()
    monkeypatch.setattr(view_server, "LOADING_TIME", 60)
    server.wait_for_pages()
    assert time.monotonic() - begin < 30


def test_motions_play_in_time_and_long_ones_are_thinned() -> None:
    robot = ab.load_robot("puma560").robot
    time_points = np.linspace(0, 3, 12_001)
    poses = np.zeros((12_001, 8, 4, 4)) + np.eye(4)
    content = motion_content(robot, np.zeros((12_001, 6)), time_points, poses)
    assert content.shown["play"] and content.shown["joints"] is None
    (header, *_), count = content.frame.split(b"}", 1), 4001
    assert json.loads(header[4:] + b"}")["count"] == count
    assert content.shown["run"]["stopTime"] == 3.0
    assert len(content.frame) > count * 8 * (1 + 8 * 16)


def test_sliders_have_the_limits_of_the_joints_or_a_turn() -> None:
    arm = ab.Arm(build_mixed_tree(1, [Revolute, Prismatic, Spherical, Free]))
    sliders = arm_content(arm.robot, arm.neutral()).shown["joints"]["sliders"]
    assert [entry["name"] for entry in sliders] == [entry.name for entry in arm.robot.positions]
    for entry, (low, high) in zip(sliders, arm.robot.qlim, strict=True):
        assert entry["low"] < entry["high"] and np.isfinite([entry["low"], entry["high"]]).all()
        assert low in (entry["low"], -np.inf) and high in (entry["high"], np.inf)


def test_moved_quaternions_have_length_one() -> None:
    robot = build_mixed_tree(1, [Spherical])
    arm = ab.Arm(robot)
    q, poses = moved(robot, arm.neutral(), 0.3 * np.ones(arm.nq))
    assert np.allclose(arm.normalised(q), q) and np.allclose(poses, arm.link_poses(q))
    unchanged, _ = moved(robot, q, np.zeros(arm.nq))
    assert np.isfinite(arm.link_poses(unchanged)).all()


def test_closed_loops_stay_closed() -> None:
    robot = four_bar()
    arm = ab.Arm(robot)
    start = arm.assemble().q
    target = start + np.array([0.2, 0.0, 0.0])
    q, _ = moved(robot, start, target)
    assert q[0] == target[0] and np.abs(q[1:] - start[1:]).max() > 1e-3
    assert np.allclose(arm.assemble(q).q, q, atol=1e-8)
    impossible = start.copy()
    impossible[2] += 2.0  # the rocker cannot turn so far
    assert moved(robot, start, impossible)[0].tolist() == start.tolist()


def test_notebooks_get_widgets_with_sliders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arm_views, "in_notebook", lambda: True)
    arm = ab.load_robot("puma560")
    widget = arm.teach(Q)
    assert widget.q.tolist() == Q
    widget.joints = [0.5, *Q[1:]]  # as the front end does
    assert widget.q[0] == 0.5 and np.allclose(widget._poses["poses"], arm.link_poses(widget.q))
    widget.joints = [0.5]
    widget.joints = [float("nan")] * 6
    assert widget.q.tolist() == [0.5, *Q[1:]]
    widget.q = Q
    assert widget.joints == Q
    with pytest.raises(InputError, match="5 joint coordinates were given"):
        widget.q = Q[1:]
    motion = arm.animate(np.linspace(np.zeros(6), Q, 5), 0.1, size=(300, 200))
    assert motion._shown["play"] and motion.height == 200 and motion.q.tolist() == Q


def test_notebooks_are_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    class Module:
        def __init__(self, **functions: object) -> None:
            vars(self).update(functions)

    for name in ("IPython", "marimo"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    assert not arm_views.in_notebook()
    monkeypatch.setitem(sys.modules, "marimo", Module(running_in_notebook=lambda: True))
    assert arm_views.in_notebook()
    monkeypatch.delitem(sys.modules, "marimo")
    for shell, expected in ((None, False), (Module(), False), (Module(kernel=object()), True)):
        monkeypatch.setitem(sys.modules, "IPython", Module(get_ipython=lambda shell=shell: shell))
        assert arm_views.in_notebook() is expected
