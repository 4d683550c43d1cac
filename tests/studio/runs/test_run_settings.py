"""Configuration parameters: accepted texts, and errors of invalid ones."""

from __future__ import annotations

import dataclasses

import pytest

from armblocks.equations import SimulationOptions
from armblocks.errors import InputError, UnknownNameError
from armblocks.studio.runs.settings import setting_rules, solver_choices
from armblocks.studio.sheet.typed_settings import setting_faults, with_settings


def test_every_run_option_has_a_field() -> None:
    names = {field.name for field in dataclasses.fields(SimulationOptions)}
    assert {rule.name for rule in setting_rules()} == names
    assert all(rule.doc for rule in setting_rules())
    assert {choice.name for choice in solver_choices()} >= {"auto", "rk45", "rk4", "rodas5p"}
    assert {choice.name for choice in solver_choices() if choice.stiff} >= {"rodas5p", "ros5"}


def test_numeric_formulas_are_evaluated_and_empty_fields_select_the_default() -> None:
    options = with_settings(
        SimulationOptions(step=0.5), {"stop_time": "2*pi", "rtol": "1/1000", "step": None}
    )
    assert options == SimulationOptions(stop_time=2 * 3.141592653589793, rtol=1e-3)


@pytest.mark.parametrize(
    ("values", "name", "words"),
    [
        ({"stop_time": "soon"}, "stop_time", "soon"),
        ({"stop_time": "[1 2]"}, "stop_time", "stop_time is a list"),
        ({"stop_time": "-1"}, "stop_time", "a finite time in s"),
        ({"rtol": "2"}, "rtol", "rtol is 2.0"),
        ({"step": "20"}, "step", "at most the stop time 10 s"),
        ({"solver": "magic"}, "solver", "magic"),
        ({"solver": "rk45", "step": "0.1"}, "step", "solver rk45 chooses its own steps"),
        ({"max_step": "0"}, "max_step", "a time in s above 0"),
    ],
)
def test_an_invalid_setting_gives_an_error_at_its_field(
    values: dict[str, str], name: str, words: str
) -> None:
    faults = setting_faults(SimulationOptions(), values)
    assert list(faults) == [name]
    assert words in faults[name]
    with pytest.raises((InputError, UnknownNameError)):
        with_settings(SimulationOptions(), dict(values))


def test_an_unknown_setting_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="setting"):
        with_settings(SimulationOptions(), {"speed": 1.0})
