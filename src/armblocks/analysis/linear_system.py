"""A linear system as matrices with names: what a linearisation gives, and what is asked of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from armblocks.analysis.frequency import Margins
    from armblocks.analysis.modes import Mode
    from armblocks.analysis.operating_point import OperatingPoint
    from armblocks.analysis.time_response import TimeResponse
    from armblocks.analysis.transfer_function import TransferFunction

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True, eq=False, repr=False)
class LinearSystem:
    """``x' = A x + B u, y = C x + D u`` where ``dt`` is 0, else ``x[k+1] = A x[k] + B u[k]`` every ``dt`` s.

    ``A (nx, nx)``, ``B (nx, nu)``, ``C (ny, nx)``, ``D (ny, nu)``. All quantities are small changes about the
    operating ``point``. ``states``, ``inputs`` and ``outputs`` name the scalars, with their SI units; without
    names they are ``x1``, ``u1``, ``y1`` … Raises ``InputError`` for matrices that do not fit together or
    hold what is not a finite number.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    _: KW_ONLY
    dt: float = 0.0
    states: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    state_units: tuple[str, ...] = ()
    input_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    name: str = ""
    point: OperatingPoint | None = None

    def __post_init__(self) -> None:
        sizes = _checked_matrices(self)
        for letter, kind, size in zip("xuy", ("state", "input", "output"), sizes):
            given: tuple[str, ...] = tuple(getattr(self, f"{kind}s"))
            names = given or tuple(f"{letter}{k + 1}" for k in range(size))
            units: tuple[str, ...] = tuple(getattr(self, f"{kind}_units")) or ("",) * size
            if len(names) != size or len(units) != size:
                raise InputError(
                    f"{len(names)} names and {len(units)} units are given for the {kind}s",
                    allowed=f"one for each of the {size}",
                    where="linear system",
                    fix="give as many, or leave them out",
                )
            object.__setattr__(self, f"{kind}s", names)
            object.__setattr__(self, f"{kind}_units", units)
        if not (np.isfinite(self.dt) and self.dt >= 0.0):
            raise InputError(
                f"the sample time is {self.dt}",
                allowed="0 (continuous) or a finite time > 0 s",
                where="linear system",
                fix="give dt in seconds",
            )

    # What it is.

    @property
    def order(self) -> int:
        """Count of states."""
        return self.A.shape[0]

    @property
    def is_discrete(self) -> bool:
        """Whether the system moves in steps of ``dt``."""
        return self.dt > 0.0

    @property
    def is_siso(self) -> bool:
        """Whether there is one input and one output."""
        return self.D.shape == (1, 1)

    @property
    def is_stable(self) -> bool:
        """Whether every free motion dies away: poles left of the imaginary axis, or in the unit circle.

        A pole that is on that edge to the accuracy of the computation does not die away.
        """
        from armblocks.analysis.shown_values import growth

        return growth(self) < 0.0

    def select(
        self, outputs: str | Sequence[str] | None = None, inputs: str | Sequence[str] | None = None
    ) -> LinearSystem:
        """The same system seen through some of its ends: names, or the name of a vector for all its entries.

        Raises ``UnknownNameError``.
        """
        rows = _chosen(self.outputs, outputs, "output")
        columns = _chosen(self.inputs, inputs, "input")
        return dataclasses.replace(
            self,
            B=self.B[:, columns],
            C=self.C[rows],
            D=self.D[np.ix_(rows, columns)],
            inputs=tuple(self.inputs[k] for k in columns),
            outputs=tuple(self.outputs[k] for k in rows),
            input_units=tuple(self.input_units[k] for k in columns),
            output_units=tuple(self.output_units[k] for k in rows),
        )

    # Poles and zeros.

    def poles(self) -> Complex:
        """Eigenvalues of A (nx,), rad/s or per step, slowest first."""
        from armblocks.analysis.modes import poles

        return poles(self)

    def zeros(self) -> Complex:
        """Invariant zeros: where the system matrix loses rank, uncontrollable and unobservable modes among
        them."""
        from armblocks.analysis.zeros import invariant_zeros

        return invariant_zeros(self.A, self.B, self.C, self.D)

    def damp(self) -> tuple[Mode, ...]:
        """Natural frequency, damping ratio and time constant of every pole."""
        from armblocks.analysis.modes import modes

        return modes(self)

    def transfer_function(self) -> TransferFunction:
        """Zeros, poles and gain of the one output over the one input. Raises ``InputError`` for more."""
        from armblocks.analysis.transfer_function import transfer_function

        return transfer_function(self)

    # Over the frequency.

    def at(self, s: complex) -> Complex:
        """``C (s I - A)^-1 B + D`` (ny, nu) at one complex number: ``s``, or ``z`` of a discrete system."""
        from armblocks.analysis.frequency import evaluate

        return evaluate(self, np.array([s], dtype=np.complex128))[0]

    def dcgain(self) -> Array:
        """Output over input (ny, nu) at rest; infinite where an integrator makes it so."""
        from armblocks.analysis.frequency import dcgain

        return dcgain(self)

    def frequency_response(self, frequencies: ArrayLike) -> Complex:
        """Response (N, ny, nu) at angular frequencies (N,) in rad/s."""
        from armblocks.analysis.frequency import frequency_response

        return frequency_response(self, np.asarray(frequencies, dtype=np.float64))

    def margins(self) -> Margins:
        """Gain, phase and delay margin of the loop that this system is the open loop of, with ``1 + L``."""
        from armblocks.analysis.frequency import margins

        return margins(self)

    def bandwidth(self, drop: float = 3.0) -> float:
        """First angular frequency (rad/s) at which the gain is ``drop`` dB below that at rest."""
        from armblocks.analysis.frequency import bandwidth

        return bandwidth(self, drop)

    # Over the time.

    def step_response(self, stop_time: float | None = None, points: int = 600) -> TimeResponse:
        """Every output after a unit step of every input, exact at its instants."""
        from armblocks.analysis.time_response import step_response

        return step_response(self, stop_time, points)

    def impulse_response(self, stop_time: float | None = None, points: int = 600) -> TimeResponse:
        """Every output after a unit impulse of every input (discrete: a 1 for one sample)."""
        from armblocks.analysis.time_response import impulse_response

        return impulse_response(self, stop_time, points)

    def response(self, time: ArrayLike, inputs: ArrayLike, start: ArrayLike | None = None) -> TimeResponse:
        """Outputs for ``inputs`` (N, nu) at ``time`` (N,) s, straight between the instants, from state
        ``start`` (nx,)."""
        from armblocks.analysis.time_response import forced_response

        return forced_response(self, time, inputs, start)

    # Structure.

    def controllability(self) -> int:
        """How many dimensions of the state the inputs reach."""
        from armblocks.analysis.reduction import reachable_dimensions

        return reachable_dimensions(self.A, self.B)

    def observability(self) -> int:
        """How many dimensions of the state the outputs tell apart."""
        from armblocks.analysis.reduction import reachable_dimensions

        return reachable_dimensions(self.A.T, self.C.T)

    def gramians(self) -> tuple[Array, Array]:
        """Controllability and observability gramian (nx, nx). Raises ``InputError`` if it is not stable."""
        from armblocks.analysis.reduction import gramians

        return gramians(self)

    def minimal(self) -> LinearSystem:
        """The same transfer function with as few states as possible, named ``x1`` …"""
        from armblocks.analysis.reduction import minimal

        return minimal(self)

    def on_path(self) -> LinearSystem:
        """Without the states that no input reaches or no output follows from; the others keep their names."""
        from armblocks.analysis.reduction import on_path

        return on_path(self)

    def transformed(self, T: ArrayLike) -> LinearSystem:
        """The same system in other states, ``x = T x_new``."""
        matrix = np.asarray(T, dtype=np.float64)
        return dataclasses.replace(
            self,
            A=np.linalg.solve(matrix, self.A @ matrix),
            B=np.linalg.solve(matrix, self.B),
            C=self.C @ matrix,
            states=(),
            state_units=(),
        )

    # Put together.

    def __neg__(self) -> LinearSystem:
        return dataclasses.replace(self, C=-self.C, D=-self.D)

    def __add__(self, other: LinearSystem) -> LinearSystem:
        from armblocks.analysis.connections import parallel

        return parallel(self, other)

    def __sub__(self, other: LinearSystem) -> LinearSystem:
        return self + -other

    def __matmul__(self, other: LinearSystem) -> LinearSystem:
        """``second @ first``: the outputs of the right one are the inputs of the left one."""
        from armblocks.analysis.connections import series

        return series(self, other)

    def feedback(self, other: LinearSystem | float = 1.0, *, sign: int = -1) -> LinearSystem:
        """The closed loop ``(1 - sign L)^-1 L`` with ``other`` in the way back."""
        from armblocks.analysis.connections import feedback

        return feedback(self, other, sign)

    # To elsewhere.

    def to_control(self) -> Any:
        """A ``StateSpace`` of python-control, which has to be installed."""
        from armblocks.analysis.export import to_control

        return to_control(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Write ``.json``, ``.npz`` or ``.mat``, all of it or nothing."""
        from armblocks.analysis.export import save

        save(self, path)

    def __repr__(self) -> str:
        from armblocks.analysis.text import system_text

        return system_text(self)

    def _repr_html_(self) -> str:
        from armblocks.analysis.text import system_html

        return system_html(self)


def _checked_matrices(system: LinearSystem) -> tuple[int, int, int]:
    """Make the matrices fresh, two-dimensional and read-only; the counts of states, inputs and outputs."""
    for letter in "ABCD":
        matrix = np.array(getattr(system, letter), dtype=np.float64)
        if matrix.ndim != 2:
            raise InputError(
                f"{letter} has {matrix.ndim} axes",
                allowed="matrices, two axes",
                where="linear system",
                fix=f"give {letter} as a list of rows",
            )
        if not np.isfinite(matrix).all():
            raise InputError(
                f"{letter} is not all finite numbers",
                allowed="finite matrices",
                where="linear system",
                fix=f"take NaN and infinities out of {letter}",
            )
        matrix.flags.writeable = False
        object.__setattr__(system, letter, matrix)
    (ny, nu), nx = system.D.shape, system.A.shape[0]
    for letter, shape in (("A", (nx, nx)), ("B", (nx, nu)), ("C", (ny, nx))):
        if getattr(system, letter).shape != shape:
            raise InputError(
                f"{letter} has shape {getattr(system, letter).shape}",
                allowed=f"shape {shape}, as A has {nx} rows and D has shape {system.D.shape}",
                where="linear system",
                fix=f"change the rows or columns of {letter}",
            )
    return nx, nu, ny


def _chosen(names: tuple[str, ...], wanted: str | Sequence[str] | None, kind: str) -> list[int]:
    if wanted is None:
        return list(range(len(names)))
    chosen: list[int] = []
    for name in (wanted,) if isinstance(wanted, str) else wanted:
        places = [k for k, known in enumerate(names) if known == name or known.rpartition("[")[0] == name]
        if not places:
            raise UnknownNameError(kind, name, names)
        chosen += places
    return chosen
