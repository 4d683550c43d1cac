"""The result of an identification: base parameters with standard errors, the robot, residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError, UnknownNameError, counted, shortened_list
from armblocks.face.arm import Arm
from armblocks.face.estimates import (
    Comparison,
    cell,
    comparison_chart,
    confidence_intervals,
    correlations,
    standard_errors,
    summary_line,
    value_of,
)
from armblocks.face.joint_log import LogSource, prepared, read_logs
from armblocks.face.payload import Payload
from armblocks.face.text_table import text_table
from armblocks.face.trajectory_report import save_picture
from armblocks.pictures.numbers import table_number
from armblocks.pictures.picture import Picture
from armblocks.pictures.style import FIGURE_WIDTH
from armblocks.robot import Robot

Array = NDArray[np.float64]

_UNITS = {"m": "kg", "Jm": "kg m2", "B": "N m s/rad", "Tc": "N m", "Tc+": "N m", "Tc-": "N m"}
_CORRELATED = 0.2
_GROUPING_WIDTH = 60
_MISFIT_OF_NOISE, _MISFIT_OF_TORQUES = 0.3, 0.01
"""A deviation of the torques of ``robot`` from the fit is reported if it exceeds both multiples: of the
noise, and of the measured torques."""


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class IdentificationResult(metaclass=ArgumentErrors):
    """The identified parameters of an arm. ``print`` shows them as a table.

    - ``parameters``: the names of the b base parameters.
    - ``groupings``: each base parameter as a sum of parameters of links and motors.
    - ``values`` (b,), ``covariance`` (b, b): parameters in ``not_identified`` are NaN, because the motion of
      the log does not determine them.
    - ``prior`` (b,): the values of the description.
    - ``condition``: condition number of the weighted regressor with columns of length 1.
    - ``noise`` (n,): standard deviation of each joint's torque, N m or N.
    - ``robot``: a description with physically consistent bodies whose base parameters are nearest to the
      estimate. Combinations that the torques do not determine stay near the description that was given.
    - ``consistent_values`` (b,): the base parameters of ``robot``.
    - ``time`` (N,) s; ``tau``, ``fitted`` (N, n): measured and fitted torques of the used samples.
    - ``dropped``: the number of samples that were omitted, with missing values or at the ends.
    - ``notes``: the filters and weights.
    """

    parameters: tuple[str, ...]
    groupings: tuple[str, ...]
    values: Array
    prior: Array
    covariance: Array
    condition: float
    noise: Array
    degrees_of_freedom: int
    robot: Robot
    consistent_values: Array
    time: Array = field(repr=False)
    tau: Array = field(repr=False)
    fitted: Array = field(repr=False)
    dropped: int = field(default=0, repr=False)
    notes: tuple[str, ...] = field(default=(), repr=False)

    @property
    def name(self) -> str:
        """The name of the robot."""
        return self.robot.name

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the n entries of ``tau``."""
        return tuple(entry.name for entry in self.robot.speeds)

    @property
    def joint_units(self) -> tuple[str, ...]:
        """The units of the entries of ``tau``: N m or N."""
        return tuple("N" if entry.unit == "m" else "N m" for entry in self.robot.speeds)

    @property
    def units(self) -> tuple[str, ...]:
        """The units of the parameters."""
        return tuple(unit_of(name) for name in self.parameters)

    @property
    def standard_errors(self) -> Array:
        """The standard errors (b,) of the values; NaN for parameters that are not identified."""
        return standard_errors(self.covariance)

    @property
    def not_identified(self) -> tuple[str, ...]:
        """The base parameters that the motion of the log does not determine."""
        return tuple(name for name, value in zip(self.parameters, self.values.tolist()) if value != value)

    @property
    def autocorrelation(self) -> Array:
        """The correlation (n,) of neighbouring residuals, 0 for independent noise."""
        return lag_correlations(self.time, self.residuals)

    def __getitem__(self, parameter: str) -> float:
        """The value of a base parameter. Raises UnknownNameError."""
        return value_of(parameter, self.parameters, self.values, "base parameter", self.name)

    @property
    def arm(self) -> Arm:
        """The identified ``robot`` with compiled kinematics and dynamics."""
        return Arm(self.robot)

    @property
    def residuals(self) -> Array:
        """Measured minus fitted torques (N, n), N m or N."""
        return self.tau - self.fitted

    @property
    def errors(self) -> Array:
        """RMS of each joint's residuals (n,), in % of the RMS of its measured torque."""
        size = np.sqrt(np.mean(self.tau**2, axis=0))
        return 100.0 * np.sqrt(np.mean(self.residuals**2, axis=0)) / np.where(size > 0.0, size, np.inf)

    @property
    def correlation(self) -> Array:
        """The correlations (b, b) of the estimates; NaN for parameters that are not identified."""
        return correlations(self.covariance)

    def confidence_intervals(self, level: float = 0.95) -> Array:
        """Lower and upper ends (b, 2) of the intervals that contain each parameter with this probability.

        They are valid for independent, normally distributed noise of the torques and an exact motion.
        """
        return confidence_intervals(self.values, self.covariance, self.degrees_of_freedom, level)

    def validate(
        self, data: LogSource, *, cutoff: float | None = None, payload: Payload | float | None = None
    ) -> Array:
        """Root mean square (n,) of measured minus computed torques of ``robot`` for other logs, N m or N.

        ``data`` and ``cutoff`` as for :func:`identify`. ``payload``: a known body at the tool during these
        measurements. Use a motion that was not used for the estimate.
        """
        logs = prepared(read_logs(data, self.robot, "validate"), self.robot, cutoff, whole=False)
        arm = self.arm
        differences = [
            s.tau
            - (arm.rne(s.q, s.qd, s.qdd) if payload is None else arm.rne(s.q, s.qd, s.qdd, payload=payload))
            for s in logs.segments
            if len(s.time)
        ]
        if not differences:
            raise InputError(
                "no sample is complete",
                where="validate",
                allowed="samples with q and tau",
                fix="give another log",
            )
        return np.sqrt(np.mean(np.concatenate(differences) ** 2, axis=0))

    def table(self) -> list[dict[str, float | str]]:
        """One row for each base parameter."""
        rows: list[dict[str, float | str]] = []
        for k, name in enumerate(self.parameters):
            value, error = float(self.values[k]), float(self.standard_errors[k])
            rows.append(
                {
                    "parameter": name,
                    "unit": self.units[k],
                    "value": value,
                    "standard error": error,
                    "%": 100.0 * error / abs(value) if value else float("nan"),
                    "description": float(self.prior[k]),
                    "consistent": float(self.consistent_values[k]),
                    "sum": self.groupings[k],
                }
            )
        return rows

    def picture(self, width: float = FIGURE_WIDTH, *, joints: tuple[str, ...] = ()) -> Picture:
        """Measured torques, fitted torques and residuals over time, one panel for each joint.

        ``joints``: the shown joints, by default all. Raises UnknownNameError.
        """
        for joint in joints:
            if joint not in self.joints:
                raise UnknownNameError("joint", joint, self.joints, where="IdentificationResult.picture")
        shown = [j for j, joint in enumerate(self.joints) if not joints or joint in joints]
        rows = [
            Comparison(
                quantity=f"{'Force' if self.joint_units[j] == 'N' else 'Torque'} of {self.joints[j]}",
                unit=self.joint_units[j],
                measured=self.tau[:, j],
                fitted=self.fitted[:, j],
            )
            for j in shown
        ]
        title = f"Identification of {self.name}: torques"
        description = "Measured and fitted joint torques and their differences."
        return comparison_chart(self.time, rows, title, description, width)

    def plot(self, *, save: str | PathLike[str] | None = None) -> Picture:
        """The picture of torques and residuals; ``save``: the ``.svg`` or ``.png`` file to write."""
        picture = self.picture()
        if save is not None:
            save_picture(picture, save, "IdentificationResult.plot")
        return picture

    def __repr__(self) -> str:
        return (
            f"<IdentificationResult {self.name}: {counted(len(self.parameters), 'base parameter')} from "
            f"{counted(len(self.time), 'sample')}>"
        )

    def __str__(self) -> str:
        heads = ["parameter", "value", "std. error", "%", "description", "unit", "sum"]
        rows = [
            [
                str(row["parameter"]),
                *(cell(row[name], 4) for name in ("value", "standard error", "%", "description")),
                str(row["unit"]),
                _shortened(str(row["sum"])),
            ]
            for row in self.table()
        ]
        lines = [repr(self)[1:-1].removeprefix("IdentificationResult "), *_left_last(heads, rows), ""]
        errors, noise = self.errors, self.noise
        joint_rows = [
            [joint, table_number(float(noise[j]), 4), self.joint_units[j], f"{errors[j]:.2f} %"]
            for j, joint in enumerate(self.joints)
        ]
        lines += text_table(["joint", "noise", "unit", "of torque"], joint_rows)
        lines += ["", self.summary]
        lines += self.findings
        return "\n".join(lines)

    @property
    def summary(self) -> str:
        """The condition number and the degrees of freedom, as a sentence."""
        return summary_line(self.condition, self.degrees_of_freedom)

    @property
    def findings(self) -> tuple[str, ...]:
        """Sentences on filters, missing samples, unidentified and impossible parameters, correlated noise."""
        found = list(self.notes)
        if self.dropped:
            found.append(f"{counted(self.dropped, 'sample')} omitted, with missing values or at the ends")
        if self.not_identified:
            found.append(
                "not identified, because the motion does not excite them: "
                + shortened_list(list(self.not_identified))
            )
        with np.errstate(invalid="ignore"):
            weak = np.flatnonzero(self.standard_errors > np.abs(self.values))
        if weak.size:
            found.append(
                "standard error above the value: "
                + shortened_list([self.parameters[k] for k in weak.tolist()])
            )
        if misfit := self._misfit:
            found.append(
                "no possible bodies have the estimated parameters: the torques of the robot deviate from the "
                f"fit by {100.0 * misfit:.3g} %; check the payload, and the units and signs of the log"
            )
        correlated = np.flatnonzero(self.autocorrelation > _CORRELATED)
        if correlated.size:
            found.append(
                f"neighbouring residuals of {', '.join(self.joints[j] for j in correlated.tolist())} are "
                "correlated (filtered data, or an effect that the model does not have): the standard errors "
                "are too small; use decimate"
            )
        return tuple(found)

    @property
    def _misfit(self) -> float:
        """Deviation of the torques of ``robot`` from ``fitted``, relative to ``tau``; 0 if negligible."""
        used = np.flatnonzero(np.isfinite(self.values) & (self.standard_errors > 0.0))
        noisy = self.noise > 0.0
        size = float(np.sum((self.tau[:, noisy] / self.noise[noisy]) ** 2)) / max(self.tau.size, 1)
        errors = ((self.consistent_values - self.values) / self.standard_errors)[used]
        inverse = np.linalg.pinv(self.correlation[np.ix_(used, used)], hermitian=True)
        square = float(errors @ inverse @ errors) / max(self.degrees_of_freedom, 1)
        limit = max(_MISFIT_OF_NOISE**2, _MISFIT_OF_TORQUES**2 * size)
        return math.sqrt(square / size) if limit < square < math.inf and size > 0.0 else 0.0


def unit_of(parameter: str) -> str:
    """The unit of a parameter ``link.quantity``."""
    quantity = parameter.rpartition(".")[2]
    return _UNITS.get(quantity, "kg m" if quantity.startswith("m") else "kg m2")


def lag_correlations(time: Array, residuals: Array) -> Array:
    """The correlation (n,) of each residual with the next one, without pairs across gaps."""
    steps = np.diff(time)
    if not len(steps):
        return np.zeros(len(residuals.T))
    pairs = (steps > 0.0) & (steps <= 1.5 * np.median(np.abs(steps)))
    before, after = residuals[:-1][pairs], residuals[1:][pairs]
    correlations = np.zeros(len(residuals.T))
    for j in range(len(correlations)):
        square = float(before[:, j] @ before[:, j])
        correlations[j] = float(before[:, j] @ after[:, j]) / square if square > 0.0 else 0.0
    return correlations


def _shortened(text: str) -> str:
    if len(text) <= _GROUPING_WIDTH:
        return text
    return text[:_GROUPING_WIDTH].rpartition(" ")[0].rstrip(" +-") + " …"


def _left_last(heads: list[str], rows: list[list[str]]) -> list[str]:
    """A table whose last two columns are aligned to the left."""
    widths = [max(len(row[-2]) for row in [heads, *rows])]
    first = text_table(heads[:-2], [row[:-2] for row in rows])
    width = max(len(line) for line in first)
    return [
        f"{line.ljust(width)}  {row[-2].ljust(widths[0])}  {row[-1]}".rstrip()
        for line, row in zip(first, [heads, *rows])
    ]
