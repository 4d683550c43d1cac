"""The run settings and solvers for the dialog of configuration parameters."""

from __future__ import annotations

import dataclasses

from armblocks.equations import SimulationOptions
from armblocks.integration.rosenbrock_tableau import RosenbrockTableau
from armblocks.simulation.tableaux import TABLEAUX
from armblocks.studio.protocol.messages.studio import SettingRule, SolverChoice

_RULES = (
    ("stop_time", "Stop time", "s", "The run goes from 0 to this time."),
    (
        "solver",
        "Solver",
        "",
        "auto begins with an explicit method and goes on with one for stiff systems where that is needed; "
        "after the run it says what it chose, and why.",
    ),
    (
        "rtol",
        "Relative tolerance",
        "",
        "An adaptive step is accepted where its error is below atol + rtol |x|.",
    ),
    ("atol", "Absolute tolerance", "", "The error that states near zero may have, in their own units."),
    ("max_step", "Largest step", "s", "Bounds the steps of an adaptive solver; empty: the solver chooses."),
    ("step", "Fixed step", "s", "Size of every step of a fixed-step solver; empty: as the sample time."),
    (
        "sample_time",
        "Sample time of the record",
        "s",
        "Spacing of the recorded instants; it changes no step. Empty: the fixed step, else a thousandth of "
        "the run.",
    ),
)


def setting_rules() -> list[SettingRule]:
    """The settings in the order of the dialog, with their defaults."""
    defaults = dataclasses.asdict(SimulationOptions())
    return [
        SettingRule(name=name, title=title, unit=unit, doc=doc, default=defaults[name])
        for name, title, unit, doc in _RULES
    ]


def solver_choices() -> list[SolverChoice]:
    """The solvers by name; the first is the automatic choice."""
    automatic = SolverChoice(
        name="auto", title="chosen by armblocks, while it runs", adaptive=True, stiff=False
    )
    stiff = {tableau.name for tableau in TABLEAUX if isinstance(tableau, RosenbrockTableau)}
    return [
        automatic,
        *(
            SolverChoice(name=one.name, title=one.title, adaptive=one.adaptive, stiff=one.name in stiff)
            for one in TABLEAUX
        ),
    ]
