"""The studio's views in a notebook: the scopes of a run, and the arm, with one time cursor.

The widgets follow the protocol of anywidget, so Jupyter, VS Code, Colab and marimo show them. They contain
all scripts and styles that they need; nothing is downloaded.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.diagram import Diagram, View, ViewKind, diagram_views
from armblocks.errors import InputError, check_type
from armblocks.extras import from_extra
from armblocks.face.arm import Arm
from armblocks.face.model import CompiledDiagram, given_diagram
from armblocks.face.robots import given_arm
from armblocks.robot import Robot
from armblocks.simulation import SimulationResult
from armblocks.studio.built_page import built_page
from armblocks.studio.protocol.frames import sample_frame
from armblocks.studio.robots.scene import link_frames_of
from armblocks.studio.view_content import ViewContent, arm_content, moved

Array = NDArray[np.float64]

if TYPE_CHECKING:
    from anywidget import AnyWidget

HEIGHT = 460
"""Default height of a widget, px."""
PARTS = ("scopes", "robot")
DISPLAYED_KINDS = (ViewKind.TRACES, ViewKind.PATH, ViewKind.ROBOT)
SCRIPT = Path(__file__).parent / "notebook_widget.js"


def run_widget(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    result: SimulationResult,
    *,
    show: str | None = None,
    height: int = HEIGHT,
) -> AnyWidget:
    """Show the record of a run of ``diagram`` as the studio does: scopes, the arm, a time cursor.

    ``show`` selects ``"scopes"`` or ``"robot"``; ``None`` shows both. ``height`` is in pixels. Widgets of one
    result share a time cursor; ``widget.time`` (s) reads and sets it. Raises ``InputError`` if the diagram
    has nothing to show, ``MissingLibraryError`` if anywidget is not installed.
    """
    diagram = given_diagram(diagram, "run_widget")
    check_type(result, SimulationResult, "the result of simulate", where="run_widget")
    if show not in (None, *PARTS):
        raise InputError(
            f"show is {show!r}",
            where="run_widget",
            allowed="'scopes', 'robot', or None for both",
            fix="omit it for both",
        )
    views = [(name, view) for name, view in diagram_views(diagram) if view.kind in DISPLAYED_KINDS]
    robots = [(name, view.subject) for name, view in views if isinstance(view.subject, Robot)]
    arm = _arm(*robots[0]) if robots and show != "scopes" else None
    scopes = show != "robot" and any(view.kind is not ViewKind.ROBOT for _, view in views)
    if arm is None and not scopes:
        raise InputError(
            f"diagram '{diagram.name}' has nothing to show here",
            where="run_widget",
            fix="add a Scope, an XY Graph or a Robot Plot",
        )
    key, run, frame = _record(views, result)
    content = {"key": key, "run": run, "scopes": scopes, "arm": arm}
    return _widget(f"Run of {diagram.name}", height, content, frame)


def robot_widget(
    robot: Arm | Robot | str | PathLike[str], q: ArrayLike | None = None, *, height: int = HEIGHT
) -> AnyWidget:
    """Show an arm at the joint coordinates ``q`` (nq,), rad or m, with a slider for each of them.

    The default is the neutral configuration. ``widget.q`` reads and sets the coordinates.

    Raises ``InputError`` for a wrong number of coordinates, ``MissingLibraryError`` if anywidget is not
    installed.
    """
    described = given_arm(robot, "robot_widget").robot
    coordinates = described.neutral if q is None else np.asarray(q, dtype=np.float64)
    link_frames_of(described, coordinates.tolist())  # raises for a wrong number of coordinates
    return content_widget(arm_content(described, coordinates), height)


def content_widget(content: ViewContent, height: int) -> AnyWidget:
    """A widget with an arm: sliders, or a motion. ``widget.q`` reads and sets the coordinates."""
    widget = _widget(content.title, height, content.shown, content.frame)
    widget.follow(content.robot, content.q)
    return widget


def _arm(path: str, robot: Robot) -> dict[str, Any]:
    return {**arm_content(robot, robot.neutral).shown["arm"], "path": path}


def _record(views: Sequence[tuple[str, View]], result: SimulationResult) -> tuple[str, dict[str, Any], bytes]:
    """Key, description and rows of the signals in the views, with jumps, in the format of the front end."""
    result = result.with_jumps()
    signal_names = [f"{name}/{signal}" for name, view in views for signal in view.signals]
    aliases = {name: result.resolve(name) for name in signal_names}
    names = list(dict.fromkeys(aliases.values()))
    # A block with one output names its signal in legends, as in the studio.
    blocks = {name.rpartition("/")[0]: name for name in names}
    aliases |= {block: name for block, name in blocks.items() if result.aliases.get(block) == name}
    values = [np.asarray(result[name], dtype=np.float64) for name in names]
    signals = np.concatenate([value.reshape(result.time.size, -1).T for value in values])
    run = {
        "stopTime": float(result.time[-1]),
        "channels": [
            {
                "name": slot.name,
                "shape": list(slot.shape),
                "unit": slot.unit,
                "entries": list(slot.entries),
                "title": slot.title,
            }
            for slot in (result.signals_layout[name] for name in names)
        ],
        "views": [
            {
                "block": name,
                "kind": view.kind.value,
                "signals": list(view.signals),
                "labels": list(view.labels),
                "title": view.title,
            }
            for name, view in views
        ],
        "aliases": aliases,
    }
    # The key is a hash of the samples, so that all widgets of one result share it.
    key = hashlib.sha256(result.name.encode() + result.time.tobytes() + signals.tobytes()).hexdigest()[:16]
    return key, run, sample_frame(key, 0, result.time, signals)


def _widget(title: str, height: int, content: dict[str, Any], frame: bytes) -> Any:
    return _widget_class()(title=title, height=height, _shown=content, _frame=frame, _page=_page())


@cache
def _page() -> str:
    """Return the HTML document of the iframe, with its script and styles inline."""
    folder = built_page() / "notebook"
    script = (folder / "frame.js").read_text(encoding="utf-8").replace("</script", "<\\/script")
    styles = (folder / "frame.css").read_text(encoding="utf-8").replace("</style", "<\\/style")
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><style>{styles}</style>'
        f'<body><div id="root"></div><script>{script}</script>'
    )


@cache
def _widget_class() -> type[AnyWidget]:
    with from_extra("notebook", "widgets in notebooks"):
        import anywidget
        import traitlets

    class StudioWidget(anywidget.AnyWidget):
        """An iframe with views of the studio."""

        _esm = SCRIPT
        _page = traitlets.Unicode().tag(sync=True)
        _shown = traitlets.Dict().tag(sync=True)
        _frame = traitlets.Bytes().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        time = traitlets.Float(None, allow_none=True).tag(sync=True)
        joints = traitlets.List(traitlets.Float()).tag(sync=True)
        _poses = traitlets.Dict(None, allow_none=True).tag(sync=True)
        _live = traitlets.Bool(True).tag(sync=True)

        def follow(self, robot: Robot, q: Array) -> None:
            """Compute the poses of a robot at the coordinates that the sliders or Python set."""
            self._robot, self._q = robot, q
            self.joints = q.tolist()
            self.observe(self._move, "joints")

        @property
        def q(self) -> Array:
            """The coordinates (nq,) at the sliders, rad or m."""
            return self._q.copy()

        @q.setter
        def q(self, value: ArrayLike) -> None:
            coordinates = np.asarray(value, dtype=np.float64)
            link_frames_of(self._robot, coordinates.tolist())
            self.joints = coordinates.tolist()

        def _move(self, change: Any) -> None:
            q = np.asarray(change["new"], dtype=np.float64)
            if q.shape != self._q.shape or not np.isfinite(q).all():
                return
            self._q, poses = moved(self._robot, self._q, q)
            self._poses = {"q": self._q.tolist(), "poses": poses}

    return StudioWidget
