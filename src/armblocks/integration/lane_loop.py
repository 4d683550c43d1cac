"""The loop of explicit methods over many runs, with a run in each lane of the vector registers.

The runs have different parameters, start values and steps. A lane repeats a rejected step with its next
trial, while the other lanes continue; a lane whose run has ended takes the next run. The operations of a
lane are those of the loop of a single run (:mod:`armblocks.integration.loop`) in the same order, so the
results are bit-identical. Runs that need anything else, such as another method or the error of a failed step,
end with a status other than ``DONE``, and the caller computes them alone.
"""

from __future__ import annotations

from collections.abc import Callable

from armblocks.compiler.ir_text import Module
from armblocks.compiler.lane_function import emit_lane_function
from armblocks.compiler.native import NativeCode, load_code
from armblocks.compiler.program_text import add_program
from armblocks.compiler.tape import Tape
from armblocks.integration.butcher_tableau import ButcherTableau
from armblocks.integration.lane_frame import Row, SharedCount, SharedPlace
from armblocks.integration.lane_runs import LaneFunctions
from armblocks.integration.lane_step import LaneStep
from armblocks.integration.workspace import LoopSizes, Status
from armblocks.routines.lanes import LaneArray
from armblocks.routines.memory import Addresses
from armblocks.routines.routine import Program, Routine
from armblocks.routines.values import Integer


def lane_code(
    sizes: LoopSizes, digest: str, tape: Callable[[], Tape], tableau: ButcherTableau, lanes: int
) -> NativeCode:
    """The loop of a system without ticks and events, as function ``runs`` of the arguments of
    :func:`define_lane_loop`. ``digest`` and ``tape``: of the derivative."""

    def write() -> str:
        module = Module()
        emit_lane_function(module, tape(), "lane_derivative", lanes, reports_unsupported=True)
        program = Program(lanes)
        define_lane_loop(program, "runs", tableau, sizes)
        add_program(module, program)
        return module.text

    return load_code(("runs in lanes", tableau.content, repr(sizes), str(lanes), digest), write)


def define_lane_loop(program: Program, symbol: str, tableau: ButcherTableau, sizes: LoopSizes) -> None:
    """Define the loop ``(memory, addresses, first, stop)`` over the runs ``first`` to ``stop - 1``.

    ``memory`` has the rows of :class:`LaneWorkspace`; ``addresses`` is the table of :class:`SharedPlace`.
    """
    assert not sizes.hybrid
    functions = LaneFunctions(program, tableau, sizes)

    def runs(r: Routine, memory: LaneArray, addresses: Addresses, first: Integer, stop: Integer) -> None:
        counts = addresses[SharedPlace.COUNTS].integers
        counts[SharedCount.NEXT_RUN], counts[SharedCount.STOP_RUN] = first, stop
        for lane in r.range(0, program.lanes):
            r.call(functions.take, memory, addresses, lane)
        with r.loop() as iteration:
            starting, running = memory[Row.STARTING] > 0.0, memory[Row.RUNNING] > 0.0
            with r.when(starting.any, rarely=True):
                r.call(functions.start, memory, addresses)
                iteration.again()
            iteration.leave_unless(running.any)
            over = running & (memory[Row.ACCEPTED].bits() >= memory[Row.ALLOWED].bits())
            with r.when(over.any, rarely=True):
                r.call(functions.end_runs, memory, addresses, over.bits(), r.constant_integer(Status.PAUSED))
                iteration.again()
            LaneStep(r, functions, memory, addresses, running).write()

    program.define(runs, symbol, public=True)
