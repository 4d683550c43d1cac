"""Connections of linear systems: series, parallel, feedback."""

from __future__ import annotations

import dataclasses

import numpy as np

from armblocks.analysis.state_space import StateSpaceModel, SystemT
from armblocks.errors import InputError, counted


def _common_sample_time(first: StateSpaceModel, second: StateSpaceModel) -> float:
    """The sample time (s) of both systems. Raises ``InputError`` if it differs."""
    if first.dt != second.dt:
        raise InputError(
            f"systems with the sample times {first.dt:g} s and {second.dt:g} s are connected",
            allowed="one sample time, or continuous systems only",
            fix="linearize the whole diagram instead",
            where="linear systems",
        )
    return first.dt


def _size_error(message: str, allowed: str) -> InputError:
    """The error for systems whose numbers of inputs and outputs cannot be connected."""
    return InputError(
        message,
        allowed=allowed,
        fix="choose inputs and outputs with select()",
        where="linear systems",
    )


def _states(first: StateSpaceModel, second: StateSpaceModel) -> dict[str, tuple[str, ...]]:
    """The names of all states, if they are unique, and their units."""
    names = (*first.states, *second.states)
    units = (*first.state_units, *second.state_units)
    return {"states": names if len(set(names)) == len(names) else (), "state_units": units}


def series(second: SystemT, first: StateSpaceModel) -> SystemT:
    """The series connection: the outputs of ``first`` are the inputs of ``second``.

    Raises ``InputError`` if the numbers of signals or the sample times differ.
    """
    dt = _common_sample_time(first, second)
    if second.D.shape[1] != first.D.shape[0]:
        raise _size_error(
            f"{counted(first.D.shape[0], 'output is', 'outputs are')} connected to "
            f"{counted(second.D.shape[1], 'input')}",
            "equal numbers of signals",
        )
    zero = np.zeros((first.order, second.order))
    return dataclasses.replace(
        second,
        A=np.block([[first.A, zero], [second.B @ first.C, second.A]]),
        B=np.vstack([first.B, second.B @ first.D]),
        C=np.hstack([second.D @ first.C, second.C]),
        D=second.D @ first.D,
        dt=dt,
        inputs=first.inputs,
        input_units=first.input_units,
        point=None,
        **_states(first, second),
    )


def parallel(first: SystemT, second: StateSpaceModel) -> SystemT:
    """The parallel connection: the sum of the outputs for the same inputs.

    Raises ``InputError`` if the numbers of signals or the sample times differ.
    """
    dt = _common_sample_time(first, second)
    if first.D.shape != second.D.shape:
        raise _size_error(
            f"systems of the shapes {first.D.shape} and {second.D.shape} are added", "equal shapes"
        )
    zero = np.zeros((first.order, second.order))
    return dataclasses.replace(
        first,
        A=np.block([[first.A, zero], [zero.T, second.A]]),
        B=np.vstack([first.B, second.B]),
        C=np.hstack([first.C, second.C]),
        D=first.D + second.D,
        dt=dt,
        point=None,
        **_states(first, second),
    )


def feedback(forward: SystemT, back: StateSpaceModel | float, sign: int) -> SystemT:
    """The closed loop of ``forward`` with the feedback path ``back``: a system, or one gain for all outputs.

    Raises ``InputError`` if the numbers of signals or the sample times differ, or if the matrix
    ``I - sign D_back D_forward`` is singular.
    """
    ny, nu = forward.D.shape
    if isinstance(back, int | float):
        if ny != nu:
            raise _size_error(
                f"{counted(ny, 'output is', 'outputs are')} fed back to {counted(nu, 'input')}",
                "as many outputs as inputs",
            )
        empty = np.zeros((0, 0))
        back = dataclasses.replace(
            forward,
            A=empty,
            B=np.zeros((0, ny)),
            C=np.zeros((nu, 0)),
            D=float(back) * np.eye(ny),
            states=(),
            state_units=(),
            inputs=(),
            outputs=(),
            input_units=(),
            output_units=(),
        )
    dt = _common_sample_time(forward, back)
    if back.D.shape != (nu, ny):
        raise _size_error(f"the feedback path has the shape {back.D.shape}", f"shape {(nu, ny)}")
    loop = np.eye(nu) - sign * back.D @ forward.D
    if np.linalg.cond(loop) > 1e14:
        raise InputError(
            "the direct-feedthrough loop is singular",
            allowed="a regular matrix I - sign D_back D_forward",
            fix="change a gain in the loop",
            where="linear systems",
        )
    # u = loop^-1 (v + sign (C2 x2 + D2 C1 x1))
    inverse = np.linalg.inv(loop)
    u1, u2 = sign * inverse @ back.D @ forward.C, sign * inverse @ back.C
    y1, y2, yv = forward.C + forward.D @ u1, forward.D @ u2, forward.D @ inverse
    return dataclasses.replace(
        forward,
        A=np.block([[forward.A + forward.B @ u1, forward.B @ u2], [back.B @ y1, back.A + back.B @ y2]]),
        B=np.vstack([forward.B @ inverse, back.B @ yv]),
        C=np.hstack([y1, y2]),
        D=yv,
        dt=dt,
        point=None,
        **_states(forward, back),
    )
