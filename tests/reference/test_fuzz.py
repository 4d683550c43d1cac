"""Random diagrams obey the laws: a few fixed seeds of the computation of ``scripts/fuzz.py``."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from fuzz_case import InconclusiveError
from fuzz_laws import LAWS, findings
from fuzzing import NO_FINDING, checked, reduced
from random_diagrams import Node, Recipe, random_recipe

BASIC_LAWS = ("reference", "formulas", "equations")
OTHER_LAWS = tuple(name for name in LAWS if name not in BASIC_LAWS)


@pytest.mark.parametrize("number", range(7))
def test_a_random_diagram_obeys_the_laws(number: int) -> None:
    """Check all laws that need one run, and two of the others, on a diagram that can be compared.

    Another diagram of a seed, after a change of the blocks, may be refused or have infinite signals.
    """
    other_laws = (OTHER_LAWS[number % len(OTHER_LAWS)], OTHER_LAWS[(3 * number + 1) % len(OTHER_LAWS)])
    laws = (*BASIC_LAWS, *dict.fromkeys(other_laws))
    outcomes = (checked(random_recipe(seed), laws) for seed in range(10 * number, 10 * number + 10))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        contradictions = next(found for found in outcomes if not found.keys() & set(NO_FINDING))
    assert contradictions == {}


def test_a_seed_always_gives_the_same_diagram() -> None:
    assert random_recipe(5) == random_recipe(5)
    assert random_recipe(5).diagram() == random_recipe(5).diagram()
    assert random_recipe(5) != random_recipe(6)


def test_a_finding_is_reduced_to_the_necessary_block() -> None:
    """The check of this test reports only sine waves, in a diagram of many blocks."""
    recipe = next(
        recipe for recipe in map(random_recipe, range(100)) if contains_kind(recipe.nodes, "SineWave")
    )
    check = lambda smaller, laws: {"law": ["a sine"]} if contains_kind(smaller.nodes, "SineWave") else {}  # noqa: E731
    smallest, text = reduced(check, recipe, "law", until=np.inf)
    assert [node.kind for node in smallest.nodes] == ["SineWave"]
    assert text == "a sine"


def contains_kind(nodes: tuple[Node, ...], kind: str) -> bool:
    return any(node.kind == kind or contains_kind(node.inside, kind) for node in nodes)


def test_a_loop_without_a_solution_contradicts_the_equations() -> None:
    """u = if(u > 0, -1, 1) has no solution: it is refused, or its result contradicts the equations."""
    recipe = Recipe((Node("e", "Expression", {"formula": "if(u>0,-1,1)"}, {"u": "e/y"}),))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            contradictions = findings(recipe, ("equations",))
        except (InconclusiveError, ValueError):
            return  # the diagram is refused, which is correct
    assert "equations" in contradictions


def test_a_pole_behind_a_limited_state_is_not_reported_as_a_failed_run() -> None:
    """1/u has a pole at 1/3 s. The reference crosses it, and the limits of the state hide the step size."""
    fall = {"times": [0.0, 0.25, 0.5], "values": [0.5, 0.5, -1.0]}
    nodes = (
        Node("fall", "RepeatingSequence", fall),
        Node("inverse", "MatrixInverse", {}, {"u": "fall/y"}),
        Node("x", "IntegratorLimited", {}, {"u": "inverse/y"}),
    )
    with pytest.raises(InconclusiveError, match=r"'inverse/y' has a pole at 0\.3333"):
        findings(Recipe(nodes, 0.375), ("equations",))
