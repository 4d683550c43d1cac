"""Running diagrams from Python."""

import inspect
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

import armblocks as ab
from armblocks.equations import SimulationOptions
from armblocks.errors import DiagramError, InputError, LimitWarning, UnknownNameError
from armblocks.face.settings import RunSettings

POSITIONS = {  # paper/specification.md: an independent plain-NumPy computation
    0.0: (1.95, -1.25, -1.85),
    2.0: (2.36963237462, -0.835183999087, -1.693963015984),
    5.0: (1.252643063297, 3.318570240624, 0.041710789934),
    10.0: (-2.949278739196, 1.254698768685, 2.347929043243),
}


@pytest.fixture(scope="module")
def paper() -> ab.Diagram:
    return ab.load_diagram("kr180model")


def test_the_run_reproduces_the_positions_of_the_paper(paper: ab.Diagram) -> None:
    result = ab.simulate(paper)
    assert len(result.time) == 1001
    for t, expected in POSITIONS.items():
        row = int(np.searchsorted(result.time, t))
        actual = [result[f"T2xyz/{axis}"][row] for axis in "xyz"]
        np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9)


def test_derivative_blocks_are_exact(paper: ab.Diagram) -> None:
    """Torques from two Derivative blocks equal those from the speeds and accelerations of the trajectory."""
    result = ab.simulate(paper)
    path = ab.jtraj([0, 0, 0, 0], [3.14, 0, 1.57, 0], result.time)
    arm = ab.load_robot("kr180")
    np.testing.assert_allclose(result["rne/tau"], arm.rne(path.q, path.qd, path.qdd), rtol=1e-9, atol=1e-8)


def test_tunable_parameters_reuse_the_compiled_system(paper: ab.Diagram) -> None:
    model = ab.compile_diagram(paper)
    compiled = model.compiled
    shorter = ab.simulate(paper, parameters={"jtraj.tmax": 5.0})
    assert ab.compile_diagram(paper).compiled is compiled
    np.testing.assert_allclose(shorter["jtraj/q"][500], [3.14, 0, 1.57, 0], atol=1e-12)
    np.testing.assert_array_equal(ab.simulate(paper)["jtraj/q"][-1], [3.14, 0, 1.57, 0])


def test_signatures_list_the_settings_of_a_run() -> None:
    fields = get_type_hints(SimulationOptions)
    assert get_type_hints(RunSettings) == fields
    calls = (ab.simulate, ab.begin, ab.linearize, ab.frequency_response, ab.trim, ab.sensitivity)
    for call in (*calls, ab.CompiledDiagram.simulate, ab.CompiledDiagram.begin):
        parameters = inspect.signature(call).parameters
        assert list(parameters)[-len(fields) :] == list(fields), call
        assert {repr(parameters[name].default) for name in fields} == {"<the diagram's>"}
        arguments = {"diagram": "kr180model"} if "diagram" in parameters else {"self": None}
        required = [n for n, p in parameters.items() if p.default is p.empty and n not in arguments]
        with pytest.raises(UnknownNameError, match=r"no argument named 'stop_tme'.*did you mean 'stop_time'"):
            call(**arguments, **dict.fromkeys(required, ""), stop_tme=1.0)


def test_unknown_settings_and_parameters_are_refused_with_the_nearest_name(paper: ab.Diagram) -> None:
    with pytest.raises(UnknownNameError, match=r"no argument named 'stoptime'.*did you mean 'stop_time'"):
        ab.simulate(paper, stoptime=3)
    with pytest.raises(UnknownNameError, match=r"no block named 'jtrai'.*did you mean 'jtraj'"):
        ab.simulate(paper, parameters={"jtrai.tmax": 3})
    with pytest.raises(UnknownNameError, match=r"no parameter named 'tmx'.*did you mean 'tmax'"):
        ab.simulate(paper, parameters={"jtraj.tmx": 3})
    with pytest.raises(DiagramError, match=r"jtraj.*tmax"):
        ab.simulate(paper, parameters={"jtraj.tmax": -3})


@pytest.mark.parametrize("name", ab.list_examples())
def test_every_example_runs_and_has_a_notebook_representation(name: str) -> None:
    result = ab.simulate(name, stop_time=0.5)
    assert result.run.complete
    assert "<svg" in result._repr_html_()


def test_a_trajectory_beyond_the_joint_limits_raises_a_warning(paper: ab.Diagram) -> None:
    """Joint 2 moves to 2 rad = 114.6 deg; the quintic gives the time at which it passes its limit, 90 deg."""
    with pytest.warns(LimitWarning) as caught:
        ab.simulate(paper, parameters={"jtraj.qf": (3.14, 2.0, 1.57, 0.0)})
    (text,) = (str(warning.message) for warning in caught)
    assert "joint 'link2' leaves its range" in text
    assert "114.6 deg at t = 10 s" in text
    s = np.linspace(0, 1, 100_001)
    crossing = 10 * s[np.searchsorted(2.0 * (10 * s**3 - 15 * s**4 + 6 * s**5), np.pi / 2)]
    assert f"from t = {crossing:.4g} s on" in text


def test_a_joint_above_its_speed_limit_raises_a_warning(paper: ab.Diagram) -> None:
    with pytest.warns(LimitWarning, match=r"joint 'link1' is faster than allowed \(at most 105 deg/s\)"):
        ab.simulate(paper, parameters={"jtraj.tmax": 3.0}, stop_time=3.0)


def test_a_run_is_paused_tuned_and_continued() -> None:
    run = ab.begin("van_der_pol_pid", stop_time=30.0)
    run.advance(10.0, exactly=True)
    assert run.time == 10.0 and not run.finished and run.stop_time == 30.0
    state = run.state()
    run.set("PID.P", 4.0)
    run.advance()
    result = run.result()
    rest = ab.simulate("van_der_pol_pid", stop_time=30.0, parameters={"PID.P": 4.0}, initial_state=state)
    later = result.time > 10.0
    np.testing.assert_array_equal(result["x1"][later], rest["x1"][rest.time > 10.0])
    assert result.parameters["PID.P"] == 4.0 and run.parameters["PID.P"] == 4.0
    assert run.diagram.blocks["PID"].parameter_value("P") == 4.0
    assert run.samples(run.recorded - 5)["x1"].shape == (5,)


def test_parameters_that_limit_each_other_are_changed_together() -> None:
    builder = ab.DiagramBuilder("limited", settings=SimulationOptions(stop_time=1.0))
    source = builder.add("source", ab.blocks.Constant(value=10.0))
    builder.add("limit", ab.blocks.Saturation(lower=0.0, upper=2.0), source)
    run = ab.begin(builder.build())
    run.advance(0.5, exactly=True)
    with pytest.raises(DiagramError):
        run.set("limit.lower", 3.0)
    with pytest.raises(UnknownNameError):
        run.set_all({"limit.lower": -1.0, "limit.uper": 4.0})
    assert run.parameters["limit.lower"] == 0.0
    run.set_all({"limit.lower": 3.0, "limit.upper": 4.0})
    run.advance()
    assert run.result()["limit"][-1] == 4.0


def test_a_run_refuses_parameters_that_are_not_tunable() -> None:
    run = ab.begin("van_der_pol_pid", parameters={"PID.P": 3.0})
    assert run.parameters["PID.P"] == 3.0
    run.advance(steps=10)
    with pytest.raises(InputError, match=r"'error.signs' cannot take this value during a run"):
        run.set("error.signs", "++")
    with pytest.raises(UnknownNameError, match=r"no parameter named 'Q'"):
        run.set("PID.Q", 1.0)
    run.stop()
    assert run.finished and run.result().run.message == "stopped"


def test_a_run_starts_from_a_saved_state(tmp_path: Path) -> None:
    first = ab.begin("van_der_pol_pid", stop_time=20.0)
    first.advance(5.0)
    first.state().save(tmp_path / "state.npz")
    first.advance()
    second = ab.begin("van_der_pol_pid", stop_time=20.0, initial_state=tmp_path / "state.npz")
    second.advance()
    np.testing.assert_array_equal(first.result()["x1"][-100:], second.result()["x1"][-100:])
    with pytest.raises(UnknownNameError, match="no argument named 'stop'"):
        ab.begin("van_der_pol_pid", stop=3.0)
