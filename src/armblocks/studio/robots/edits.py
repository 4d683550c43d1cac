"""The edits of robots; each is a pure function from one robot to the next.

Cell texts are parsed like block parameters (:mod:`armblocks.studio.sheet.parameter_values`): numbers and
numeric formulas, by the interpreter of MATLAB scripts. A robot is always valid: an edit that leads to an
invalid robot is refused with the reason, and the robot is unchanged.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

from armblocks.errors import InputError, RobotError, counted
from armblocks.robot import DhConvention, DhRow, Link, Robot, link_from_dh, serial_chain
from armblocks.robot.dh_conversion import converted, reread
from armblocks.studio.documents.edit_table import EditTable
from armblocks.studio.protocol.messages.robot_edits import (
    AddJoint,
    MoveJoint,
    RemoveJoint,
    RenameLink,
    SetCell,
    SetConvention,
)
from armblocks.studio.robots.columns import ROBOT_COLUMNS, Column, Owner, Quantity, Value
from armblocks.studio.robots.link_columns import LINK_COLUMNS
from armblocks.studio.sheet.parameter_values import number_value

_EXPLICIT_UNIT = re.compile(r"\b(pi|deg|rad)\b|°")
_UNIT_AFTER_NUMBER = re.compile(r"(?<=[0-9.)])\s*(deg|rad)\b")
_DEGREES = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(?:\*?\s*deg|°)\s*")


ROBOT_EDITS: EditTable[Robot, []] = EditTable()


# -- cells ---------------------------------------------------------------------------------------------------


def _cell_title(edit: SetCell) -> str:
    column = LINK_COLUMNS.get(edit.column) or ROBOT_COLUMNS.get(edit.column)
    title = column.title if column else edit.column
    return f"{title} of {edit.link or (column.group.lower() if column and column.group else 'robot')}"


@ROBOT_EDITS.on(SetCell, _cell_title)
def _set_cell(edit: SetCell, robot: Robot) -> Robot:
    if not edit.link:
        column = _column(ROBOT_COLUMNS, edit.column)
        return column.write(robot, _typed_value(column, robot, edit, f"robot '{robot.name}'", turns=False))
    link = robot.link(edit.link)
    column = _column(LINK_COLUMNS, edit.column)
    where = f"link '{link.name}', {column.title}"
    if why := column.locked(link):
        raise InputError("this cell cannot be edited", where=where, allowed=why, fix="edit another cell")
    changed = column.write(link, _typed_value(column, link, edit, where, turns=link.joint.rotates))
    return replace(robot, links=tuple(changed if other is link else other for other in robot.links))


def _column(columns: Mapping[str, Column[Owner]], name: str) -> Column[Owner]:
    if name not in columns:
        raise InputError(
            f"there is no column '{name[:40]}'",
            allowed=", ".join(columns),
            where="robot table",
            fix="choose one of these columns",
        )
    return columns[name]


def _typed_value(column: Column[Owner], owner: Owner, edit: SetCell, where: str, *, turns: bool) -> Value:
    """Return the SI value of the typed text."""
    text = edit.text.strip()
    if column.quantity is Quantity.TEXT:
        return text
    if column.quantity is Quantity.CHOICE:
        if text not in column.choices:
            raise InputError(
                f"'{text[:40]}' is not a choice",
                where=where,
                allowed=", ".join(column.choices),
                fix="choose one from the list",
            )
        return text
    if not text:
        if column.optional:
            return None
        raise InputError("the cell is empty", where=where, allowed="a number", fix="type 0 for no value")
    angular = column.quantity is Quantity.ANGLE or (
        turns and column.quantity in (Quantity.COORDINATE, Quantity.RATE)
    )
    value = angle_value(text, where, edit.angles) if angular else _one_number(text, where)
    if not math.isfinite(value):
        raise InputError(
            f"{column.title} is {value}", where=where, allowed="a finite number", fix="type a finite number"
        )
    return value


def angle_value(text: str, where: str, unit: Literal["deg", "rad"]) -> float:
    """Parse an angle, in rad; a plain number is in ``unit``.

    A text that contains ``pi``, ``deg``, ``°`` or ``rad`` has its own unit: ``pi/2`` is a right angle also in
    a table in degrees. Whole degrees give the same float as ``math.radians``.
    """
    if degrees := _DEGREES.fullmatch(text):
        return math.radians(_one_number(degrees.group(1), where))
    if _EXPLICIT_UNIT.search(text):
        return _one_number(_UNIT_AFTER_NUMBER.sub(r"*\1", text.replace("°", "*deg")), where)
    value = _one_number(text, where)
    return math.radians(value) if unit == "deg" else value


def _one_number(text: str, where: str) -> float:
    value = number_value(text, where)
    if isinstance(value, list):
        raise InputError(
            f"{counted(len(value), 'number was', 'numbers were')} typed",
            where=where,
            allowed="one number",
            fix="type one number",
        )
    return value


# -- links ---------------------------------------------------------------------------------------------------


@ROBOT_EDITS.on(RenameLink, lambda edit: f"name of {edit.link}")
def _rename(edit: RenameLink, robot: Robot) -> Robot:
    old, name = robot.link(edit.link).name, edit.name.strip()
    links = tuple(
        replace(
            link,
            name=name if link.name == old else link.name,
            parent=name if link.parent == old else link.parent,
        )
        for link in robot.links
    )
    constraints = tuple(constraint.with_renamed_link(old, name) for constraint in robot.constraints)
    frames = tuple(frame.with_renamed_link(old, name) for frame in robot.frames)
    springs = tuple(spring.with_renamed_link(old, name) for spring in robot.springs)
    return replace(robot, links=links, constraints=constraints, frames=frames, springs=springs)


def _is_chain(robot: Robot) -> bool:
    return robot.links == serial_chain(robot.links)


@ROBOT_EDITS.on(AddJoint, lambda edit: "new joint")
def _add_joint(edit: AddJoint, robot: Robot) -> Robot:
    """Insert a revolute link with the convention of its neighbour between a link and its children."""
    after = edit.after
    links = list(robot.links)
    index = links.index(robot.link(after)) + 1 if after else 0
    neighbour = next((link.dh for link in links[index - 1 :: -1] + links if link.dh is not None), None)
    convention = neighbour.convention if neighbour is not None else DhConvention.STANDARD
    name = _free_name(links)
    new_link = link_from_dh(name, DhRow(a=0.2, convention=convention), parent=after or None)
    # In a tree, a link inserted at the base is a second root, not the parent of the other roots.
    is_inserted = bool(after) or _is_chain(robot)
    reparented = [
        replace(link, parent=name) if is_inserted and link.parent == new_link.parent else link
        for link in links
    ]
    return replace(robot, links=(*reparented[:index], new_link, *reparented[index:]))


def _free_name(links: Sequence[Link]) -> str:
    used_names = {link.name for link in links}
    return next(name for k in range(1, len(links) + 2) if (name := f"link{len(links) + k}") not in used_names)


@ROBOT_EDITS.on(RemoveJoint, lambda edit: f"remove {edit.link}")
def _remove_joint(edit: RemoveJoint, robot: Robot) -> Robot:
    removed = robot.link(edit.link)
    if len(robot.links) == 1:
        raise RobotError(
            "a robot has at least one link",
            where=f"robot '{robot.name}'",
            allowed="removing a link of several",
            fix="change this link instead",
        )
    links = tuple(
        replace(link, parent=removed.parent) if link.parent == removed.name else link
        for link in robot.links
        if link is not removed
    )
    return replace(robot, links=links)


@ROBOT_EDITS.on(MoveJoint, lambda edit: f"move {edit.link}")
def _move_joint(edit: MoveJoint, robot: Robot) -> Robot:
    name, by = edit.link, edit.by
    links = list(robot.links)
    index = links.index(robot.link(name))
    if not _is_chain(robot):
        raise RobotError(
            "the links do not form a single chain",
            where=f"robot '{robot.name}'",
            allowed="reordering the links of a chain, not of a tree",
            fix="change the parents of the links",
        )
    if not 0 <= index + by < len(links):
        raise InputError(
            "there is no link on that side",
            where=f"link '{name}'",
            allowed="the other direction",
            fix="move it the other way",
        )
    links[index], links[index + by] = links[index + by], links[index]
    return replace(robot, links=serial_chain(links))


@ROBOT_EDITS.on(SetConvention, lambda edit: f"{edit.convention} D-H")
def _set_convention(edit: SetConvention, robot: Robot) -> Robot:
    change = converted if edit.keep_arm else reread
    return change(robot, DhConvention(edit.convention))
