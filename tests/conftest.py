"""Fixtures that several folders of tests use."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from armblocks.robot import Robot
from robots_for_tests import LAW_ROBOTS, build_kr180, build_puma560

TESTS = Path(__file__).parent
FULL_EFFORT = (
    "compiler",
    "dynamics/test_dynamics_kernels.py",
    "integration",
    "simulation/test_hybrid_simulation.py",
    "simulation/test_tableaux.py",
)
"""Folders and files of tests that compile as users do: their laws are about the compiled code."""
ALLOCATIONS_BEFORE_COLLECTION = 10_000
"""With Python's own 700, the collector takes a tenth of the tests' time: diagrams are many small objects."""

# The same examples in every run, however long one takes on a busy machine.
settings.register_profile("seeded", derandomize=True, deadline=None, database=None)
settings.load_profile("seeded")


def pytest_sessionstart() -> None:
    """Modules and tests that are collected stay: a search for garbage among them finds none."""
    gc.disable()


def pytest_collection_finish() -> None:
    """What has been collected is no garbage for the rest of the session."""
    gc.freeze()
    gc.set_threshold(ALLOCATIONS_BEFORE_COLLECTION)
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Journeys in a browser come first: they are the longest, and would be waited for at the end."""
    items.sort(key=lambda item: "browser" not in getattr(item, "fixturenames", ()))


@pytest.fixture(params=LAW_ROBOTS.values(), ids=list(LAW_ROBOTS))
def robot(request: pytest.FixtureRequest) -> Robot:
    """Each robot of the law tests in turn: every shipped one, and random trees."""
    return request.param


@pytest.fixture
def puma560() -> Robot:
    """Corke's Puma 560 of 8/95, written out in Python."""
    return build_puma560()


@pytest.fixture
def kr180() -> Robot:
    """The paper's arm, written out in Python."""
    return build_kr180()


@pytest.fixture(autouse=True, scope="module")
def effort(request: pytest.FixtureRequest) -> Iterator[None]:
    """Most tests compile what they then run for milliseconds: they need little effort of the compiler.

    That the bits are the same is shown by laws of their own. With ``ARMBLOCKS_EFFORT=full`` all tests compile
    as users do.
    """
    asked = os.environ.get("ARMBLOCKS_EFFORT", "little")
    full = any(request.path.is_relative_to(TESTS / place) for place in FULL_EFFORT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARMBLOCKS_EFFORT", "full" if full else asked)
        yield


@pytest.fixture(autouse=True, scope="session")
def state_of_nobody(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What the studio keeps for its user lies in a folder of the tests, never in the user's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield
