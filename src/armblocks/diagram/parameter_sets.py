"""Parameter sets: named values of parameters that are stored with a diagram and applied on request.

``diagram.parameter_sets["stiff"]`` maps paths, ``"controller/pid.kp"``, ``"controller.kp"`` or ``"kp"`` as in
:func:`~armblocks.diagram.with_parameters`, to values. The diagram itself keeps its own values; sets of inner
diagrams are stored, but only sets of the outermost diagram can be applied.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from armblocks.diagram.diagram import Diagram
from armblocks.diagram.mask_tuning import dependent_parameters
from armblocks.diagram.names import check_new_name
from armblocks.diagram.parameter import Parameter, ParameterKind, Value
from armblocks.diagram.variation import check_settable, found_block, with_parameters
from armblocks.errors import ArmblocksError, DiagramError, UnknownNameError, check_type

MAX_SETS = 1000
"""Maximum number of parameter sets of a diagram."""
MAX_SET_VALUES = 1000
"""Maximum number of parameters of a set."""
_KINDS = (
    ParameterKind.NUMBER,
    ParameterKind.ARRAY,
    ParameterKind.INTEGER,
    ParameterKind.BOOLEAN,
    ParameterKind.CHOICE,
    ParameterKind.STRING,
)


def settable_parameter(diagram: Diagram, path: str) -> tuple[Parameter, Value]:
    """The rule and the present value of the parameter at a path, which a parameter set may change.

    Raises ``UnknownNameError`` if it does not exist, ``DiagramError`` if a formula or a library determines
    it, and for robots, tables, functions and diagrams.
    """
    name, _, parameter = path.rpartition(".")
    if not name:
        valid_paths = [*diagram.mask_values, *(f"{block}.…" for block in diagram.blocks)]
        rule = _rule(diagram.mask, path, valid_paths, f"diagram '{diagram.name}'")
        return rule, diagram.mask_values[parameter]
    outside, level, inner = found_block(diagram, name)
    block = level.block(inner)
    rules = block.own_parameters()
    rule = _rule(rules, path, [entry.name for entry in rules], f"block '{name}' ({block.title})")
    check_settable(outside, name, block, parameter)
    return rule, block.parameter_value(parameter)


def _rule(rules: Sequence[Parameter], path: str, known: Sequence[str], where: str) -> Parameter:
    name = path.rpartition(".")[2]
    rule = next((rule for rule in rules if rule.name == name), None)
    if rule is None:
        raise UnknownNameError("parameter", name, known, where=where)
    if rule.kind not in _KINDS:
        raise DiagramError(
            f"'{path}' is a {rule.kind.value}",
            where=where,
            allowed="parameters that are numbers, arrays, choices or strings",
            fix="remove it from the parameter set",
        )
    return rule


def is_tunable(diagram: Diagram, path: str) -> bool:
    """Whether the parameter at a path may change during a run. Raises as :func:`settable_parameter`."""
    settable_parameter(diagram, path)
    name, _, parameter = path.rpartition(".")
    if name:
        _, level, inner = found_block(diagram, name)
        block = level.block(inner)
        if any(rule.name == parameter for rule in block.parameters()):
            return any(rule.name == parameter and rule.tunable for rule in block.inputs_of_the_run())
    try:
        return not dependent_parameters(diagram, path).structural
    except UnknownNameError:  # in a commented subsystem
        return False


def checked_set(diagram: Diagram, values: Mapping[str, object], where: str) -> dict[str, Value]:
    """The values of a parameter set in canonical form, each checked by the rule of its parameter.

    Relations between parameters are checked when the set is applied. Raises ``UnknownNameError``,
    ``DiagramError`` and ``InputError`` that name the parameter.
    """
    check_value_count(len(values), where)
    return {path: checked_entry(diagram, path, value, where) for path, value in values.items()}


def check_value_count(count: int, where: str) -> None:
    """Raise ``DiagramError`` for a parameter set with too many values."""
    if count > MAX_SET_VALUES:
        raise DiagramError(
            f"the parameter set has {count} parameters",
            where=where,
            allowed=f"at most {MAX_SET_VALUES}",
            fix="divide it into several sets",
        )


def checked_entry(diagram: Diagram, path: str, value: object, where: str) -> Value:
    """One value of a parameter set in canonical form; raises as :func:`checked_set`."""
    try:
        rule, _ = settable_parameter(diagram, path)
    except UnknownNameError as error:
        place = f"{where}, {error.where}"
        raise UnknownNameError(error.kind, error.name, error.known, where=place) from None
    except ArmblocksError as error:
        place = f"{where}, {error.where}"
        raise DiagramError(error.what, where=place, allowed=error.allowed, fix=error.fix) from None
    return rule.check(value, f"{where}, '{path}'")


def check_set_name(name: str, others: Iterable[str], where: str) -> None:
    """Raise ``DiagramError`` for a name that is empty, too long, not printable, or used by another set."""
    check_new_name(name, others, where, noun="parameter set", max_count=MAX_SETS)


def check_parameter_sets(diagram: Diagram) -> None:
    """Raise ``DiagramError`` or ``UnknownNameError`` for a set whose parameters or values are invalid."""
    for name, values in diagram.parameter_sets.items():
        checked_set(diagram, values, set_location(diagram, name))


def set_location(diagram: Diagram, name: str) -> str:
    """The location of a parameter set in messages."""
    return f"diagram '{diagram.name}', parameter set '{name}'"


def parameter_set(diagram: Diagram, name: str) -> Mapping[str, Value]:
    """The values of a parameter set; raises ``UnknownNameError`` with the nearest name."""
    if name not in diagram.parameter_sets:
        raise UnknownNameError(
            "parameter set", name, diagram.parameter_sets, where=f"diagram '{diagram.name}'"
        )
    return diagram.parameter_sets[name]


def with_parameter_set(diagram: Diagram, name: str) -> Diagram:
    """A copy of a diagram with the values of one of its parameter sets, which are checked.

    Parameters that the set does not contain keep the values of the diagram. Raises ``UnknownNameError`` for
    an unknown set, and for a set with a parameter that does not exist; ``DiagramError`` for values that the
    diagram does not allow.
    """
    check_type(diagram, Diagram, "a Diagram", where="with_parameter_set")
    values = checked_set(diagram, parameter_set(diagram, name), set_location(diagram, name))
    return with_parameters(diagram, values)
