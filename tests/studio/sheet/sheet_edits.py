"""Random edits of every kind, generated from the content of a sheet, most of which are valid."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

from armblocks.diagram import BLOCK_COLOURS, NAME_SIDES, Diagram, DiagramBlock, ParameterKind
from armblocks.formats import load_robot
from armblocks.studio.protocol.messages import sheet_edits as do
from armblocks.studio.sheet.clipping import clipped
from armblocks.studio.sheet.document import Document

TYPES = ("Gain", "Integrator", "Sum", "Scope", "Constant", "SineWave", "Mux")
NEW_NAMES = tuple(f"new {k}" for k in range(12))


class Sheet:
    """One sheet of a diagram and a random generator."""

    def __init__(self, diagram: Diagram, chance: random.Random) -> None:
        self.diagram = diagram
        self.chance = chance
        self.blocks = list(diagram.blocks)
        self.outputs = [
            f"{name}/{port.name}" for name, block in diagram.blocks.items() for port in block.output_ports()
        ]
        self.inputs = [
            f"{name}/{port.name}" for name, block in diagram.blocks.items() for port in block.input_ports()
        ]
        self.wires = [do.Wire(source=str(c.source), target=str(c.target)) for c in diagram.connections]
        self.insides = [name for name, block in diagram.blocks.items() if isinstance(block, DiagramBlock)]

    def one(self, of: Any) -> Any:
        return self.chance.choice(list(of) or ["nothing"])

    def some(self, of: Any) -> list[Any]:
        entries = list(of)
        return self.chance.sample(entries, min(len(entries), self.chance.randint(1, 3)))

    def place(self) -> do.Place:
        return do.Place(
            x=self.chance.randint(-500, 500),
            y=float(self.chance.randint(-500, 500)),
            flipped=self.chance.random() < 0.3,
            rotation=self.one((0, 90, 180, 270)),
            name_side=self.one(NAME_SIDES),
            colour=self.one(BLOCK_COLOURS),
        )

    def wire(self) -> do.Wire:
        return do.Wire(source=self.one(self.outputs), target=self.one(self.inputs))

    def note(self) -> do.SheetNote:
        return do.SheetNote(x=self.chance.random(), y=2.0, text=self.one(("a", "b\nc", "ä")))


def add(s: Sheet) -> do.DiagramEdit:
    name = s.one(NEW_NAMES)
    return do.AddBlocks(blocks=[do.NewBlock(name=name, type=s.one(TYPES), place=s.place())])


def paste(s: Sheet) -> do.DiagramEdit:
    names = s.some(s.blocks)
    called = {name: f"{name} copy {s.chance.randrange(100)}" for name in names}
    return do.PasteBlocks(text=clipped(s.diagram, names, [], load_robot), names=called, shift=20.0)


def remove(s: Sheet) -> do.DiagramEdit:
    return s.one(
        (
            do.RemoveBlocks(blocks=[s.one(s.blocks)] if s.blocks else []),
            do.RemoveBlocks(wires=[s.one(s.wires)] if s.wires else []),
            do.RemoveBlocks(notes=s.some(s.diagram.notes)),
        )
    )


def move(s: Sheet) -> do.DiagramEdit:
    places = {name: s.place() for name in s.some(s.blocks)}
    notes = {name: s.note() for name in s.diagram.notes}
    return do.MoveBlocks(places=places, notes=notes, instead=s.some(s.wires)[: s.chance.randint(0, 1)])


def bend(s: Sheet) -> do.DiagramEdit:
    ways = [[], [10.0, 40.0, 90.0], [1.5]]
    return do.BendWires(wires=[w.model_copy(update={"bends": tuple(s.one(ways))}) for w in s.some(s.wires)])


def numbers(s: Sheet) -> list[str]:
    """The numeric parameters of the blocks of a sheet, as ``block.parameter``."""
    return [
        f"{name}.{rule.name}"
        for name, block in s.diagram.blocks.items()
        for rule in block.own_parameters()
        if rule.kind in (ParameterKind.NUMBER, ParameterKind.ARRAY)
    ]


def parameters(s: Sheet) -> do.DiagramEdit:
    block, _, parameter = s.one(numbers(s)).rpartition(".")
    return do.SetParameters(block=block, values={parameter: s.one((2.0, "2*pi", "k", "1/3"))})


def mask(s: Sheet) -> do.DiagramEdit:
    declared = [do.MaskParameter(name="k", default=s.one((1.0, "3*pi")), unit=s.one(("", "m")))]
    return do.SetMask(block=s.one(["", *s.insides]), parameters=declared[: s.chance.randint(0, 3)])


def keep_tuned(s: Sheet) -> do.DiagramEdit:
    return do.KeepTuned(values={s.one(numbers(s)): s.chance.random()})


SET_NAMES = ("stiff", "soft")


def save_parameter_set(s: Sheet) -> do.DiagramEdit:
    values = {path: s.one((0.5, "2*pi", 3)) for path in s.some(numbers(s))}
    flags = {"of_others": s.chance.random() < 0.5, "replace": s.chance.random() < 0.3}
    return do.SaveParameterSet(name=s.one(SET_NAMES), values=values, **flags)


def remove_set_parameter(s: Sheet) -> do.DiagramEdit:
    paths = {path for values in s.diagram.parameter_sets.values() for path in values}
    return do.RemoveSetParameter(path=s.one(sorted(paths)))


MAKERS: dict[type[do.DiagramEdit], Callable[[Sheet], do.DiagramEdit]] = {
    do.AddBlocks: add,
    do.PasteBlocks: paste,
    do.RemoveBlocks: remove,
    do.Connect: lambda s: do.Connect(wire=s.wire(), replace=s.chance.random() < 0.5),
    do.MoveBlocks: move,
    do.BendWires: bend,
    do.SetAppearance: lambda s: do.SetAppearance(
        blocks=s.some(s.blocks), name_side=s.one((None, *NAME_SIDES)), colour=s.one((None, *BLOCK_COLOURS))
    ),
    do.SetNotes: lambda s: do.SetNotes(notes={s.one(("/1", "/2")): s.note()}),
    do.Rename: lambda s: do.Rename(block=s.one(s.blocks), name=s.one(NEW_NAMES)),
    do.SetParameters: parameters,
    do.SetMask: mask,
    do.KeepTuned: keep_tuned,
    do.SaveParameterSet: save_parameter_set,
    do.RenameParameterSet: lambda s: do.RenameParameterSet(
        name=s.one(SET_NAMES), to=s.one((*SET_NAMES, "Soft"))
    ),
    do.RemoveParameterSet: lambda s: do.RemoveParameterSet(name=s.one(SET_NAMES)),
    do.RemoveSetParameter: remove_set_parameter,
    do.ApplyParameterSet: lambda s: do.ApplyParameterSet(name=s.one(SET_NAMES)),
    do.ArrangeBlocks: lambda s: do.ArrangeBlocks(),
    do.LogSignal: lambda s: do.LogSignal(port=s.one(s.outputs), logged=s.chance.random() < 0.7),
    do.CommentBlocks: lambda s: do.CommentBlocks(
        blocks=s.some(s.blocks), comment=s.one(("out", "out", "through", ""))
    ),
    do.NameSignal: lambda s: do.NameSignal(port=s.one(s.outputs), name=s.one(("speed", "error", "ä b", ""))),
    do.GroundPorts: lambda s: do.GroundPorts(blocks=s.some(s.blocks)),
    do.GroupBlocks: lambda s: do.GroupBlocks(blocks=s.some(s.blocks), name=s.one(NEW_NAMES)),
    do.BreakLink: lambda s: do.BreakLink(block=s.one(s.insides)),
    do.SetSettings: lambda s: do.SetSettings(values={"stop_time": s.chance.random() + 0.1}),
    do.Describe: lambda s: do.Describe(text=s.one(("words", "other words"))),
}

SELDOM_VALID = (
    *(do.KeepTuned, do.KeepTuned),
    *(do.SaveParameterSet, do.SaveParameterSet, do.SaveParameterSet),
    *(do.ApplyParameterSet, do.RenameParameterSet, do.RenameParameterSet, do.RemoveSetParameter),
)
"""Edits that are made more often: values are kept only in a model that can run, and most edits of parameter
sets need a set."""


def random_edit(document: Document, chance: random.Random) -> tuple[list[str], do.DiagramEdit]:
    """Return the path of a random sheet and a random edit of it."""
    path: list[str] = []
    diagram = document.diagram
    while True:
        inner = {
            name: block.diagram for name, block in diagram.blocks.items() if isinstance(block, DiagramBlock)
        }
        if not inner or chance.random() < 0.6:
            break
        name = chance.choice(sorted(inner))
        path.append(name)
        diagram = inner[name]
    return path, MAKERS[chance.choice([*MAKERS, *SELDOM_VALID])](Sheet(diagram, chance))
