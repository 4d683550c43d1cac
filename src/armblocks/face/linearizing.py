"""Linearisation of a diagram: inputs, outputs, loop openings and operating point."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Unpack, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks import interrupts
from armblocks.analysis.linear_system import LinearSystem
from armblocks.analysis.linearisation import exact_response, input_scalars, linearise, output_scalars
from armblocks.analysis.operating_point import (
    OperatingPoint,
    initial_point,
    operating_point,
    transferred_point,
)
from armblocks.diagram import Diagram, trace_diagram, with_parameters
from armblocks.diagram.analysis_points import PreparedDiagram, with_analysis_points
from armblocks.diagram.hierarchy import flatten_hierarchy
from armblocks.diagram.mask_tuning import with_mask_parameters
from armblocks.equations import HybridSystem
from armblocks.equations.evaluation import EvaluatedSystem, Point
from armblocks.errors import InputError
from armblocks.face.model import CompiledDiagram, compile_diagram, given_diagram, simulate
from armblocks.face.settings import RunSettings, check_settings, takes_settings
from armblocks.simulation import RunState
from armblocks.simulation.whole_run import check_interrupt

Where = float | RunState | OperatingPoint
"""A time of a run from the diagram's start (s), the final state of a run, or an operating point."""


@overload
def linearize(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    inputs: str | Sequence[str] = (),
    outputs: str | Sequence[str] = (),
    *,
    at: Where = 0.0,
    open: str | Sequence[str] = (),
    delay_order: int | None = None,
    parameters: Mapping[str, object] | None = None,
    **settings: Unpack[RunSettings],
) -> LinearSystem: ...


@overload
def linearize(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    inputs: str | Sequence[str] = (),
    outputs: str | Sequence[str] = (),
    *,
    at: Sequence[float],
    open: str | Sequence[str] = (),
    delay_order: int | None = None,
    parameters: Mapping[str, object] | None = None,
    **settings: Unpack[RunSettings],
) -> tuple[LinearSystem, ...]: ...


@takes_settings
@interrupts.kept()
def linearize(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    inputs: str | Sequence[str] = (),
    outputs: str | Sequence[str] = (),
    *,
    at: Where | Sequence[float] = 0.0,
    open: str | Sequence[str] = (),
    delay_order: int | None = None,
    parameters: Mapping[str, object] | None = None,
    **settings: Unpack[RunSettings],
) -> LinearSystem | tuple[LinearSystem, ...]:
    """The exact linear system of a diagram about an operating point, by differentiating its equations.

    - ``inputs``: perturbed signals. ``"step"`` or ``"step/y"`` adds a perturbation to that output,
      ``"plant/u"`` to that input only; ``"const.value"`` perturbs a tunable parameter, also of a mask.
    - ``outputs``: signal names as in a result. The value of an output port excludes a perturbation that is
      added at this port; the value of an input port includes it.
    - ``open``: loop openings. The signal after an opening is constant at its value at the operating point,
      plus the perturbation of an input at the same port. With ``inputs="e", outputs="e", open="e"`` the
      result is the loop transfer function, signs included.
    - ``at``: a time of a run (0: the start), several times (one system each), the final state of a run
      (``result.final_state``) or the operating point of ``trim``.
    - ``delay_order``: number of states of the Padé approximation of each dead time; required if there is dead
      time. (:func:`frequency_response` is exact.)
    - ``parameters``: other values of parameters.
    - ``settings``: settings of the run up to ``at``, as in :func:`simulate`.

    Modes (a limiter at its limit) are constant. If a signal is exactly at a limit or at a jump, and small
    changes to its two sides have different effects, there is an ``ArmblocksWarning``. A diagram with sample
    times gives a discrete system with the common period of all clocks and a zero-order hold at the inputs.
    The time t in equations is constant.

    Raises ``UnknownNameError`` and ``InputError`` for invalid names, ``SimulationError`` if a signal of the
    run or a derivative is not finite.
    """
    check_settings(settings, linearize)
    resolved = resolved_diagram(diagram, parameters, "linearize")
    input_names, output_names, opening_names = _names(inputs), _names(outputs), _names(open)
    if isinstance(at, float | int | RunState | OperatingPoint):
        return _linearized(
            resolved,
            input_names,
            output_names,
            opening_names,
            operating_point_at(resolved, at, **settings),
            delay_order,
        )
    points = operating_points_at(resolved, at, **settings)
    prepared = _PreparedLinearisation(resolved, input_names, output_names, opening_names)
    return tuple(prepared.at(point, delay_order) for point in points)


def resolved_diagram(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    parameters: Mapping[str, object] | None,
    where: str,
) -> Diagram:
    """The diagram of an argument of the function ``where``, with the given parameter values."""
    given = given_diagram(diagram, where)
    return with_parameters(given, parameters) if parameters else given


def _names(names: str | Sequence[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _linearized(
    diagram: Diagram,
    inputs: tuple[str, ...],
    outputs: tuple[str, ...],
    opened: tuple[str, ...],
    point: OperatingPoint,
    delay_order: int | None,
) -> LinearSystem:
    return _PreparedLinearisation(diagram, inputs, outputs, opened).at(point, delay_order)


@takes_settings
@interrupts.kept()
def frequency_response(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    inputs: str | Sequence[str],
    outputs: str | Sequence[str],
    frequencies: ArrayLike,
    *,
    at: Where = 0.0,
    open: str | Sequence[str] = (),
    parameters: Mapping[str, object] | None = None,
    **settings: Unpack[RunSettings],
) -> NDArray[np.complex128]:
    """The response (N, ny, nu) of a diagram's linear system at angular frequencies (N,) in rad/s.

    Dead time is exact, ``exp(-j w T)``, also inside loops. Arguments and errors as for :func:`linearize`;
    dead time together with sampled blocks raises ``InputError``.
    """
    check_settings(settings, frequency_response)
    resolved = resolved_diagram(diagram, parameters, "frequency_response")
    prepared = _PreparedLinearisation(resolved, _names(inputs), _names(outputs), _names(open))
    frequency_vector = np.asarray(frequencies, dtype=np.float64).reshape(-1)
    return prepared.response(operating_point_at(resolved, at, **settings), frequency_vector)


class _PreparedLinearisation:
    """A traced diagram with linearisation points, for repeated linearisation."""

    def __init__(
        self,
        diagram: Diagram,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...],
        opened: tuple[str, ...],
    ) -> None:
        self.points: PreparedDiagram = with_analysis_points(diagram, inputs, opened)
        system = (
            compile_diagram(diagram).system
            if self.points.diagram is diagram
            else trace_diagram(self.points.diagram)
        )
        system = with_mask_parameters(system, diagram, self.points.inputs.values())
        indices, names = input_scalars(system, self.points.inputs)
        # The flat diagram with linearisation points has no ports of subsystems.
        aliases = flatten_hierarchy(diagram).aliases
        known = (name if name in system.aliases else str(aliases.get(name, name)) for name in outputs)
        rows, ports = output_scalars(system, dict(zip(outputs, known)))
        units = tuple(unit for path in self.points.inputs.values() for unit in _units(system, path))
        self.ports = dataclasses.replace(ports, inputs=names, input_units=units)
        self.evaluated = EvaluatedSystem(system, indices, rows)
        self.system = system

    def at(self, known: OperatingPoint, delay_order: int | None) -> LinearSystem:
        """The linear system about an operating point of the diagram without linearisation points."""
        return linearise(self.evaluated, self._point(known), self.ports, known, delay_order=delay_order)

    def response(self, known: OperatingPoint, frequencies: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The frequency response about an operating point."""
        return exact_response(self.evaluated, self._point(known), self.ports, frequencies)

    def _point(self, known: OperatingPoint) -> Point:
        layout = self.system.parameters
        levels = {
            path: known.signals[signal].reshape(layout[path].shape)
            for path, signal in self.points.levels.items()
        }
        zeros = {slot.name: np.zeros(slot.shape) for slot in layout if slot.name not in known.parameters}
        return transferred_point(self.evaluated, known, zeros | levels)


def _units(system: HybridSystem, path: str) -> tuple[str, ...]:
    """Units of the scalars of an input: the units of its signal or parameter."""
    slot = system.parameters[path]
    point, _, name = path.rpartition(".")
    signal = f"{point}/y"
    added = name == "offset" and signal in system.signals_layout.ranges
    return (system.signals_layout[signal].unit if added else slot.unit,) * slot.size


def operating_point_at(diagram: Diagram, at: Where, **settings: Unpack[RunSettings]) -> OperatingPoint:
    """The operating point of a diagram at a time of a run, or at the final state of a run."""
    if isinstance(at, OperatingPoint):
        return at
    if isinstance(at, float | int):
        return operating_points_at(diagram, [float(at)], **settings)[0]
    evaluated = EvaluatedSystem(compile_diagram(diagram).system)
    return _point_from_state(evaluated, at)


def operating_points_at(
    diagram: Diagram, times: Sequence[float], **settings: Unpack[RunSettings]
) -> list[OperatingPoint]:
    """Operating points at times of one run, in the order given. Raises ``InputError`` for a negative time."""
    if not all(np.isfinite(time) and time >= 0.0 for time in times):
        raise InputError(
            f"the times to linearize at are {list(times)}",
            allowed="finite times >= 0 s",
            fix="give other times",
            where=f"diagram '{diagram.name}'",
        )
    compiled = compile_diagram(diagram)
    evaluated = EvaluatedSystem(compiled.system)
    points: dict[float, OperatingPoint] = {}
    state: RunState | None = None
    for time in sorted(set(times)):
        if time == 0.0:
            point = initial_point(evaluated, compiled.system.parameter_values)
            points[time] = operating_point(evaluated, point)
            continue
        run: RunSettings = {**settings, "stop_time": time}
        result = simulate(compiled, initial_state=state, **run)
        check_interrupt(result)
        state = result.final_state
        assert state is not None  # a failed run has raised an error
        points[time] = _point_from_state(evaluated, state)
    return [points[time] for time in times]


def _point_from_state(evaluated: EvaluatedSystem, state: RunState) -> OperatingPoint:
    system = evaluated.system
    layouts = (system.states, system.discrete, system.algebraic)
    if state.names != tuple(layout.names for layout in layouts):
        raise InputError(
            f"the state of '{state.name}' at {state.time:g} s has other variables",
            where=system.name,
            allowed="a state of the same diagram",
            fix="run the diagram again",
        )
    point = Point(
        t=state.time, x=state.states, z=state.discrete, w=state.algebraic, p=system.parameter_values
    )
    return operating_point(evaluated, point)
