"""The pictures of :meth:`armblocks.SweepResult.plot`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from armblocks.errors import InputError, UnknownNameError
from armblocks.pictures.picture import Picture
from armblocks.report.charts.sweep_charts import (
    bands_chart,
    map_chart,
    parallel_chart,
    response_chart,
    scatter_matrix,
    tornado_chart,
)
from armblocks.sweeps.tables import STATUS

Array = NDArray[np.float64]

KINDS = ("response", "tornado", "scatter", "parallel", "map", "bands")
MOST_PARAMETERS = 9
"""Maximum number of parameters of a picture; those with the strongest rank correlation are shown."""


class SweepTable(Protocol):
    """The part of a result of a sweep that pictures need."""

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all columns."""
        ...

    @property
    def measures(self) -> tuple[str, ...]:
        """The names of the measures."""
        ...

    @property
    def kept(self) -> tuple[str, ...]:
        """The names of the kept signals."""
        ...

    @property
    def time(self) -> Array:
        """The sample times, s."""
        ...

    def __getitem__(self, name: str) -> NDArray[Any]: ...

    def correlations(self, name: str) -> Mapping[str, float]:
        """The rank correlations of a column with the parameters."""
        ...


def sweep_picture(
    result: SweepTable,
    kind: str,
    name: str | None,
    parameters: Sequence[str] | None = None,
    limit: float | None = None,
) -> Picture:
    """The picture of one kind."""
    if kind not in KINDS:
        raise UnknownNameError("kind of picture", kind, KINDS, where="SweepResult.plot")
    if kind == "bands":
        return _bands(result, name)
    if name is None and not result.measures:
        raise InputError(
            "the sweep has no measure",
            where="SweepResult.plot",
            allowed="a column with numbers",
            fix="repeat the sweep with measures={…}, or keep a signal and draw its 'bands'",
        )
    name = result.measures[0] if name is None else name
    chosen = _chosen(result, name, 2 if kind == "map" else MOST_PARAMETERS, parameters)
    values = result[name].astype(np.float64)
    columns: dict[str, Array] = {column: result[column].astype(np.float64) for column in chosen}
    if kind == "map":
        if len(columns) != 2:
            raise InputError(
                f"a map has two parameters, and {len(columns)} varies",
                where="SweepResult.plot",
                allowed="parameters=(first, second) with two or more values each",
                fix="draw the 'response'",
            )
        return map_chart(columns, name, values, limit)
    if kind == "response":
        return response_chart(columns, name, values)
    if kind == "tornado":
        return tornado_chart(columns, name, values)
    if kind == "parallel":
        return parallel_chart(columns, name, values)
    return scatter_matrix({**columns, name: values})


def _chosen(result: SweepTable, name: str, most: int, given: Sequence[str] | None) -> list[str]:
    """The given parameters, or those with the strongest rank correlation, in the order of the table."""
    order = result.names[1 : result.names.index(STATUS)]
    if given is not None:
        known = (*order, *result.measures)
        for parameter in given:
            if parameter not in known:
                raise UnknownNameError("parameter", parameter, known, where="SweepResult.plot")
            if result[parameter].dtype == object:
                raise InputError(
                    f"the parameter '{parameter}' has no numbers",
                    where="SweepResult.plot",
                    allowed="parameters with numbers",
                    fix="choose another parameter",
                )
        chosen = [parameter for parameter in given if np.ptp(result[parameter]) > 0.0]
    else:
        correlations = result.correlations(name)
        chosen = [column for column in correlations if np.ptp(result[column]) > 0.0]
    if not chosen:
        raise InputError(
            "no parameter with numbers varies",
            where="SweepResult.plot",
            allowed="a sweep with two or more values of a parameter",
            fix="vary a parameter",
        )
    return chosen[:most] if given is not None else sorted(chosen[:most], key=order.index)


def _bands(result: SweepTable, name: str | None) -> Picture:
    if name is None and result.kept:
        name = result.kept[0]
    if name is None or name not in result.kept:
        raise InputError(
            f"no samples of {name or 'a signal'} are kept",
            where="SweepResult.plot",
            allowed=", ".join(result.kept) or "signals of keep=",
            fix="repeat the sweep with keep=['block/y']",
        )
    return bands_chart(result.time, result[name], name)
