"""The exact linear system of a hybrid system at an operating point.

Between ticks the implicit function theorem eliminates the unknowns::

    dw = -r_w^-1 (r_x dx + r_z dz + r_p du)        dx' = A dx + Z dz + B du       dy = C dx + E dz + D du

Without clocks ``dz = 0``: modes are constant. With clocks the system is sampled once a period, the least
common multiple of the periods of all clocks. Its state is ``x`` and the part of ``z`` that clocks update,
just before the first tick of the period. The inputs are held over the period. The map over one period is a
product: the derivatives of ``update`` for each tick, and a matrix exponential for each interval between
ticks. The map is therefore exact. Source, for one clock: Franklin, Powell, Workman, Digital Control of
Dynamic Systems, 3rd ed., 4.3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from armblocks.analysis.dead_time import MAX_ORDER, PadeApproximation, dead_time
from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.one_sided import warn_of_one_side
from armblocks.analysis.operating_point import OperatingPoint
from armblocks.equations import HybridSystem, Signature
from armblocks.equations.clock_ratios import common_period, exact_clocks
from armblocks.equations.evaluation import EvaluatedSystem, Jacobians, Point
from armblocks.errors import InputError, SimulationError, UnknownNameError
from armblocks.extras import from_extra

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

MAX_TICKS = 100_000
"""Maximum number of ticks of one common period."""


@dataclass(frozen=True, kw_only=True)
class SystemPorts:
    """Inputs and outputs of a linear system: names and units of the scalars."""

    inputs: tuple[str, ...]
    input_units: tuple[str, ...]
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]


def linearise(
    evaluated: EvaluatedSystem,
    point: Point,
    ports: SystemPorts,
    known: OperatingPoint | None = None,
    *,
    delay_order: int | None = None,
) -> LinearSystem:
    """The linear system about a point at which the implicit equations are solved.

    ``evaluated`` selects the parameters that are the inputs and the signals that are the outputs. ``known``
    is stored with the result. ``delay_order`` is the order of the approximation of every dead time
    (:mod:`armblocks.analysis.dead_time`). Raises ``SimulationError`` if a derivative is not finite or the
    implicit equations are singular, and ``InputError`` for clocks without a usable common period and for dead
    time without an order.
    """
    system = evaluated.system
    unknowns = _unknowns(evaluated, point)
    flow, outputs = _jacobians(evaluated, point, unknowns, ports)
    names, units = _elements(system.states)

    def tick_jacobians(ticking: tuple[int, ...]) -> Jacobians:
        """The derivatives of ``z`` after a tick with respect to the values before the tick."""
        jacobians = _without(evaluated.update_jacobians(point, np.array(ticking, dtype=np.float64)), unknowns)
        _check_finite(system, _elements(system.discrete)[0], jacobians, "the discrete variable")
        return approximation(jacobians) if approximation else jacobians

    approximation = _pade_approximation(evaluated, point, unknowns, [flow, outputs], delay_order)
    if approximation:
        flow, outputs = approximation.flow(flow), approximation(outputs)
        names += approximation.names
        units += ("",) * len(approximation.names)
    if not system.clocks:
        matrices = (flow.x, flow.p, outputs.x, outputs.p)
        dt = 0.0
    else:
        updated = np.flatnonzero(evaluated.sampled)
        matrices, dt = _period_map(system, tick_jacobians, flow, outputs, updated)
        discrete_names, discrete_units = _elements(system.discrete)
        names += tuple(discrete_names[k] for k in updated.tolist())
        units += tuple(discrete_units[k] for k in updated.tolist())
        needed: list[int] = _needed_states(system, matrices, updated).tolist()
        a, b, c, d = matrices
        matrices = (a[np.ix_(needed, needed)], b[needed], c[:, needed], d)
        names = tuple(names[k] for k in needed)
        units = tuple(units[k] for k in needed)
    return LinearSystem(
        *matrices,
        dt=dt,
        states=names,
        inputs=ports.inputs,
        outputs=ports.outputs,
        state_units=units,
        input_units=ports.input_units,
        output_units=ports.output_units,
        name=system.name,
        point=known,
    )


def exact_response(
    evaluated: EvaluatedSystem, point: Point, ports: SystemPorts, frequencies: Array
) -> Complex:
    """The response (N, ny, nu) about a point at angular frequencies (N,) in rad/s; dead time is exact.

    Raises the errors of :func:`linearise`, and ``InputError`` for dead time in a diagram with clocks.
    """
    system = evaluated.system
    if system.delays is None:
        return linearise(evaluated, point, ports).frequency_response(frequencies)
    if system.clocks:
        raise InputError(
            f"the dead time of {_delayed_blocks(system)} is in one diagram with the clock of "
            f"{system.clocks[0].period:g} s",
            where=system.name,
            allowed="an exact response of dead time among continuous blocks only",
            fix="linearize with a delay_order, and use the frequency_response of the result",
        )
    unknowns = _unknowns(evaluated, point)
    flow, outputs = _jacobians(evaluated, point, unknowns, ports)
    inputs = _without(evaluated.delay_input_jacobians(point), unknowns)
    dead = dead_time(evaluated, point, inputs, [flow, outputs])
    open_loop = LinearSystem(
        flow.x,
        np.hstack([flow.p, flow.z[:, dead.indices]]),
        np.vstack([outputs.x, dead.inputs.x]),
        np.vstack(
            [
                np.hstack([outputs.p, outputs.z[:, dead.indices]]),
                np.hstack([dead.inputs.p, dead.feedthrough]),
            ]
        ),
    ).frequency_response(frequencies)
    ny, nu = outputs.p.shape
    delay_factors = np.exp(-1j * np.multiply.outer(frequencies, dead.delays))
    # v = delay_factors (H u + K v), y = D u + F v
    closed = np.eye(dead.count) - delay_factors[:, :, None] * open_loop[:, ny:, nu:]
    v = np.linalg.solve(closed, delay_factors[:, :, None] * open_loop[:, ny:, :nu])
    return np.asarray(open_loop[:, :ny, :nu] + open_loop[:, :ny, nu:] @ v, dtype=np.complex128)


def _jacobians(
    evaluated: EvaluatedSystem, point: Point, unknowns: Jacobians | None, ports: SystemPorts
) -> tuple[Jacobians, Jacobians]:
    """The derivatives of the flow and of the outputs. Raises an error if one is not finite. Warns if they
    hold to one side only."""
    flow = _without(evaluated.derivative_jacobians(point), unknowns)
    outputs = _without(evaluated.signal_jacobians(point), unknowns)
    _check_finite(evaluated.system, _elements(evaluated.system.states)[0], flow, "the rate of state")
    _check_finite(evaluated.system, ports.outputs, outputs, "the output")
    update = None
    if clocks := len(evaluated.system.clocks):
        update = _without(evaluated.update_jacobians(point, np.ones(clocks)), unknowns)
    warn_of_one_side(evaluated, point, flow, outputs, update)
    return flow, outputs


def _pade_approximation(
    evaluated: EvaluatedSystem,
    point: Point,
    unknowns: Jacobians | None,
    readers: list[Jacobians],
    order: int | None,
) -> PadeApproximation | None:
    """The approximation of the dead time, or ``None`` without dead time."""
    system = evaluated.system
    if system.delays is None:
        return None
    if order is None:
        raise InputError(
            f"the dead time of {_delayed_blocks(system)} has no finite linear system",
            where=system.name,
            allowed="dead time with `delay_order`, the order of its approximation",
            fix="give delay_order=3, which is accurate up to about 3 / delay in rad/s",
        )
    if not _is_order(order):
        raise InputError(
            f"the delay_order is {order!r}",
            where=system.name,
            allowed=f"an integer from 1 to {MAX_ORDER}",
            fix="begin with delay_order=3",
        )
    all_readers = [*readers]
    if system.clocks:
        all_readers.append(_without(evaluated.update_jacobians(point, np.ones(len(system.clocks))), unknowns))
    inputs = _without(evaluated.delay_input_jacobians(point), unknowns)
    return PadeApproximation(dead_time(evaluated, point, inputs, all_readers), order)


def _is_order(order: object) -> bool:
    return isinstance(order, int) and not isinstance(order, bool) and 1 <= order <= MAX_ORDER


def _delayed_blocks(system: HybridSystem) -> str:
    """The paths of all blocks with dead time, as text."""
    names, _ = _elements(system.discrete)
    indices = system.delays.values if system.delays else ()
    return ", ".join(sorted({names[k].rpartition("/")[0] for k in indices}))


def _elements(layout: Signature) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Name and unit of every scalar."""
    pairs = [(name, slot.unit) for slot in layout for name in slot.elements]
    return tuple(name for name, _ in pairs), tuple(unit for _, unit in pairs)


def _unknowns(evaluated: EvaluatedSystem, point: Point) -> Jacobians | None:
    """The derivatives of the unknowns of the implicit equations with respect to all other variables.

    ``None`` without unknowns.
    """
    system = evaluated.system
    if not system.algebraic.size:
        return None
    j = evaluated.residual_jacobians(point)
    matrix = j.w
    if not np.isfinite(matrix).all() or np.linalg.cond(matrix) > 1e14:
        raise SimulationError(
            f"the implicit equations of '{', '.join(system.algebraic.names)}' are singular at this point",
            where=system.name,
            allowed="points at which the unknowns depend smoothly on all other variables",
            fix="linearize at another point, or change the loop",
        )

    def sensitivity(right: Array) -> Array:
        return np.asarray(-np.linalg.solve(matrix, right), dtype=np.float64)

    return Jacobians(t=sensitivity(j.t), x=sensitivity(j.x), z=sensitivity(j.z), w=matrix, p=sensitivity(j.p))


def _without(j: Jacobians, unknowns: Jacobians | None) -> Jacobians:
    """Total derivatives, with the implicit unknowns eliminated."""
    if unknowns is None:
        return j
    return Jacobians(
        t=j.t + j.w @ unknowns.t,
        x=j.x + j.w @ unknowns.x,
        z=j.z + j.w @ unknowns.z,
        w=j.w,
        p=j.p + j.w @ unknowns.p,
    )


def _check_finite(system: HybridSystem, names: Sequence[str], j: Jacobians, subject: str) -> None:
    """Raise ``SimulationError`` if a derivative is not finite; ``names`` are the names of the rows."""
    for row, name in enumerate(names):
        if not all(np.isfinite(part[row]).all() for part in (j.x, j.z, j.p)):
            raise SimulationError(
                f"the derivative of {subject} '{name}' is not finite",
                where=system.name,
                allowed="points at which all equations are smooth",
                fix="linearize at another operating point",
            )


def _period_map(
    system: HybridSystem,
    tick_jacobians: Callable[[tuple[int, ...]], Jacobians],
    flow: Jacobians,
    outputs: Jacobians,
    updated: NDArray[np.intp],
) -> tuple[tuple[Array, Array, Array, Array], float]:
    """The map of ``[x; z]`` over one period, and the output right after its first tick."""
    with from_extra("analysis", "linear systems with clocks"):
        from scipy.linalg import expm

    n, m, k = flow.x.shape[1], updated.size, flow.p.shape[1]
    period, instants = ticks_of_a_period(system)
    generator = np.zeros((n + m + k, n + m + k))
    generator[:n] = np.hstack([flow.x, flow.z[:, updated], flow.p])
    flows: dict[Fraction, Array] = {}
    ticks: dict[tuple[int, ...], Array] = {}
    transition = np.eye(n + m + k)
    output = np.hstack([outputs.x, outputs.z[:, updated], outputs.p])
    times = [time for time, _ in instants]
    for index, (time, ticking) in enumerate(instants):
        if ticking not in ticks:
            j = tick_jacobians(ticking)
            jump = np.eye(n + m + k)
            jump[n : n + m] = np.hstack([j.x[updated], j.z[np.ix_(updated, updated)], j.p[updated]])
            ticks[ticking] = jump
        transition = ticks[ticking] @ transition
        if index == 0:
            output = output @ transition
        interval = (times[index + 1] if index + 1 < len(times) else times[0] + period) - time
        if interval not in flows:
            flows[interval] = expm(generator * float(interval))
        transition = flows[interval] @ transition
    size = n + m
    a, b = transition[:size, :size], transition[:size, size:]
    return (a, b, output[:, :size], output[:, size:]), float(period)


def ticks_of_a_period(system: HybridSystem) -> tuple[Fraction, list[tuple[Fraction, tuple[int, ...]]]]:
    """The least common multiple of all periods (s), and the ticks of one period.

    Each tick is a time and one mark (1 or 0) for every clock. Sample times have the same ratios as in a run
    (:mod:`armblocks.equations.clock_ratios`). Raises ``InputError`` if one period has more than ``MAX_TICKS``
    ticks.
    """
    clocks = exact_clocks(system.clocks)
    periods = [clock_period for clock_period, _ in clocks]
    period = common_period(clocks)
    count = sum(int(period / clock_period) for clock_period in periods)
    if count > MAX_TICKS:
        period_texts = ", ".join(f"{float(clock_period):g} s" for clock_period in periods)
        raise InputError(
            f"the clocks ({period_texts}) have the common period {float(period):g} s with {count} ticks",
            where=system.name,
            allowed=f"{MAX_TICKS} ticks in the least common multiple of the sample times",
            fix="choose sample times that are multiples of one another",
        )
    ticking: dict[Fraction, list[int]] = {}
    for clock, (clock_period, offset) in enumerate(clocks):
        for tick in range(int(period / clock_period)):
            ticking.setdefault(offset + tick * clock_period, [0] * len(periods))[clock] = 1
    return period, [(time, tuple(clock_flags)) for time, clock_flags in sorted(ticking.items())]


def _needed_states(
    system: HybridSystem, matrices: tuple[Array, Array, Array, Array], updated: NDArray[np.intp]
) -> NDArray[np.intp]:
    """All states except held outputs that are recomputed before they are read."""
    a, _, c, _ = matrices
    n = a.shape[0] - updated.size
    is_held = np.zeros(n + updated.size, dtype=np.bool_)
    names = [slot.name for slot in system.discrete for _ in range(slot.size)]
    is_held[n:] = [names[k] in system.signals_layout.ranges for k in updated]
    unread = ~(a.any(axis=0) | c.any(axis=0))
    return np.flatnonzero(~(is_held & unread))


def input_scalars(system: HybridSystem, paths: Mapping[str, str]) -> tuple[list[int], tuple[str, ...]]:
    """Indices in ``p`` and names of the scalars of some parameters.

    ``paths`` maps the displayed names of the parameters to their paths.
    """
    indices: list[int] = []
    names: list[str] = []
    for name, path in paths.items():
        slot = system.parameters[path]
        indices += range(*system.parameters.ranges[path].indices(system.parameters.size))
        names += [name + element.removeprefix(path) for element in slot.elements]
    return indices, tuple(names)


def output_scalars(system: HybridSystem, paths: Mapping[str, str]) -> tuple[list[int], SystemPorts]:
    """Rows of ``y``, names and units of the scalars of some signals.

    ``paths`` maps the displayed names of the signals to their paths. The inputs of the result are empty.
    Raises ``UnknownNameError`` for an unknown signal.
    """
    rows: list[int] = []
    names: list[str] = []
    units: list[str] = []
    for name, alias in paths.items():
        path = system.aliases.get(alias, alias)
        if path not in system.signals_layout.ranges:
            signal_names = [*system.signals_layout.names, *system.aliases]
            raise UnknownNameError("signal", name, signal_names, where=system.name)
        slot = system.signals_layout[path]
        rows += range(*system.signals_layout.ranges[path].indices(system.signals_layout.size))
        names += [name + element.removeprefix(path) for element in slot.elements]
        units += [slot.unit] * slot.size
    return rows, SystemPorts(inputs=(), input_units=(), outputs=tuple(names), output_units=tuple(units))
