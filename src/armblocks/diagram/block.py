"""What a block is: frozen parameters plus pure equations over ``t, x, u, p``. It stores no state."""

from __future__ import annotations

import dataclasses
from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar, Self

from casadi import SX, logic_or

from armblocks.diagram.mask import ParameterFormula, Scope, formula_names, formula_value
from armblocks.diagram.parameter import Parameter, Value, shape_of
from armblocks.diagram.port import Condition, DelayLine, Guard, Port, State, View, name_before
from armblocks.diagram.shape_rules import broadcast
from armblocks.diagram.signs import FaceSign, Outline, Title, value_text
from armblocks.diagram.worked_example import WorkedExample
from armblocks.equations import Shape
from armblocks.errors import UnknownNameError, check_arguments

_LONGEST_FORMULA = 16
"""Characters of a formula that a face shows in the place of its value."""
Shapes = Mapping[str, Shape]
"""Shapes by port name."""
Signals = Mapping[str, SX]
"""Symbolic values by name, each in its natural shape: scalar 1x1, vector a column, matrix as it is."""


@dataclass(frozen=True, kw_only=True)
class Block(ABC):
    """One kind of block. Subclasses are final frozen dataclasses whose fields are parameters.

    A subclass sets ``title``, declares its parameters with
    :func:`~armblocks.diagram.parameter.parameter`, and overrides what it has: ports, states, equations.
    In the equations ``t`` is the time (s), ``x`` the block's states of all kinds, ``u`` its inputs, ``p`` its
    tunable parameters, all symbolic; the other parameters are plain attributes. An equation must not read a
    tunable parameter from ``self``, only from ``p``: the compiled system may be run with another value.

    A *sampled* block (``sampled = True``, parameter ``sample_time``) works at the ticks of its clock only:
    its outputs are worked out there from the discrete states as they were before, then held, and its
    ``updates`` say what the discrete states become. Its equations find the period (s) as ``p["T"]``.

    A block with *modes* switches between equations at *events*. A mode keeps its value while the time flows,
    so that the flow is smooth; ``guards`` say where an event happens, ``resets`` what it changes, and
    ``mode_values`` what a mode has to be by the values of the moment (at the start, and within a sampled
    part of a diagram, which only looks at its ticks).

    Where a mode is no more than whether some quantity is positive, the block states *conditions* instead:
    ``condition_values`` gives the quantity, the equations find 1 or 0 as ``x[name]``, and mode, guard and
    reset follow. A block that only sampled blocks and constants feed asks its conditions directly.

    A block may read what an input was some time ago: ``delay_lines`` names such values, ``delay_times`` says
    how long ago. The equations find them as ``x[name]``; the numerics keep the past.

    A parameter may be given as a :func:`~armblocks.diagram.mask.formula` over the mask of the diagram that
    the block stands in. The diagram gives it the value; the text stays in ``formulas``.

    The first line of a subclass's docstring says in one sentence what the block does, with its equation.
    """

    title: ClassVar[str]
    """The name people know the block by, as Simulink or the toolbox shows it: ``XY Graph``."""
    time_derivatives: ClassVar[Mapping[str, str]] = {}
    """Output ports that are the exact time derivative of an input: output name to input name.

    They have no equation: the tracing differentiates what feeds the input."""
    output_rates: ClassVar[Mapping[str, str]] = {}
    """Outputs whose exact time derivative is another output: ``{"q": "qd"}``.

    A Derivative block behind ``q`` then gives ``qd`` itself, to the last bit: a joint that stands still has
    the speed 0, and not 1e-17, which Coulomb friction would see."""

    implicit_outputs: ClassVar[tuple[str, ...]] = ()
    """Outputs that are unknowns: what ``outputs`` gives for such a one is not its value but what has to be 0
    by the choice of it. Where Newton's method has to search, it begins at ``initial_guesses``."""
    sampled: ClassVar[bool] = False
    """Whether the block works at the ticks of a clock only; it then has the parameter ``sample_time``."""
    called: ClassVar[bool] = False
    """Whether Python is called at each tick of a sampled block, before it: :meth:`call` is given the discrete
    states ``port?`` of the inputs, as they are at the tick, and says what those of the outputs become."""
    virtual: ClassVar[bool] = False
    """Whether the block stands for wires only: it has no equations and is gone before a diagram is traced."""
    spreads: ClassVar[tuple[str, ...]] = ()
    """Array parameters whose shape the outputs share with the inputs, scalars spreading over it."""
    memoryless: ClassVar[bool] = False
    """Whether all modes are functions of the signals alone, and all guards only locate their changes."""
    rated_inputs: ClassVar[tuple[str, ...]] = ()
    """Inputs whose exact time derivative the equations read, as ``u["name'"]``."""
    example: ClassVar[WorkedExample] = WorkedExample()
    """What shows the block at work; left out, it is fed with signals that fit its ports."""

    formulas: tuple[tuple[str, str], ...] = field(default=(), repr=False, metadata={"formulas": True})
    """The parameters that are formulas, by name, with their texts."""

    def __new__(cls, *values: object, **named: object) -> Self:
        check_arguments(cls, values, named)
        return super().__new__(cls)

    sign: ClassVar[FaceSign | None] = None
    """What stands on the block's face, where no parameter matters for it; left out, its title."""
    outline: ClassVar[Outline] = Outline.CARD
    """The block's outline, where no parameter matters for it."""
    card_size: ClassVar[tuple[float, float] | None] = None
    """Width and height of a card, px; left out, as much as the sign takes. Names of ports may widen it."""

    def __post_init__(self) -> None:
        formulas, open_ones = dict(self.formulas), False
        for rule in self.parameters():
            where = f"{type(self).__name__}.{rule.name}"
            value = getattr(self, rule.name)
            if isinstance(value, ParameterFormula):
                formulas[rule.name] = value.text
                if formula_names(value.text):
                    open_ones = True  # the diagram that the block is put into knows the names
                    continue
                value = formula_value(rule, value.text, {}, type(self).__name__)
            object.__setattr__(self, rule.name, rule.check(value, where))
        object.__setattr__(self, "formulas", tuple(sorted(formulas.items())))
        if not open_ones:
            self.check()

    # -- description -------------------------------------------------------------------------------------

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """The parameters, in the order of declaration."""
        return _parameters_of(cls)

    def inputs_of_the_run(self) -> tuple[Parameter, ...]:
        """The parameters that stay inputs of the compiled system: all tunable ones, and those that this block
        reads by index."""
        return tuple(rule for rule in self.parameters() if rule.tunable)

    def parameters_behind_inputs(self) -> tuple[str, ...]:
        """Parameters that the equations know only by inputs of the run that follow from them.

        Such an input is no parameter of the block but an attribute of the same name.
        """
        return ()

    def structure_of_the_run(self) -> tuple[Parameter, ...]:
        """The parameters that the equations are made with; others change without anything being traced."""
        inputs, behind = self.inputs_of_the_run(), self.parameters_behind_inputs()
        return tuple(rule for rule in self.parameters() if rule not in inputs and rule.name not in behind)

    def face_outline(self) -> Outline:
        """The outline of the block."""
        return self.outline

    def face_sign(self) -> FaceSign:
        """What stands on the block's face."""
        return self.sign or Title(self.title)

    def stated_text(self, name: str) -> str:
        """What a face shows for a parameter: its formula where that is short, else its value."""
        text = dict(self.formulas).get(name, "")
        return text if 0 < len(text) <= _LONGEST_FORMULA else value_text(self.parameter_value(name))

    @classmethod
    def type_name(cls) -> str:
        """The name of this kind of block in files: the class's own."""
        return cls.__name__

    @classmethod
    def summary(cls) -> str:
        """One sentence for people: the docstring's first line."""
        return (cls.__doc__ or "").strip().splitlines()[0]

    def own_parameters(self) -> tuple[Parameter, ...]:
        """The parameters of this block: those of its type, and of a diagram inside those of its mask."""
        return self.parameters()

    def parameter_value(self, name: str) -> Value:
        """The checked value of one parameter."""
        return getattr(self, name)

    def stated_value(self, name: str) -> Value | ParameterFormula:
        """What somebody has written for a parameter: its formula where it has one, else its value."""
        text = dict(self.formulas).get(name)
        return self.parameter_value(name) if text is None else ParameterFormula(text)

    def with_parameters(self, **values: Any) -> Self:
        """The block with other values or formulas of some of its parameters.

        Raises ``UnknownNameError`` for a parameter that it has not, ``InputError`` for a value.
        """
        known = [rule.name for rule in self.own_parameters()]
        for name in values:
            if name not in known:
                raise UnknownNameError("parameter", name, known, where=self.type_name())
        texts = {name: value.text for name, value in values.items() if isinstance(value, ParameterFormula)}
        kept = {name: text for name, text in self.formulas if name not in values} | texts
        plain = {name: value for name, value in values.items() if name not in texts}
        return self.replaced({**plain, "formulas": tuple(sorted(kept.items()))})

    def in_scope(self, scope: Scope, where: str) -> Self:
        """The block with the values that its formulas give in a scope.

        Raises ``UnknownNameError`` for a name that is not in scope, ``InputError`` for a value.
        """
        if not self.formulas:
            return self
        rules = {rule.name: rule for rule in self.own_parameters()}
        values: dict[str, Any] = {}
        for name, text in self.formulas:
            if name not in rules:
                raise UnknownNameError("parameter", name, rules, where=where)
            values[name] = formula_value(rules[name], text, scope, where)
        if all(self.parameter_value(name) == value for name, value in values.items()):
            return self
        return self.replaced(values)

    def replaced(self, values: Mapping[str, Any]) -> Self:
        """A copy with other values of parameters; formulas stay as they are, unless they are given."""
        return dataclasses.replace(self, **values)

    def check(self) -> None:  # noqa: B027 - optional, most blocks have nothing to add
        """Raise ``InputError`` where parameters contradict each other; each alone is already checked."""

    # -- ends --------------------------------------------------------------------------------------------

    def input_ports(self) -> tuple[Port, ...]:
        """Inputs, in order."""
        return ()

    def output_ports(self) -> tuple[Port, ...]:
        """Outputs, in order."""
        return ()

    def bus_inputs(self) -> tuple[str, ...]:
        """Inputs that may be buses, all with the same elements: what passes a signal on unchanged has some.

        There is then a block for each signal, and every output is a bus of what they give.
        """
        return ()

    def record_ports(self) -> tuple[Port, ...]:
        """Signals that a run records as ``block/name`` but that nothing can be connected to.

        Their shape must be given.
        """
        return ()

    def states(self, inputs: Shapes) -> tuple[State, ...]:
        """Continuous states, given the shapes of all inputs."""
        return ()

    def discrete_states(self, inputs: Shapes) -> tuple[State, ...]:
        """States that only a tick (``updates``) or an event (``resets``) changes."""
        return ()

    def modes(self, inputs: Shapes) -> tuple[State, ...]:
        """Which of its equations holds: changed by events, numbered as ``doc`` says."""
        return ()

    def guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        """Quantities at whose zeros an event happens."""
        return ()

    def all_modes(self, inputs: Shapes) -> tuple[State, ...]:
        """The modes, each with whether it follows the signals."""
        return tuple(
            dataclasses.replace(mode, follows=mode.follows or self.memoryless) for mode in self.modes(inputs)
        )

    def all_guards(self, inputs: Shapes) -> tuple[Guard, ...]:
        """The guards, each with whether it only locates a change of modes."""
        return tuple(
            dataclasses.replace(guard, locates=guard.locates or self.memoryless)
            for guard in self.guards(inputs)
        )

    def conditions(self, inputs: Shapes) -> tuple[Condition, ...]:
        """What the equations ask of the values, in an order in which each may depend on those before it."""
        return ()

    def delay_lines(self, inputs: Shapes) -> tuple[DelayLine, ...]:
        """Inputs whose values of some time ago the equations read, each in ``rated_inputs`` too."""
        return ()

    def output_shapes(self, inputs: Shapes) -> Shapes:
        """Shapes of those outputs whose port does not state one, given the shapes of all inputs.

        Unless a block says otherwise, that is the common shape of the inputs without a stated one and of the
        parameters in ``spreads``. Raises ``InputError`` where they do not fit together.
        """
        ends = [port.name for port in self.output_ports() if port.shape is None]
        if self.virtual or not ends:
            return {}
        own = {port.name for port in self.input_ports() if port.shape is not None}
        wide = {name: shape for name, shape in inputs.items() if name not in own}
        for name in self.spreads:
            wide[f"parameter {name}" if name in wide else name] = shape_of(self.parameter_value(name))
        return dict.fromkeys(ends, broadcast(wide))

    def assumed_output_shapes(self) -> Shapes:
        """Shapes to assume for outputs in a loop, before the inputs are known (an integrator's start value).

        They are only ever widened from a scalar to what the inputs turn out to need.
        """
        return {}

    def output_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        """SI units of outputs that follow from the inputs' units; a port's own unit is the default."""
        return {}

    def input_units(self, inputs: Mapping[str, str]) -> Mapping[str, str]:
        """SI units of inputs that follow from those of the other inputs, as of the terms of a sum."""
        return {}

    def views(self) -> tuple[View, ...]:
        """The pictures that this block asks for: sinks have one or more."""
        return ()

    # -- equations ---------------------------------------------------------------------------------------

    def outputs(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every output port (but those of ``time_derivatives``)."""
        return {}

    def derivatives(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Time derivative of every state, each of its state's shape (a scalar is spread over it)."""
        return {}

    def records(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every record port. A stack (k, m, n) is given as a (k m, n) matrix."""
        return {}

    def initial_states(self, p: Signals) -> Signals:
        """Start value of every continuous and discrete state (a scalar is spread over it)."""
        return {}

    def initial_outputs(self, p: Signals) -> Signals:
        """Held outputs of a sampled block before its first tick, where they are not 0."""
        return {}

    def initial_guesses(self, p: Signals) -> Signals:
        """Where to begin the search for every one of ``implicit_outputs``."""
        return {}

    def updates(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """What every discrete state of a sampled block becomes at a tick."""
        return {}

    def call(self, t: float, inputs: Mapping[str, Any]) -> Mapping[str, Any]:
        """What a ``called`` block gives at a tick: numbers or arrays by output port, for those by input port.

        Raises ``InputError``.
        """
        return {}

    def guard_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """Value of every guard."""
        return {}

    def condition_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The quantity of every condition: the answer is 1 where it is positive."""
        return {}

    def delay_times(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """How long ago (s), one number for each delay line."""
        return {}

    def delay_bounds(self, p: Signals) -> Mapping[str, tuple[SX, SX]]:
        """The shortest and the longest that each delay may be (s), above 0: no step is longer."""
        return {}

    def initial_past(self, p: Signals) -> Signals:
        """What each delay line gives for times before the start."""
        return {}

    def mode_values(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """The consistent value of every mode at this moment.

        It follows from the values of the moment. ``x`` has the modes as they are, for modes with a memory, or
        as they were before the instant, for those that remember it.
        """
        return {}

    def contradictions(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """By mode, 1 where the mode is not consistent with the values of this moment, else 0.

        A mode that contradicts its condition takes the value of :meth:`mode_values`: after every jump, and at
        the first instant of a step at which it does. By default a mode contradicts wherever it differs from
        that value. Blocks override this where a mode is allowed to differ (hysteresis, counted edges), or
        where its value costs more than the question.
        """
        before = {mode: x[name_before(mode)] for mode in x if name_before(mode) in x}
        found = self.mode_values(t, {**x, **before}, u, p)
        return {name: logic_or(value > x[name], value < x[name]) for name, value in found.items()}

    def resets(self, t: SX, x: Signals, u: Signals, p: Signals, e: Signals) -> Signals:
        """New values of those states and modes that an event may change.

        ``e``, by guard: +1 or -1 where it fired upwards or downwards, 0 elsewhere. Where it is 0 everywhere,
        some other block has had an event, and the old values must come out unless the inputs or states of
        this moment alone ask for others.
        """
        return {}

    def captures(self, t: SX, x: Signals, u: Signals, p: Signals) -> Signals:
        """What those discrete states become that keep how things were just before a tick or event."""
        return {}

    def breakpoints(self, p: Signals) -> tuple[SX, ...]:
        """Instants (s) at which an output or a derivative of it jumps, as far as parameters tell.

        At such an instant ``outputs`` gives what follows: its condition ``t >= instant`` has the expression
        that stands here, because another one may be rounded to another time.
        """
        return ()


@cache
def _parameters_of(kind: type[Block]) -> tuple[Parameter, ...]:
    fields = [entry for entry in dataclasses.fields(kind) if "formulas" not in entry.metadata]
    return tuple(dataclasses.replace(_declared(entry), name=entry.name) for entry in fields)


def _declared(field: dataclasses.Field[Any]) -> Parameter:
    # A plain field would be invisible to files and dialogs: this is a mistake of the block's author.
    if "parameter" not in field.metadata:
        raise TypeError(f"field '{field.name}' of a block must be declared with parameter(...)")
    return field.metadata["parameter"]
