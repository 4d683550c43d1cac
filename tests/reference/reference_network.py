"""Numerical evaluation of all blocks of a diagram at one time, for :mod:`reference_simulator`."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

import numpy as np
from reference_block import BlockNumbers, UnsupportedError
from reference_controls import CONTROLS, Enable, Trigger
from reference_events import has_own_events, instant_order
from reference_order import EvaluationOrder, Node, assign_clocks

from armblocks.diagram import Diagram, PortRef, flat_diagram, infer_shapes

MAX_PASSES = 30
Link = tuple[np.ndarray, np.ndarray]
"""The array of an input, and the array of the signal that drives it."""
Work = Callable[[], bool]
"""Evaluates a node and returns whether a mode has changed."""


class Network:
    """All blocks of a diagram, their signals at the present time, and the operations of an instant."""

    def __init__(self, diagram: Diagram) -> None:
        self.diagram = flat = flat_diagram(diagram)
        shapes = infer_shapes(flat)
        self.blocks: dict[str, Any] = {}
        self.time = np.zeros(1)
        for name, block in flat.blocks.items():
            kind = CONTROLS.get(type(block), BlockNumbers)
            triggered = {"triggered": True} if "?elapsed" in flat.gates.get(name, {}) else {}
            self.blocks[name] = kind(name, block, shapes.inputs[name], shapes.outputs[name], **triggered)
            self.blocks[name].arrays["t"] = self.time
        self.drivers: dict[tuple[str, str], PortRef] = {
            (name, port.name): flat.drivers[PortRef(name, port.name)]
            for name, block in flat.blocks.items()
            for port in block.input_ports()
        }
        for name, gate in flat.gates.items():
            block_numbers = self.blocks[name]
            block_numbers.gate = {key: self.blocks[ref.block].outputs[ref.port] for key, ref in gate.items()}
            if "?elapsed" in gate and "p:T" in block_numbers.arrays:
                block_numbers.arrays["p:T"] = block_numbers.gate["?elapsed"]
        self._locate_states()
        self.clocks = assign_clocks(flat, self.blocks, self.drivers)
        self.order = EvaluationOrder(self.blocks, self.drivers, flat.gates)
        self.instant_order = instant_order(self.order)
        self.ranks = self.instant_order.ranks
        self.links = {b.name: [self._link(b, port) for port in b.inputs_read] for b in self.blocks.values()}
        self.links_of_node: dict[Node, list[Link]] = {}
        self.plans: dict[tuple[bool, bool], list[Work]] = {}
        self.followed = [b for b in self.blocks.values() if b.clock is None and (b.lines or b.modes)]
        self._start()

    # -- structure -----------------------------------------------------------------------------------------

    def _locate_states(self) -> None:
        """Allocate one vector x of all continuous states; the arrays of the blocks are views of it."""
        states = [(b, s) for b in self.blocks.values() for s in b.states]
        self.x = np.zeros(sum(math.prod(state.shape) for _, state in states))
        self.xdot = np.zeros_like(self.x)
        self.state_parts: list[tuple[Any, str, slice]] = []
        start = 0
        for block, state in states:
            part = slice(start, start + math.prod(state.shape))
            block.arrays[f"x:{state.name}"] = self.x[part]
            self.state_parts.append((block, state.name, part))
            start = part.stop

    # -- numbers -------------------------------------------------------------------------------------------

    def _start(self) -> None:
        self.frozen = False
        self.ticking: set[str] = set()
        self.t = 0.0
        for block in self.blocks.values():
            block.restart()
            block.was_restarted = False
            for name in block.names("held") if block.block.sampled else ():
                block.outputs[name][:] = block.value("held", name)
            for name in block.names("guess"):
                block.outputs[name][:] = block.value("guess", name)
            for line in block.lines:
                block.arrays[f"x:{line.name}"][:] = block.value("past", line.name)
                block.history[line.name].begin(block.value("past", line.name))
        self.signs: dict[tuple[str, str], np.ndarray] = {
            (name, guard.name): np.zeros(math.prod(guard.shape))
            for name, block in self.blocks.items()
            if block.has_events
            for guard in block.guards
        }
        self.was_on = {name: True for name, _ in self.signs}

    def shortest_delays(self) -> list[float]:
        return [float(b.value("shortest", line.name)[0]) for b in self.blocks.values() for line in b.lines]

    def breakpoints(self) -> list[float]:
        return [float(b.value("break", k)[0]) for b in self.blocks.values() for k in b.names("break")]

    def signals(self) -> dict[str, np.ndarray]:
        """Return every output in its shape, by ``block/port``."""
        return {
            f"{name}/{port}": array.reshape(block.output_shapes[port]).copy()
            for name, block in self.blocks.items()
            for port, array in block.outputs.items()
        }

    def evaluate(self, t: float, frozen: bool = False, flowing: bool = False) -> None:
        """Evaluate all signals at a time, and the modes unless they are ``frozen``.

        ``flowing``: evaluate only signals on which states, modes, guards and delays depend.
        """
        self.t, self.frozen = t, frozen
        self.time[0] = t
        plan = self._plan(frozen, flowing)
        for _ in range(MAX_PASSES):
            changed = False
            for work in plan:
                changed = work() or changed
            if frozen or not (changed and self.order.two_passes):
                return
        raise UnsupportedError(f"modes and signals have no consistent values at {t}")

    def _link(self, block: Any, port: str) -> Link:
        """Return the array of an input (with a prime: of its derivative), and the array of its source."""
        ref = self.drivers[block.name, port.removesuffix("'")]
        source = self.blocks[ref.block]
        if port.endswith("'"):
            rate = source.rates.setdefault(ref.port, np.zeros_like(source.outputs[ref.port]))
            return block.arrays[f"u:{port}"], rate
        return block.arrays[f"u:{port}"], source.outputs[ref.port]

    def _feed_all(self, block: Any) -> None:
        for target, source in self.links[block.name]:
            target[:] = source

    def _plan(self, frozen: bool, flowing: bool) -> list[Work]:
        """Return the functions that evaluate the nodes in order."""
        if (frozen, flowing) not in self.plans:
            groups = self.order.flowing if flowing else self.order.groups
            self.plans[frozen, flowing] = [
                self._loop_work(group) if group in self.order.loops else self._work(group[0])
                for group in groups
                if not (frozen and group not in self.order.loops and group[0][0] == "modes")
            ]
        return self.plans[frozen, flowing]

    def _loop_work(self, loop: tuple[Node, ...]) -> Work:
        def work() -> bool:
            self._solve(loop)
            return False

        return work

    def _work(self, node: Node) -> Work:
        """Return the function that evaluates one node."""
        kind, name, port = node
        block = self.blocks[name]

        def held() -> bool:
            return block.clock is not None and (name not in self.ticking or not block.on)

        def take_derivative() -> bool:
            ref = self.drivers[name, block.block.time_derivatives[port]]
            block.outputs[port][:] = self.blocks[ref.block].rates[ref.port]
            return False

        def take_rate() -> bool:
            self._rate(block, port)
            return False

        if kind == "out" and port in block.block.time_derivatives:
            return take_derivative
        if kind == "rate":
            return take_rate
        links = self._links_of(block, node)

        def feed() -> None:
            for target, source in links:
                target[:] = source

        def update_modes() -> bool:
            if held() or not block.on:
                return False
            feed()
            self._read_histories(block)
            return block.update_modes()

        def take_output() -> bool:
            if block.clock is None or not held():
                feed()
                self._read_histories(block)
                block.outputs[port][:] = block.value("out", port)
            return False

        def take_state_derivative() -> bool:
            feed()
            block.rates[f"x:{port}"] = block.value("xdot", port) * (1.0 if block.on else 0.0)
            return False

        return {"modes": update_modes, "out": take_output}.get(kind, take_state_derivative)

    def _links_of(self, block: Any, node: Node) -> list[Link]:
        """Return the links of the inputs that a node reads."""
        if node not in self.links_of_node:
            kind, _, port = node
            keys: set[str] = set()
            for entry in [m.name for m in block.modes] if kind == "modes" else [port]:
                keys |= block.needs("mode" if kind == "modes" else kind, entry)
            ports = sorted(key[2:] for key in keys if key.startswith("u:"))
            self.links_of_node[node] = [self._link(block, port) for port in ports]
        return self.links_of_node[node]

    def _feed_some(self, block: Any, node: Node) -> None:
        for target, source in self._links_of(block, node):
            target[:] = source

    def _rate(self, block: Any, port: str) -> None:
        total = block.rates.setdefault(port, np.zeros_like(block.outputs[port]))
        if block.block.sampled:
            total[:] = 0.0
            return
        if not isinstance(block, BlockNumbers):
            source = block.followed(port)
            ref = None if source is None else self.drivers[block.name, source]
            total[:] = 0.0 if ref is None else self.blocks[ref.block].rates[ref.port]
            return
        rates: dict[str, np.ndarray] = {}
        for key in sorted(block.needs("out", port)):
            letter, _, entry = key.partition(":")
            if letter == "u":
                ref = self.drivers[block.name, entry]
                rates[key] = block.rates.setdefault(f"of {key}", np.zeros_like(block.arrays[key]))
                rates[key][:] = self.blocks[ref.block].rates[ref.port]
            elif letter == "x" and f"x:{entry}" in block.rates:
                rates[key] = block.rates.setdefault(f"of {key}", np.zeros_like(block.arrays[key]))
                rates[key][:] = block.rates[f"x:{entry}"]
        total[:] = block.rate(port, rates)

    def _solve(self, loop: tuple[Node, ...]) -> None:
        """Solve an algebraic loop by Newton's method with difference quotients for all its signals."""
        outs = [self.blocks[name].outputs[port] for kind, name, port in loop if kind == "out"]
        if any(kind != "out" for kind, _, _ in loop):
            raise UnsupportedError("a loop through derivatives")

        def residual(v: np.ndarray) -> np.ndarray:
            residuals = []
            start = 0
            for array in outs:
                array[:] = v[start : start + array.size]
                start += array.size
            for kind, name, port in loop:
                block = self.blocks[name]
                if block.clock is not None and name not in self.ticking:
                    residuals.append(block.outputs[port].copy())
                    continue
                self._feed_some(block, (kind, name, port))
                self._read_histories(block)
                result = block.value("out", port).copy()
                # For an implicit output the equation returns the residual, which must be zero.
                residuals.append(
                    result + block.outputs[port] if port in block.block.implicit_outputs else result
                )
            return np.concatenate(residuals) - v

        v = np.concatenate(outs)
        if not np.isfinite(v).all():
            v[:] = 0.0
        for _ in range(30):
            r = residual(v)
            steps = 1e-7 * np.maximum(1.0, np.abs(v))
            J = np.column_stack([(residual(v + s * d) - r) / s for s, d in zip(steps, np.eye(v.size))])
            change = np.linalg.solve(J, r)
            v = v - change
            if np.max(np.abs(change)) <= 1e-14 * (1.0 + np.max(np.abs(v))):
                break
        else:
            raise UnsupportedError("an algebraic loop was not solved")
        residual(v)

    def _read_histories(self, block: Any) -> None:
        """Read the delayed signals of a block from their histories."""
        for line in block.lines:
            keys = block.needs("delay", line.name)
            for key in keys:
                if key.startswith("u:"):
                    target, source = self._link(block, key[2:])
                    target[:] = source
            when = self.t - float(block.value("delay", line.name)[0])
            history = block.history[line.name]
            block.arrays[f"x:{line.name}"][:] = history.at(when, history.segment if self.frozen else None)

    # -- flow ----------------------------------------------------------------------------------------------

    def derivative(self, t: float) -> np.ndarray:
        """Return dx/dt with the modes of the start of the step."""
        self.evaluate(t, frozen=True, flowing=True)
        for block, name, part in self.state_parts:
            if not block.on:
                self.xdot[part] = 0.0
                continue
            self._feed_all(block)
            self.xdot[part] = block.value("xdot", name)
        return self.xdot.copy()

    def modes_differ(self) -> bool:
        """Return whether the modes are inconsistent with the present signals."""
        for block in self.followed:
            if not block.on:
                continue
            for line in block.lines:
                self._read_histories(block)
                when = self.t - float(block.value("delay", line.name)[0])
                if block.history[line.name].segment_at(when) != block.history[line.name].segment:
                    return True
            if block.modes:
                self._feed_all(block)
                if block.modes_differ():
                    return True
        return False

    def fired(self) -> dict[tuple[str, str], np.ndarray]:
        """Return guards whose sign has changed in their direction, with +1 (rising) or -1 (falling)."""
        events: dict[tuple[str, str], np.ndarray] = {}
        for (name, guard), before in self.signs.items():
            block = self.blocks[name]
            if not block.on or block.was_restarted:
                continue
            self._feed_all(block)
            sign = np.sign(block.value("guard", guard))
            direction = next(g.direction for g in block.guards if g.name == guard)
            e = np.where((sign * before < 0.0) & (sign * direction >= 0.0), sign, 0.0)
            if e.any():
                events[name, guard] = e
        return events

    def take_signs(self, only: Iterable[tuple[str, str]] | None = None, later: Collection[str] = ()) -> None:
        for key in self.signs if only is None else only:
            block = self.blocks[key[0]]
            if not block.on or key[0] in later:
                continue
            self._feed_all(block)
            sign = np.sign(block.value("guard", key[1]))
            fallback = self.signs[key] if only is None else 0.0 * sign
            self.signs[key] = np.where(sign != 0.0, sign, fallback)

    # -- instants ------------------------------------------------------------------------------------------

    def capture(self, t: float) -> None:
        """Store the values just before this time in all blocks that need them."""
        if not any(block.names("capture") for block in self.blocks.values()):
            return
        self.evaluate(float(np.nextafter(t, 0.0)), frozen=True)
        for block in self.blocks.values():
            if block.on:
                self._feed_all(block)
                captured = {name: block.value("capture", name).copy() for name in block.names("capture")}
                for name, value in captured.items():
                    block.arrays[f"x:{name}"][:] = value

    def tick(self, t: float, clocks: list[int], level: int) -> None:
        """Evaluate the outputs of this level of all blocks that tick, then update the discrete states."""
        order, ticking = self.instant_order, [b for b in self.blocks.values() if b.clock in clocks]
        self._mark({b.name for b in ticking if order.output_level[b.name] == level})
        updating = {b.name for b in ticking if order.update_level[b.name] == level}
        last_rank = order.last_rank_after(level)
        self.evaluate(t)
        restarted: set[str] = set()
        for _ in range(2):  # a restart at this tick changes the values that are read
            restarting = [
                b
                for b in self.blocks.values()
                if b.restarts
                and (self.ranks[b.name] <= last_rank if b.clock is None else b.name in self.ticking)
            ]
            restarting = [block for block in restarting if block.name not in restarted]
            if not restarting:
                break
            for block in restarting:
                block.restart()
                restarted.add(block.name)
            self.evaluate(t)
        new: list[tuple[np.ndarray, np.ndarray]] = []
        for block in self.blocks.values():
            if block.name in updating and block.on:
                new += self._updated(block)
        self._act(t, new)
        self._mark(set())

    def _mark(self, ticking: set[str]) -> None:
        """Set the blocks whose outputs tick now."""
        self.ticking = ticking
        for block in self.blocks.values():
            if isinstance(block, Enable):
                block.ticking = bool(ticking)

    def iterate(self, t: float, first: bool = False, last_rank: float = math.inf) -> bool:
        """Perform one iteration of an instant; return whether it has changed a state or a mode.

        Guards and resets of a block use consistent signals at its inputs, but its previous modes: an event is
        the end of the previous mode. With a ``last_rank``, only events up to this rank are processed.
        """
        before = self.fingerprint()
        for name in self.was_on:
            block = self.blocks[name]
            for entry in block.captured_when_enabled if block.on and not self.was_on[name] else ():
                block.arrays[f"x:{entry}"][:] = block.value("capture", entry)
        eventful = [block for block in self.blocks.values() if block.has_events]
        old = {block.name: block.mode_values() for block in eventful}
        self.evaluate(t)
        consistent = {block.name: block.mode_values() for block in eventful}
        for block in eventful:
            block.set_modes(old[block.name])
        fired = {} if first else self.fired()
        lowest = math.inf if first else self._lowest_rank(fired)
        if lowest > last_rank:
            return False
        fired = {key: e for key, e in fired.items() if self.ranks[key[0]] <= lowest}
        later = {block.name for block in self.blocks.values() if self.ranks[block.name] > lowest}
        if not first:
            self.take_signs(later=later)
        if self._hold_controls(later):
            self.evaluate(t, frozen=True)
        new: list[tuple[np.ndarray, np.ndarray]] = []
        for block in eventful if fired or first else ():
            # An event determines the new modes of its block; without an event the signals do.
            decides = first or any(name == block.name for name, _ in fired)
            if block.on:
                new += self._reset(block, fired, set() if decides else set(old[block.name]))
                consistent[block.name] = {} if decides else consistent[block.name]
        for block in eventful:
            block.set_modes(consistent[block.name])
        if fired:
            self._remember(later)
        acted = self._act(t, new)
        self.evaluate(t)
        if fired:
            self.take_signs(fired)
        for block in eventful:
            if block.name in later:
                block.set_modes(old[block.name])
        return bool(fired) or acted or bool(later) or self.fingerprint() != before

    def settle(self) -> bool:
        """Apply the resets without events of blocks that start at this instant, as at the start of a run;
        return whether a state has changed."""
        before = self.fingerprint()
        for name in {name for name, _ in self.signs}:
            block = self.blocks[name]
            if block.has_events and block.on and (block.was_restarted or not self.was_on[name]):
                for array, value in self._reset(block, {}, {mode.name for mode in block.modes}):
                    array[:] = value
        self.evaluate(self.t)
        return self.fingerprint() != before

    def _lowest_rank(self, fired: Iterable[tuple[str, str]]) -> float:
        """Return the lowest rank of the blocks with pending events, or infinity."""
        controls = [b for b in self.blocks.values() if isinstance(b, Enable | Trigger)]
        pending = {name for name, _ in fired if has_own_events(self.blocks[name])}
        pending |= {control.name for control in controls if control.pending()}
        return min((self.ranks[name] for name in pending), default=math.inf)

    def _hold_controls(self, later: set[str]) -> bool:
        """Set pending controls that act later to their previous values; return whether there are any."""
        held = [self.blocks[name] for name in later if isinstance(self.blocks[name], Enable | Trigger)]
        held = [control for control in held if control.pending()]
        for control in held:
            control.arrays["x:side"][:] = control.arrays["x:previous"]
        return bool(held)

    def hold_zeros(self, below: float) -> bool:
        """Let the quantities of conditions that are almost 0 count as 0; return whether there are any.

        ``below``: the largest magnitude of such a quantity. With 0, all quantities count as they are.
        """
        for block in self.blocks.values():
            if block.conditions and block.on:
                self._feed_all(block)
                near = {c.name: np.abs(block.value("quantity", c.name)) < below for c in block.conditions}
                block.at_zero = {name: elements for name, elements in near.items() if elements.any()}
        return any(block.at_zero for block in self.blocks.values() if block.conditions)

    def _reset(
        self, block: Any, fired: Mapping[tuple[str, str], np.ndarray], without: set[str]
    ) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the arrays that events change, except those in ``without``, and their new values."""
        self._feed_all(block)
        for guard in block.guards:
            block.arrays[f"e:{guard.name}"][:] = fired.get((block.name, guard.name), 0.0)
        names = [name for name in block.names("reset") if name not in without]
        return [(block.arrays[f"x:{name}"], block.value("reset", name).copy()) for name in names]

    def _updated(self, block: Any) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return the arrays of discrete states and their values after a tick."""
        self._feed_all(block)
        names = block.names("update")
        return [(block.arrays[f"x:{name}"], block.value("update", name).copy()) for name in names]

    def _act(self, t: float, new: list[tuple[np.ndarray, np.ndarray]]) -> bool:
        """Assign the new states, and execute the restarts and triggers of subsystems."""
        starts: list[Any] = []
        for block in self.blocks.values():
            if block.restarts and block.name not in self.ticking:
                starts.append(block)
            if block.fires and block.block.sampled:
                new += self._updated(block)
        acted = False
        for block in self.blocks.values():
            if hasattr(block, "act"):
                self._feed_all(block)
                acted = block.act(t) or acted
        for array, value in new:
            array[:] = value
        for block in starts:
            block.restart()
        return acted

    def _remember(self, later: Collection[str] = ()) -> None:
        """Store the consistent modes with hysteresis as the previous modes, except those of blocks whose
        events come later."""
        for block in self.blocks.values():
            if block.name in later:
                continue
            self._feed_all(block)
            block.remember()

    def _begin_signs(self, block: Any) -> None:
        """Initialise the signs of the guards of a block, as at the start of a run."""
        self._feed_all(block)
        for name, guard in self.signs:
            if name == block.name:
                self.signs[name, guard] = np.sign(block.value("guard", guard)) * block.on

    def end_instant(self) -> None:
        """Start to monitor the guards of subsystems that were restarted or enabled at this instant."""
        self._remember()
        for name in {name for name, _ in self.signs}:
            block = self.blocks[name]
            if block.was_restarted or (block.on and not self.was_on[name]):
                self._begin_signs(block)
        self.was_on = {name: self.blocks[name].on for name in self.was_on}
        for block in self.blocks.values():
            block.was_restarted = False
            for name in block.momentary:
                block.arrays[f"x:{name}"][:] = 0.0

    @property
    def delays(self) -> bool:
        """Return whether a block delays a signal."""
        return any(block.lines for block in self.blocks.values())

    def record_delays(self, x: Mapping[float, np.ndarray], t: float, h: float) -> None:
        """Store the inputs of delays for a step, from the states at four points of it (0, 1/3, 2/3, 1)."""
        lines = [(block, line) for block in self.blocks.values() for line in block.lines]
        samples: dict[int, list[np.ndarray]] = {k: [] for k in range(len(lines))}
        end = self.x.copy()
        for fraction, state in x.items():
            self.x[:] = state
            time = t + fraction * h
            self.evaluate(time if fraction < 1.0 else float(np.nextafter(time, 0.0)), True, flowing=True)
            for k, (block, line) in enumerate(lines):
                wide = np.zeros(math.prod(line.shape)) + self._link(block, line.input)[1]
                samples[k].append(wide)
        self.x[:] = end
        for k, (block, line) in enumerate(lines):
            block.history[line.name].add(t, h, np.array(samples[k]))

    def select_segments(self) -> None:
        """Select the segment of each history that is read after this instant."""
        for block in self.blocks.values():
            for line in block.lines:
                when = self.t - float(block.value("delay", line.name)[0])
                block.history[line.name].segment = block.history[line.name].segment_at(when)

    def fingerprint(self) -> tuple[bytes, ...]:
        """Return states, modes and held outputs for comparison."""
        arrays = [self.x]
        for block in self.blocks.values():
            arrays += [block.arrays[f"x:{s.name}"] for s in (*block.discrete, *block.modes)]
            arrays += list(block.outputs.values()) if block.clock is not None else []
        return tuple(array.tobytes() for array in arrays)

    def ended(self) -> bool:
        """Return whether a block ends the run."""
        has_ended = False
        for block in self.blocks.values():
            for guard in block.guards:
                if guard.action in ("stop", "fail") and block.on:
                    self._feed_all(block)
                    has_ended = has_ended or bool((block.value("guard", guard.name) > 0.0).any())
        return has_ended
