"""Fixtures that several folders of tests use."""

from __future__ import annotations

import pytest

from armblocks.robot import Robot
from robots_for_tests import LAW_ROBOTS, build_kr180, build_puma560


@pytest.fixture(params=LAW_ROBOTS.values(), ids=LAW_ROBOTS.keys())
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
