"""Catalogues of motors and gears as CSV files."""

from __future__ import annotations

import csv
import dataclasses
import io
import math
from os import PathLike, fspath
from typing import Any

from armblocks.errors import InputError, UnknownNameError
from armblocks.files import read_bounded
from armblocks.report.drive_load import Drive

_MAX_BYTES = 1 << 24
_FROM_RPM = math.pi / 30.0
_COLUMNS = {
    "name": ("name", 1.0),
    "joint": ("joints", 1.0),
    "gear_ratio": ("gear_ratio", 1.0),
    "inertia_kgm2": ("inertia", 1.0),
    "stall_torque_nm": ("stall_torque", 1.0),
    "rated_torque_nm": ("rated_torque", 1.0),
    "rated_speed_rpm": ("rated_speed", _FROM_RPM),
    "peak_torque_nm": ("peak_torque", 1.0),
    "corner_speed_rpm": ("corner_speed", _FROM_RPM),
    "max_speed_rpm": ("max_speed", _FROM_RPM),
    "brake_torque_nm": ("brake_torque", 1.0),
    "thermal_time_constant_s": ("thermal_time_constant", 1.0),
    "efficiency": ("efficiency", 1.0),
    "gear_peak_torque_nm": ("gear_peak_torque", 1.0),
    "gear_rated_torque_nm": ("gear_rated_torque", 1.0),
    "gear_max_speed_rpm": ("gear_max_speed", _FROM_RPM),
    "viscous_friction_nms": ("viscous_friction", 1.0),
    "coulomb_friction_nm": ("coulomb_friction", 1.0),
    "torque_constant_nm_per_a": ("torque_constant", 1.0),
    "resistance_ohm": ("resistance", 1.0),
    "max_inertia_ratio": ("max_inertia_ratio", 1.0),
}
"""Field of :class:`Drive` and factor to its unit, by the name of a column."""
_REQUIRED = tuple(
    column
    for column, (field, _) in _COLUMNS.items()
    for entry in dataclasses.fields(Drive)
    if entry.name == field and entry.default is dataclasses.MISSING
)


def load_drives(path: str | PathLike[str]) -> tuple[Drive, ...]:
    """The candidate motors and gears of a CSV file, one in each row.

    Columns, with the quantities of :class:`Drive`:

    - required: ``name``, ``gear_ratio``, ``stall_torque_nm``, ``max_speed_rpm``;
    - ``joint``: names separated by semicolons; empty for all joints;
    - the motor: ``inertia_kgm2``, ``rated_torque_nm``, ``rated_speed_rpm``, ``peak_torque_nm``,
      ``corner_speed_rpm``, ``thermal_time_constant_s``, ``torque_constant_nm_per_a``, ``resistance_ohm``,
      ``max_inertia_ratio``;
    - the brake: ``brake_torque_nm``;
    - the gear: ``efficiency``, ``gear_peak_torque_nm``, ``gear_rated_torque_nm``, ``gear_max_speed_rpm``;
    - friction: ``viscous_friction_nms``, ``coulomb_friction_nm``.

    An empty cell is the default of :class:`Drive`.

    Raises ``FormatError`` for a file that cannot be read, ``UnknownNameError`` for other columns, and
    InputError that names the line for missing or invalid values.
    """
    name = fspath(path)
    text = read_bounded(name, _MAX_BYTES).decode("utf-8-sig", errors="replace")
    reader = csv.DictReader(io.StringIO(text))
    columns = [column.strip() for column in reader.fieldnames or ()]
    for column in columns:
        if column not in _COLUMNS:
            raise UnknownNameError("column", column, list(_COLUMNS), where=name)
    for column in _REQUIRED:
        if column not in columns:
            raise InputError(
                f"the column '{column}' is missing",
                where=name,
                allowed=f"at least the columns {', '.join(_REQUIRED)}",
                fix="add the column",
            )
    reader.fieldnames = columns
    drives = tuple(_drive(row, f"{name}:{reader.line_num}") for row in reader)
    if not drives:
        raise InputError(
            "the catalogue has no rows",
            where=name,
            allowed="a row for each drive below the names of the columns",
            fix="add the drives",
        )
    return drives


def _drive(row: dict[str | Any, str | Any], where: str) -> Drive:
    values: dict[str, object] = {}
    if None in row:
        raise InputError(
            "the row has more cells than the first line",
            where=where,
            allowed="as many cells as names of columns",
            fix="put entries with commas into quotation marks",
        )
    for column, text in row.items():
        cell = (text or "").strip()
        field, factor = _COLUMNS[column]
        if field == "name":
            values[field] = cell
        elif field == "joints":
            values[field] = tuple(part.strip() for part in cell.split(";") if part.strip())
        elif cell:
            try:
                values[field] = float(cell) * factor
            except ValueError:
                raise InputError(
                    f"{column} = '{cell}'",
                    where=where,
                    allowed="a number with a decimal point, or an empty cell",
                    fix="correct the cell",
                ) from None
        elif column in _REQUIRED:
            raise InputError(
                f"{column} is empty",
                where=where,
                allowed=f"a value for each of {', '.join(_REQUIRED)}",
                fix="fill in the cell",
            )
    try:
        return Drive(**values)  # pyright: ignore[reportArgumentType] - fields by name
    except InputError as error:
        raise InputError(
            error.what, where=f"{where}, {error.where}", allowed=error.allowed, fix=error.fix
        ) from None
