"""Robot kernels compared with Pinocchio in one process: batches, single calls, operation counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from measure import Timing, in_turn
from urdf import to_urdf

import armblocks as ab

N = 100_000
SINGLE = 2_000


@dataclass(frozen=True)
class Comparison:
    """One row of a table: the times of another program and of armblocks, in seconds per evaluation."""

    name: str
    peer: str
    theirs: Timing
    ours: Timing
    target: float

    @property
    def ratio(self) -> float:
        return self.ours.times_faster_than(self.theirs)


@dataclass(frozen=True)
class Agreement:
    """Largest relative difference between the results of armblocks and Pinocchio."""

    name: str
    error: float


class Case:
    """One robot without friction (Pinocchio has none), with the same random states for both libraries."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.arm = ab.load_robot(name).nofriction("all")
        robot = self.arm.robot
        self.model = pin.buildModelFromXML(to_urdf(robot))
        self.model.armature = np.array(
            [
                0.0 if link.motor is None else link.motor.gear_ratio**2 * link.motor.inertia
                for link in robot.links
            ]
        )
        self.model.gravity.linear = np.array(robot.gravity)
        self.data = self.model.createData()
        self.tip = self.model.getFrameId("tip")
        n = self.arm.n
        draw = [np.random.default_rng((0, k)).uniform(-h, h, (N, n)) for k, h in enumerate((np.pi, 2.0, 5.0))]
        self.q, self.qd, self.qdd = draw
        self.tau = self.arm.rne(self.q, self.qd, self.qdd)

    # ---- results of Pinocchio for one state ------------------------------------------------------------
    def tip_pose(self, q: np.ndarray) -> np.ndarray:
        pin.forwardKinematics(self.model, self.data, q)
        return pin.updateFramePlacement(self.model, self.data, self.tip).homogeneous

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        return pin.computeFrameJacobian(self.model, self.data, q, self.tip, pin.LOCAL_WORLD_ALIGNED)

    def agreement(self) -> list[Agreement]:
        """Compare 200 states: the largest difference, relative to the largest entry."""
        arm, k = self.arm, 200
        q, qd, qdd, tau = (x[:k] for x in (self.q, self.qd, self.qdd, self.tau))
        pairs = {
            "fkine": (arm.fkine(q), [self.tip_pose(x) for x in q]),
            "jacob0": (arm.jacob0(q), [self.jacobian(x).copy() for x in q]),
            "inertia": (arm.inertia(q), [pin.crba(self.model, self.data, x).copy() for x in q]),
            "rne": (
                arm.rne(q, qd, qdd),
                [pin.rnea(self.model, self.data, *x).copy() for x in zip(q, qd, qdd)],
            ),
            "accel": (
                arm.accel(q, qd, tau),
                [pin.aba(self.model, self.data, *x).copy() for x in zip(q, qd, tau)],
            ),
        }
        return [
            Agreement(f"{self.name} {name}", float(np.abs(ours - theirs).max() / np.abs(theirs).max()))
            for name, (ours, theirs) in pairs.items()
        ]

    # ---- batches ---------------------------------------------------------------------------------------
    def batches(self, repeats: int) -> list[Comparison]:
        arm, n = self.arm, self.arm.n
        pool = pin.ModelPool(self.model, 2)
        columns = [np.asfortranarray(x.T) for x in (self.q, self.qd, self.qdd, self.tau)]
        theirs_out = np.zeros((n, N), order="F")
        out = np.empty((N, n))
        q, qd, qdd, tau = self.q, self.qd, self.qdd, self.tau
        tau_columns = columns.pop()

        rows = [
            self._row(
                "rne, batch, 1 thread",
                "pinocchio rneaInParallel, 1 thread",
                lambda: pin.rneaInParallel(1, pool, *columns, theirs_out),
                lambda: arm.rne(q, qd, qdd, out=out),
                50,
                repeats,
            ),
            self._row(
                "accel, batch, 1 thread",
                "pinocchio abaInParallel, 1 thread",
                lambda: pin.abaInParallel(1, pool, columns[0], columns[1], tau_columns, theirs_out),
                lambda: arm.accel(q, qd, tau, out=out),
                40,
                repeats,
            ),
        ]
        part = 5_000
        pose, jacobian, mass = np.empty((N, 4, 4)), np.empty((N, 6, n)), np.empty((N, n, n))
        loops: dict[str, tuple[Callable[[np.ndarray], object], Callable[[], object]]] = {
            "fkine": (self.tip_pose, lambda: arm.fkine(q, out=pose)),
            "jacob0": (self.jacobian, lambda: arm.jacob0(q, out=jacobian)),
            "inertia": (lambda x: pin.crba(self.model, self.data, x), lambda: arm.inertia(q, out=mass)),
        }
        for name, (single, batch) in loops.items():
            states = list(q[:part])
            loop, ours = in_turn([lambda: [single(x) for x in states], batch], repeats)  # noqa: B023
            rows.append(
                Comparison(
                    f"{self.name} {name}, batch, 1 thread",
                    "pinocchio in a Python loop",
                    loop.per(part),
                    ours.per(N),
                    25,
                )
            )
        for name, work in {
            "rne": lambda threads: arm.rne(q, qd, qdd, out=out, threads=threads),
            "accel": lambda threads: arm.accel(q, qd, tau, out=out, threads=threads),
        }.items():
            one, two = in_turn([lambda: work(1), lambda: work(2)], 2 * repeats + 1)  # noqa: B023
            rows.append(
                Comparison(
                    f"{self.name} {name}, batch, 2 threads",
                    "armblocks, 1 thread",
                    one.per(N),
                    two.per(N),
                    1.8,
                )
            )
        return rows

    def _row(
        self,
        name: str,
        peer: str,
        theirs: Callable[[], object],
        ours: Callable[[], object],
        target: float,
        repeats: int,
    ) -> Comparison:
        a, b = in_turn([theirs, ours], repeats)
        return Comparison(f"{self.name} {name}", peer, a.per(N), b.per(N), target)

    # ---- single calls ----------------------------------------------------------------------------------
    def singles(self, repeats: int) -> list[Comparison]:
        arm, model, data = self.arm, self.model, self.data
        q, qd, qdd = (list(x[:SINGLE]) for x in (self.q, self.qd, self.qdd))
        rne, fkine = arm.rne, arm.fkine
        rnea, forward, update, tip = pin.rnea, pin.forwardKinematics, pin.updateFramePlacement, self.tip

        def their_rne() -> None:
            for x, v, a in zip(q, qd, qdd):
                rnea(model, data, x, v, a)

        def our_rne() -> None:
            for x, v, a in zip(q, qd, qdd):
                rne(x, v, a)

        def their_fkine() -> None:
            for x in q:
                forward(model, data, x)

        def their_tip() -> None:
            for x in q:
                forward(model, data, x)
                update(model, data, tip)

        def our_fkine() -> None:
            for x in q:
                fkine(x)

        functions = [their_rne, our_rne, their_fkine, their_tip, our_fkine]
        a, b, c, d, e = (timing.per(SINGLE) for timing in in_turn(functions, repeats, warm=2))
        return [
            Comparison(f"{self.name} rne, single call", "pinocchio.rnea", a, b, 3),
            Comparison(
                f"{self.name} fkine, single call", "forwardKinematics (all joints, no tool pose)", c, e, 3
            ),
            Comparison(
                f"{self.name} fkine, single call", "forwardKinematics + updateFramePlacement", d, e, 3
            ),
        ]


def share(case: Case, name: str, peak: float, repeats: int) -> list[str]:
    """Table cells of one kernel: operations, batch time per evaluation, fraction of the arithmetic peak."""
    kernel = getattr(case.arm, name)
    count = case.arm.operation_count(name)
    inputs = {
        "rne": (case.q, case.qd, case.qdd),
        "accel": (case.q, case.qd, case.tau),
        "coriolis": (case.q, case.qd),
    }
    arguments = inputs.get(name, (case.q,))
    out = np.empty_like(kernel(*arguments))
    [timing] = in_turn([lambda: kernel(*arguments, out=out)], repeats)
    seconds = timing.median / N
    operations = count.multiplies + count.adds + 2 * count.fused_multiply_adds
    return [
        str(count.multiplies),
        str(count.adds),
        str(count.fused_multiply_adds),
        str(count.divisions + count.square_roots),
        str(count.function_calls),
        f"{seconds * 1e9:.1f} ns",
        f"{operations / seconds / peak:.0%}",
    ]
