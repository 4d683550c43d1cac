"""Teaching of an arm: dragging its tool, motions through recorded poses, the workspace."""

from __future__ import annotations

from typing import Annotated, Generic, Literal

from pydantic import Field

from armblocks.studio.protocol.message import Message, ReplyT, Request
from armblocks.studio.protocol.messages.robots import Joints

Duration = Annotated[float, Field(ge=1e-3, le=3600.0, allow_inf_nan=False)]
Points = str
"""Numbers of many points: base64 of little-endian float32."""

# -- data ----------------------------------------------------------------------------------------------------


class Reached(Message):
    """The configuration of an arm whose tool was dragged.

    ``q`` (nq,) and the ``poses`` (L+2, 4, 4) of base, links and tool. ``reached``: whether the tool has the
    target; otherwise ``why`` is the reason. ``at_limit``: the coordinates at a limit. ``missing``: the
    directions that the joints cannot follow, such as ``turn about x``. ``tool``: the pose of the tool (16,).
    """

    q: list[float]
    poses: list[list[list[float]]]
    reached: bool
    why: str
    at_limit: list[str]
    missing: list[str]
    tool: list[float]


class JointPeaks(Message):
    """Extremes of one joint in a motion, with its limits, in rad or m, s, N m or N.

    ``lowest``, ``highest``: the extreme positions; ``low``, ``high``: the limits of the position. ``speed``,
    ``torque``: the largest magnitudes. A limit is ``None`` if it is unknown.
    """

    name: str
    unit: str
    lowest: float
    highest: float
    low: float | None
    high: float | None
    speed: float
    speed_limit: float | None
    torque: float
    torque_limit: float | None


class PlannedMotion(Message):
    """A motion through poses.

    ``time`` (N,) s, ``q``, ``qd``, ``qdd`` (N, n) in rad or m and s. ``poses`` (N, L+2, 12): the first three
    rows of the poses of base, links and tool. ``via``: the times of the recorded poses, s. ``tool_speed``:
    largest speed of the tool, m/s. ``rows``: the number L+2 of poses at each time. ``exceeded``: a
    sentence for each exceeded limit.
    """

    time: list[float]
    q: list[list[float]]
    qd: list[list[float]]
    qdd: list[list[float]]
    rows: int
    poses: Points
    via: list[float]
    tool_speed: float
    peaks: list[JointPeaks]
    exceeded: list[str]


# -- requests ------------------------------------------------------------------------------------------------


class TeachingRequest(Request[ReplyT], Generic[ReplyT]):
    """A request about the robot of a document."""

    document: str


class AskReach(TeachingRequest[Reached]):
    """Move the tool from its pose at ``q`` to ``target``, in the same configuration of the arm.

    ``target``: 16 numbers, the pose in the world row by row, m.
    """

    kind: Literal["reach"] = "reach"
    q: Joints
    target: Joints


class MotionRequest(TeachingRequest[ReplyT], Generic[ReplyT]):
    """A request about a motion through recorded poses of a robot.

    ``poses``: their names; the order is that of the robot, and ``None`` means all poses. ``course``: joint
    motions or straight lines of the tool, with a stop at each pose, or a spline in joint space without stops.
    ``duration`` s; ``None``: the shortest duration under the limits of speed and torque.
    """

    poses: list[str] | None = Field(default=None, max_length=10_000)
    course: Literal["joint", "line", "spline"]
    duration: Duration | None = None


class AskMotion(MotionRequest[PlannedMotion]):
    """Plan the motion, for its display."""

    kind: Literal["motion"] = "motion"


class AskMotionRows(MotionRequest[list[list[float]]]):
    """Return the motion as the parameter of a Trajectory block: rows of t, q, qd, qdd."""

    kind: Literal["motion_rows"] = "motion_rows"


class SaveMotion(MotionRequest[str]):
    """Write the motion as a CSV file of the project folder. The reply is its path."""

    kind: Literal["save_motion"] = "save_motion"
    path: str = Field(max_length=400)
    overwrite: bool = False


class AskWorkspace(TeachingRequest[Points]):
    """Return positions of the tool (N, 3) m at random configurations within the limits."""

    kind: Literal["workspace"] = "workspace"
