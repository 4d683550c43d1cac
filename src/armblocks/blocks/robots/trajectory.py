"""Playback of a planned or measured joint motion from a table of positions, speeds and accelerations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from casadi import SX, if_else, vertcat

from armblocks.blocks.table_rows import BlockWithRows, TableRows
from armblocks.diagram import (
    ParameterKind,
    Port,
    Signals,
    TimeTable,
    WorkedExample,
    parameter,
)
from armblocks.diagram.signs import FaceSign, graph
from armblocks.errors import InputError, counted


@dataclass(frozen=True, kw_only=True)
class Trajectory(BlockWithRows):
    """A joint motion from a table: rows of t, q, qd, qdd, interpolated by quintics.

    ``trajectory.block()`` returns this block for any joint trajectory, and ``trajectory.save(path)`` writes
    its table.

    - All trajectories of armblocks up to the fifth degree are reproduced exactly: jtraj, lspb, mstraj,
      splines, jerk-limited motions.
    - Two rows with the same time are a jump of the accelerations. Each row is an event, so that no step
      passes over a jump.
    - Before the first row and after the last row the joints are at rest, at the positions of that row.
    """

    title: ClassVar[str] = "trajectory"
    sign: ClassVar[FaceSign] = graph((0, 0), (0.3, 0.05), (0.5, 0.6), (0.7, 0.5), (0.85, 1), (1, 1))
    example: ClassVar[WorkedExample] = WorkedExample(
        shows="Two joints pass a point after 2 s without stopping, and end at rest after 5 s.",
        parameters={
            "data": (
                (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
                (2.0, 1.0, 0.5, 0.3, 0.0, 0.0, 0.0),
                (5.0, 1.5, -0.5, 0.0, 0.0, 0.0, 0.0),
            )
        },
    )
    output_rates: ClassVar[Mapping[str, str]] = {"q": "qd", "qd": "qdd"}

    data: Any = parameter(
        ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0)),
        kind=ParameterKind.TABLE,
        of_type=TimeTable,
        tunable=True,
        doc="rows of a time (s), n positions, n speeds, n accelerations",
    )

    def check(self) -> None:
        width = self._size[1]
        if (width - 1) % 3:
            raise InputError(
                f"the table has {counted(width, 'column')}",
                where="Trajectory.data",
                allowed="1 + 3 n: the time, then n positions, n speeds and n accelerations",
                fix="use trajectory.block(), or a file of trajectory.save(path)",
            )

    def output_ports(self) -> tuple[Port, ...]:
        shape = ((self._size[1] - 1) // 3,)
        return (
            Port("q", "joint coordinates", "rad", shape),
            Port("qd", "joint speeds", "rad/s", shape),
            Port("qdd", "joint accelerations", "rad/s2", shape),
        )

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        table, n = self._rows(p), (self._size[1] - 1) // 3
        row, between = table.present(x["row"]), table.is_between(x["row"])
        next_row = table.present(row + 1.0)
        q0, qd0, qdd0 = _motion(table, row, n)
        q1, qd1, qdd1 = _motion(table, next_row, n)
        begin = table.entry(row, 0)
        h = if_else(between, table.entry(next_row, 0) - begin, 1.0)
        s = if_else(between, (t - begin) / h, 0.0)
        # The difference from the motion with constant acceleration qdd0 determines the powers 3 to 5 of s.
        a = (q1 - q0) - h * (qd0 + h * qdd0 / 2.0)
        b, c = h * (qd1 - qd0 - h * qdd0), h * h * (qdd1 - qdd0)
        cubic, fourth, fifth = (
            10.0 * a - 4.0 * b + c / 2.0,
            7.0 * b - 15.0 * a - c,
            6.0 * a - 3.0 * b + c / 2.0,
        )
        q = q0 + s * h * (qd0 + s * h * qdd0 / 2.0) + s * s * s * (cubic + s * (fourth + s * fifth))
        qd = qd0 + s * h * qdd0 + s * s * (3.0 * cubic + s * (4.0 * fourth + 5.0 * s * fifth)) / h
        qdd = qdd0 + s * (6.0 * cubic + s * (12.0 * fourth + 20.0 * s * fifth)) / (h * h)
        return {"q": q, "qd": if_else(between, qd, 0.0), "qdd": if_else(between, qdd, 0.0)}


def _motion(table: TableRows, row: SX, n: int) -> list[SX]:
    """Positions, speeds and accelerations (n, 1) of a row."""
    return [vertcat(*(table.entry(row, 1 + part * n + k) for k in range(n))) for part in range(3)]
