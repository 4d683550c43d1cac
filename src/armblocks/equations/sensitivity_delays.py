"""Sensitivities of delayed signals, and the arrival of their jumps.

For ``y(t) = u(t - d)`` the derivative with respect to a parameter is ``y_p = u_p(t - d) - u'(t - d) d_p``, so
``u_p`` becomes another delayed signal. A jump of ``u`` at the time ``s`` arrives when ``t - d = s``. The
derivative of the arrival time is ``(s_p + d_p) / (1 - d')``. Three more delayed signals describe the jump:
the number of jumps, ``s_p`` of the last jump, and the value of ``u`` before it. A guard fires when the
delayed number changes. If equations also read the derivative ``u'(t - d)``, then ``u''`` and the derivative
before a jump are delayed too.

Source: Bellen and Zennaro, Numerical Methods for Delay Differential Equations, 2003, chapter 2.
"""

from __future__ import annotations

from casadi import (
    SX,
    Function,
    depends_on,
    fabs,
    fmax,
    if_else,
    logic_and,
    logic_or,
    substitute,
    vertcat,
    vertsplit,
)

from armblocks.equations.hybrid_system import Delays
from armblocks.equations.sensitivity_layout import Columns
from armblocks.equations.signatures import signature
from armblocks.equations.traced_function import TracedFunction

SAME_VALUE = 1e-11
"""Relative difference between the two sides of an instant up to which a signal counts as continuous."""


class DelayedSensitivities:
    """The delayed scalars of a system, ``n`` of them, with their sensitivities; ``n`` = 0 without delays."""

    def __init__(self, columns: Columns) -> None:
        self.columns = columns
        delays = columns.system.delays
        self.n = 0 if delays is None else len(delays.values)
        self.rate_along = SX.zeros(columns.z.numel())
        """The time derivative of z at the indices of the delayed values."""
        self.tau = columns.value(delays.times) if delays is not None else SX(0, 1)
        self.tau_p = [self._along_parameter(self.tau, k) for k in range(len(columns.names))]
        self.values = [] if delays is None else list(delays.values)
        """The indices of the delayed values in z."""
        self.derivatives = [] if delays is None else list(delays.derivatives)
        self.reads_derivatives = delays is not None and self._derivatives_are_read()
        self.curvature = columns.add("curvature", self.n if self.reads_derivatives else 0)
        """u'' at the delayed time, if derivatives of delayed signals are read."""
        self.Z = [self._corrected(k) for k in range(len(columns.names))]
        """Sensitivities of z; sensitivities of delayed values are computed from the history."""
        if delays is None:
            return
        n, count = self.n, len(columns.names)
        both = columns.value(delays.inputs)
        self.u, self.du = both[:n], both[n:]
        add, at_start = columns.add, self._before_start()
        self.jumps = add("jumps", n, 1.0)
        self.arrived = add("arrived", n)
        self.before_jump = add("before jump", n, at_start)
        self.left, self.left_derivative = add("left limit", n), add("left derivative", n)
        self.jump_p = [add(f"jump by {name}", n) for name in columns.names]
        self.delayed_jumps = add("jumps (delayed)", n)
        self.delayed_before = add("before jump (delayed)", n, at_start)
        self.delayed_p = [add(f"jump by {name} (delayed)", n) for name in columns.names]
        self.step_derivatives = add("derivative of steps", n * (2 + count))
        if self.reads_derivatives:
            self.derivative_before_jump = add("derivative before jump", n)
            self.delayed_derivative_before = add("derivative before jump (delayed)", n)
            self.step_derivative_of_derivative = add("derivative of steps of the derivative", n)
            self.delayed_derivative = add("derivative (delayed)", n)

    def _along_parameter(self, expression: SX, k: int) -> SX:
        c = self.columns
        return c.derivative_along(expression, t=0.0, x=c.S[k], z=c.Z[k], w=c.W[k], p=c.seeds[k])

    def _corrected(self, k: int) -> SX:
        """The sensitivities of z. At the index of a delayed value, Z stores only ``u_p(t - d)``."""
        corrected = SX(self.columns.Z[k])
        for i, (value, derivative) in enumerate(zip(self.values, self.derivatives)):
            corrected[value] = corrected[value] - self.columns.z[derivative] * self.tau_p[k][i]
            if self.curvature.numel():
                corrected[derivative] = corrected[derivative] - self.curvature[i] * self.tau_p[k][i]
        return corrected

    def _derivatives_are_read(self) -> bool:
        c, system = self.columns, self.columns.system
        read = vertcat(*(c.z[index] for index in self.derivatives), SX(0, 1))
        functions = (system.derivative, system.signals, system.guards, self._delays.inputs)
        values = [c.value(function) for function in functions]
        values.append(c.value(system.reset, SX.sym("e", len(system.guard_directions))))
        values.append(c.value(system.update, SX.sym("m", len(system.clocks))))
        unchanged = {*self.derivatives}
        changed = [value[k] for value in values[:-2] for k in range(value.numel())]
        indices = range(c.z.numel())
        n = c.x.numel()
        changed += [values[-2][k] for k in range(n)] + [
            values[-2][n + k] for k in indices if k not in unchanged
        ]
        changed += [values[-1][k] for k in indices if k not in unchanged]
        return bool(read.numel() and depends_on(vertcat(*changed), read))

    def _before_start(self) -> SX:
        initial = self.columns.system.initial_discrete
        function = Function("f", list(initial.arguments), [vertcat(*initial.results)])
        (value,) = function.call([self.columns.p], True, False)
        return value[self.values]

    def set_flow(self, flow: SX) -> None:
        """Set x' to ``flow``, and compute ``delay_rate`` = d' and the time derivatives of the delayed
        values."""
        if not self.n:
            return
        c = self.columns
        zeros = SX.zeros(c.z.numel())
        self.delay_rate = c.derivative_along(
            self.tau, t=1.0, x=flow, z=zeros, w=SX.zeros(c.w.numel()), p=SX.zeros(c.p.numel())
        )
        for i, (value, derivative) in enumerate(zip(self.values, self.derivatives)):
            self.rate_along[value] = c.z[derivative] * (1.0 - self.delay_rate[i])
            if self.reads_derivatives:
                self.rate_along[derivative] = self.curvature[i]
        self.ddu = c.derivative_along(
            self.du, t=1.0, x=flow, z=self.rate_along, w=SX.zeros(c.w.numel()), p=SX.zeros(c.p.numel())
        )

    # At an instant.

    def begin(self) -> dict[str, SX]:
        """Left limits stored before an instant."""
        return {"left limit": self.u, "left derivative": self.du} if self.n else {}

    def guards(self, at_instant: SX) -> list[SX]:
        """Guards that fire upwards: when a jump arrives, and when the input of a delay has jumped at this
        instant."""
        if not self.n:
            return []
        size = fabs(self.u) + fabs(self.left)
        drift = 1e-13 * (1.0 + self.columns.t) * fmax(fabs(self.du), fabs(self.left_derivative))
        jumps = fabs(self.u - self.left) > SAME_VALUE * size + drift
        bends = fabs(self.du - self.left_derivative) > SAME_VALUE * (
            fabs(self.du) + fabs(self.left_derivative)
        )
        fixed = SX([float(fixed) for fixed in self._delays.fixed])
        changed = logic_and(at_instant, logic_or(jumps, logic_and(bends, fixed)))
        return [self.delayed_jumps - self.arrived - 0.5, if_else(changed, 1.0, -1.0)]

    @property
    def _delays(self) -> Delays:
        delays = self.columns.system.delays
        assert delays is not None
        return delays

    def arrivals(self, fired: SX) -> list[SX]:
        """The derivatives of the arrival times of the last jumps with respect to the parameters, each (n,).

        The rate d' is its left limit: a jump that arrives may change it.
        """
        if not self.n:
            return [SX(0, 1) for _ in self.columns.names]
        rate = substitute(self.delay_rate, self.columns.z, self.before_arrival(fired))
        steady = if_else(rate == 1.0, 0.0, rate)
        return [
            (jump + along) / (1.0 - steady) for jump, along in zip(self.delayed_p, self.tau_p, strict=True)
        ]

    def before_arrival(self, fired: SX) -> SX:
        """z with the delayed values before the jumps that have arrived."""
        z = SX(self.columns.z)
        for i, value in enumerate(self.values):
            z[value] = if_else(fired[i], self.delayed_before[i], z[value])
            if self.reads_derivatives:
                derivative = self.derivatives[i]
                z[derivative] = if_else(fired[i], self.delayed_derivative_before[i], z[derivative])
        return z

    def after(self, arrived: SX, jumped: SX, instants: list[SX]) -> dict[str, SX]:
        """Changes of discrete variables where jumps arrive and where inputs of delays jump; ``instants``: the
        derivatives of the present instant."""
        if not self.n:
            return {}
        changes = {
            "arrived": if_else(arrived, self.delayed_jumps, self.arrived),
            "jumps": self.jumps + jumped,
            "before jump": if_else(jumped, self.left, self.before_jump),
        }
        if self.reads_derivatives:
            changes["derivative before jump"] = if_else(
                jumped, self.left_derivative, self.derivative_before_jump
            )
        for name, known, instant in zip(self.columns.names, self.jump_p, instants):
            changes[f"jump by {name}"] = if_else(jumped, instant, known)
        return changes

    # The delayed signals of the whole system.

    def delays(self) -> Delays | None:
        """All delayed scalars: the system's, their sensitivities, and the signals that describe jumps."""
        if not self.n:
            return None
        c, old, n, nz = self.columns, self._delays, self.n, self.columns.z.numel()
        count = len(c.names)
        values, derivatives = list(self.values), list(self.derivatives)
        u, du = [self.u], [self.du]
        for k in range(count):
            values += [nz * (k + 1) + index for index in self.values]
            derivatives += [nz * (k + 1) + index for index in self.derivatives]
            u.append(self._sensitivity(self.u, k))
            du.append(self._sensitivity(self.du, k))
        step_derivatives = self._indices("derivative of steps", 2 + count)
        steps = {"jumps (delayed)": self.jumps, "before jump (delayed)": self.before_jump}
        steps |= {f"jump by {name} (delayed)": known for name, known in zip(c.names, self.jump_p)}
        for (name, signal), derivative in zip(steps.items(), step_derivatives):
            values += self._indices(name)[0]
            derivatives += derivative
            u.append(signal)
            du.append(SX.zeros(n))
        if self.reads_derivatives:
            values += [
                *self._indices("derivative before jump (delayed)")[0],
                *self._indices("derivative (delayed)")[0],
            ]
            derivatives += [
                *self._indices("derivative of steps of the derivative")[0],
                *self._indices("curvature")[0],
            ]
            u += [self.derivative_before_jump, self.du]
            du += [SX.zeros(n), self.ddu]
        copies = len(u)
        (p,) = old.bounds.arguments
        shortest, longest = vertsplit(vertcat(*old.bounds.results), [0, n, 2 * n])
        bounds = vertcat(*[shortest] * copies, *[longest] * copies)
        return Delays(
            values=tuple(values),
            derivatives=tuple(derivatives),
            fixed=old.fixed * copies,
            inputs=c.function("delay_inputs", {}, d=vertcat(*u, *du)),
            times=c.function("delay_times", {}, d=vertcat(*[self.tau] * copies)),
            bounds=TracedFunction(
                "delay_bounds", old.bounds.inputs, signature(("d", (bounds.numel(),))), (p,), (bounds,)
            ),
        )

    def _indices(self, name: str, count: int = 1) -> list[list[int]]:
        """The indices of an added variable in the augmented z, in ``count`` parts."""
        start = self.columns.index(name)
        return [list(range(start + k * self.n, start + (k + 1) * self.n)) for k in range(count)]

    def _sensitivity(self, expression: SX, k: int) -> SX:
        c = self.columns
        return c.derivative_along(expression, t=0.0, x=c.S[k], z=self.Z[k], w=c.W[k], p=c.seeds[k])
