"""Models whose compiled code is in the disk cache run without tracing."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armblocks as ab
from armblocks.blocks import Gain, Integrator, PythonFunction, Scope, SineWave
from armblocks.equations import HybridSystem
from armblocks.face import model as face_model


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("ARMBLOCKS_CACHE_DIR", str(tmp_path))
    return tmp_path


def refuse(diagram: ab.Diagram) -> HybridSystem:
    raise AssertionError(f"{diagram.name} was traced")


@pytest.mark.parametrize("name", ["van_der_pol_pid", "dc_motor_sampled_pid", "robertson_kinetics"])
def test_a_second_start_of_a_shipped_model_does_not_trace(
    name: str, own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = ab.simulate(ab.load_diagram(name))
    monkeypatch.setattr(face_model, "trace_diagram", refuse)
    # a new object that shares nothing with the first, as in another process
    second = ab.simulate(ab.load_diagram(name))
    assert second.names == first.names and second.units == first.units
    assert second.columns() == first.columns()
    for path in first.names:
        assert np.asarray(second[path]).tobytes() == np.asarray(first[path]).tobytes()
    longer = 1.25 * float(first.time[-1])
    resumed = ab.simulate(ab.load_diagram(name), initial_state=first.final_state, stop_time=longer)
    assert "exactly as the previous run" in resumed.run.reason


def made(factor: float) -> Callable[[Any], Any]:
    return lambda u: factor * u


def chain(gain: float, factor: float = 2.0) -> ab.Diagram:
    builder = ab.DiagramBuilder("chain")
    wave = builder.add("gain", Gain(gain=gain), builder.add("wave", SineWave()))
    law = builder.add("law", PythonFunction(function=made(factor)), wave)
    builder.add("scope", Scope(), builder.add("integral", Integrator(), law))
    return builder.build()


def test_a_diagram_with_changed_content_is_traced_again(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = ab.simulate(chain(1.0))["integral"]
    # other numbers and other code have other keys
    np.testing.assert_allclose(ab.simulate(chain(3.0))["integral"], 3 * plain, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(ab.simulate(chain(1.0, 4.0))["integral"], 2 * plain, rtol=1e-5, atol=1e-5)
    monkeypatch.setattr(face_model, "trace_diagram", refuse)
    assert ab.simulate(chain(1.0))["integral"].tobytes() == plain.tobytes()
    longer = dataclasses.replace(chain(1.0), description="settings and layout are not part of the equations")
    assert ab.simulate(longer, stop_time=2.0)["integral"].size
    with pytest.raises(AssertionError, match="chain was traced"):
        ab.simulate(chain(1.5))


def test_a_model_with_a_foreign_block_class_is_traced_each_time(
    own_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Doubled(Gain):
        """A block class outside the package."""

    builder = ab.DiagramBuilder("theirs")
    builder.add("scope", Scope(), builder.add("doubled", Doubled(gain=2.0), builder.add("wave", SineWave())))
    diagram = builder.build()
    ab.simulate(dataclasses.replace(diagram))
    monkeypatch.setattr(face_model, "trace_diagram", refuse)
    with pytest.raises(AssertionError, match="theirs was traced"):
        ab.simulate(dataclasses.replace(diagram))
