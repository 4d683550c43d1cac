"""Editing the mask of a diagram, for the dialog "Edit mask"."""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping
from typing import Any

from armblocks.diagram import Block, Diagram, DiagramBlock, Parameter, ParameterKind
from armblocks.diagram.diagram import block_in_scope
from armblocks.diagram.mask import parameters_read
from armblocks.diagram.parameter import REQUIRED, Value
from armblocks.errors import DiagramError, InputError, UnknownNameError
from armblocks.studio.protocol.messages.sheet_edits import MaskParameter, SetMask
from armblocks.studio.sheet.nesting import with_block
from armblocks.studio.sheet.parameter_values import ResolveRobot, parameter_json, parameter_value

_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}


def mask_of(diagram: Diagram) -> SetMask:
    """Return the mask of a diagram as the edit that declares it."""
    return SetMask(name=diagram.name, parameters=[_mask_parameter(rule) for rule in diagram.mask])


def _mask_parameter(rule: Parameter) -> MaskParameter:
    return MaskParameter(
        name=rule.name,
        was=rule.name,
        kind=rule.kind.value,  # pyright: ignore[reportArgumentType]
        default=parameter_json(rule.default),
        unit=rule.unit,
        doc=rule.doc,
        minimum=rule.minimum if math.isfinite(rule.minimum) else None,
        above=rule.above,
        maximum=rule.maximum if math.isfinite(rule.maximum) else None,
        choices=list(rule.choices),
    )


def with_mask(edit: SetMask, diagram: Diagram, resolve_robot: ResolveRobot) -> Diagram:
    """Return the diagram after an edit of its mask or of the mask of one of its subsystems.

    Renamed parameters are renamed in all formulas; parameters keep their values. Raises ``DiagramError`` for
    a block without a mask and for removing a parameter that a formula reads, and the errors of invalid
    declarations and values.
    """
    if not edit.block:
        return _masked(edit, diagram, resolve_robot)
    if edit.block not in diagram.blocks:
        raise UnknownNameError("block", edit.block, diagram.blocks, where=f"diagram '{diagram.name}'")
    block = diagram.blocks[edit.block]
    where = f"block '{edit.block}' ({block.title})"
    if not isinstance(block, DiagramBlock):
        raise DiagramError(
            "the block cannot have a mask",
            where=where,
            allowed="subsystems",
            fix="put it into a subsystem first",
        )
    if block.diagram.link:
        raise DiagramError(
            f"the mask belongs to the library block '{block.diagram.link}'",
            where=where,
            allowed="changing the values of its parameters",
            fix="break the link first",
        )
    names = _renamings(edit) | {rule.name: rule.name for rule in block.parameters()}
    changed = dataclasses.replace(
        block,
        diagram=_masked(edit, block.diagram, resolve_robot),
        formulas=tuple(sorted((names[name], text) for name, text in block.formulas if name in names)),
    )
    return with_block(diagram, edit.block, block_in_scope(edit.block, changed, diagram.mask_values))


def _renamings(edit: SetMask) -> dict[str, str]:
    """Map the former names of the remaining parameters to their new names."""
    return {rule.was: rule.name for rule in edit.parameters if rule.was}


def _masked(edit: SetMask, diagram: Diagram, resolve_robot: ResolveRobot) -> Diagram:
    where = f"diagram '{diagram.name}'"
    old = {rule.name: rule for rule in diagram.mask}
    names = _renamings(edit)
    for name in names:
        if name not in old:
            raise UnknownNameError("mask parameter", name, old, where=where)
    mask = tuple(_rule(rule, old.get(rule.was), where, resolve_robot) for rule in edit.parameters)
    values: dict[str, Value] = {}
    for declaration, rule in zip(edit.parameters, mask):
        before = old.get(declaration.was)
        # A parameter with a new type takes its default; a value equal to the old default becomes the new
        # default.
        if before is None or before.kind is not rule.kind:
            continue
        if (value := diagram.mask_values[declaration.was]) != before.default:
            values[rule.name] = rule.check(value, f"{where}, '{rule.name}'")
    removed = [name for name in old if name not in names]
    blocks = {
        name: _with_renamed_parameters(name, block, names, removed) for name, block in diagram.blocks.items()
    }
    return dataclasses.replace(
        diagram, name=edit.name or diagram.name, mask=mask, mask_values=values, blocks=blocks
    )


def _rule(
    declaration: MaskParameter, old: Parameter | None, where: str, resolve_robot: ResolveRobot
) -> Parameter:
    """Return the declaration; properties that the dialog does not show are unchanged."""
    kind = ParameterKind(declaration.kind)
    plain = Parameter(name="", kind=kind, doc="", default=REQUIRED)
    base = plain if old is None or old.kind is not kind else old
    rule = dataclasses.replace(
        base,
        name=declaration.name,
        doc=declaration.doc,
        unit=declaration.unit,
        default=REQUIRED,
        minimum=-math.inf if declaration.minimum is None else declaration.minimum,
        above=declaration.above,
        maximum=math.inf if declaration.maximum is None else declaration.maximum,
        choices=tuple(declaration.choices),
    )
    default = parameter_value(rule, _typed(declaration, where), where, resolve_robot)
    return dataclasses.replace(rule, default=default)


def _typed(declaration: MaskParameter, where: str) -> Any:
    typed = declaration.default
    if declaration.kind != "boolean" or not isinstance(typed, str):
        return typed
    if typed.strip().lower() not in _BOOLEANS:
        raise InputError(
            f"the value is '{typed[:40]}'",
            where=f"{where}, parameter '{declaration.name}'",
            allowed="true or false",
            fix="choose one of the two",
        )
    return _BOOLEANS[typed.strip().lower()]


def _with_renamed_parameters(name: str, block: Block, names: Mapping[str, str], removed: list[str]) -> Block:
    """Return the block with the new parameter names in its formulas."""
    formulas: list[tuple[str, str]] = []
    for parameter, text in block.formulas:
        missing = parameters_read(text, removed)
        if missing:
            raise DiagramError(
                f"the mask parameter '{min(missing)}' is removed, and the formula '{text[:60]}' reads it",
                where=f"block '{name}' ({block.title}), parameter '{parameter}'",
                allowed="removing a parameter that no formula reads",
                fix="change that formula first, or keep the parameter",
            )
        formulas.append((parameter, renamed_in(text, names)))
    changed = tuple(formulas)
    return block if changed == block.formulas else dataclasses.replace(block, formulas=changed)


def renamed_in(formula: str, names: Mapping[str, str]) -> str:
    """Return the formula with all names replaced at the same time, so that names can be exchanged."""
    return re.sub(r"(?<![\w.])[^\W\d]\w*", lambda match: names.get(match[0], match[0]), formula)
