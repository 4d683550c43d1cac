"""Fixtures that several folders of tests use."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

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
"""Folders and files of tests that compile with full effort, as users do: they test the compiled code."""
ALLOCATIONS_BEFORE_COLLECTION = 10_000
"""With Python's default of 700, garbage collection takes a tenth of the test time."""

# The same examples in every run, without limits of time that a busy machine could exceed.
settings.register_profile(
    "seeded",
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("seeded")


def pytest_sessionstart() -> None:
    """Disable garbage collection while pytest collects: modules and tests stay in memory."""
    gc.disable()


def pytest_collection_finish() -> None:
    """Exclude the collected modules and tests from garbage collection for the rest of the session."""
    gc.freeze()
    gc.set_threshold(ALLOCATIONS_BEFORE_COLLECTION)
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run the browser tests first: they take longest, and at the end the other processes would be idle.

    Then run the files that use the worked examples of all blocks: the process that runs them all builds and
    traces each example once.
    """

    def last(item: pytest.Item) -> tuple[bool, bool]:
        without_browser = "browser" not in getattr(item, "fixturenames", ())
        return without_browser, not hasattr(getattr(item, "module", None), "worked_example")

    items.sort(key=last)


@pytest.hookimpl(optionalhook=True)  # of the plugin xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> object:
    """Distribute the files so that browser tests and others run at the same time."""
    from distribution import BrowserFilesBeside

    return BrowserFilesBeside(config, log) if config.getoption("dist") == "loadfile" else None


@pytest.fixture(params=LAW_ROBOTS.values(), ids=list(LAW_ROBOTS))
def robot(request: pytest.FixtureRequest) -> Robot:
    """Shipped robots of different kinds, and random trees."""
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
    """Compile with little optimisation: most tests run the compiled code for milliseconds only.

    Other tests show that the effort does not change the results. With ``ARMBLOCKS_EFFORT=full`` all tests
    compile as users do.
    """
    requested = os.environ.get("ARMBLOCKS_EFFORT", "little")
    full = any(request.path.is_relative_to(TESTS / folder) for folder in FULL_EFFORT)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARMBLOCKS_EFFORT", "full" if full else requested)
        yield


@pytest.fixture(autouse=True, scope="session")
def separate_user_state(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """The studio keeps the user's state in a temporary folder, not in the folder of the user."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield
