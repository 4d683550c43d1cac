"""The matrices of a linear system with names, on which the functions of this package operate."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass
from functools import partial
from typing import TYPE_CHECKING, Self, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, UnknownNameError, counted

if TYPE_CHECKING:
    from armblocks.analysis.operating_point import OperatingPoint

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class StateSpaceModel(metaclass=ArgumentErrors):
    """The system ``x' = A x + B u, y = C x + D u``, or ``x[k+1] = A x[k] + B u[k]`` for ``dt > 0`` (s).

    - ``A (nx, nx)``, ``B (nx, nu)``, ``C (ny, nx)``, ``D (ny, nu)``: the matrices. All quantities are
      deviations from the operating ``point``.
    - ``dt``: the sample time, s; 0 (the default) for a continuous system.
    - ``states``, ``inputs``, ``outputs``: the names of the scalars; by default ``x1``, ``u1``, ``y1`` …
    - ``state_units``, ``input_units``, ``output_units``: their units; by default empty.

    Raises ``InputError`` for matrices whose shapes do not fit or whose entries are not finite, for numbers of
    names or units that do not fit, and for a negative or infinite ``dt``.
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
            own_names: tuple[str, ...] = tuple(getattr(self, f"{kind}s"))
            names = own_names or tuple(f"{letter}{k + 1}" for k in range(size))
            units: tuple[str, ...] = tuple(getattr(self, f"{kind}_units")) or ("",) * size
            if len(names) != size or len(units) != size:
                raise InputError(
                    f"{counted(len(names), 'name')} and {counted(len(units), 'unit')} are given "
                    f"for the {kind}s",
                    allowed=f"one for each of the {size}",
                    where="linear system",
                    fix="give a name and a unit for each, or omit them",
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

    def __reduce__(self) -> tuple[object, ...]:
        # Pickling does not preserve that arrays are read-only, but the constructor does.
        fields = {entry.name: getattr(self, entry.name) for entry in dataclasses.fields(self)}
        return partial(type(self), **fields), ()

    @property
    def order(self) -> int:
        """Number of states."""
        return self.A.shape[0]

    @property
    def is_discrete(self) -> bool:
        """Whether the system is discrete, with the sample time ``dt``."""
        return self.dt > 0.0

    @property
    def is_siso(self) -> bool:
        """Whether there is one input and one output."""
        return self.D.shape == (1, 1)

    def select(
        self, outputs: str | Sequence[str] | None = None, inputs: str | Sequence[str] | None = None
    ) -> Self:
        """The same system with some of its inputs and outputs, by name.

        The name of a vector selects all its entries. Raises ``UnknownNameError`` for an unknown name.
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

    def transformed(self, T: ArrayLike) -> Self:
        """The same system in other state coordinates, ``x = T x_new``, without names of the states.

        ``T (nx, nx)`` must be regular; NumPy raises ``LinAlgError`` for a singular matrix.
        """
        matrix = np.asarray(T, dtype=np.float64)
        return dataclasses.replace(
            self,
            A=np.linalg.solve(matrix, self.A @ matrix),
            B=np.linalg.solve(matrix, self.B),
            C=self.C @ matrix,
            states=(),
            state_units=(),
        )


SystemT = TypeVar("SystemT", bound=StateSpaceModel)
"""Type variable: functions that change a system return the class of their argument."""


def _checked_matrices(system: StateSpaceModel) -> tuple[int, int, int]:
    """Replace the matrices by read-only copies, and return the numbers of states, inputs and outputs."""
    for letter in "ABCD":
        matrix = np.array(getattr(system, letter), dtype=np.float64) + 0.0  # 0 instead of -0
        if matrix.ndim != 2:
            raise InputError(
                f"{letter} has {counted(matrix.ndim, 'axis', 'axes')}",
                allowed="matrices, two axes",
                where="linear system",
                fix=f"give {letter} as a list of rows",
            )
        if not np.isfinite(matrix).all():
            raise InputError(
                f"{letter} contains NaN or infinity",
                allowed="finite matrices",
                where="linear system",
                fix=f"remove NaN and infinities from {letter}",
            )
        matrix.flags.writeable = False
        object.__setattr__(system, letter, matrix)
    (ny, nu), nx = system.D.shape, system.A.shape[0]
    for letter, shape in (("A", (nx, nx)), ("B", (nx, nu)), ("C", (ny, nx))):
        if getattr(system, letter).shape != shape:
            raise InputError(
                f"{letter} has shape {getattr(system, letter).shape}",
                allowed=f"shape {shape}, as A has {counted(nx, 'row')} and D has shape {system.D.shape}",
                where="linear system",
                fix=f"change the rows or columns of {letter}",
            )
    return nx, nu, ny


def _chosen(names: tuple[str, ...], selection: str | Sequence[str] | None, kind: str) -> list[int]:
    if selection is None:
        return list(range(len(names)))
    selected_indices: list[int] = []
    for name in (selection,) if isinstance(selection, str) else selection:
        indices = [k for k, known in enumerate(names) if known == name or known.rpartition("[")[0] == name]
        if not indices:
            raise UnknownNameError(kind, name, names)
        selected_indices += indices
    return selected_indices
