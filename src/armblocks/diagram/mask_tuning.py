"""The block parameters that depend on a mask parameter, and whether it may change during a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from casadi import SX, evalf, vertcat

from armblocks.diagram.block import Block
from armblocks.diagram.comments import active_levels
from armblocks.diagram.diagram import Diagram
from armblocks.diagram.hierarchy import flat_diagram
from armblocks.diagram.levels import joined, levels_of
from armblocks.diagram.mask import as_symbols, formula_symbols, parameters_read
from armblocks.diagram.parameter import Parameter, Value, shape_of
from armblocks.diagram.structure import DiagramBlock
from armblocks.equations import HybridSystem, Slot, substituted, unflatten
from armblocks.equations.added_parameters import AddedParameters, with_added_parameters
from armblocks.errors import InputError, UnknownNameError


@dataclass
class DependentParameters:
    """The parameters that depend on one mask parameter through formulas, by path, at any depth.

    ``tunable``: parameters that stay inputs of the compiled system, as formulas of the mask parameter's
    symbol. ``structural``: parameters that are constants of the equations.
    """

    tunable: dict[str, SX] = field(default_factory=dict[str, SX])
    structural: list[str] = field(default_factory=list[str])


def mask_parameters(diagram: Diagram) -> Mapping[str, tuple[Diagram, Parameter]]:
    """The mask parameters of a hierarchy by path, ``servo.kp`` or ``kp``, with their diagrams.

    Commented subsystems are omitted.
    """
    return {
        f"{path}.{rule.name}" if path else rule.name: (level, rule)
        for path, level in active_levels(levels_of(diagram)).items()
        for rule in level.mask
    }


def dependent_parameters(diagram: Diagram, path: str, symbol: SX | None = None) -> DependentParameters:
    """The parameters that depend on the mask parameter of this path, whose value is ``symbol``.

    Raises ``UnknownNameError`` for a path that is not a mask parameter.
    """
    level, rule = _mask_parameter(diagram, path)
    value = as_symbols(level.mask_values[rule.name])
    if symbol is None:
        symbol = SX.sym(rule.name, *((1, 1) if value is None else value.shape))
    return _dependents(diagram, {path: symbol})


def added_parameters(diagram: Diagram, paths: Sequence[str]) -> AddedParameters:
    """Mask parameters as parameters of the equations: their changes, and those of dependent parameters.

    Raises ``UnknownNameError`` for a path that is not a mask parameter, ``InputError`` for a parameter that
    is not a number or on which a structural parameter depends.
    """
    slots: list[Slot] = []
    perturbed: dict[str, SX] = {}
    changes: list[SX] = []
    for path in paths:
        level, rule = _mask_parameter(diagram, path)
        value = level.mask_values[rule.name]
        nominal = as_symbols(value)
        if nominal is None or isinstance(value, bool):
            raise InputError(
                f"the mask parameter '{path}' is {type(value).__name__}, which has no derivative",
                where=f"diagram '{diagram.name}'",
                allowed="numbers and arrays",
                fix="choose another parameter",
            )
        structural = dependent_parameters(diagram, path).structural
        if structural:
            raise InputError(
                f"'{structural[0]}', which is not tunable, depends on '{path}'",
                where=f"diagram '{diagram.name}'",
                allowed="parameters on which only tunable parameters depend",
                fix="use the difference of two runs for this parameter",
            )
        slots.append(Slot(path, shape_of(value), rule.unit))
        changes.append(SX.sym(rule.name, slots[-1].size))
        perturbed[path] = nominal + unflatten(changes[-1], slots[-1].shape)
    change = SX(vertcat(*changes))
    # A formula may contain several of the parameters: its change is that of all of them together.
    formulas = _dependents(diagram, perturbed).tunable
    return AddedParameters(
        slots=tuple(slots),
        symbols=tuple(changes),
        changes={
            name: formula - SX(evalf(substituted(formula, change, SX.zeros(change.numel()))))
            for name, formula in formulas.items()
        },
    )


def _mask_parameter(diagram: Diagram, path: str) -> tuple[Diagram, Parameter]:
    parameters = mask_parameters(diagram)
    if path not in parameters:
        raise UnknownNameError("mask parameter", path, parameters, where=f"diagram '{diagram.name}'")
    return parameters[path]


def with_mask_parameters(system: HybridSystem, diagram: Diagram, names: Iterable[str]) -> HybridSystem:
    """The equations of a diagram with the mask parameters among ``names`` as parameters.

    A name may be the name of one entry: ``servo.gains[1]``. Raises as :func:`added_parameters`.
    """
    parameters = mask_parameters(diagram)
    wholes = (name if name in parameters else name.rpartition("[")[0] for name in names)
    added = [
        name for name in dict.fromkeys(wholes) if name in parameters and name not in system.parameters.ranges
    ]
    if not added:
        return system
    return with_added_parameters(system, added_parameters(diagram, added))


def _dependents(diagram: Diagram, perturbed: Mapping[str, SX]) -> DependentParameters:
    """The parameters that depend on mask parameters, given by path with their symbols."""
    by_level: dict[str, dict[str, SX]] = {}
    for path, symbol in perturbed.items():
        level, _, name = path.rpartition(".")
        by_level.setdefault(level, {})[name] = symbol
    dependents = DependentParameters()
    _add_dependents("", diagram, {}, by_level, dependents)
    return dependents


def _add_dependents(
    path: str,
    level: Diagram,
    inherited: Mapping[str, SX],
    by_level: Mapping[str, Mapping[str, SX]],
    dependents: DependentParameters,
) -> None:
    """Find formulas of the perturbed parameters in one diagram and, recursively, in its subsystems.

    Perturbed are ``inherited``, the mask parameters that depend on those of the diagram around this one, and
    those of this level in ``by_level``.
    """
    perturbed = dict(inherited)
    for name, value in by_level.get(path, {}).items():
        nominal = as_symbols(level.mask_values[name])
        perturbed[name] = value
        if name in inherited and nominal is not None:
            perturbed[name] = inherited[name] + (value - nominal)
    constants = {
        name: symbols
        for name, value in level.mask_values.items()
        if (symbols := as_symbols(value)) is not None
    }
    for name, block in level.blocks.items():
        if name in level.commented:
            continue
        inner: dict[str, SX] = {}
        for parameter, text in block.formulas:
            if not parameters_read(text, perturbed):
                continue
            if isinstance(block, DiagramBlock) and parameter in block.diagram.mask_values:
                if as_symbols(block.diagram.mask_values[parameter]) is None:
                    inner[parameter] = SX.sym(parameter)  # a choice or a robot: the only formula is its name
                else:
                    inner[parameter] = formula_symbols(text, {**constants, **perturbed})
            elif _is_run_input(block, parameter):
                dependents.tunable[f"{joined(path, name)}.{parameter}"] = formula_symbols(
                    text, {**constants, **perturbed}
                )
            else:
                dependents.structural.append(f"{joined(path, name)}.{parameter}")
        below = joined(path, name)
        has_own = any(other == below or other.startswith(f"{below}/") for other in by_level)
        if isinstance(block, DiagramBlock) and (inner or has_own):
            _add_dependents(below, block.diagram, inner, by_level, dependents)


def _is_run_input(block: Block, parameter: str) -> bool:
    return any(rule.name == parameter for rule in block.inputs_of_the_run())


def tunable_parameters(diagram: Diagram) -> list[tuple[str, Parameter, Value]]:
    """Path, rule and value of every parameter that may be changed while the diagram runs.

    Mask parameters come first, then parameters of blocks without a formula and outside library blocks.
    """
    levels = levels_of(diagram)
    linked = [f"{path}/" for path, level in levels.items() if level.link]
    structural = {
        f"{joined(path, name)}.{parameter}"
        for path, level in levels.items()
        for name, block in level.blocks.items()
        for parameter, _ in block.formulas
    }
    parameters = [
        (path, rule, level.mask_values[rule.name])
        for path, (level, rule) in mask_parameters(diagram).items()
        if as_symbols(level.mask_values[rule.name]) is not None
        and not dependent_parameters(diagram, path).structural
    ]
    flat = flat_diagram(diagram)
    # Blocks that share parameters have the same paths.
    owners = {flat.owner(name): block for name, block in flat.blocks.items()}
    parameters += [
        (f"{name}.{rule.name}", rule, block.parameter_value(rule.name))
        for name, block in owners.items()
        for rule in block.inputs_of_the_run()
        if rule.tunable
    ]
    return [
        (path, rule, value)
        for path, rule, value in parameters
        if path not in structural and not any(path.startswith(inside) for inside in linked)
    ]
