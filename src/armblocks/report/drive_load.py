"""Loads of a motor and its gear over a cycle, against their limits.

All values are at the shaft of the motor, unless stated otherwise. Signals are interpolated linearly between
their samples; the integrals of torques squared and of powers are exact for this interpolation.

Source: the selection procedure of drive manufacturers (effective torque at mean speed, peak torque and speed
against the curves of the motor). For strain wave gears the average output torque is the cubic mean of the
torque, weighted by speed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armblocks.argument_errors import ArgumentErrors
from armblocks.errors import InputError
from armblocks.report.motion_summary import signed_integrals

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Drive(metaclass=ArgumentErrors):
    """A motor with its gear from a catalogue.

    Torques are in N m, speeds in rad/s and inertias in kg m², all at the motor, unless stated otherwise.
    ``None`` and infinity: no limit.

    - ``gear_ratio``: motor turns per joint turn (rad/m for a prismatic joint), above 0.
    - ``stall_torque``: continuous torque at rest.
    - ``max_speed``: the largest speed.
    - ``inertia``: rotor, brake and input side of the gear.
    - ``rated_torque``, ``rated_speed``: a second point of the continuous curve, which is a straight line.
    - ``peak_torque``: the limit up to ``corner_speed``. From there it falls on a line to the continuous
      torque at ``max_speed``.
    - ``brake_torque``: holding torque of the brake.
    - ``thermal_time_constant``: of the winding, s.
    - ``efficiency``: of the gear in both directions, 0 to 1.
    - ``gear_peak_torque``, ``gear_rated_torque``: at the output of the gear, N m (N).
    - ``gear_max_speed``: at the input of the gear.
    - ``viscous_friction`` (N m s), ``coulomb_friction`` (N m): as for :class:`~armblocks.Motor`.
    - ``torque_constant`` (N m/A), ``resistance`` (Ω): for the copper losses.
    - ``max_inertia_ratio``: largest load inertia divided by the inertia of the drive.
    - ``joints``: the names of the joints for which the drive is a candidate; none: all joints.
    """

    name: str
    gear_ratio: float
    stall_torque: float
    max_speed: float
    inertia: float = 0.0
    rated_torque: float | None = None
    rated_speed: float | None = None
    peak_torque: float = math.inf
    corner_speed: float | None = None
    brake_torque: float | None = None
    thermal_time_constant: float | None = None
    efficiency: float = 1.0
    gear_peak_torque: float = math.inf
    gear_rated_torque: float = math.inf
    gear_max_speed: float = math.inf
    viscous_friction: float = 0.0
    coulomb_friction: float = 0.0
    torque_constant: float | None = None
    resistance: float | None = None
    max_inertia_ratio: float = math.inf
    joints: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        finite = ("gear_ratio", "stall_torque", "max_speed")
        optional = ("rated_torque", "rated_speed", "corner_speed", "brake_torque", "resistance")
        unlimited = ("peak_torque", "gear_peak_torque", "gear_rated_torque", "gear_max_speed")
        others = ("thermal_time_constant", "torque_constant", "max_inertia_ratio")
        nonnegative = ("inertia", "viscous_friction", "coulomb_friction")
        above_zero = ("a number above 0", 0.0, math.inf, True)
        rules: dict[str, tuple[str, float, float, bool]] = {}
        rules |= dict.fromkeys(finite, ("a finite number above 0", 0.0, math.inf, False))
        rules |= dict.fromkeys((*optional, *unlimited, *others), above_zero)
        rules |= dict.fromkeys(nonnegative, ("a finite number, 0 or more", -1e-300, math.inf, False))
        rules["efficiency"] = ("a number above 0 and up to 1", 0.0, 1.0, True)
        for name, (allowed, above, most, included) in rules.items():
            value = getattr(self, name)
            if value is None:
                continue
            fits = isinstance(value, float | int) and above < value <= most and (included or value < most)
            if not fits:
                raise InputError(
                    f"{name} = {value!r}",
                    where=f"drive '{self.name}'",
                    allowed=allowed,
                    fix=f"correct {name}, in the unit of the catalogue's column",
                )
            object.__setattr__(self, name, float(value))
        if (self.rated_torque is None) != (self.rated_speed is None):
            raise InputError(
                "rated_torque and rated_speed are not given together",
                where=f"drive '{self.name}'",
                allowed="both, as one point of the continuous curve, or none",
                fix="add the missing value",
            )

    def continuous_torque(self, speed: Array | float) -> Array:
        """The continuous torque at motor speeds (rad/s): the line through stall torque and rated point."""
        falling = 0.0
        if self.rated_torque is not None and self.rated_speed is not None:
            falling = (self.stall_torque - self.rated_torque) / self.rated_speed
        return np.maximum(self.stall_torque - falling * np.abs(speed), 1e-9 * self.stall_torque)

    def peak_torque_at(self, speed: ArrayLike) -> Array:
        """The greatest torque at motor speeds (rad/s)."""
        corner = self.max_speed if self.corner_speed is None else min(self.corner_speed, self.max_speed)
        fast = np.maximum(np.abs(np.asarray(speed, dtype=np.float64)), corner)
        if not math.isfinite(self.peak_torque) or corner == self.max_speed:
            return np.full_like(fast, self.peak_torque)
        end = float(self.continuous_torque(self.max_speed))
        share = np.minimum((fast - corner) / (self.max_speed - corner), 1.0)
        return self.peak_torque + (min(end, self.peak_torque) - self.peak_torque) * share


@dataclass(frozen=True, kw_only=True)
class LimitCheck:
    """One limit of a drive: the ``value`` of the cycle, its ``limit``, in ``unit``."""

    name: str
    value: float
    limit: float
    unit: str

    @property
    def passes(self) -> bool:
        """Whether the value is within the limit."""
        return self.value <= self.limit * (1.0 + 1e-9)

    @property
    def used(self) -> float:
        """The value divided by the limit."""
        return self.value / self.limit

    @property
    def margin(self) -> float:
        """1 - value / limit: the remaining fraction of the limit, negative beyond it."""
        return 1.0 - self.used


@dataclass(frozen=True, eq=False, kw_only=True)
class DriveLoad(metaclass=ArgumentErrors):
    """The load of one drive at one joint over a cycle: a motion and a pause.

    - ``time`` (N,) s.
    - ``speed`` (N,) rad/s, ``torque`` (N,) N m: of the motor.
    - ``output_torque`` (N,) N m or N: at the output of the gear.
    - ``pause`` s, ``pause_torque`` N m: duration of the pause and motor torque in it.
    - ``holding_torque`` N m: the largest gravity torque, at the motor.
    - ``load_inertia`` kg m²: the largest inertia at the joint without the drive, divided by the square of the
      gear ratio.
    """

    joint: str
    drive: Drive
    time: Array
    speed: Array
    torque: Array
    output_torque: Array
    pause: float
    pause_torque: float
    holding_torque: float
    load_inertia: float

    @property
    def duration(self) -> float:
        """Duration of the motion, s."""
        return float(self.time[-1] - self.time[0])

    @property
    def cycle_time(self) -> float:
        """Duration of motion and pause, s."""
        return self.duration + self.pause

    @cached_property
    def rms_torque(self) -> float:
        """Root mean square of the motor torque over the cycle, N m."""
        return math.sqrt((self._squared + self.pause_torque**2 * self.pause) / self.cycle_time)

    @cached_property
    def mean_speed(self) -> float:
        """Mean magnitude of the motor speed during the motion, rad/s."""
        work, taken = signed_integrals(self.time, self.speed)
        return (work + taken) / self.duration

    @cached_property
    def peak_power(self) -> float:
        """Largest mechanical power of the motor, W; negative powers count by their magnitude."""
        return float(np.abs(self.torque * self.speed).max())

    @cached_property
    def energy(self) -> float:
        """Mechanical energy that the motor delivers per cycle, J."""
        return signed_integrals(self.time, self.torque * self.speed)[0]

    @cached_property
    def regenerated_energy(self) -> float:
        """Mechanical energy that the motor takes in while braking, per cycle, J."""
        return signed_integrals(self.time, self.torque * self.speed)[1]

    @property
    def copper_loss(self) -> float | None:
        """Heat of the winding per cycle, J; ``None`` without torque constant and resistance."""
        k, R = self.drive.torque_constant, self.drive.resistance
        return None if k is None or R is None else R * self.rms_torque**2 * self.cycle_time / k**2

    @property
    def inertia_ratio(self) -> float:
        """Load inertia at the motor divided by the inertia of the drive; infinite if the latter is zero."""
        return self.load_inertia / self.drive.inertia if self.drive.inertia else math.inf

    @cached_property
    def temperature_rise(self) -> float:
        """Peak of the winding's temperature rise in the periodic state, relative to the allowed one.

        The temperature rise is the response of a first-order lag, with the thermal time constant of the
        drive, to (torque / continuous torque)². Without a time constant, the result is the mean of this
        square.
        """
        heat = (self.torque / self.drive.continuous_torque(self.speed)) ** 2
        heating = np.append((heat[:-1] + heat[1:]) / 2.0, (self.pause_torque / self.drive.stall_torque) ** 2)
        steps = np.append(np.diff(self.time), self.pause)
        constant = self.drive.thermal_time_constant
        if constant is None:
            return float((heating * steps).sum() / self.cycle_time)
        decay = np.exp(-steps / constant)
        gained = heating * -np.expm1(-steps / constant)
        final = 0.0
        for kept, gain in zip(decay.tolist(), gained.tolist()):
            final = final * kept + gain
        rise = final / -math.expm1(-self.cycle_time / constant)
        peak = rise
        for kept, gain in zip(decay.tolist(), gained.tolist()):
            rise = rise * kept + gain
            peak = max(peak, rise)
        return peak

    @property
    def cycles_per_hour(self) -> float:
        """Number of cycles in an hour."""
        return 3600.0 / self.cycle_time

    @property
    def most_cycles_per_hour(self) -> float:
        """The largest number of cycles per hour for which the RMS torque is allowed.

        The pause is longer or shorter for another number of cycles.
        The result is 0 if the torque of the pause exceeds the continuous torque.
        """
        allowed = float(self.drive.continuous_torque(self.mean_speed)) ** 2
        missing = self._squared - allowed * self.duration
        if missing <= 0.0:
            return 3600.0 / self.duration
        gained = allowed - self.pause_torque**2
        return 3600.0 / (self.duration + missing / gained) if gained > 0.0 else 0.0

    @cached_property
    def gear_mean_torque(self) -> float:
        """Cubic mean of the output torque, weighted by the speed, N m or N."""
        weight = np.abs(self.speed)
        cubes = np.abs(self.output_torque) ** 3 * weight
        total = float(np.trapezoid(weight, self.time))
        return float(np.trapezoid(cubes, self.time) / total) ** (1.0 / 3.0) if total else 0.0

    @cached_property
    def checks(self) -> tuple[LimitCheck, ...]:
        """All given limits of the drive with the values of the cycle."""
        drive = self.drive
        curve = drive.peak_torque_at(self.speed)
        worst = int(np.argmax(np.abs(self.torque) / curve))
        output = float(np.abs(self.output_torque).max())
        fastest = float(np.abs(self.speed).max())
        allowed = float(drive.continuous_torque(self.mean_speed))
        every = [
            LimitCheck(name="speed", value=fastest, limit=drive.max_speed, unit="rad/s"),
            LimitCheck(
                name="peak torque",
                value=float(abs(self.torque[worst])),
                limit=float(curve[worst]),
                unit="N m",
            ),
            LimitCheck(name="RMS torque", value=self.rms_torque, limit=allowed, unit="N m"),
            LimitCheck(name="temperature", value=self.temperature_rise, limit=1.0, unit=""),
            LimitCheck(name="gear speed", value=fastest, limit=drive.gear_max_speed, unit="rad/s"),
            LimitCheck(name="gear peak torque", value=output, limit=drive.gear_peak_torque, unit="N m"),
            LimitCheck(
                name="gear mean torque",
                value=self.gear_mean_torque,
                limit=drive.gear_rated_torque,
                unit="N m",
            ),
            LimitCheck(
                name="inertia ratio", value=self.inertia_ratio, limit=drive.max_inertia_ratio, unit=""
            ),
        ]
        if drive.brake_torque is not None:
            every.append(
                LimitCheck(name="brake", value=self.holding_torque, limit=drive.brake_torque, unit="N m")
            )
        return tuple(check for check in every if math.isfinite(check.limit))

    @property
    def passes(self) -> bool:
        """Whether all limits hold."""
        return all(check.passes for check in self.checks)

    @property
    def tightest(self) -> LimitCheck:
        """The limit with the smallest margin."""
        return min(self.checks, key=lambda check: check.margin)

    def used(self, name: str) -> float:
        """The utilisation of a limit by its name, 1 at the limit; NaN for a limit that is not given."""
        return next((check.used for check in self.checks if check.name == name), math.nan)

    @cached_property
    def _squared(self) -> float:
        """The time integral of the square of the torque during the motion."""
        a, b = self.torque[:-1], self.torque[1:]
        return float(np.sum(np.diff(self.time) * (a * a + a * b + b * b)) / 3.0)


def motor_torque(
    drive: Drive, output_torque: Array, speed: Array, acceleration: Array, direction: Array
) -> Array:
    """Torque of the motor (N,), N m, for a torque at the output of the gear.

    ``speed`` (rad/s) and ``acceleration`` (rad/s²) of the motor; ``direction``: the sign of the speed; where
    the speed is 0, the sign of the motion before or after. The gear loses power in both directions: the
    output torque is divided by the efficiency if the motor drives, and multiplied by it if the load drives.
    """
    loss = np.where(output_torque * direction > 0.0, 1.0 / drive.efficiency, drive.efficiency)
    loss = np.where(direction == 0.0, 1.0, loss)
    friction = drive.viscous_friction * speed + drive.coulomb_friction * np.sign(direction)
    return output_torque * loss / drive.gear_ratio + drive.inertia * acceleration + friction
