"""How the signals of a run follow its parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armblocks.compiler.system import compile_system
from armblocks.diagram import Diagram
from armblocks.diagram.mask_tuning import mask_parameters, with_mask_parameters
from armblocks.equations.sensitivity import sensitivity_name, sensitivity_system
from armblocks.errors import InputError, UnknownNameError
from armblocks.face.linearizing import described_diagram
from armblocks.face.model import CompiledDiagram, compile_diagram
from armblocks.simulation import SimulationResult
from armblocks.simulation import simulate as run_system

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class SensitivityResult:
    """A run with the derivatives of some of its signals by some parameters.

    ``result[output, parameter]`` is d output / d parameter, ``(N, *shape of the output)``, at ``time`` (N,)
    s; an entry of a vector parameter is named ``pid.kp[0]``. ``run`` has all signals as well, and the
    derivatives under ``"output by parameter"``.
    """

    run: SimulationResult
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]

    @property
    def time(self) -> Array:
        """Instants (N,), s."""
        return self.run.time

    def __getitem__(self, key: tuple[str, str]) -> Array:
        output, parameter = key
        if parameter not in self.parameters:
            raise UnknownNameError("parameter", parameter, self.parameters, where=self.run.name)
        return self.run[sensitivity_name(self.run.resolve(output), parameter)]

    def __repr__(self) -> str:
        head = f"<SensitivityResult {self.run.name}: {self.time.size} instants>"
        lines = [f"  d {output} / d {name}" for output in self.outputs for name in self.parameters]
        return "\n".join([head, *lines])


def sensitivity(
    diagram: Diagram | CompiledDiagram | str | PathLike[str],
    parameters: str | Sequence[str],
    outputs: str | Sequence[str],
    *,
    values: Mapping[str, object] | None = None,
    **settings: Any,
) -> SensitivityResult:
    """Run a diagram together with the exact derivatives of ``outputs`` by tunable ``parameters``.

    Parameters of masks are among them, and what follows from them by formulas is moved with them.

    The traced equations are differentiated and integrated beside the equations themselves, natively, under
    the same error control; ticks, implicit equations and the instants of events are accounted for.
    ``values``: other values of parameters; ``settings`` those of the run, as in :func:`simulate`.

    Raises ``UnknownNameError`` for names; ``InputError`` for a parameter that says when a signal jumps or
    is a table that is read by index, and where events and implicit equations come together;
    ``SimulationError`` as a run does.
    """
    described = described_diagram(diagram, values)
    names = (parameters,) if isinstance(parameters, str) else tuple(parameters)
    system = with_mask_parameters(compile_diagram(described).system, described, names)
    wanted = (outputs,) if isinstance(outputs, str) else tuple(outputs)
    if not names or not wanted:
        raise InputError(
            f"{len(names)} parameters and {len(wanted)} outputs are given",
            allowed="one or more of each",
            where=system.name,
            fix="name a parameter and an output",
        )
    for name in names:
        if name not in system.parameters.ranges:
            known = [*mask_parameters(described), *system.parameters.names]
            raise UnknownNameError("tunable parameter", name, known, where=system.name)
    paths = [system.aliases.get(name, name) for name in wanted]
    for path in paths:
        if path not in system.signals_layout.ranges:
            known = [*system.signals_layout.names, *system.aliases]
            raise UnknownNameError("signal", path, known, where=system.name)
    augmented = sensitivity_system(system, names, paths)
    options = dataclasses.replace(described.settings, **settings)
    return SensitivityResult(
        run=run_system(compile_system(augmented), options),
        outputs=wanted,
        parameters=tuple(element for name in names for element in system.parameters[name].elements),
    )
