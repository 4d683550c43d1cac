"""Frames of SDF models: which frame a pose is relative to, and which link a frame is attached to.

Source: sdformat.org, *Pose Frame Semantics: Terminology and Behavior*. A name is searched in the scope of its
model (or world); ``a::b`` is the frame b of the nested model a, ``__model__`` the frame of the model. The
defaults apply to all versions; attributes that name other frames exist since SDF 1.7.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from armblocks.errors import FormatError, UnknownNameError
from armblocks.formats.file_findings import FileContext
from armblocks.formats.sdf.rules import FRAME
from armblocks.formats.sdf.values import pose_of, text_in
from armblocks.formats.xml_elements import Element, note, shortened
from armblocks.spatial import Transform

MODEL_FRAME = "__model__"
WORLD = "world"
MAX_FRAMES = 5000
"""Maximum number of names in a model."""


class Source(NamedTuple):
    """The ``version`` of SDF and the ``folder`` of the file that an element is in."""

    version: tuple[int, int]
    folder: Path | None

    @property
    def before_frames(self) -> bool:
        """Whether the version is older than SDF 1.7, which introduced frames."""
        return self.version < (1, 7)


@dataclass(eq=False, kw_only=True, repr=False)
class Frame:
    """The frame of a link, joint, ``<frame>``, model or world.

    ``kind``: the tag of its element, or ``merged`` for the frame of a model whose content became a part of
    another model. ``name`` includes the names of nested models. ``scope``: the names that its element can
    refer to. ``model_frame``: the meaning of ``__model__`` in this element. ``pose``: its ``<pose>``.
    ``inner``: the scope inside a model. ``placement``: the name of the frame inside a model to which the pose
    applies.
    """

    kind: str
    name: str
    element: Element
    source: Source
    scope: Scope
    model_frame: Frame | None = None
    pose: Element | None = None
    inner: Scope | None = None
    placement: str = ""


@dataclass(eq=False, kw_only=True, repr=False)
class Scope:
    """The names inside a model or a world.

    ``frame``: the frame of the model or world. ``fixed``: the model is static, or a part of a static model.
    ``prefix``: the beginning of the full names. ``canonical``: the name of the link to which the frame of the
    model is attached.
    """

    prefix: str = ""
    fixed: bool = False
    canonical: str = ""
    names: dict[str, Frame] = field(default_factory=dict[str, Frame])
    frame: Frame = field(init=False)

    def frames(self, kind: str) -> Iterator[Frame]:
        """The frames of a kind in this scope and in nested models, in the order of the files."""
        for frame in self.names.values():
            if frame.kind == kind:
                yield frame
            if frame.inner is not None:
                yield from frame.inner.frames(kind)

    def add(self, key: str, frame: Frame) -> None:
        """Add a name. Raises ``FormatError`` if it exists.

        Before SDF 1.7, a joint may have the name of a link, and elements may be named ``world``. Poses of
        these files cannot refer to joints, which therefore get keys that no link has.
        """
        if frame.source.before_frames and frame.kind == "joint":
            key = f"joint {key}"
        reserved = () if frame.source.before_frames else (MODEL_FRAME, WORLD)
        if key in self.names or key in reserved:
            place = f" in line {self.names[key].element.line}" if key in self.names else ""
            raise frame.element.error(
                f"there is another element of this name{place}", allowed="unique names", fix="rename it"
            )
        if len(self.names) >= MAX_FRAMES:
            raise frame.element.error(
                "the model has too many links, joints and frames", allowed=f"at most {MAX_FRAMES}"
            )
        self.names[key] = frame


class Frames:
    """Poses of frames, and the links that they are attached to."""

    def __init__(self, context: FileContext) -> None:
        self.context = context
        self._steps: dict[Frame, tuple[Frame, Transform]] = {}
        self._computing: list[Frame] = []
        self._bodies: dict[Frame, Frame] = {}

    def lookup(self, owner: Frame, name: str, element: Element) -> Frame:
        """The frame that ``name`` means in an element of ``owner``. Raises ``UnknownNameError``."""
        return self._lookup(owner.scope, owner.model_frame, name, element)

    def _lookup(self, scope: Scope, model_frame: Frame | None, name: str, element: Element) -> Frame:
        if name == MODEL_FRAME and model_frame is not None:
            return model_frame
        if name in scope.names:  # before SDF 1.7, names may have the separator in them, or be "world"
            return scope.names[name]
        if name == WORLD:
            return _world(scope)
        *models, last = name.split("::")
        inside: Scope | None = scope
        for model in models:
            entry = inside.names.get(model) if inside is not None else None
            inside = entry.inner if entry is not None else None
        if inside is not None and models and last == MODEL_FRAME:
            return inside.frame
        if inside is None or last not in inside.names:
            raise UnknownNameError("frame", name, scope.names, where=element.where)
        return inside.names[last]

    def between(self, a: Frame, b: Frame) -> Transform:
        """``T_ab``: the pose of frame b in frame a, in the initial configuration.

        The common part of the chains of both frames is not computed, so that the default pose of a joint on
        its child link is exactly the identity.
        """
        chain_a, chain_b = self._chains(a, b)
        T_b = self._product(chain_b)
        return T_b if not chain_a else self._product(chain_a).inverse() @ T_b

    def inside(self, link: Frame, pose: Element | None) -> Transform:
        """The pose in a link of an element of the link, such as a visual."""
        value = pose_of(pose, self.context, old=link.source.before_frames)
        if pose is None or not value.relative_to:
            return value.transform
        return self.between(link, self._relative_to(link, value.relative_to, pose, link)) @ value.transform

    def body(self, frame: Frame) -> Frame:
        """The link to which a frame is attached, directly or through other frames; the frame of the world if
        the frame does not move."""
        path: list[Frame] = []
        while frame not in self._bodies:
            if frame in path:
                raise _cycle([*path[path.index(frame) :], frame], "attached to")
            path.append(frame)
            carrier = self._carrier(frame)
            if frame.kind in (WORLD, "link"):
                self._bodies[frame] = frame
            frame = carrier
        for step in path:
            self._bodies[step] = self._bodies[frame]
        return self._bodies[frame]

    def _carrier(self, frame: Frame) -> Frame:
        """The frame to which a frame is attached; a link or the world is returned unchanged."""
        if frame.kind in (WORLD, "link"):
            return frame
        if frame.kind in ("joint", "frame"):
            return self._default(frame)
        if frame.kind == "merged":
            return frame.scope.frame
        inner = frame.inner
        assert inner is not None
        if inner.fixed:
            return _world(inner)
        if inner.canonical:
            return self._lookup(inner, frame, inner.canonical, frame.element)
        entries = [
            entry for kind in ("link", "model") for entry in inner.names.values() if entry.kind == kind
        ]
        if not entries:
            raise frame.element.error("the model has no links", allowed="<link name=…>")
        return entries[0]

    def _default(self, frame: Frame) -> Frame:
        """The frame that the pose of ``frame`` is relative to if it names none."""
        if frame.kind == "joint":
            return self.lookup(frame, text_in(frame.element, "child"), frame.element)
        attached_to = frame.element.attributes.get("attached_to", "").strip() if frame.kind == "frame" else ""
        if attached_to:
            return self.lookup(frame, attached_to, frame.element)
        return frame.model_frame or _world(frame.scope)

    def _chains(self, a: Frame, b: Frame) -> tuple[list[Frame], list[Frame]]:
        """The frames from a and from b to the first frame that both are relative to, without this frame.

        Both chains are extended alternately, so that the effort depends only on the distance of the frames.
        """
        chains: tuple[dict[Frame, None], dict[Frame, None]] = ({a: None}, {b: None})
        ends = [a, b]
        while True:
            for own, other in ((0, 1), (1, 0)):
                if ends[own] in chains[other]:
                    first, second = ([*chain] for chain in chains)
                    return first[: first.index(ends[own])], second[: second.index(ends[own])]
                if ends[own].kind == WORLD:
                    continue
                ends[own], _ = self._step(ends[own])
                if ends[own] in chains[own]:
                    names = list(chains[own])
                    raise _cycle([*names[names.index(ends[own]) :], ends[own]], "relative to")
                chains[own][ends[own]] = None

    def _product(self, chain: list[Frame]) -> Transform:
        """The pose of the first frame in the frame that follows the last frame."""
        product = Transform()
        for frame in chain:
            product = self._step(frame)[1] @ product
        return product

    def _step(self, frame: Frame) -> tuple[Frame, Transform]:
        """The frame that the pose of ``frame`` is relative to, and the pose in it."""
        if frame not in self._steps:
            if frame in self._computing:
                raise _cycle([*self._computing[self._computing.index(frame) :], frame], "placed by")
            self._computing.append(frame)
            try:
                self._steps[frame] = self._computed_step(frame)
            finally:
                self._computing.pop()
        return self._steps[frame]

    def _computed_step(self, frame: Frame) -> tuple[Frame, Transform]:
        value = pose_of(frame.pose, self.context, old=frame.source.before_frames)
        parent, placed_at = self._default(frame), value.transform
        if frame.pose is not None and value.relative_to:
            parent = self._relative_to(frame, value.relative_to, frame.pose, parent)
        if frame.placement:
            scope = frame.inner or frame.scope
            placed = self._lookup(scope, frame, frame.placement, frame.element)
            chain = [placed]
            while chain[-1] is not frame:
                step, _ = self._step(chain[-1])
                if step in chain or step.kind == WORLD:
                    raise _cycle([*chain, step], "placed by")
                chain.append(step)
            placed_at = placed_at @ self._product(chain[:-1]).inverse()
        return parent, placed_at

    def _relative_to(self, owner: Frame, name: str, pose: Element, default: Frame) -> Frame:
        """The frame that the pose of an element of ``owner`` names."""
        try:
            return self.lookup(owner, name, pose)
        except UnknownNameError:
            if not owner.source.before_frames:
                raise
            what = f"there is no frame '{shortened(name)}'; the pose is read without it"
            note(self.context, FRAME, pose, what, owner.element.label)
            return default


def _world(scope: Scope) -> Frame:
    frame = scope.frame
    while frame.kind != WORLD:
        frame = frame.scope.frame
    return frame


def _cycle(frames: list[Frame], relation: str) -> FormatError:
    names = " -> ".join(shortened(frame.name or frame.kind) for frame in frames[:8])
    return frames[0].element.error(
        f"frames are {relation} each other: {names}",
        allowed="chains of frames that end at the model",
        fix="correct one of these frames",
    )
