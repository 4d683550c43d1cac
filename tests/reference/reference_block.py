"""Numerical evaluation of one block: its equations as functions between arrays.

Every equation of a block is one CasADi function. Arrays hold the states, modes and inputs of the block.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from casadi import SX, Function, densify, fabs, fmax, if_else, jtimes, symvar, vertcat
from reference_history import History

from armblocks.blocks import FromFile, Trajectory
from armblocks.blocks.discontinuities.rate_limits import RateLimiting
from armblocks.diagram import Block, shape_of
from armblocks.equations import Shape, flatten, unflatten

SMALLEST_JUMP = 2e-6
"""Smallest relative change of a rate limiter's input that counts as a jump; above the integration error."""


class UnsupportedError(Exception):
    """A diagram that the reference does not support."""


def column(value: Any, shape: Shape) -> SX:
    """Return a value as a flat column; a scalar is broadcast to the shape."""
    value = SX(value)
    return SX.ones(math.prod(shape)) * value if value.numel() == 1 else flatten(value, shape)


def read_symbols(expression: SX, symbols: Mapping[str, SX]) -> set[str]:
    """Return the keys of all symbols that occur in an expression."""
    read = {element.element_hash() for element in symvar(expression)}
    return {
        key
        for key, symbol in symbols.items()
        if any(symbol[k].element_hash() in read for k in range(symbol.numel()))
    }


def own_modes(block: Block, x: Mapping[str, SX], u: Mapping[str, SX], p: Mapping[str, SX]) -> dict[str, SX]:
    """Return the mode of a rate limiter, whose output follows or approaches the input at limited rates.

    The previous mode m is 1 (rising), -1 (falling) or 0 (following). If y has reached u, or follows it, the
    rate of u decides. After a jump of u above ``SMALLEST_JUMP`` the output must approach u again.
    """
    if not isinstance(block, RateLimiting):
        return {}
    limits, gap, m = block.limits(u, p), u["u"] - x["y"], x["mode"]
    by_rate = if_else(u["u'"] > limits["rising"], 1.0, if_else(u["u'"] < limits["falling"], -1.0, 0.0))
    passed_on = SMALLEST_JUMP * fmax(1.0, fabs(u["u"]))
    following = if_else(gap > passed_on, 1.0, if_else(gap < -passed_on, -1.0, by_rate))
    rising, falling = if_else(gap > 0.0, 1.0, following), if_else(gap < 0.0, -1.0, following)
    return {"mode": if_else(m > 0.0, rising, if_else(m < 0.0, falling, following))}


class BlockNumbers:
    """One block: an array for every quantity, and its equations as functions between the arrays."""

    def __init__(
        self,
        name: str,
        block: Block,
        shapes: Mapping[str, Shape],
        outputs: Mapping[str, Shape],
        triggered: bool = False,
    ) -> None:
        if block.called:
            raise UnsupportedError(f"'{name}' calls Python at its ticks")
        is_table = isinstance(block, FromFile | Trajectory)
        if is_table or any(not rule.tunable for rule in block.inputs_of_the_run()):
            raise UnsupportedError(f"'{name}' has a long table")
        self.name, self.block, self.shapes = name, block, shapes
        self.clock: int | None = None
        self.period = 0.0
        self.gate: dict[str, np.ndarray] = {}
        self.was_restarted = False
        self.states = block.states(shapes)
        self.discrete = block.discrete_states(shapes)
        self.momentary = [state.name for state in self.discrete if state.momentary]
        self.captured_when_enabled = [state.name for state in self.discrete if state.captured_when_enabled]
        self.lines = block.delay_lines(shapes)
        self.conditions = block.conditions(shapes)
        self.modes = (*block.modes(shapes), *self.conditions)
        self.at_zero: dict[str, np.ndarray] = {}
        """Elements of conditions whose quantity counts as 0, whatever its rounding error is."""
        self.remembered = [mode for mode in block.modes(shapes) if mode.hysteresis]
        self.guards = block.guards(shapes)
        self.symbols: dict[str, SX] = {"t": SX.sym("t")}
        self.arrays: dict[str, np.ndarray] = {"t": np.zeros(1)}
        self.output_shapes = outputs
        self.outputs = {port: np.zeros(math.prod(shape)) for port, shape in outputs.items()}
        self.rates: dict[str, np.ndarray] = {}
        self.history = {line.name: History(math.prod(line.shape)) for line in self.lines}
        ends = {
            "x": {s.name: s.shape for s in (*self.states, *self.discrete, *self.lines, *self.modes)}
            | {mode.before: mode.shape for mode in self.remembered},
            "u": {**shapes, **{f"{u}'": shapes[u.rstrip("'")] for u in block.differentiated_inputs}},
            "e": {guard.name: guard.shape for guard in self.guards},
            "p": {rule.name: shape_of(block.parameter_value(rule.name)) for rule in block.inputs_of_the_run()}
            | ({"T": ()} if block.sampled else {}),
        }
        natural: dict[str, dict[str, SX]] = {}
        for letter, named in ends.items():
            natural[letter] = {}
            for key, shape in named.items():
                symbol = SX.sym(key, math.prod(shape))
                self.symbols[f"{letter}:{key}"] = symbol
                self.arrays[f"{letter}:{key}"] = np.zeros(math.prod(shape))
                natural[letter][key] = unflatten(symbol, shape)
        for rule in block.inputs_of_the_run():
            self.arrays[f"p:{rule.name}"][:] = np.ravel(block.parameter_value(rule.name))
        self._last: dict[str, tuple[SX, SX]] = {}
        if block.reads_next_period:
            natural["p"]["T_next"] = natural["p"]["T"]
            if triggered:
                natural["x"] |= self._states_after_last_trigger(natural)
        self._build(natural["x"], natural["u"], natural["p"], natural["e"])

    def _states_after_last_trigger(self, natural: Mapping[str, dict[str, SX]]) -> dict[str, SX]:
        """Return the discrete states after the update of the previous trigger event.

        That update depends on ``T_next``, the time until the next event: the ``T`` of the present event. The
        states, the inputs and T at the previous event are stored; ``last:done`` is 0 before the first event.
        """
        for key, symbol in [(key, symbol) for key, symbol in self.symbols.items() if key[0] == "u"]:
            self._last[key] = (SX.sym(f"last {key}", symbol.numel()), symbol)
        self._last["p:T"] = (SX.sym("last T"), natural["p"]["T"])
        self._last["done"] = (SX.sym("done"), SX(1.0))
        for key, (symbol, _) in self._last.items():
            self.symbols[f"x:last:{key}"] = symbol
            self.arrays[f"x:last:{key}"] = np.zeros(symbol.numel())
        x, u = natural["x"], natural["u"]
        p = natural["p"] | {"T": self._last["p:T"][0]}
        then = {key: unflatten(self._last[f"u:{key}"][0], shape) for key, shape in self.shapes.items()}
        updates = self.block.updates(self.symbols["t"], x, u | then, p)
        return {key: if_else(self._last["done"][0], value, x[key]) for key, value in updates.items()}

    def _build(self, x: dict[str, SX], u: dict[str, SX], p: dict[str, SX], e: dict[str, SX]) -> None:
        """Collect all equations as flat columns by kind and name."""
        block, t = self.block, self.symbols["t"]
        shape_of_state = {s.name: s.shape for s in (*self.states, *self.discrete)}
        outputs = block.outputs(t, x, u, p)
        self.expressions: dict[tuple[str, str], SX] = {}

        def add(kind: str, values: Mapping[str, Any], shape_by_name: Mapping[str, Shape]) -> None:
            for key, shape in shape_by_name.items():
                if key in values:
                    self.expressions[kind, key] = column(values[key], shape)

        out_shapes = {port.name: port.shape for port in block.output_ports() if port.shape is not None}
        out_shapes |= dict(block.output_shapes(self.shapes))
        add("out", outputs, out_shapes)
        add("xdot", block.derivatives(t, x, u, p), {s.name: s.shape for s in self.states})
        if self._last:
            # A trigger event sets the states to their values after the previous event.
            add("update", x, {s.name: s.shape for s in self.discrete})
            last = {f"last:{key}": value for key, (_, value) in self._last.items()}
            add("update", last, {key: (value.numel(),) for key, value in last.items()})
            add("start", {"last:done": SX(0.0)}, {"last:done": ()})
        else:
            add("update", block.updates(t, x, u, p), {s.name: s.shape for s in self.discrete})
        add("guard", block.guard_values(t, x, u, p), {g.name: g.shape for g in self.guards})
        earlier = x | {mode.name: x[mode.before] for mode in self.remembered}
        mode_values = dict(block.mode_values(t, earlier, u, p)) | own_modes(block, x, u, p)
        quantities = block.condition_values(t, x, u, p) if self.conditions else {}
        for condition in self.conditions:
            quantity = quantities[condition.name]
            mode_values[condition.name] = quantity >= 0.0 if condition.closed else quantity > 0.0
        add("quantity", quantities, {condition.name: condition.shape for condition in self.conditions})
        add("mode", mode_values, {m.name: m.shape for m in self.modes})
        mode_shapes = {m.name: m.shape for m in self.modes}
        resets = block.resets(t, x, u, p, e) if self.guards and not isinstance(block, RateLimiting) else {}
        add("reset", resets, shape_of_state | mode_shapes)
        self.has_events = any(key in shape_of_state for key in resets)
        add("capture", block.captures(t, x, u, p), shape_of_state)
        add("delay", block.delay_times(t, x, u, p), {line.name: () for line in self.lines})
        bounds = block.delay_bounds(p)
        add("shortest", {key: bound[0] for key, bound in bounds.items()}, dict.fromkeys(bounds, ()))
        past = block.initial_history(p)
        add("past", past, {line.name: line.shape for line in self.lines})
        add("start", block.initial_states(p), shape_of_state)
        add("guess", block.initial_guesses(p), out_shapes)
        add("held", block.initial_outputs(p), out_shapes)
        breaks = block.breakpoints(p)
        add("break", {str(k): v for k, v in enumerate(breaks)}, {str(k): () for k in range(len(breaks))})
        self.functions: dict[tuple[str, str], tuple[Callable[[], None], np.ndarray]] = {}
        self._needs: dict[tuple[str, str], set[str]] = {}
        self._buffers: list[Any] = []
        read = {key for entry in self.expressions for key in self.needs(*entry)}
        self.inputs_read = sorted(key[2:] for key in read if key.startswith("u:"))

    def needs(self, kind: str, name: str) -> set[str]:
        """Return the keys of the arrays that an equation reads."""
        if (kind, name) not in self._needs:
            self._needs[kind, name] = read_symbols(self.expressions[kind, name], self.symbols)
        return self._needs[kind, name]

    def value(self, kind: str, name: str) -> np.ndarray:
        """Evaluate an equation. The next evaluation overwrites the returned array."""
        if (kind, name) not in self.functions:
            self.functions[kind, name] = self._function(self.expressions[kind, name])
        run, result = self.functions[kind, name]
        run()
        return result

    def rate(self, port: str, rates: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the time derivative of an output with constant modes: d/dt + the sum of d/da da/dt."""
        if ("rate", port) not in self.functions:
            expression = self.expressions["out", port]
            along = [self.symbols[key] for key in rates]
            seeds = [SX.sym(f"{key}'", symbol.numel()) for key, symbol in zip(rates, along)]
            direction = vertcat(1.0, *seeds)
            total = jtimes(expression, vertcat(self.symbols["t"], *along), direction)
            rate_inputs = {f"rate of {key}": (seed, rates[key]) for key, seed in zip(rates, seeds)}
            self.functions["rate", port] = self._function(total, rate_inputs)
        run, result = self.functions["rate", port]
        run()
        return result

    def _function(
        self, expression: SX, extra: Mapping[str, tuple[SX, np.ndarray]] | None = None
    ) -> tuple[Callable[[], None], np.ndarray]:
        ends = {key: (symbol, self.arrays[key]) for key, symbol in self.symbols.items()} | dict(extra or {})
        read = read_symbols(expression, {key: symbol for key, (symbol, _) in ends.items()})
        used = [end for key, end in ends.items() if key in read]
        function = Function("f", [symbol for symbol, _ in used], [densify(expression)])
        result = np.zeros(expression.numel())
        buffer, run = function.buffer()
        for k, (_, array) in enumerate(used):
            buffer.set_arg(k, memoryview(array))
        buffer.set_res(0, memoryview(result))
        self._buffers.append(buffer)
        return run, result

    # -- operations of the simulator on one block
    # -------------------------------------------------------------

    def names(self, kind: str) -> list[str]:
        return [name for entry, name in self.expressions if entry == kind]

    @property
    def on(self) -> bool:
        return "?on" not in self.gate or self.gate["?on"][0] != 0.0

    @property
    def restarts(self) -> bool:
        return "?restart" in self.gate and self.gate["?restart"][0] != 0.0

    @property
    def fires(self) -> bool:
        return "?fire" in self.gate and self.gate["?fire"][0] != 0.0

    def restart(self) -> None:
        self.was_restarted = True
        for name in set(self.names("start")) - set(self.captured_when_enabled):
            self.arrays[f"x:{name}"][:] = self.value("start", name)
        for name in (*(mode.name for mode in self.modes), *(mode.before for mode in self.remembered)):
            self.arrays[f"x:{name}"][:] = 0.0

    def remember(self) -> None:
        """Store modes with memory, and the discrete states that belong to them, as the previous values."""
        if not self.on:
            return
        for state in self.discrete:
            if state.hysteresis:
                self.arrays[f"x:{state.name}"][:] = self.value("capture", state.name)
        for mode in self.remembered:
            self.arrays[f"x:{mode.before}"][:] = self.arrays[f"x:{mode.name}"]

    def mode_values(self) -> dict[str, np.ndarray]:
        """Return the present modes by name."""
        return {mode.name: self.arrays[f"x:{mode.name}"].copy() for mode in self.modes}

    def set_modes(self, values: Mapping[str, np.ndarray]) -> None:
        for name, value in values.items():
            self.arrays[f"x:{name}"][:] = value

    def mode_value(self, name: str) -> np.ndarray:
        """Return the value of a mode that is consistent with the signals."""
        value = self.value("mode", name)
        if name in self.at_zero:
            closed = next(condition.closed for condition in self.conditions if condition.name == name)
            value[self.at_zero[name]] = float(closed)
        return value

    def update_modes(self) -> bool:
        """Update the modes from the signals; return whether a mode has changed."""
        changed = False
        for _ in range(len(self.modes) + 2):
            again = False
            for mode in self.modes:
                new, array = self.mode_value(mode.name), self.arrays[f"x:{mode.name}"]
                if new.tolist() != array.tolist():  # faster than NumPy's comparison for a few numbers
                    array[:] = new
                    again = True
            if not again:
                return changed
            changed = True
        raise UnsupportedError(
            f"the modes of '{self.name}' have no consistent value at {self.arrays['t'][0]}"
        )

    def modes_differ(self) -> bool:
        """Return whether the modes are inconsistent with the signals."""
        return any(
            self.mode_value(mode.name).tolist() != self.arrays[f"x:{mode.name}"].tolist()
            for mode in self.modes
        )
