"""Conversion of the settings that a user types to run options, and error texts for invalid settings."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from armblocks.equations import SimulationOptions
from armblocks.errors import ArmblocksError, InputError, UnknownNameError
from armblocks.simulation.plan import check_options
from armblocks.simulation.tableaux import find_tableau
from armblocks.studio.sheet.parameter_values import number_value

SettingValue = bool | float | str | None


def with_settings(options: SimulationOptions, values: Mapping[str, SettingValue]) -> SimulationOptions:
    """Return the options with the given values; numbers may be typed as formulas such as ``1/1000``.

    Raises ``UnknownNameError`` or ``InputError`` for a setting that a run does not allow.
    """
    setting_names = [field.name for field in dataclasses.fields(SimulationOptions)]
    for name in values:
        if name not in setting_names:
            raise UnknownNameError("setting", name, setting_names)
    parsed: dict[str, Any] = {name: _parsed(name, value) for name, value in values.items()}
    changed = dataclasses.replace(options, **parsed)
    check_options(changed, "the settings")
    tableau = None if changed.solver.casefold() == "auto" else find_tableau(changed.solver)
    if tableau is not None and tableau.adaptive and changed.step is not None:
        raise InputError(
            f"step is {changed.step:g} s, and solver {tableau.name} chooses its own steps",
            where="the settings",
            allowed="no step, or a fixed-step solver",
            fix="use the largest step to bound the steps, or choose rk4",
        )
    return changed


def setting_faults(options: SimulationOptions, values: Mapping[str, SettingValue]) -> dict[str, str]:
    """Return error texts for invalid settings by name, for display while the user types."""
    faults: dict[str, str] = {}
    for name, value in values.items():
        try:
            _parsed(name, value)
        except ArmblocksError as error:
            faults[name] = _error_text(error)
    if faults:
        return faults
    try:
        with_settings(options, values)
    except ArmblocksError as error:
        # The error text begins with the name of the setting.
        name = next((name for name in values if error.what.startswith(name)), "solver")
        return {name: _error_text(error)}
    return {}


def _parsed(name: str, value: SettingValue) -> SettingValue:
    if not isinstance(value, str) or name == "solver":
        return value
    number = number_value(value, name)
    if isinstance(number, list):
        raise InputError(
            f"{name} is a list", where="the settings", allowed="one number", fix="type one number"
        )
    return number


def _error_text(error: ArmblocksError) -> str:
    return f"{error.what}. Allowed: {error.allowed}" if error.allowed else error.what
