"""The features of a block inside a conditional subsystem, gated by its control.

While the control is off, continuous and sampled states keep their values. At a restart all states are reset
to their initial values. When the control turns on, modes become consistent with the present values, as at the
start of a run, and guards are evaluated from then on. A triggered block executes when the trigger fires, as a
sampled block does at a tick.

``conditional`` composes functions from features to features, one for each of these rules. The
functions treat equations by role (``SlotKind.while_off``), not by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Iterable

from casadi import SX, if_else, logic_and

from armblocks.diagram.block import Signals
from armblocks.diagram.features import AT_TICKS, Arguments, Equation, Features, SlotKind, WhileOff
from armblocks.diagram.port import Guard, State, name_before

ON, RESTART, FIRE, ELAPSED = "?on", "?restart", "?fire", "?elapsed"
"""Hidden inputs: whether the block is active; whether its states are reset now; whether the trigger fires
now; the time since the previous trigger event, s."""
_TICK_RESET, _INSTANT_RESET = "?done", "?restarted"
"""Hidden states: whether the present tick has reset the block, and whether the present instant has."""
_MODES_CONSISTENT = "?running"
"""Hidden mode: whether the control is on and the modes of the block are consistent."""
_PENDING, _PREVIOUS_PERIOD, _PREVIOUS = "?pending", "?period", "?previous "
"""Hidden states of a triggered block whose updates read the time to the next trigger event: whether the
update of an earlier trigger event is pending; the period T at that event, s; with this prefix, the inputs."""
_CONTROL_GUARD = "?turned"
"""Hidden guard: the control crosses 0.5."""


def conditional(features: Features, gate: Collection[str], *, clocked: bool, ticking: bool) -> Features:
    """The features of a block with these hidden inputs.

    ``clocked``: the block is active at the ticks of a clock. ``ticking``: the equations are evaluated at a
    tick, where a restart acts before all equations. At an event a restart acts through the resets, one
    iteration after the control has changed. The hidden state ``?done`` prevents a second restart after a
    restart at a tick.
    """
    own = with_hidden_inputs(features, gate)
    if ELAPSED in gate and features.reads_next_period:
        own = updated_at_the_next_trigger(own)
    if ON in gate and clocked:
        # Before the restart: a state that a tick resets while the control is off keeps its initial value.
        own = while_on(own, AT_TICKS)
    if RESTART in gate and ticking:
        own = restarted_before_a_tick(own)
    gated = own
    if ON in gate:
        gated = while_on(gated, [kind for kind in SlotKind if kind not in AT_TICKS])
    if FIRE in gate and features.sampled:
        gated = executed_when_fired(gated)
    if RESTART in gate:
        gated = restarted(gated, clocked=clocked)
    if ON in gate and features.modes:
        gated = with_consistent_modes(gated)
    return gated


def with_hidden_inputs(features: Features, gate: Collection[str]) -> Features:
    """Add hidden inputs. The block's own equations read neither hidden inputs nor hidden states.

    In a triggered block, the period ``T`` is the time since the previous trigger event.
    """

    def own(at: Arguments) -> Arguments:
        p = {**at.p, "T": at.u[ELAPSED]} if ELAPSED in gate else at.p
        return dataclasses.replace(at, x=_plain(at.x), u=_plain(at.u), p=p)

    return dataclasses.replace(
        features.at_arguments(own), inputs={**features.inputs, **dict.fromkeys(gate, ())}
    )


def updated_at_the_next_trigger(features: Features) -> Features:
    """Compute the updates of a triggered block at the next trigger event, when the time to it is known.

    The states are those before the pending update. All equations are evaluated at the states after it.
    """
    updates = features.equations[SlotKind.UPDATE]
    names = {name: shape for name, shape in features.inputs.items() if not name.startswith("?")}

    def present(at: Arguments) -> dict[str, SX]:
        previous = {name: at.x[_PREVIOUS + name] for name in names}
        u = {**at.u, **previous, ELAPSED: at.x[_PREVIOUS_PERIOD]}
        then = dataclasses.replace(at, u=u, p={**at.p, "T_next": at.u[ELAPSED]})
        return {
            name: if_else(at.x[_PENDING] != 0.0, value, at.x[name]) for name, value in updates(then).items()
        }

    def update(at: Arguments) -> Signals:
        inputs = {_PREVIOUS + name: at.u[name] for name in names}
        return {**present(at), **inputs, _PREVIOUS_PERIOD: at.u[ELAPSED], _PENDING: SX(1.0)}

    def initial_states(p: Signals) -> Signals:
        return {**features.initial_states(p), _PENDING: SX(0.0)}

    added = (
        *(State(_PREVIOUS + name, shape, "an input") for name, shape in names.items()),
        State(_PREVIOUS_PERIOD, (), "the period at the previous trigger event", "s"),
        State(_PENDING, (), "whether the update of an earlier trigger event is pending"),
    )
    changed = features.at_arguments(lambda at: at.with_states(present(at)))
    return dataclasses.replace(
        changed.with_equations({SlotKind.UPDATE: update}),
        discrete=(*features.discrete, *added),
        initial_states=initial_states,
    )


def while_on(features: Features, kinds: Iterable[SlotKind]) -> Features:
    """Apply equations of these roles only while the control is on; see ``SlotKind.while_off``.

    A hysteresis mode may change in an iteration in which the control is still on, before the control turns
    off at the same instant. The mode then returns to its previous value.
    """
    previous = {mode.name: mode.before for mode in features.modes if mode.hysteresis}

    def off_value(kind: SlotKind, name: str, at: Arguments) -> SX | float:
        if kind is SlotKind.MODE:
            return at.x[previous.get(name, name)]
        if kind is SlotKind.CONTRADICTION and name in previous:
            return at.x[name] != at.x[previous[name]]
        return at.x[name] if kind.while_off is WhileOff.KEPT else 0.0

    def gated(kind: SlotKind, equation: Equation) -> Equation:
        return lambda at: {
            name: if_else(at.u[ON] != 0.0, value, off_value(kind, name, at))
            for name, value in equation(at).items()
        }

    return features.with_equations(
        {
            kind: gated(kind, features.equations[kind])
            for kind in kinds
            if kind.while_off is not WhileOff.EVALUATED
        }
    )


def restarted_before_a_tick(features: Features) -> Features:
    """Evaluate equations at the initial states where the block is restarted.

    The previous values of its modes are then 0.
    """
    zeros = {mode.name: SX(0.0) for mode in features.modes}

    def at_start(at: Arguments, modes: Signals) -> Arguments:
        starts = {**_initial_states(features, at), **modes}
        return at.with_states(
            {name: if_else(at.u[RESTART] != 0.0, start, at.x[name]) for name, start in starts.items()}
        )

    changed = features.at_arguments(lambda at: at_start(at, {}))
    modes = features.equations[SlotKind.MODE]
    return changed.with_equations({SlotKind.MODE: lambda at: modes(at_start(at, zeros))})


def executed_when_fired(features: Features) -> Features:
    """Apply the updates when the trigger fires, instead of at ticks."""
    resets, updates = features.equations[SlotKind.RESET], features.equations[SlotKind.UPDATE]

    def fired(at: Arguments) -> Signals:
        after = dict(resets(at))
        updated = {
            name: if_else(at.u[FIRE] != 0.0, value, after.get(name, at.x[name]))
            for name, value in updates(at).items()
        }
        return {**after, **updated}

    return features.with_equations({SlotKind.RESET: fired, SlotKind.UPDATE: lambda at: {}})


def restarted(features: Features, *, clocked: bool) -> Features:
    """Reset states and modes at a restart, and suppress the guards until the end of that instant.

    Modes are reset as at the start of a run: to their consistent values, or to 0 while the control is off.
    ``clocked``: the block is active at the ticks of a clock. After a restart by a tick, discrete states keep
    their values after the tick; continuous states and modes are reset.
    """
    resets, updates = features.equations[SlotKind.RESET], features.equations[SlotKind.UPDATE]
    modes = features.equations[SlotKind.MODE]
    ticked = {state.name for state in features.discrete} if clocked else set[str]()

    def reset(at: Arguments) -> Signals:
        after = dict(resets(at))
        restarts = at.u[RESTART] != 0.0
        starts = _initial_states(features, at)
        if clocked:
            after[_TICK_RESET] = if_else(restarts, 0.0, at.x[_TICK_RESET])
            done = at.x[_TICK_RESET] != 0.0
            after_tick = {name: after.get(name, at.x[name]) for name in ticked}
            starts |= {name: if_else(done, value, starts[name]) for name, value in after_tick.items()}
        initial_values = {**starts, **_initial_modes(modes, at.with_states(starts))}
        for name, value in initial_values.items():
            after[name] = if_else(restarts, value, after.get(name, at.x[name]))
        if features.guards:
            after[_INSTANT_RESET] = if_else(at.u[RESTART] != 0.0, 1.0, at.x[_INSTANT_RESET])
        return after

    def update(at: Arguments) -> Signals:
        after = {**updates(at), _TICK_RESET: at.u[RESTART]}
        if features.guards:
            after[_INSTANT_RESET] = if_else(at.u[RESTART] != 0.0, 1.0, at.x[_INSTANT_RESET])
        return after

    equations: dict[SlotKind, Equation] = {SlotKind.RESET: reset}
    added: list[State] = []
    if clocked:
        equations[SlotKind.UPDATE] = update
        added.append(State(_TICK_RESET, (), "whether this tick has reset the block"))
    if features.guards:
        added.append(State(_INSTANT_RESET, (), "1 from a restart to the end of its instant", momentary=True))
    return dataclasses.replace(
        features.with_equations(equations),
        discrete=(*features.discrete, *added),
        guards=tuple(dataclasses.replace(guard, disabled_by=_INSTANT_RESET) for guard in features.guards),
    )


def with_consistent_modes(features: Features) -> Features:
    """Make the modes consistent when the control turns on, before any guard is evaluated.

    Until then, previous modes and the values captured with them are left limits of the instant.
    """
    equations = features.equations
    captured_with_modes = {state.name for state in features.discrete if state.hysteresis}
    captured_when_enabled = {state.name for state in features.discrete if state.captured_when_enabled}

    def modes(at: Arguments) -> Signals:
        return {**equations[SlotKind.MODE](at), _MODES_CONSISTENT: at.u[ON] != 0.0}

    def contradictions(at: Arguments) -> Signals:
        # Modes are constant while the control is off; `reset` computes all of them when it turns on.
        return {
            **equations[SlotKind.CONTRADICTION](at),
            _MODES_CONSISTENT: (at.u[ON] != 0.0) != at.x[_MODES_CONSISTENT],
        }

    def guards(at: Arguments) -> Signals:
        values = equations[SlotKind.GUARD](at)
        consistent = {
            name: if_else(at.x[_MODES_CONSISTENT] != 0.0, value, 0.0) for name, value in values.items()
        }
        return {**consistent, _CONTROL_GUARD: at.u[ON] - 0.5}

    def reset(at: Arguments) -> Signals:
        after = dict(equations[SlotKind.RESET](at))
        turns_on = logic_and(at.u[ON] != 0.0, at.x[_MODES_CONSISTENT] == 0.0)
        present = {**at.x, **after}
        earlier = {name: present[name_before(name)] for name in present if name_before(name) in present}
        for name, value in modes(dataclasses.replace(at, x={**present, **earlier})).items():
            after[name] = if_else(turns_on, value, after.get(name, at.x[name]))
        for name, value in equations[SlotKind.CAPTURE](at).items() if captured_when_enabled else ():
            if name in captured_when_enabled:
                after[name] = if_else(turns_on, value, after.get(name, at.x[name]))
        after[_MODES_CONSISTENT] = at.u[ON] != 0.0
        return after

    def captures(at: Arguments) -> Signals:
        return {
            name: if_else(at.x[_MODES_CONSISTENT] != 0.0, value, at.x[name])
            if name in captured_with_modes
            else value
            for name, value in equations[SlotKind.CAPTURE](at).items()
        }

    changed = features.with_equations(
        {
            SlotKind.MODE: modes,
            SlotKind.CAPTURE: captures,
            SlotKind.CONTRADICTION: contradictions,
            SlotKind.GUARD: guards,
            SlotKind.RESET: reset,
        }
    )
    return dataclasses.replace(
        changed,
        modes=(
            *(
                dataclasses.replace(mode, stored_while=_MODES_CONSISTENT) if mode.hysteresis else mode
                for mode in features.modes
            ),
            State(_MODES_CONSISTENT, (), "whether the modes are consistent"),
        ),
        guards=(*features.guards, Guard(_CONTROL_GUARD, (), "the control")),
    )


def _plain(values: Signals) -> dict[str, SX]:
    """The values of all names that are not hidden."""
    return {name: value for name, value in values.items() if not name.startswith("?")}


def _initial_states(features: Features, at: Arguments) -> dict[str, SX]:
    """The initial states after a restart; the previous values of modes are 0.

    A state that is captured when the subsystem is enabled, such as the time of an instant, keeps its value.
    """
    before = {name_before(name) for name in at.x} & set(at.x)
    kept = {state.name for state in features.discrete if state.captured_when_enabled}
    starts = {name: SX(v) for name, v in features.initial_states(at.p).items() if name not in kept}
    return starts | {name: SX(0.0) for name in sorted(before)}


def _initial_modes(modes: Equation, at: Arguments) -> Signals:
    """The consistent modes at a restart, with present modes 0 as at the start of a run."""
    zero = {name: SX(at.x[name]) * 0.0 for name in modes(at)}
    return modes(at.with_states(zero))
