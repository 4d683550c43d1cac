"""Designs of sweeps: the values of the varied parameters of each run."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.analysis.designs import DESIGNS, RANDOM, normal_quantile, unit_points
from armblocks.argument_errors import ArgumentErrors, with_argument_errors
from armblocks.errors import InputError, UnknownNameError
from armblocks.sweeps.sensitivity_designs import SENSITIVITY_DESIGNS, sensitivity_points

Array = NDArray[np.float64]
Column = NDArray[Any]
"""The values of one parameter, a row for each run; an array of objects for values that are not numbers."""

GRID, PAIRED = "grid", "paired"
MAX_RUNS = 1_000_000_000


@dataclass(frozen=True, kw_only=True)
class Distribution(metaclass=ArgumentErrors):
    """The distribution of a varied parameter, from :func:`uniform`, :func:`loguniform`, :func:`normal` or
    :func:`seeds`."""

    kind: str
    first: float
    second: float = 0.0

    def values(self, probability: Array) -> Array:
        """The quantiles of probabilities ``(n,)``."""
        if self.kind == "uniform":
            return self.first + probability * (self.second - self.first)
        if self.kind == "loguniform":
            low, high = math.log(self.first), math.log(self.second)
            return np.clip(np.exp(low + probability * (high - low)), self.first, self.second)
        if self.kind == "normal":
            return self.first + self.second * normal_quantile(probability)
        return self.first + np.arange(probability.size, dtype=np.float64)


def _bounds(kind: str, low: float, high: float) -> tuple[float, float]:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise InputError(
            f"{kind} has the bounds {low!r} and {high!r}",
            allowed="two finite numbers, the lower number first",
            where="sweep",
            fix="exchange the bounds, or vary a list with one value",
        )
    return float(low), float(high)


@with_argument_errors
def uniform(low: float, high: float) -> Distribution:
    """A uniform distribution between two bounds, for :func:`armblocks.sweep`. Raises ``InputError``."""
    low, high = _bounds("uniform", low, high)
    return Distribution(kind="uniform", first=low, second=high)


@with_argument_errors
def loguniform(low: float, high: float) -> Distribution:
    """A distribution between two positive bounds whose logarithm is uniform, for :func:`armblocks.sweep`.

    Raises ``InputError``.
    """
    low, high = _bounds("loguniform", low, high)
    if low <= 0.0:
        raise InputError(
            f"loguniform has the bound {low:g}",
            allowed="bounds above 0",
            where="sweep",
            fix="use uniform, or a small positive bound",
        )
    return Distribution(kind="loguniform", first=low, second=high)


@with_argument_errors
def normal(mean: float, deviation: float) -> Distribution:
    """A normal distribution with a standard deviation, for :func:`armblocks.sweep`. Raises ``InputError``."""
    if not (math.isfinite(mean) and math.isfinite(deviation) and deviation > 0.0):
        raise InputError(
            f"normal has the mean {mean!r} and the standard deviation {deviation!r}",
            allowed="finite numbers, a standard deviation above 0",
            where="sweep",
            fix="give ab.normal(mean, deviation)",
        )
    return Distribution(kind="normal", first=float(mean), second=float(deviation))


@with_argument_errors
def seeds(first: int = 1) -> Distribution:
    """A different seed for each run: ``first``, ``first + 1`` …, for the seed of a noise block.

    Without a varied seed the noise is the same in all runs.
    """
    if not 0 <= first < 2**31 or first != int(first):
        raise InputError(
            f"the first seed is {first!r}",
            allowed="an integer from 0 to 2^31 - 1",
            where="sweep",
            fix="start at 1",
        )
    return Distribution(kind="seeds", first=float(int(first)))


@with_argument_errors
def linspace(first: float, last: float, count: int) -> Array:
    """``count`` values at equal distances, for :func:`armblocks.sweep`: NumPy's ``linspace``."""
    start, stop, number = _ends(first, last, count, "linspace")
    return np.linspace(start, stop, number)


@with_argument_errors
def geomspace(first: float, last: float, count: int) -> Array:
    """``count`` values with equal ratios, for :func:`armblocks.sweep`: NumPy's ``geomspace``."""
    start, stop, number = _ends(first, last, count, "geomspace")
    if not (start * stop > 0.0).all():
        raise InputError(
            f"the values are from {first} to {last}",
            where="geomspace",
            allowed="two numbers of the same sign, other than 0",
            fix="use linspace",
        )
    return np.geomspace(start, stop, number)


def _ends(first: ArrayLike, last: ArrayLike, count: object, where: str) -> tuple[Array, Array, int]:
    """Two finite values, numbers or arrays, and a number of values. Raises ``InputError``."""
    ends: list[Array] = []
    for value in (first, last):
        try:
            end = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            end = np.array(np.nan)
        if not np.isfinite(end).all():
            raise InputError(
                f"{value!r} is not a finite number",
                where=where,
                allowed="the first and the last value",
                fix="give two numbers and the number of values",
            )
        ends.append(end)
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 1:
        raise InputError(
            f"the number of values is {count!r}",
            where=where,
            allowed="an integer, 1 or more",
            fix=f"write for example {where}(1, 10, 20)",
        )
    return ends[0], ends[1], int(cast("int", count))


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """The varied parameters of ``count`` runs: a column for each parameter, ``(count, *shape)``."""

    columns: Mapping[str, Column]
    count: int
    kind: str = PAIRED
    points: Array | None = None
    """The probabilities of the parameters ``(count, d)``, of a design for sensitivity indices."""

    @cached_property
    def digest(self) -> str:
        """A digest of all names and values; objects are represented by their texts."""
        content = hashlib.sha256()
        for name, column in self.columns.items():
            content.update(f"{name} {column.dtype} {column.shape}\n".encode())
            texts = "\n".join(map(str, column)).encode() if column.dtype == object else b""
            content.update(texts or np.ascontiguousarray(column).tobytes())
        return content.hexdigest()

    def row(self, run: int) -> dict[str, Any]:
        """The values of one run, as Python values."""
        return {name: _plain(column[run]) for name, column in self.columns.items()}


def make_design(vary: object, runs: int | None, kind: str | None, seed: int) -> Design:
    """The design that the arguments of :func:`armblocks.sweep` describe.

    Raises ``InputError`` and ``UnknownNameError``.
    """
    known = (GRID, PAIRED, *DESIGNS, *SENSITIVITY_DESIGNS)
    if kind is not None and kind not in known:
        raise UnknownNameError("design", kind, known, where="sweep")
    for name, number in (("runs", runs), ("seed", seed)):
        whole = isinstance(number, int | np.integer) and not isinstance(number, bool) and number >= 0
        if number is not None and not whole:
            raise InputError(
                f"{name} is {number!r}",
                allowed="an integer from 0 on",
                where="sweep",
                fix=f"give another {name}",
            )
    given, paired = _columns_of(vary)
    levels = {name: _levels(name, value) for name, value in given.items() if not _is_random(value)}
    random = {name: value for name, value in given.items() if isinstance(value, Distribution)}
    if paired or kind == PAIRED:
        return _paired(levels, random, runs)
    if kind == GRID and random:
        raise InputError(
            f"'{next(iter(random))}' has a distribution, and the design is a grid",
            allowed="lists and linspace in a grid",
            where="sweep",
            fix="give a list of values, or another design: random, sobol, halton or latin",
        )
    if kind in SENSITIVITY_DESIGNS:
        return _for_sensitivity(kind, levels, random, runs, seed)
    points = math.prod(len(values) for values in levels.values())
    count = _count(points, runs, bool(random))
    columns: dict[str, Column] = {}
    probabilities = unit_points(kind or RANDOM, count, len(random), seed) if random else np.empty((count, 0))
    for place, (name, distribution) in enumerate(random.items()):
        columns[name] = distribution.values(probabilities[:, place])
    repeat = count
    for name, values in levels.items():
        repeat //= len(values)
        numbers = np.arange(count) // repeat % len(values)
        columns[name] = values[numbers]
    return Design(columns={name: columns[name] for name in given}, count=count, kind=kind or RANDOM)


def _for_sensitivity(
    kind: str, levels: Mapping[str, Column], random: Mapping[str, Distribution], runs: int | None, seed: int
) -> Design:
    """A design for sensitivity indices."""
    unsuitable = [*levels, *(name for name, value in random.items() if value.kind == "seeds")]
    if unsuitable:
        raise InputError(
            f"'{unsuitable[0]}' has no distribution with quantiles, and the design is '{kind}'",
            allowed="ab.uniform, ab.loguniform and ab.normal",
            where="sweep",
            fix="give the parameter a distribution, or set it with parameters={…}",
        )
    points = sensitivity_points(kind, runs, len(random), seed)
    columns = {name: value.values(points[:, k]) for k, (name, value) in enumerate(random.items())}
    return Design(columns=columns, count=len(points), kind=kind, points=points)


def _count(points: int, runs: int | None, random: bool) -> int:
    """The number of runs: the size of the grid, or a multiple of this size for random parameters."""
    if runs is None:
        if random and points == 1:
            raise InputError(
                "the number of runs is missing",
                allowed="runs=… for parameters with distributions",
                where="sweep",
                fix="write for example runs=1000",
            )
        runs = points
    if runs > MAX_RUNS:
        raise InputError(
            f"the sweep has {runs} runs",
            allowed=f"at most {MAX_RUNS}",
            where="sweep",
            fix="give fewer values, or distributions with runs=…",
        )
    fits = runs % points == 0 if random else runs == points
    if not (runs > 0 and fits):
        multiple = f"a multiple of {points}, the number of combinations of the lists"
        raise InputError(
            f"runs is {runs}",
            allowed=multiple if random else f"{points}, the number of combinations of the lists",
            where="sweep",
            fix="omit runs, or change it",
        )
    return runs


def _paired(levels: Mapping[str, Column], random: Mapping[str, Distribution], runs: int | None) -> Design:
    lengths = {name: len(values) for name, values in levels.items()}
    if random or len(set(lengths.values())) != 1 or runs not in (None, *lengths.values()):
        texts = [f"{name}: {length}" for name, length in lengths.items()]
        texts += [f"{name}: a distribution" for name in random]
        raise InputError(
            f"the columns of a paired design have different lengths ({', '.join(texts)})",
            allowed="columns with one value for each run",
            where="sweep",
            fix="give each parameter as many values as there are runs",
        )
    return Design(columns=levels, count=next(iter(lengths.values())))


def _columns_of(vary: object) -> tuple[Mapping[str, object], bool]:
    """The columns by name, and whether they are paired: a table, or a list with a mapping for each run."""
    columns = getattr(vary, "columns", None)
    if columns is not None and not isinstance(vary, Mapping):
        frame = cast("Any", vary)
        names = [str(name) for name in columns]
        equal = next((name for name in names if names.count(name) > 1), None)
        if equal is not None:
            raise InputError(
                f"the table has several columns '{equal}'",
                allowed="a column for each parameter",
                where="sweep",
                fix="rename or delete columns",
            )
        return {str(name): np.asarray(frame[name]) for name in columns}, True
    if isinstance(vary, Sequence) and not isinstance(vary, str) and vary:
        listed = cast("Sequence[object]", vary)
        rows = [cast("Mapping[str, object]", row) for row in listed if isinstance(row, Mapping)]
        if len(rows) == len(listed) and all(row.keys() == rows[0].keys() for row in rows):
            return {name: [row[name] for row in rows] for name in rows[0]}, True
    if isinstance(vary, Mapping) and vary:
        return cast("Mapping[str, object]", vary), False
    raise InputError(
        f"vary is {vary!r:.60}",
        allowed="a mapping {'block.parameter': values}, a table, or a list of mappings with equal keys",
        where="sweep",
        fix="write for example vary={'pid.P': [1, 2, 3]}",
    )


def _is_random(value: object) -> bool:
    return isinstance(value, Distribution)


def _levels(name: str, value: object) -> Column:
    """The values of one parameter, a row for each value; values that are not numbers are objects."""
    listed: Any = value
    if isinstance(value, np.ndarray) or hasattr(value, "__array__"):  # also a column of a pandas table
        listed = np.atleast_1d(cast("Any", value))
    elif not isinstance(value, list | tuple | range):
        listed = [value]
    if len(listed) == 0:
        raise InputError(
            f"'{name}' has no values",
            allowed="one or more values",
            where="sweep",
            fix="give a list of values",
        )
    try:
        array = np.asarray(cast("ArrayLike", listed))
    except ValueError:
        array = np.empty(0, dtype=object)
    if array.dtype.kind in "iuf":
        numbers = array.astype(np.float64)
        if not np.isfinite(numbers).all():
            raise InputError(
                f"'{name}' has a value that is not finite",
                allowed="finite numbers",
                where="sweep",
                fix="remove NaN and infinite values",
            )
        return numbers if array.dtype.kind == "f" else array
    objects = np.empty(len(listed), dtype=object)
    for place, entry in enumerate(listed):
        objects[place] = entry
    return objects


def _key(value: object) -> object:
    return str(value) if isinstance(value, str) else id(value)


def _plain(value: Any) -> Any:
    return cast("Any", value.tolist()) if isinstance(value, np.ndarray | np.generic) else value


def combinations(columns: Sequence[Column]) -> tuple[list[int], NDArray[np.intp]]:
    """The first run with each combination of values, and the number of the combination of each run.

    Numbers are equal if all bits are, texts if all characters are; other objects if they are the same object.
    """
    known: dict[tuple[object, ...], int] = {}
    first: list[int] = []
    numbers = np.empty(len(columns[0]), dtype=np.intp)
    keys = [
        map(_key, column) if column.dtype == object else (row.tobytes() for row in column)
        for column in columns
    ]
    for run, key in enumerate(zip(*keys)):
        number = known.setdefault(key, len(known))
        if number == len(first):
            first.append(run)
        numbers[run] = number
    return first, numbers
