"""Sensitivities: derivatives of the signals of a run with respect to its parameters."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from typing import Unpack

import numpy as np
from casadi import SX, Function, vertcat
from numpy.typing import NDArray

from armblocks import interrupts
from armblocks.argument_errors import ArgumentErrors
from armblocks.diagram import Diagram
from armblocks.diagram.mask_tuning import mask_parameters, with_mask_parameters
from armblocks.equations import HybridSystem, Signature, Slot
from armblocks.equations.sensitivity import LIMIT, MIXED, SAMPLED, TIES, sensitivity_system
from armblocks.equations.sensitivity_layout import entry_name, sensitivity_name
from armblocks.equations.table_reading import evaluated, reads_tables
from armblocks.errors import InputError, SimulationError, UnknownNameError, counted
from armblocks.face.linearizing import resolved_diagram
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.face.settings import RunSettings, check_settings, takes_settings, with_settings
from armblocks.integration.system import compile_system
from armblocks.simulation import SimulationResult
from armblocks.simulation import simulate as run_system

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SensitivityResult(metaclass=ArgumentErrors):
    """A run with the derivatives of some of its signals with respect to some parameters.

    ``result[output, parameter]`` is d output / d parameter at ``time`` (N,) s: ``(N, *shape of the output)``
    for a parameter of one entry, else ``(N, *shape of the output, *shape of the parameter)``. One entry of a
    parameter is named ``pid.kp[0]``. ``run`` has all signals as well, and the derivatives under
    ``"output by parameter"``.
    """

    run: SimulationResult
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    slots: Signature = field(repr=False)
    """The parameters with their shapes, also if only some entries of a parameter were chosen."""

    @property
    def time(self) -> Array:
        """Recorded times (N,), s."""
        return self.run.time

    def __getitem__(self, key: tuple[str, str]) -> Array:
        output, parameter = key
        path = self.run.resolve(output)
        whole = [slot for slot in self.slots if slot.name in self.parameters]
        valid_names = dict.fromkeys([*self.parameters, *(entry for slot in whole for entry in slot.elements)])
        if parameter not in valid_names:
            raise UnknownNameError("parameter", parameter, valid_names, where=self.run.name)
        slot = self.slots.slot_of(parameter)
        if parameter != slot.name or slot.size == 1:
            return self.run[sensitivity_name(path, entry_name(slot, parameter))]
        entries = [self.run[sensitivity_name(path, element)] for element in slot.elements]
        stacked = np.stack(entries, axis=-1)
        return stacked.reshape(*stacked.shape[:-1], *slot.shape)

    def __repr__(self) -> str:
        head = f"<SensitivityResult {self.run.name}: {counted(self.time.size, 'sample')}>"
        lines = [f"  d {output} / d {name}" for output in self.outputs for name in self.parameters]
        return "\n".join([head, *lines])


@takes_settings
@interrupts.kept()
def sensitivity(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    parameters: str | Sequence[str],
    outputs: str | Sequence[str],
    *,
    values: Mapping[str, object] | None = None,
    **settings: Unpack[RunSettings],
) -> SensitivityResult:
    """Run a diagram together with the exact derivatives of ``outputs`` with respect to tunable
    ``parameters``.

    One entry of a parameter is ``"g.gain[1]"`` or ``"g.gain[0,2]"``, with indices from 0. Mask parameters are
    allowed; parameters that depend on them by formulas are included.

    The traced equations are differentiated. The derivatives are integrated together with the equations,
    natively, with the same error control. The times of events, of jumps at known times and of the arrival of
    delayed jumps are differentiated too, and so are implicit equations and jumps inside formulas. ``values``:
    other values of parameters. The settings of the run are as in :func:`simulate`.

    Raises ``UnknownNameError`` for unknown names, and ``SimulationError`` like a run. ``SimulationError`` is
    also raised if a parameter change would separate coinciding events, or move a signal that is exactly at a
    limit between two instants or at a tick: the derivative does not exist.
    Raises ``InputError`` for

    - an index that is out of range,
    - a table that is read by index,
    - a parameter whose integer part alone has an effect,
    - a parameter that shifts an event at the start, or a limit or jump at which a block starts exactly,
    - implicit equations together with delays, or with a parameter that determines a jump time.
    """
    check_settings(settings, sensitivity)
    resolved = resolved_diagram(diagram, values, "sensitivity")
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    system = with_mask_parameters(compile_diagram(resolved).system, resolved, names)
    output_names = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    if not names or not output_names:
        raise InputError(
            f"{counted(len(names), 'parameter')} and {counted(len(output_names), 'output')} are given",
            allowed="one or more of each",
            where=system.name,
            fix="name a parameter and an output",
        )
    chosen = [_parameter(system, resolved, name) for name in names]
    paths = [system.aliases.get(name, name) for name in output_names]
    for path in paths:
        if path not in system.signals_layout.ranges:
            parameter_names = [*system.signals_layout.names, *system.aliases]
            raise UnknownNameError("signal", path, parameter_names, where=system.name)
    augmented = sensitivity_system(system, names, paths)
    options = with_settings(resolved.settings, settings)
    run = run_system(compile_system(augmented), options)
    InstantChecks(augmented).check(run)
    slots = Signature(tuple(dict.fromkeys(chosen)))
    return SensitivityResult(run=run, outputs=output_names, parameters=names, slots=slots)


def _parameter(system: HybridSystem, diagram: Diagram, name: str) -> Slot:
    """The slot of a parameter, or of the parameter with this entry.

    Raises ``UnknownNameError`` for an unknown parameter, ``InputError`` for an unknown entry.
    """
    try:
        return system.parameters.slot_of(name)
    except UnknownNameError:
        parameter_names = [*mask_parameters(diagram), *system.parameters.names]
        raise UnknownNameError("tunable parameter", name, parameter_names, where=system.name) from None
    except InputError as error:
        raise InputError(error.what, allowed=error.allowed, fix=error.fix, where=system.name) from None


class InstantChecks:
    """Checks of runs of a system with sensitivities for instants at which a parameter has no derivative.

    A change of the parameter separates coinciding events, or moves a signal that is exactly at a limit.
    """

    def __init__(self, system: HybridSystem) -> None:
        self._system = system
        self._ranges = {
            name: places
            for name, places in system.discrete.ranges.items()
            if name in (MIXED, *TIES, SAMPLED) or name.startswith(LIMIT)
        }

    def check(self, run: SimulationResult, p: Array | None = None) -> None:
        """Raise ``SimulationError`` for the first such instant of a run with parameters ``(np,)``."""
        state = run.final_state
        if not self._ranges or state is None:
            return
        values = state.discrete
        self._refuse(run, {name: values[places] for name, places in self._ranges.items()})
        p = np.asarray(self._system.parameter_values if p is None else p, dtype=np.float64)
        arguments = [np.array([state.time]), state.states, values, state.algebraic, p]
        (column,) = evaluated(self._at_end, arguments, reads=self._reads_tables)
        ends = itertools.accumulate(places.stop - places.start for places in self._ranges.values())
        self._refuse(run, dict(zip(self._ranges, np.split(column, list(ends)[:-1]))))

    @cached_property
    def _at_end(self) -> Function:
        """The variables of these instants as they would be at an instant at the end of a run, in one column,
        from ``t, x, z, w, p``."""
        update = self._system.update
        function = Function("f", list(update.arguments), list(update.results))
        arguments = list(update.arguments[:5])
        (z,) = function.call([*arguments, SX.zeros(len(self._system.clocks))], True, False)
        return Function("f", arguments, [vertcat(*(z[places] for places in self._ranges.values()))])

    @cached_property
    def _reads_tables(self) -> bool:
        return reads_tables(self._at_end)

    def _refuse(self, run: SimulationResult, instants: Mapping[str, Array]) -> None:
        for name, values in instants.items():
            if values[0] < 0.0:
                continue
            what, allowed, fix = self._description(name, f"{values[0]:.9g} s", int(values[-1]) - 1)
            raise SimulationError(
                f"{what}: the derivative does not exist",
                where=self._system.name,
                allowed=allowed,
                fix=f"{fix}, or use the difference of two runs",
                partial=run,
            )

    def _description(self, name: str, time: str, index: int) -> tuple[str, str, str]:
        """What happened at an instant, what is allowed, and a remedy. ``index``: that of a guard or of a
        discrete variable."""
        if name == MIXED:
            block = self._system.guard_names[index]
            return (
                f"several events coincide at {time}, one of '{block}' among them, and a parameter change "
                "would separate them",
                "events that coincide, or do not, for all small parameter changes",
                "shift one of the events",
            )
        if name == SAMPLED:
            elements = [element for slot in self._system.discrete for element in slot.elements]
            block = elements[index].rpartition("/")[0]
            return (
                f"block '{block}' samples a signal exactly at a limit or at a jump at {time}, and a "
                "parameter change would move it away",
                "sampled signals that have derivatives at the ticks",
                "shift the ticks or the signal a little",
            )
        block = name.removeprefix(LIMIT) if name.startswith(LIMIT) else self._system.guard_names[index]
        return (
            f"block '{block}' is exactly at a limit or at a jump after an event or a tick at {time}, and a "
            "parameter change would move it away",
            "signals that jump at all small parameter changes, or at none",
            "change the new value or the limit a little",
        )
