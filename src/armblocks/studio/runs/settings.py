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
        "auto starts with an explicit method and switches to a method for stiff systems if needed; "
        "the log of the run states the choice and its reason.",
    ),
    (
        "rtol",
        "Relative tolerance",
        "",
        "An adaptive step is accepted if its error is below atol + rtol |x|.",
    ),
    ("atol", "Absolute tolerance", "", "Allowed error of states near zero, in their own units."),
    ("max_step", "Largest step", "s", "Bounds the steps of an adaptive solver; empty: the solver chooses."),
    ("step", "Fixed step", "s", "Size of every step of a fixed-step solver; empty: as the sample time."),
    (
        "sample_time",
        "Sample time of the record",
        "s",
        "Interval between samples; no effect on the steps. Empty: the fixed step, else a thousandth "
        "of the run.",
    ),
    (
        "record_jumps",
        "Record jumps",
        "",
        "Record both sides of every jump of a signal, also between the samples.",
    ),
)


def setting_rules() -> list[SettingRule]:
    """Return the settings in the order of the dialog, with their defaults."""
    defaults = dataclasses.asdict(SimulationOptions())
    return [
        SettingRule(name=name, title=title, unit=unit, doc=doc, default=defaults[name])
        for name, title, unit, doc in _RULES
    ]


def solver_choices() -> list[SolverChoice]:
    """Return the solvers by name; the first is the automatic choice."""
    automatic = SolverChoice(
        name="auto", title="chosen automatically during the run", adaptive=True, stiff=False
    )
    stiff = {tableau.name for tableau in TABLEAUX if isinstance(tableau, RosenbrockTableau)}
    return [
        automatic,
        *(
            SolverChoice(
                name=tableau.name,
                title=tableau.title,
                adaptive=tableau.adaptive,
                stiff=tableau.name in stiff,
            )
            for tableau in TABLEAUX
        ),
    ]
