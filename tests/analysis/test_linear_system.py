"""Linear systems compared with closed forms, identities and python-control.

Each test imports python-control in its body: the import takes seconds, and every worker process collects this
file.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.io import loadmat

from armblocks.analysis.linear_system import LinearSystem
from armblocks.errors import InputError, UnknownNameError
from unordered import matched

Array = NDArray[np.float64]
SEEDS = range(6)


def random_system(
    seed: int, states: int = 5, inputs: int = 2, outputs: int = 3, dt: float = 0.0
) -> LinearSystem:
    """A random stable system with direct feedthrough."""
    random = np.random.default_rng(seed)
    A = random.standard_normal((states, states))
    if dt:
        A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    else:
        A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(states)
    return LinearSystem(
        A,
        random.standard_normal((states, inputs)),
        random.standard_normal((outputs, states)),
        random.standard_normal((outputs, inputs)),
        dt=dt,
    )


def transfer(numerator: list[float], denominator: list[float]) -> LinearSystem:
    """The transfer function in controllable canonical form."""
    den = np.array(denominator) / denominator[0]
    num = np.concatenate([np.zeros(len(den) - len(numerator)), np.array(numerator) / denominator[0]])
    n = len(den) - 1
    A = np.eye(n, k=1)
    A[-1] = -den[:0:-1]
    B = np.zeros((n, 1))
    B[-1] = 1.0
    remainder = num[1:] - num[0] * den[1:]
    return LinearSystem(A, B, remainder[::-1][None, :], np.array([[num[0]]]))


# Poles and zeros.


def test_poles_are_the_roots_of_the_characteristic_polynomial() -> None:
    system = transfer([1.0], [1.0, 6.0, 11.0, 6.0])
    assert matched(system.poles(), [-1.0, -2.0, -3.0])


def test_poles_of_a_second_order_system_have_its_damping_and_frequency() -> None:
    wn, zeta = 3.0, 0.2
    modes = transfer([wn**2], [1.0, 2 * zeta * wn, wn**2]).damp()
    assert [mode.frequency for mode in modes] == pytest.approx([wn, wn])
    assert [mode.damping for mode in modes] == pytest.approx([zeta, zeta])
    assert modes[0].time_constant == pytest.approx(1.0 / (zeta * wn))


def test_damping_of_a_discrete_pole_equals_that_of_the_continuous_pole() -> None:
    s, dt = complex(-0.4, 2.0), 0.1
    z = np.exp(s * dt)
    A = [[z.real, z.imag], [-z.imag, z.real]]
    mode = LinearSystem(A, np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1)), dt=dt).damp()[0]  # type: ignore[arg-type]
    assert mode.frequency == pytest.approx(abs(s))
    assert mode.damping == pytest.approx(0.4 / abs(s))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_system_matrix_loses_rank_at_a_zero(seed: int) -> None:
    system = random_system(seed, 6, 2, 2)
    zeros = system.zeros()
    assert len(zeros) == 6  # D is square and invertible
    for zero in zeros:
        system_matrix = np.block([[system.A - zero * np.eye(6), system.B], [system.C, system.D]])
        sizes = np.linalg.svd(system_matrix, compute_uv=False)
        assert sizes[-1] < 1e-8 * sizes[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_zeros_without_feedthrough_equal_the_finite_zeros_of_python_control(seed: int) -> None:
    import control

    system = random_system(seed, 6, 2, 2)
    strict = LinearSystem(system.A, system.B, system.C, np.zeros((2, 2)))
    assert len(strict.zeros()) == 4  # C B is invertible
    expected_control = control.StateSpace(strict.A, strict.B, strict.C, strict.D).zeros()
    assert matched(strict.zeros(), expected_control[np.abs(expected_control) < 1e8], 1e-6)


def test_a_system_with_more_outputs_than_inputs_has_only_common_zeros() -> None:
    assert len(random_system(1, 5, 1, 3).zeros()) == 0
    # Both numerators have the factor s + 2.
    first, second = transfer([1.0, 2.0], [1.0, 3.0, 5.0]), transfer([3.0, 6.0], [1.0, 3.0, 5.0])
    both = LinearSystem(first.A, first.B, np.vstack([first.C, second.C]), np.vstack([first.D, second.D]))
    assert matched(both.zeros(), [-2.0])


def test_an_uncontrollable_mode_is_an_invariant_zero() -> None:
    system = LinearSystem(np.diag([-1.0, -2.0]), [[1.0], [0.0]], [[1.0, 1.0]], [[0.0]])  # type: ignore[arg-type]
    assert matched(system.zeros(), [-2.0])


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("dt", [0.0, 0.05])
def test_a_similarity_transformation_keeps_poles_and_gains(seed: int, dt: float) -> None:
    system = random_system(seed, dt=dt)
    T = np.random.default_rng(seed + 100).standard_normal((5, 5)) + 3.0 * np.eye(5)
    other = system.transformed(T)
    assert matched(system.poles(), other.poles(), 1e-7)
    assert np.allclose(system.at(0.3 + 0.8j), other.at(0.3 + 0.8j), rtol=1e-9)
    assert np.allclose(system.dcgain(), other.dcgain(), rtol=1e-9)


# Transfer functions and frequency.


def test_a_canonical_form_returns_its_transfer_function() -> None:
    function = transfer([2.0, 3.0], [1.0, 4.0, 6.0, 5.0]).transfer_function()
    assert np.allclose(function.numerator, [2.0, 3.0], rtol=1e-9)
    assert np.allclose(function.denominator, [1.0, 4.0, 6.0, 5.0], rtol=1e-9)
    assert repr(function).splitlines() == ["       2 s + 3", "---------------------", "s^3 + 4 s^2 + 6 s + 5"]


def test_a_system_without_states_is_a_stable_gain() -> None:
    no_states = np.zeros((0, 0))
    gain = LinearSystem(no_states, np.zeros((0, 1)), np.zeros((1, 0)), np.array([[-4.0]]))
    assert gain.transfer_function().numerator.tolist() == [-4.0]
    assert gain.dcgain().tolist() == [[-4.0]]
    assert gain.is_stable


def test_cancelling_poles_and_zeros_are_removed() -> None:
    function = transfer([1.0, 1.0], [1.0, 3.0, 2.0]).transfer_function()
    assert matched(function.poles, [-2.0])
    assert len(function.zeros) == 0


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("dt", [0.0, 0.05])
def test_frequency_response_agrees_with_python_control(seed: int, dt: float) -> None:
    system = random_system(seed, dt=dt)
    w = np.geomspace(0.01, 50.0, 40)
    expected_control = np.moveaxis(np.asarray(system.to_control().frequency_response(w).complex), 2, 0)
    assert np.allclose(system.frequency_response(w), expected_control, rtol=1e-9, atol=1e-12)


def test_the_static_gain_of_an_integrator_is_infinite_only_on_its_own_channel() -> None:
    system = LinearSystem(
        [[0.0, 0.0], [0.0, -2.0]],
        [[1.0, 0.0], [0.0, 1.0]],
        [[1.0, 0.0], [0.0, 4.0]],
        np.zeros((2, 2)),  # type: ignore[arg-type]
    )
    assert system.dcgain().tolist() == [[math.inf, 0.0], [0.0, 2.0]]


def test_bandwidth_of_a_lag_is_its_half_power_frequency() -> None:
    assert transfer([5.0], [1.0, 4.0]).bandwidth(10.0 * math.log10(2.0)) == pytest.approx(4.0, rel=1e-10)


LOOPS = {
    "third order": transfer([4.0], [1.0, 3.0, 3.0, 1.0]),
    "integrating": transfer([2.0, 1.0], [1.0, 2.0, 4.0, 0.0]),
    "unstable": transfer([3.0, 6.0], [1.0, 1.0, -2.0]),
    "resonant": transfer([0.3, 0.02, 1.2], [1.0, 0.03, 4.0, 0.0]),
}


@pytest.mark.parametrize("name", LOOPS)
def test_margins_agree_with_python_control(name: str) -> None:
    import control

    loop = LOOPS[name]
    margins = loop.margins()
    expected_control = control.stability_margins(loop.to_control(), returnall=True)
    # python-control reports a phase crossover at infinite frequency, where the gain is only rounding error.
    gains = [value for value in np.asarray(expected_control[0]) if 0.0 < value < 1e9]
    assert matched([gain for _, gain in margins.gain_crossings], gains, 1e-6)
    assert matched([angle for _, angle in margins.phase_crossings], expected_control[1], 1e-6)
    assert margins.stable == bool(control.feedback(loop.to_control(), 1).poles().real.max() < 0)


def test_a_loop_scaled_by_its_gain_margin_is_marginally_stable() -> None:
    loop = LOOPS["third order"]
    margins = loop.margins()
    assert margins.gain == pytest.approx(2.0, rel=1e-9)  # 8 / 4, at sqrt(3)
    assert margins.gain_frequency == pytest.approx(math.sqrt(3.0), rel=1e-9)
    scaled = LinearSystem(loop.A, margins.gain * loop.B, loop.C, margins.gain * loop.D)
    assert scaled.feedback().poles().real.max() == pytest.approx(0.0, abs=1e-8)


def test_the_delay_margin_moves_the_open_loop_to_minus_one() -> None:
    loop = LOOPS["integrating"]
    margins = loop.margins()
    value = loop.at(1j * margins.delay_frequency)[0, 0] * np.exp(
        -1j * margins.delay_frequency * margins.delay
    )
    assert value == pytest.approx(-1.0, abs=1e-8)
    assert abs(1.0 + loop.at(1j * margins.modulus_frequency)[0, 0]) == pytest.approx(margins.modulus)


# Time responses.


def test_a_step_response_equals_its_closed_form() -> None:
    wn, zeta = 3.0, 0.3
    response = transfer([wn**2], [1.0, 2 * zeta * wn, wn**2]).step_response(6.0)
    t, wd = response.time, wn * math.sqrt(1 - zeta**2)
    expected = 1 - np.exp(-zeta * wn * t) * (np.cos(wd * t) + zeta * wn / wd * np.sin(wd * t))
    assert np.allclose(response.values[:, 0, 0], expected, atol=1e-11)
    measures = response.measures()
    assert measures.overshoot == pytest.approx(
        100 * math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), rel=1e-3
    )
    assert measures.peak_time == pytest.approx(math.pi / wd, abs=0.02)
    assert measures.final == pytest.approx(1.0)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("dt", [0.0, 0.05])
def test_responses_agree_with_python_control(seed: int, dt: float) -> None:
    import control

    system = random_system(seed, dt=dt)
    step = system.step_response(4.0)
    expected_control = control.step_response(system.to_control(), step.time)
    assert np.allclose(step.values, np.moveaxis(expected_control.outputs, 2, 0), rtol=1e-7, atol=1e-9)
    time = np.arange(81) * 0.05
    inputs = np.stack([np.sin(time), np.cos(3 * time)], axis=1)
    start = np.arange(5.0)
    forced = system.response(time, inputs, start)
    forced_control = control.forced_response(system.to_control(), time, inputs.T, start)
    assert np.allclose(forced.values[:, :, 0], forced_control.outputs.T, rtol=1e-7, atol=1e-8)


def test_an_impulse_response_is_the_derivative_of_the_step_response() -> None:
    system = LinearSystem(*(lambda s: (s.A, s.B, s.C, np.zeros_like(s.D)))(random_system(2)))
    step, impulse = system.step_response(2.0, 4000), system.impulse_response(2.0, 4000)
    rate = np.gradient(step.values, step.time, axis=0)
    assert np.allclose(rate[1:-1], impulse.values[1:-1], atol=1e-4 * np.abs(impulse.values).max())


def test_a_discrete_impulse_response_lists_the_markov_parameters() -> None:
    system = random_system(3, dt=0.1)
    values = system.impulse_response(1.0).values
    assert np.allclose(values[0], system.D)
    for k in range(1, 6):
        assert np.allclose(values[k], system.C @ np.linalg.matrix_power(system.A, k - 1) @ system.B)


# Structure.


def test_uncontrollable_states_are_removed_from_the_minimal_system() -> None:
    small = random_system(4, 3, 1, 1)
    T = np.random.default_rng(0).standard_normal((5, 5)) + 3.0 * np.eye(5)
    A, B, C = np.zeros((5, 5)), np.zeros((5, 1)), np.zeros((1, 5))
    A[:3, :3], A[3:, 3:], A[:3, 3:] = small.A, -np.eye(2), 1.0
    B[:3], C[:, :3] = small.B, small.C
    large = LinearSystem(A, B, C, small.D).transformed(T)
    assert large.controllability() == 3
    assert large.observability() < 5 or large.observability() == 5
    reduced = large.minimal()
    assert reduced.order == 3
    assert matched(reduced.poles(), small.poles(), 1e-7)
    assert reduced.at(1.0 + 2.0j)[0, 0] == pytest.approx(small.at(1.0 + 2.0j)[0, 0], rel=1e-9)


def test_states_outside_the_path_are_removed_and_the_others_keep_their_names() -> None:
    system = LinearSystem(
        np.array([[-1.0, 0.0, 0.0], [1.0, -2.0, 0.0], [0.0, 1.0, -3.0]]),
        np.array([[0.0], [1.0], [0.0]]),
        np.array([[0.0, 1.0, 0.0]]),
        np.zeros((1, 1)),
        states=("before", "on", "behind"),
    )
    assert system.on_path().states == ("on",)


@pytest.mark.parametrize("dt", [0.0, 0.1])
def test_gramians_solve_their_equations(dt: float) -> None:
    system = random_system(5, dt=dt)
    controllable, observable = system.gramians()
    A, B, C = system.A, system.B, system.C
    if dt:
        assert np.allclose(A @ controllable @ A.T + B @ B.T, controllable)
        assert np.allclose(A.T @ observable @ A + C.T @ C, observable)
    else:
        assert np.allclose(A @ controllable + controllable @ A.T, -B @ B.T)
        assert np.allclose(A.T @ observable + observable @ A, -C.T @ C)


# Connections.


@pytest.mark.parametrize("seed", SEEDS)
def test_connections_obey_the_algebra_of_transfer_matrices(seed: int) -> None:
    first, second = random_system(seed, 3, 2, 2), random_system(seed + 50, 4, 2, 2)
    s = 0.4 + 1.1j
    a, b = first.at(s), second.at(s)
    assert np.allclose((second @ first).at(s), b @ a)
    assert np.allclose((first + second).at(s), a + b)
    assert np.allclose((first - second).at(s), a - b)
    assert np.allclose(first.feedback(second).at(s), a @ np.linalg.inv(np.eye(2) + b @ a))
    assert np.allclose(first.feedback(0.5, sign=1).at(s), a @ np.linalg.inv(np.eye(2) - 0.5 * a))


# Rejected inputs.


def test_inconsistent_shapes_and_unsuitable_systems_are_refused() -> None:
    system = random_system(0)
    with pytest.raises(InputError, match="B has shape"):
        LinearSystem(system.A, system.B[:2], system.C, system.D)
    with pytest.raises(InputError, match=r"A has 1 axis.*Allowed: matrices, two axes"):
        LinearSystem(system.A[0], system.B, system.C, system.D)
    with pytest.raises(InputError, match="A contains NaN or infinity"):
        LinearSystem(system.A * np.nan, system.B, system.C, system.D)
    with pytest.raises(InputError, match="1 name and 5 units are given for the states"):
        LinearSystem(system.A, system.B, system.C, system.D, states=("x",))
    with pytest.raises(InputError, match=r"the sample time is -1"):
        LinearSystem(system.A, system.B, system.C, system.D, dt=-1.0)
    with pytest.raises(UnknownNameError, match="there is no output named 'y9'"):
        system.select("y9")
    with pytest.raises(InputError, match="the system has 2 inputs and 3 outputs"):
        system.transfer_function()
    with pytest.raises(InputError, match="margins of 2 inputs and 3 outputs are requested"):
        system.margins()
    with pytest.raises(InputError, match="the bandwidth of 2 inputs and 3 outputs is requested"):
        system.bandwidth()
    with pytest.raises(InputError, match="the steady-state gain is inf"):
        transfer([1.0], [1.0, 0.0]).bandwidth()
    with pytest.raises(InputError, match="is not stable and has no Gramians"):
        transfer([1.0], [1.0, 0.0]).gramians()
    with pytest.raises(InputError, match="the stop time is -1"):
        system.step_response(-1.0)


def test_connections_of_inconsistent_sizes_or_sample_times_are_refused() -> None:
    system, square = random_system(0), random_system(0, 3, 2, 2)
    with pytest.raises(InputError, match=r"systems with the sample times 0 s and 0.1 s are connected"):
        _ = random_system(0, dt=0.1) @ system
    with pytest.raises(
        InputError, match=r"3 outputs are connected to 2 inputs.*Allowed: equal numbers of signals"
    ):
        _ = system @ system
    with pytest.raises(InputError, match=r"systems of the shapes .* are added"):
        _ = system + square
    with pytest.raises(InputError, match=r"are fed back to .*as many outputs as inputs"):
        system.feedback()
    with pytest.raises(InputError, match="the feedback path has the shape"):
        square.feedback(system)
    with pytest.raises(InputError, match="the direct-feedthrough loop is singular"):
        LinearSystem(square.A, square.B, square.C, -np.eye(2)).feedback()


def test_responses_with_inconsistent_times_or_shapes_are_refused() -> None:
    system = random_system(0)
    with pytest.raises(InputError, match="the times are not ascending"):
        system.response([0.0, 0.0], np.zeros((2, 2)))
    with pytest.raises(InputError, match="the inputs have shape"):
        system.response([0.0, 1.0], np.zeros((2, 3)))
    with pytest.raises(InputError, match="the start has shape"):
        system.response([0.0, 1.0], np.zeros((2, 2)), [1.0])
    with pytest.raises(InputError, match=r"the times are not 0.1 s apart"):
        random_system(0, dt=0.1).response([0.0, 1.0], np.zeros((2, 2)))


def test_without_python_control_the_conversion_names_the_install_command(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(InputError, match=r"python-control is not installed.*Fix: pip install control"):
        random_system(0).to_control()


@pytest.mark.parametrize("suffix", ["json", "npz", "mat"])
def test_files_keep_the_matrices_bit_for_bit(tmp_path: Path, suffix: str) -> None:
    system = random_system(1, dt=0.1)
    path = tmp_path / f"plant.{suffix}"
    system.save(path)
    content: Any
    if suffix == "json":
        content = json.loads(path.read_text())
        assert content["states"] == list(system.states)
    elif suffix == "npz":
        content = np.load(path)
        assert json.loads(str(content["description"]))["dt"] == 0.1
    else:
        content = loadmat(path)
        assert content["Ts"].item() == 0.1
    for letter in "ABCD":
        assert np.array_equal(np.asarray(content[letter]), getattr(system, letter))
    with pytest.raises(UnknownNameError, match=r"there is no file format named '\.txt'"):
        system.save(tmp_path / "plant.txt")


def test_text_and_notebook_representations_summarise_the_system() -> None:
    text = repr(random_system(0))
    assert text.startswith("<LinearSystem linear system: continuous, 5 states, 2 inputs, 3 outputs, stable>")
    html = random_system(0, 20)._repr_html_()
    assert "<caption>A</caption>" in html
    assert "…" in html  # the middle of a large matrix is omitted
