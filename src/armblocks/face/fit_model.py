"""A diagram as a function of the fitted parameters: measured signals and their derivatives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armblocks.diagram import Diagram, flat_diagram, with_parameters
from armblocks.diagram.mask_tuning import mask_parameters, with_mask_parameters
from armblocks.diagram.parameter import Parameter
from armblocks.equations import HybridSystem, SimulationOptions
from armblocks.equations.sensitivity import sensitivity_system
from armblocks.equations.sensitivity_layout import sensitivity_name
from armblocks.errors import InputError, SimulationError, UnknownNameError
from armblocks.face.fit_data import Measurement
from armblocks.face.model import compile_diagram
from armblocks.face.python_calls import called_functions
from armblocks.integration.system import CompiledSystem, compile_system
from armblocks.simulation import Simulation, SimulationResult
from armblocks.simulation.whole_run import check_interrupt, run_to_the_end

Array = NDArray[np.float64]

_STEP = 3e-5
"""Relative step of central differences: the errors of runs with a relative tolerance of 1e-8 stay below the
derivative's fifth digit."""
_TOLERANCE = 1e-8


class FittedParameters:
    """The entries of the fitted parameters by name: ``plant.mass``, ``gain.gain[1]``."""

    def __init__(self, diagram: Diagram, system: HybridSystem, names: Sequence[str], where: str) -> None:
        self.entries: list[str] = []
        start: list[float] = []
        self._wholes: dict[str, Array] = {}
        self._places: list[tuple[str, int]] = []
        masks = mask_parameters(diagram)
        for name in names:
            whole = name if _is_parameter(diagram, system, name) else name.rpartition("[")[0]
            if not whole or not _is_parameter(diagram, system, whole):
                known = [*masks, *system.parameters.names]
                raise UnknownNameError("parameter", name, known, where=where)
            value = parameter_value(diagram, whole, where)
            self._wholes.setdefault(whole, value)
            slots = [whole] if not value.shape else _element_names(whole, value.shape)
            chosen = slots if name == whole else [name]
            for entry in chosen:
                if entry not in slots:
                    raise UnknownNameError("entry", entry, slots, where=where)
                single = entry if value.size > 1 else whole
                if single in self.entries:
                    raise InputError(
                        f"the parameter '{single}' is named twice",
                        where=where,
                        allowed="every parameter once",
                        fix="remove one of the names",
                    )
                self.entries.append(single)
                self._places.append((whole, slots.index(entry)))
                start.append(float(value.ravel()[slots.index(entry)]))
        self.start = np.array(start)

    def values(self, theta: Array) -> dict[str, object]:
        """The values of the whole parameters."""
        wholes = {name: value.copy() for name, value in self._wholes.items()}
        for (whole, index), number in zip(self._places, theta.tolist()):
            wholes[whole].flat[index] = number
        return {name: value if value.shape else float(value) for name, value in wholes.items()}

    @property
    def wholes(self) -> tuple[str, ...]:
        """The names of the parameters, without indices."""
        return tuple(self._wholes)

    def whole_of(self, k: int) -> str:
        """The parameter of entry ``k``."""
        return self._places[k][0]


def _is_parameter(diagram: Diagram, system: HybridSystem, name: str) -> bool:
    if name in system.parameters.ranges or name in mask_parameters(diagram):
        return True
    block, _, parameter = name.rpartition(".")
    blocks = flat_diagram(diagram).blocks
    return block in blocks and parameter in [rule.name for rule in blocks[block].own_parameters()]


def parameter_rule(diagram: Diagram, name: str) -> Parameter:
    """The declaration of a parameter."""
    masks = mask_parameters(diagram)
    if name in masks:
        return masks[name][1]
    block, _, parameter = name.rpartition(".")
    rules = flat_diagram(diagram).blocks[block].own_parameters()
    return next(rule for rule in rules if rule.name == parameter)


def parameter_value(diagram: Diagram, name: str, where: str) -> Array:
    """The value of a parameter of numbers."""
    masks = mask_parameters(diagram)
    if name in masks:
        level, rule = masks[name]
        value: object = level.mask_values[rule.name]
    else:
        block, _, parameter = name.rpartition(".")
        value = flat_diagram(diagram).blocks[block].parameter_value(parameter)
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if not array.size or not np.isfinite(array).all() or isinstance(value, bool):
        raise InputError(
            f"the parameter '{name}' has no finite numbers",
            where=where,
            allowed="parameters that are numbers, vectors or matrices",
            fix="choose another parameter, or give it a finite value to start from",
        )
    return array


def _element_names(name: str, shape: tuple[int, ...]) -> list[str]:
    return [f"{name}[{','.join(map(str, index))}]" for index in np.ndindex(*shape)]


class FittedRun:
    """One experiment: its run gives the measured signals and their derivatives.

    ``reasons``: for parameters without an exact derivative the reason; they are differentiated by central
    differences of two runs.
    """

    def __init__(
        self,
        diagram: Diagram,
        parameters: FittedParameters,
        measurement: Measurement,
        options: SimulationOptions,
        reasons: Mapping[str, str],
    ) -> None:
        self.parameters, self.measurement, self.options = parameters, measurement, options
        self.paths = list(measurement.signals)
        self.reasons = dict(reasons)
        system = compile_diagram(diagram).system
        self.layout, self.aliases = system.signals_layout, system.aliases
        names = parameters.entries
        self._exact = [k for k in range(len(names)) if parameters.whole_of(k) not in reasons]
        self._diagram = diagram
        self._structural: dict[str, object] | None = None
        self._compiled: CompiledSystem | None = None
        self._own: frozenset[str] = frozenset()
        time = measurement.time
        self._times = time if time[0] == 0.0 else np.insert(time, 0, 0.0)

    def evaluate(self, theta: Array) -> tuple[Array, Array]:
        """The signals ``(N, m)`` and their derivatives ``(N, m, k)``."""
        result = self._exact_run(theta)
        outputs = self._outputs(result)
        derivatives = np.zeros((*outputs.shape, len(theta)))
        for k in range(len(theta)):
            if k in self._exact:
                name = self.parameters.entries[k]
                columns = [self._rows(result[sensitivity_name(path, name)]) for path in self.paths]
                derivatives[:, :, k] = np.hstack(columns)
            else:
                derivatives[:, :, k] = self._difference(theta, k)
        return outputs, derivatives

    def outputs(self, theta: Array) -> Array:
        """The signals ``(N, m)``."""
        return self._outputs(self._exact_run(theta))

    def _exact_run(self, theta: Array) -> SimulationResult:
        """The run with the exact derivatives."""
        values = self.parameters.values(theta)
        exact = {self.parameters.whole_of(k) for k in self._exact}
        structural = {name: value for name, value in values.items() if name not in exact}
        if self._compiled is None or repr(structural) != repr(self._structural):
            self._compile(structural)
        compiled = self._compiled
        assert compiled is not None
        p = compiled.parameter_values.copy()
        for name in exact:
            # The parameter of a mask is a change of its value.
            offset = 0.0 if name in self._own else parameter_value(self._diagram, name, self._diagram.name)
            p[compiled.parameters.ranges[name]] = (np.asarray(values[name]) - offset).ravel()
        return self._run(self._diagram, compiled, p, self.options)

    def _compile(self, structural: dict[str, object]) -> None:
        if structural:
            self._diagram = with_parameters(self._diagram, structural)
        self._structural = structural
        plain = compile_diagram(self._diagram)
        names = [self.parameters.entries[k] for k in self._exact]
        self._own = frozenset(plain.system.parameters.names)
        if names:
            extended = with_mask_parameters(plain.system, self._diagram, names)
            self._compiled = compile_system(sensitivity_system(extended, names, self.paths))
        else:
            self._compiled = plain.compiled

    def _difference(self, theta: Array, k: int) -> Array:
        """The central difference of two runs at a tight tolerance, (N, m)."""
        step = _STEP * max(abs(float(theta[k])), abs(float(self.parameters.start[k])), 1e-3)
        rtol = min(self.options.rtol, _TOLERANCE)
        options = replace(self.options, rtol=rtol, atol=min(self.options.atol, 1e-2 * rtol))
        sides: list[Array] = []
        for sign in (1.0, -1.0):
            shifted = theta.copy()
            shifted[k] += sign * step
            model = compile_diagram(with_parameters(self._diagram, self.parameters.values(shifted)))
            sides.append(self._outputs(self._run(model.diagram, model.compiled, None, options)))
        return (sides[0] - sides[1]) / (2.0 * step)

    def _run(
        self, diagram: Diagram, compiled: CompiledSystem, p: Array | None, options: SimulationOptions
    ) -> SimulationResult:
        calls = called_functions(diagram, compiled)
        result = run_to_the_end(Simulation(compiled, options, p, calls=calls, times=self._times))
        check_interrupt(result)
        if len(result.time) < len(self._times):
            raise SimulationError(
                f"the run ended at {result.time[-1]:.6g} s, before the last measured time "
                f"{self._times[-1]:.6g} s",
                where=diagram.name,
                allowed="runs that reach the last measured time",
                fix="remove the block that ends the run, or the measurements after this time",
                partial=result,
            )
        return result

    def _outputs(self, result: SimulationResult) -> Array:
        return np.hstack([self._rows(result[path]) for path in self.paths])

    def _rows(self, values: Array) -> Array:
        rows = values.reshape(len(self._times), -1)
        return rows[len(self._times) - len(self.measurement.time) :]


def reasons_without_derivative(
    diagram: Diagram, parameters: FittedParameters, paths: Sequence[str]
) -> dict[str, str]:
    """The parameters that have no exact derivative, with the reason."""

    def attempt(names: Sequence[str]) -> str:
        system = compile_diagram(diagram).system
        try:
            sensitivity_system(with_mask_parameters(system, diagram, names), names, paths)
        except (InputError, UnknownNameError) as error:
            return "it changes the equations" if isinstance(error, UnknownNameError) else error.what
        return ""

    wholes = parameters.wholes
    if not attempt(wholes):
        return {}
    reasons = {name: attempt([name]) for name in wholes}
    return {name: reason for name, reason in reasons.items() if reason}
