"""The class ``Arm``: shapes, batches, options, and error messages."""

import pickle
import re

import numpy as np
import pytest

import armblocks as ab
from armblocks.drawing import drawing_bytes
from armblocks.errors import InputError, UnknownNameError

METHODS_OF_Q = (
    "fkine",
    "link_poses",
    "jacob0",
    "jacobe",
    "manipulability",
    "gravload",
    "inertia",
    "centre_of_mass",
)


@pytest.fixture(scope="module")
def puma() -> ab.Arm:
    return ab.load_robot("puma560")


@pytest.fixture(scope="module")
def states(puma: ab.Arm) -> list[np.ndarray]:
    return list(np.random.default_rng(7).uniform(-2, 2, (3, 37, puma.n)))


@pytest.mark.parametrize("method", METHODS_OF_Q)
def test_a_batch_equals_its_samples_bit_for_bit(puma: ab.Arm, states: list[np.ndarray], method: str) -> None:
    call = getattr(puma, method)
    q = states[0]
    batch = call(q)
    np.testing.assert_array_equal(batch, np.array([call(row) for row in q]))
    np.testing.assert_array_equal(batch, call(q, threads=2))


@pytest.mark.parametrize("method", ["rne", "accel"])
def test_loads_are_run_time_inputs(puma: ab.Arm, states: list[np.ndarray], method: str) -> None:
    call = getattr(puma, method)
    q, qd, third = states
    plain = call(q, qd, third)
    unloaded = call(q, qd, third, payload=ab.Payload(mass=0.0))
    np.testing.assert_allclose(unloaded, plain, rtol=1e-11, atol=1e-10)
    payload = ab.Payload(mass=2.0, centre=(0.0, 0.0, 0.1), inertia=(0.01, 0.01, 0.02, 0.0, 0.0, 0.0))
    loaded = call(q, qd, third, payload=payload)
    assert np.abs(loaded - plain).max() > 1
    np.testing.assert_array_equal(loaded, call(q, qd, third, payload=payload.vector()))
    np.testing.assert_array_equal(loaded[3], call(q[3], qd[3], third[3], payload=payload))
    pushed = call(q[3], qd[3], third[3], wrench=[0, 0, 10, 0, 0, 0])
    assert np.abs(pushed - plain[3]).max() > 1e-3


def test_arguments_may_be_given_by_name(puma: ab.Arm, states: list[np.ndarray]) -> None:
    q, qd, third = states
    for k in (slice(None), 3):
        np.testing.assert_array_equal(puma.fkine(q=q[k]), puma.fkine(q[k]))
        expected = puma.rne(q[k], qd[k], third[k])
        np.testing.assert_array_equal(puma.rne(q[k], qdd=third[k], qd=qd[k]), expected)
        loaded = puma.rne(q[k], qd[k], third[k], payload=ab.Payload(mass=2.0))
        np.testing.assert_array_equal(puma.rne(qdd=third[k], qd=qd[k], q=q[k], payload=2.0), loaded)
        np.testing.assert_array_equal(
            puma.accel(q[k], qd[k], tau=expected), puma.accel(q[k], qd[k], expected)
        )


def test_errors_about_wrong_calls_state_the_correct_call(puma: ab.Arm) -> None:
    q = np.zeros(6)
    with pytest.raises(InputError, match=r"rne: 0 arguments are given.*Fix: call rne\(q, qd, qdd\)"):
        puma.rne(payload=2.0)  # pyright: ignore[reportCallIssue]
    with pytest.raises(InputError, match=r"rne: 'qdd' is missing.*Fix: call rne\(q, qd, qdd\)"):
        puma.rne(q, qd=q)  # pyright: ignore[reportCallIssue]
    with pytest.raises(InputError, match=r"fkine: 'q' is given twice"):
        puma.fkine(q, q=q)  # pyright: ignore[reportCallIssue]
    with pytest.raises(UnknownNameError, match=r"rne: there is no argument named 'payloud'.*'payload'"):
        puma.rne(q, q, q, payloud=2.0)  # pyright: ignore[reportCallIssue]


@pytest.mark.parametrize("method", [*METHODS_OF_Q, "friction"])
def test_a_pickled_method_contains_its_arm(puma: ab.Arm, states: list[np.ndarray], method: str) -> None:
    copy = pickle.loads(pickle.dumps(getattr(puma, method)))
    np.testing.assert_array_equal(copy(states[0]), getattr(puma, method)(states[0]))


def test_integers_lists_and_strided_arrays_are_accepted(puma: ab.Arm) -> None:
    expected = puma.rne(np.zeros(6), np.zeros(6), np.ones(6))
    np.testing.assert_array_equal(puma.rne([0] * 6, [0] * 6, [1] * 6), expected)
    np.testing.assert_array_equal(
        puma.rne(np.zeros(12, np.int8)[::2], np.zeros(6), np.ones(6, np.float32)), expected
    )


def test_out_receives_the_result(puma: ab.Arm, states: list[np.ndarray]) -> None:
    q, qd, qdd = states
    out = np.empty((37, 6))
    assert puma.rne(q, qd, qdd, out=out) is out
    np.testing.assert_array_equal(out, puma.rne(q, qd, qdd))


def test_errors_about_wrong_shapes_name_the_input_and_the_allowed_shape(puma: ab.Arm) -> None:
    with pytest.raises(InputError, match=r"q.*\(5,\).*\(6,\)"):
        puma.fkine(np.zeros(5))


def test_nofriction_accepts_the_options_of_the_toolbox(puma: ab.Arm) -> None:
    qd = np.ones(6)
    both = puma.friction(qd)
    np.testing.assert_allclose(
        puma.nofriction("coulomb").friction(qd) + puma.nofriction("viscous").friction(qd), both
    )
    assert not puma.nofriction("all").friction(qd).any()
    with pytest.raises(UnknownNameError, match=r"no kind of friction named 'colomb'.*did you mean 'coulomb'"):
        puma.nofriction("colomb")


def test_older_friction_formulas_are_chosen_by_name(puma: ab.Arm) -> None:
    older = puma.with_friction_model("signed-gear")
    G = puma.robot.gear_ratios
    B = np.array([motor.viscous_friction for motor in puma.robot.motors])
    Tc = np.array([motor.coulomb_friction[0] for motor in puma.robot.motors])
    np.testing.assert_allclose(older.friction(np.ones(6)), G * (B + Tc))
    with pytest.raises(UnknownNameError, match=r"no friction model named 'signed'.*signed-gear"):
        puma.with_friction_model("signed")


def test_the_operation_count_of_an_unknown_method_is_refused(puma: ab.Arm) -> None:
    assert puma.operation_count("rne").multiplies >= 0
    with pytest.raises(UnknownNameError, match=r"no compiled method named 'rnea'.*did you mean 'rne'"):
        puma.operation_count("rnea")


def test_an_impossible_payload_is_refused() -> None:
    with pytest.raises(InputError, match=r"payload mass -1.0 kg is negative"):
        ab.Payload(mass=-1.0)
    with pytest.raises(InputError, match=r"not made of 1 \+ 3 \+ 6 finite numbers"):
        ab.Payload(mass=np.nan)


def test_text_and_notebook_representations_show_joints_and_parameters(puma: ab.Arm) -> None:
    assert "6 joints RRRRRR" in repr(puma)
    assert "| link1 |         q|    0.6718|" in str(puma)
    html = puma._repr_html_()
    assert html.count("<tr>") >= 7
    assert "<svg" in html


def test_robots_trajectories_and_diagrams_have_notebook_representations(puma: ab.Arm) -> None:
    assert puma.robot._repr_html_() == puma._repr_html_()
    diagram = ab.load_diagram("van_der_pol_pid")
    assert diagram._repr_svg_() == drawing_bytes(diagram, "svg").decode()
    html = ab.jtraj([0, 1], [2, -1], 5)._repr_html_()
    assert html.count("<figure>") == 3 and "2 joints, 5 samples to 1 s" in html


def test_the_notebook_representation_of_a_result_shows_degrees() -> None:
    html = ab.simulate("kr180model", stop_time=0.5)._repr_html_()
    assert "<figcaption>jtraj/q <span>deg · 4</span>" in html
    assert "<figcaption>jtraj/qd <span>deg/s · 4</span>" in html
    assert "rad" not in re.sub(r"<style>.*?</style>", "", html)
