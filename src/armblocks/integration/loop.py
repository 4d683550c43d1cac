"""The whole loop of a one-step method as one native function, which calls the functions of a system.

One call takes many steps: stages, error estimate, step control, recorded samples, ticks, events and
restarts at breakpoints, without returning to Python. The whole state of the loop is in two flat arrays
(:mod:`armblocks.integration.workspace`). A run can therefore stop after any number of steps and continue with
bitwise identical results.

The loop has three parts. A :class:`~armblocks.integration.method.Method` computes a step.
:class:`~armblocks.integration.step_control.Steps` chooses the step size. A
:class:`~armblocks.integration.schedule.Schedule` determines where steps end and the actions there. The
schedule is :class:`~armblocks.integration.segments.Segments` for a system without ticks and events, else
:class:`~armblocks.integration.instants.Instants` with its clocks, events and delayed signals.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.delay_history import DelayHistory
from armblocks.integration.elimination_plan import JacobianPattern
from armblocks.integration.evaluation import Evaluation
from armblocks.integration.explicit_method import ExplicitMethod
from armblocks.integration.frame import Arrays, Frame
from armblocks.integration.instants import Instants
from armblocks.integration.linear_equations import LinearEquationsLayout
from armblocks.integration.method import Method
from armblocks.integration.records import Records
from armblocks.integration.rosenbrock_method import RosenbrockMethod
from armblocks.integration.rosenbrock_tableau import Tableau
from armblocks.integration.schedule import INSTANT, START, STEP, TICKS, Schedule
from armblocks.integration.segments import Segments
from armblocks.integration.step_control import Steps
from armblocks.integration.workspace import Count, LoopSizes, Stage, Status, Workspace
from armblocks.routines.llvm import definitions
from armblocks.routines.memory import Integers, Reals
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer

POINTERS = 13
"""Number of arrays among the arguments of the loop; the last argument is the maximum number of steps."""


@lru_cache(maxsize=64)
def loop_text(tableau: Tableau, sizes: LoopSizes, pattern: JacobianPattern | None) -> Mapping[str, str]:
    """LLVM IR of the loop ``advance`` and its functions, by symbol.

    Systems with the same tableau, sizes and pattern of the Jacobian share the IR.
    """
    program = Program()
    layout = None if pattern is None else LinearEquationsLayout(pattern)
    define_loop(program, "advance", tableau, Workspace(tableau, sizes), sizes, layout)
    return definitions(program)


def define_loop(
    program: Program,
    symbol: str,
    tableau: Tableau,
    workspace: Workspace,
    sizes: LoopSizes,
    layout: LinearEquationsLayout | None = None,
) -> None:
    """Define the loop of a method for a system. The loop returns a ``Status``.

    The system's functions (:mod:`armblocks.integration.system_functions`) are external. ``layout`` is the
    memory for the linear equations of a Rosenbrock method.
    """

    def loop(
        r: Routine,
        reals: Reals,
        counts: Integers,
        p: Reals,
        samples: Reals,
        ends: Reals,
        clamps: Reals,
        out: Reals,
        out_z: Reals,
        out_w: Reals,
        jumps: Reals,
        saved_reals: Reals,
        saved_counts: Integers,
        scratch: Reals,
        max_steps: Integer,
    ) -> Integer:
        arrays = Arrays(
            reals=reals,
            counts=counts,
            p=p,
            samples=samples,
            ends=ends,
            clamps=clamps,
            out=out,
            out_z=out_z,
            out_w=out_w,
            jumps=jumps,
            saved_reals=saved_reals,
            saved_counts=saved_counts,
            scratch=scratch,
            max_steps=max_steps,
        )
        frame = Frame(r, arrays, workspace, sizes)
        _Loop(frame, tableau, layout).write()
        return frame.status.value

    program.define(loop, symbol, public=True, distinct=True)


class _Loop:
    """Combines the parts and emits them in order of execution."""

    def __init__(self, frame: Frame, tableau: Tableau, layout: LinearEquationsLayout | None) -> None:
        self.frame = frame
        r, sizes, workspace = frame.r, frame.sizes, frame.workspace
        history = DelayHistory(r.program, workspace, sizes) if sizes.delays else None
        evaluation = Evaluation(frame, history)
        self.method = _method(frame, tableau, evaluation, layout)
        point = r.real(0.0)
        records = Records(frame, self.method, evaluation, point.memory)
        self.records = records
        self.schedule: Schedule
        if sizes.hybrid:
            self.schedule = Instants(frame, self.method, records, evaluation, point)
        else:
            self.schedule = Segments(frame, self.method, records)
        self.steps = Steps(frame, self.method, records, self.schedule)

    def write(self) -> None:
        """Emit the body of the loop. At its end, the variables are stored in the arrays."""
        f, r = self.frame, self.frame.r
        with r.part() as f.body, r.stages(INSTANT, TICKS, START, STEP) as stages:
            self.schedule.enter(stages)
            stages.begin(START)
            self.start()
            stages.begin(STEP)
            continues = (f.steps_of_call.value < f.arrays.max_steps) & (f.time.value < f.pause)
            f.leave_unless(continues, Status.PAUSED)
            self.records.ensure_capacity()
            self.schedule.before_step()
            self.steps.write()
            self.schedule.accept(stages)
        f.store_variables()

    def start(self) -> None:
        """Evaluate the derivative at the start of a segment, record samples there, choose the step size."""
        f, method = self.frame, self.method
        time = f.time.value
        method.evaluate(time, method.x, 0)
        self.records.samples(time, time, None)
        f.leave_unless(method.sums.all_finite(method.K(0)), Status.NON_FINITE_START)
        if method.tableau.adaptive:
            self.schedule.first_step(time)
        f.count[Count.STAGE].value = Stage.RUNNING


def _method(
    frame: Frame, tableau: Tableau, evaluation: Evaluation, layout: LinearEquationsLayout | None
) -> Method:
    if isinstance(tableau, ButcherTableau):
        return ExplicitMethod(frame, tableau, evaluation)
    assert layout is not None
    return RosenbrockMethod(frame, tableau, evaluation, layout)
