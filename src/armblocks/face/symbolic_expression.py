"""The class ``SymbolicExpression``: a quantity in symbols, as CasADi, SymPy, text or LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from casadi import SX, Function
from numpy.typing import NDArray

from armblocks.algebra.arithmetic import sums_of
from armblocks.algebra.factors import Term, atoms_of, factored
from armblocks.algebra.notation import Latex, Names, Text, short_angle
from armblocks.algebra.sums import COORDINATE, PARAMETER, RATE, TRIGONOMETRIC, Atom, Sum
from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.face.symbolic_equations import SymbolicEquations

MAX_TERMS = 400
"""Largest number of terms of an expression in text."""
Terms = tuple[Term, ...]


class SymbolicExpression(metaclass=ArgumentErrors):
    """A quantity of a robot in symbols: the result of the methods of :class:`SymbolicArm`.

    - ``casadi``: the expression as traced, an ``SX`` in natural shape (a vector is a column), for CasADi's
      own functions.
    - ``shape``: (4, 4), (6, n), (n,), or () for a scalar.

    ``T[0, 3]`` is an entry. All other forms are simplified: products of sines and cosines of parallel axes
    become sines and cosines of the sum of the angles, and common factors are taken out. Numbers then have 12
    digits.

    ``str`` and notebooks show the short form of textbooks, ``l1 c1 + l2 c12`` with ``c12 = cos(q1 + q2)``;
    the digits are the numbers of the joints.
    """

    def __init__(
        self, equations: SymbolicEquations, method: str, frame: str | None = None, index: Any = None
    ) -> None:
        self._equations = equations
        self._method = method
        self._frame = frame
        self._index = index

    def __reduce__(self) -> tuple[type[SymbolicExpression], tuple[object, ...]]:
        """Pickle and copy the description alone; expressions are traced again."""
        return SymbolicExpression, (self._equations, self._method, self._frame, self._index)

    @cached_property
    def _entries(self) -> NDArray[np.intp]:
        """Flat indices of the entries, in the shape of this expression."""
        shape = self._equations.shape_of(self._method)
        entries = np.arange(int(np.prod(shape)), dtype=np.intp).reshape(shape)
        if self._index is None:
            return entries
        try:
            return np.asarray(entries[self._index], dtype=np.intp)
        except (IndexError, TypeError):
            raise InputError(
                f"the index is {self._index!r}",
                where=f"{self._method} of robot '{self._equations.robot.name}'",
                allowed=f"an index of an array of shape {shape}",
                fix="write T[0, 3] for an entry, T[:3, 3] for a part",
            ) from None

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the quantity."""
        return self._entries.shape

    @cached_property
    def casadi(self) -> SX:
        """The expression in ``q``, ``qd``, ``qdd`` and ``symbols`` of the :class:`SymbolicArm`."""
        flat = self._equations.flat(self._method, self._frame)
        if len(self.shape) == 2:
            rows = [[flat[int(k)] for k in row] for row in self._entries]
            result = SX(*self.shape)
            for i, row in enumerate(rows):
                for j, entry in enumerate(row):
                    result[i, j] = entry
            return result
        return SX(flat[[int(k) for k in self._entries.ravel()]])

    def __getitem__(self, index: Any) -> SymbolicExpression:
        """An entry, a row or a part, with the indices of a NumPy array.

        Raises InputError for an index outside the shape, a part without entries, and a part of a part.
        """
        if self._index is not None:
            raise InputError(
                f"the expression is already the part {self._index!r}",
                where=f"{self._method} of robot '{self._equations.robot.name}'",
                allowed="one index",
                fix="index the whole expression, such as T[0, 3]",
            )
        part = SymbolicExpression(self._equations, self._method, self._frame, index)
        if part._entries.size == 0:
            raise InputError(
                f"the part {index!r} has no entries",
                where=self._where,
                allowed="parts with one entry or more",
                fix="write T[0, 3] for an entry, T[:3, 3] for a part",
            )
        return part

    def to_sympy(self) -> Any:
        """The expression in SymPy: a scalar, or a ``Matrix`` (a vector is a column).

        Needs the extra ``symbolic``. The symbols are real and have the names of ``SymbolicArm.names``.
        Integers and halves are exact, also from angles of 90 degrees; other numbers have 15 digits. An
        expression whose expansion needs more than 200 000 products is not simplified.
        """
        from armblocks.algebra import sympy_export

        symbols = sympy_export.symbols_of(self._equations.names)
        terms = self._terms
        if terms is None:
            inputs = [[symbols[name] for name in names] for names in self._equations.names_of_inputs]
            (values,) = sympy_export.of_function(self._function, inputs, self._where)
            flat = _dense(values, self._function, sympy_export.of_terms((), (), {}))
        else:
            coordinates = self._equations.names_of_inputs[0]
            flat = [sympy_export.of_terms(entry, coordinates, symbols) for entry in terms]
        if not self.shape:
            return flat[0]
        width = self.shape[1] if len(self.shape) == 2 else 1
        return sympy_export.matrix([flat[k : k + width] for k in range(0, len(flat), width)])

    def text(self, *, short: bool = False) -> str:
        """The expression in text, one line for each row, in Python's syntax.

        ``short``: in the form of textbooks, ``l1 c1 + l2 c12``. The long form is returned if a joint has a
        number of two digits, or a symbol has a name such as c1 or s1.

        Raises InputError for expressions with more than 400 terms.
        """
        notation = Text(self._names, short=short and self._can_be_short)
        entries = [notation.sum(entry) for entry in self._shown_terms()]
        if not self.shape:
            return entries[0]
        width = self.shape[1] if len(self.shape) == 2 else 1
        columns = [max(map(len, entries[k::width])) for k in range(width)]
        rows = [
            "  ".join(entry.ljust(columns[j]) for j, entry in enumerate(entries[k : k + width])).rstrip()
            for k in range(0, len(entries), width)
        ]
        return "\n".join(rows)

    def latex(self, *, short: bool = False) -> str:
        r"""The expression in LaTeX, a matrix as ``bmatrix``; ``short``: with ``c_{12}`` for a cosine.

        Raises InputError for expressions with more than 400 terms.
        """
        notation = Latex(self._names, short=short and self._can_be_short)
        entries = [notation.sum(entry) for entry in self._shown_terms()]
        if not self.shape:
            return entries[0]
        width = self.shape[1] if len(self.shape) == 2 else 1
        rows = [" & ".join(entries[k : k + width]) for k in range(0, len(entries), width)]
        return r"\begin{bmatrix} " + r" \\ ".join(rows) + r" \end{bmatrix}"

    def __str__(self) -> str:
        """The short text, with the meaning of its sines and cosines in the last line."""
        if self._count is None or self._count > MAX_TERMS:
            return repr(self)
        text = self.text(short=True)
        legend = self._legend() if self._can_be_short else ""
        return f"{text}\n({legend})" if legend else text

    def __repr__(self) -> str:
        where = f" at {self._frame}" if self._frame else ""
        size = "too many terms for text" if self._count is None else f"{self._count} terms"
        name = f"{self._method}{where} of {self._equations.robot.name}"
        return f"<SymbolicExpression {name}: shape {self.shape}, {size}>"

    def _repr_latex_(self) -> str | None:
        """The notebook view; None for long expressions, which notebooks then show as text."""
        if self._count is None or self._count > MAX_TERMS:
            return None
        return f"$\\displaystyle {self.latex(short=True)}$"

    @property
    def _where(self) -> str:
        return f"{self._method} of robot '{self._equations.robot.name}'"

    @cached_property
    def _function(self) -> Function:
        flat = self._equations.flat(self._method, self._frame)
        entries = SX(flat[[int(k) for k in self._entries.ravel()]])
        return Function("f", [*self._equations.inputs], [entries], {"cse": True})

    @cached_property
    def _terms(self) -> list[Terms] | None:
        """The factored entries, or None if there are too many terms."""
        ranks = (COORDINATE, RATE, RATE, PARAMETER)
        inputs = [
            [
                Sum.of(Atom(rank, (float(k + 1000 * part),) if rank == RATE else (float(k),), name))
                for k, name in enumerate(names)
            ]
            for part, (rank, names) in enumerate(zip(ranks, self._equations.names_of_inputs))
        ]
        sums = sums_of(self._function, inputs, self._where)
        if sums is None:
            return None
        return [factored(entry.contracted()) for entry in _dense(sums[0], self._function, Sum())]

    @cached_property
    def _count(self) -> int | None:
        """Number of terms of all entries, or None if it is too large to be known."""
        return None if self._terms is None else sum(map(_size, self._terms))

    def _shown_terms(self) -> Sequence[Terms]:
        if self._terms is None or self._count is None or self._count > MAX_TERMS:
            count = "very many" if self._count is None else str(self._count)
            raise InputError(
                f"the expression has {count} terms",
                where=self._where,
                allowed=f"at most {MAX_TERMS} terms in text and LaTeX",
                fix="take one entry, such as M[0, 1], or use the attribute casadi or to_sympy()",
            )
        return self._terms

    @property
    def _names(self) -> Names:
        coordinates, rates, accelerations, _ = self._equations.names_of_inputs
        speeds = self._equations.names_of_speeds
        derivatives = {
            **{name: (of, 1) for name, of in zip(rates, speeds)},
            **{name: (of, 2) for name, of in zip(accelerations, speeds)},
        }
        return Names(coordinates=coordinates, rates=derivatives)

    @property
    def _can_be_short(self) -> bool:
        return self._names.allow_short(self._equations.names)

    def _legend(self) -> str:
        """The meaning of the short sines and cosines, unless joint k has the name qk."""
        coordinates = self._names.coordinates
        if list(coordinates) == [f"q{k + 1}" for k in range(len(coordinates))]:
            return ""
        notation = Text(self._names, short=False)
        meanings: dict[str, str] = {}
        for terms in self._terms or ():
            for atom in atoms_of(terms):
                digits = short_angle(atom) if atom.rank == TRIGONOMETRIC else None
                if digits is not None:
                    meanings[f"{atom.text[0]}{digits}"] = notation.sum((Term(1.0, ((atom, 1),)),))
        return ", ".join(f"{name} = {meanings[name]}" for name in sorted(meanings))


def _size(terms: Terms) -> int:
    return sum(_size(term.inner) if term.inner else 1 for term in terms)


def _dense(values: Sequence[Any], function: Function, zero: Any) -> list[Any]:
    """All entries of the first output, a column, from its structural ones."""
    dense = [zero] * function.numel_out(0)
    for row, value in zip(function.sparsity_out(0).row(), values):
        dense[row] = value
    return dense
