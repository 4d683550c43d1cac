"""Runs of diagrams: a diagram is traced and compiled once, and can run with different parameters."""

from __future__ import annotations

import dataclasses
import weakref
from collections.abc import Mapping, Sequence
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Unpack, cast

import numpy as np
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.analysis.operating_point import OperatingPoint
from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram, content_key, flat_diagram, trace_diagram, with_parameters
from armblocks.diagram.entry_names import entry_names
from armblocks.diagram.signal_names import signal_titles
from armblocks.equations import HybridSystem, Signature, SimulationOptions
from armblocks.errors import InputError
from armblocks.face.diagram_run import DiagramRun, tuned_parameters
from armblocks.face.diagrams import stored_diagram
from armblocks.face.limit_watch import LimitWatch
from armblocks.face.python_calls import called_functions
from armblocks.face.settings import RunSettings, check_settings, takes_settings, with_settings
from armblocks.integration.system import CompiledSystem, cached_system, compile_system
from armblocks.simulation import LogRequest, RunState, Simulation, SimulationResult
from armblocks.simulation.plan import changed_parameters
from armblocks.simulation.whole_run import Progress, run_to_the_end


class CompiledDiagram(metaclass=ArgumentErrors):
    """A diagram with its equations and native code, created at first use."""

    def __init__(self, diagram: Diagram) -> None:
        self.diagram = diagram
        self._watch: LimitWatch | None = None

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle and copy the diagram alone; equations and code are created again or read from the cache."""
        return CompiledDiagram, (self.diagram,)

    @cached_property
    def system(self) -> HybridSystem:
        """The diagram as equations."""
        with interrupts.kept():
            return trace_diagram(self.diagram)

    @cached_property
    def compiled(self) -> CompiledSystem:
        """The equations as native code; a cache entry makes tracing unnecessary."""
        key = content_key(self.diagram)
        with interrupts.kept():
            compiled = compile_system(self.system) if key is None else cached_system(key, lambda: self.system)
        compiled.reasons_of_invalid_values = lambda: {
            path: reason
            for path, block in flat_diagram(self.diagram).blocks.items()
            if (reason := block.reason_of_invalid_values())
        }
        return compiled

    @cached_property
    def signals_layout(self) -> Signature:
        """The layout of a run's signals, with the names of joints and of signals."""
        layout = self.compiled.signals_layout
        entries = entry_names(self.diagram, {slot.name: slot.shape for slot in layout})
        return layout.with_entries(entries).with_titles(signal_titles(self.diagram))

    @takes_settings
    def simulate(
        self,
        options: SimulationOptions | None = None,
        *,
        parameters: Mapping[str, object] | None = None,
        progress: Progress | None = None,
        initial_state: RunState | None = None,
        log: LogRequest | None = None,
        **settings: Unpack[RunSettings],
    ) -> SimulationResult:
        """Run once; see :func:`simulate`. ``options``: by default the settings of the diagram."""
        check_settings(settings, CompiledDiagram.simulate)
        tuned, values = self._tuned(parameters)
        options = with_settings(options or tuned.diagram.settings, settings)
        calls = called_functions(tuned.diagram, tuned.compiled)
        run = Simulation(tuned.compiled, options, values, initial_state, log, calls, tuned.signals_layout)
        result = run_to_the_end(run, progress)
        if tuned._watch is None:
            tuned._watch = LimitWatch(tuned.diagram, result)
        tuned._watch.warn(result)
        return result

    @takes_settings
    def begin(
        self,
        options: SimulationOptions | None = None,
        *,
        parameters: Mapping[str, object] | None = None,
        initial_state: RunState | None = None,
        log: LogRequest | None = None,
        **settings: Unpack[RunSettings],
    ) -> DiagramRun:
        """Begin a run; see :func:`begin`."""
        check_settings(settings, CompiledDiagram.begin)
        tuned, values = self._tuned(parameters)
        diagram = with_parameters(self.diagram, parameters) if parameters else self.diagram
        options = with_settings(options or diagram.settings, settings)
        calls = called_functions(tuned.diagram, tuned.compiled)
        return DiagramRun(
            diagram,
            Simulation(tuned.compiled, options, values, initial_state, log, calls, tuned.signals_layout),
        )

    def _tuned(
        self, parameters: Mapping[str, object] | None
    ) -> tuple[CompiledDiagram, NDArray[np.float64] | None]:
        """This model with a new parameter vector, or a new model if a structural parameter changes."""
        if not parameters:
            return self, None
        changed = with_parameters(self.diagram, parameters)
        tuned = tuned_parameters(self.diagram, changed)
        if tuned is None:
            return CompiledDiagram(changed), None
        return self, changed_parameters(self.compiled, self.compiled.parameter_values, tuned)


Start = RunState | OperatingPoint | str | PathLike[str]
"""The start of a run: the state of another run, the path of a saved state, or an operating point."""

_compiled: dict[int, CompiledDiagram] = {}


def given_diagram(diagram: Diagram | CompiledDiagram | str | PathLike[str], where: str) -> Diagram:
    """The diagram of an argument of the function ``where``: a diagram, compiled or not, the name of a shipped
    diagram, or the path of a file."""
    return diagram.diagram if isinstance(diagram, CompiledDiagram) else stored_diagram(diagram, where)


def compile_diagram(diagram: Diagram | CompiledDiagram | str | PathLike[str]) -> CompiledDiagram:
    """The compiled form of a diagram, cached for the lifetime of the diagram object."""
    if isinstance(diagram, CompiledDiagram):
        return diagram
    if not isinstance(diagram, Diagram):
        return CompiledDiagram(given_diagram(diagram, "compile_diagram"))
    entry = _compiled.get(id(diagram))
    if entry is None:
        # Cached by identity, because comparing by content would take longer than a run. The entry is removed
        # together with the diagram, and therefore refers to a copy of the diagram.
        _compiled[id(diagram)] = entry = CompiledDiagram(dataclasses.replace(diagram))
        weakref.finalize(diagram, _compiled.pop, id(diagram), None)
    return entry


def state_at(diagram: Diagram | CompiledDiagram, point: OperatingPoint) -> RunState:
    """The run state at an operating point."""
    system = compile_diagram(diagram).compiled
    layouts = (system.states, system.discrete, system.algebraic)
    parts = (point.states, point.discrete, point.algebraic)
    states, discrete, algebraic = (layout.pack(part) for layout, part in zip(layouts, parts))
    return RunState(
        name=point.name,
        time=point.time,
        states=states,
        discrete=discrete,
        algebraic=algebraic,
        names=(system.states.names, system.discrete.names, system.algebraic.names),
    )


@takes_settings
def simulate(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    *,
    parameters: Mapping[str, object] | None = None,
    progress: Progress | None = None,
    initial_state: Start | None = None,
    log: str | PathLike[str] | None = None,
    log_signals: Sequence[str] = (),
    **settings: Unpack[RunSettings],
) -> SimulationResult:
    """Run a diagram and return its recorded signals.

    - ``diagram``: an object, a shipped example's name or a path.
    - ``stop_time``, ``solver``, ``step``, ``sample_time``, ``max_step``, ``rtol`` and ``atol`` override the
      settings of the diagram, see :class:`SimulationOptions`.
    - ``parameters`` changes parameters of blocks, ``{"jtraj.tmax": 5.0}``; tunable parameters need no new
      compilation.
    - ``progress(time, fraction, real_time_factor)`` is called repeatedly during a long run.
    - ``initial_state``: another run's ``final_state``, or the file that its ``save`` wrote. The run continues
      from there to ``stop_time``. Without other changes the result equals the result of one longer run
      exactly. An operating point, such as the result of ``trim``, is also valid: the run begins at its time.
    - ``log``: a ``.parquet`` or ``.csv`` file to which all signals, or the ``log_signals``, are written
      during the run. Memory use is then independent of the duration, and the result holds a subset of rows
      with all extremes.

    Raises ``InputError`` for a setting out of range, ``UnknownNameError`` for an unknown argument,
    ``SimulationError`` (with the ``partial`` result) if the run fails.
    """
    check_settings(settings, simulate)
    model = compile_diagram(diagram)
    return model.simulate(
        parameters=parameters,
        progress=progress,
        initial_state=_starting_state(model, initial_state),
        log=_log_request(log, log_signals),
        **settings,
    )


@takes_settings
def begin(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    *,
    parameters: Mapping[str, object] | None = None,
    initial_state: Start | None = None,
    log: str | PathLike[str] | None = None,
    log_signals: Sequence[str] = (),
    **settings: Unpack[RunSettings],
) -> DiagramRun:
    """Create a run of a diagram that can be paused, inspected and tuned; ``advance`` starts it.

    Arguments and errors as for :func:`simulate`.
    """
    check_settings(settings, begin)
    model = compile_diagram(diagram)
    return model.begin(
        parameters=parameters,
        initial_state=_starting_state(model, initial_state),
        log=_log_request(log, log_signals),
        **settings,
    )


def _starting_state(model: CompiledDiagram, start: object) -> RunState | None:
    """The initial state of a run. Raises ``InputError`` for unsupported values."""
    if start is None or isinstance(start, RunState):
        return start
    if isinstance(start, OperatingPoint):
        return state_at(model, start)
    if isinstance(start, str | PathLike):
        return RunState.load(cast("str | PathLike[str]", start))
    raise InputError(
        f"initial_state is a {type(start).__name__}",
        where=model.diagram.name,
        allowed="a run's final_state, the path of a saved one, or an operating point",
        fix="to start from other values, give parameters={'block.initial': …}",
    )


def _log_request(log: str | PathLike[str] | None, signals: Sequence[str]) -> LogRequest | None:
    return None if log is None else LogRequest(path=Path(log), signals=tuple(signals))
