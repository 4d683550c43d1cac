"""Functions shared by elementwise blocks: numbered ports, broadcast shapes, common units."""

from __future__ import annotations

from collections.abc import Mapping

from armblocks.diagram import Block, Port, broadcast, shape_of
from armblocks.equations import Shape


def numbered_ports(letter: str, count: int, doc: str) -> tuple[Port, ...]:
    """Ports ``u1, u2, …``; a single port is named ``u``."""
    if count == 1:
        return (Port(letter, doc),)
    return tuple(Port(f"{letter}{k}", f"{doc} {k}") for k in range(1, count + 1))


def parameters_shape(block: Block, *names: str) -> Shape:
    """The common shape of array parameters, with broadcasting. Raises ``InputError`` for other shapes."""
    return broadcast({name: shape_of(block.parameter_value(name)) for name in names})


def common_unit(units: Mapping[str, str]) -> str:
    """The common unit of all quantities; ``""`` if the units differ."""
    distinct = set(units.values())
    return distinct.pop() if len(distinct) == 1 else ""


def unit_of_terms(units: Mapping[str, str]) -> Mapping[str, str]:
    """For each name, the common unit of quantities that are added, compared or selected."""
    return dict.fromkeys(units, common_unit({name: unit for name, unit in units.items() if unit}))
