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

    def __init__(self, diagram: Diagram, rng: random.Random) -> None:
        self.diagram = diagram
        self.rng = rng
        self.blocks = list(diagram.blocks)
        self.outputs = [
            f"{name}/{port.name}" for name, block in diagram.blocks.items() for port in block.output_ports()
        ]
        self.inputs = [
            f"{name}/{port.name}" for name, block in diagram.blocks.items() for port in block.input_ports()
        ]
        self.wires = [do.Wire(source=str(c.source), target=str(c.target)) for c in diagram.connections]
        self.subsystems = [name for name, block in diagram.blocks.items() if isinstance(block, DiagramBlock)]

    def pick(self, items: Any) -> Any:
        return self.rng.choice(list(items) or ["nothing"])

    def pick_some(self, items: Any) -> list[Any]:
        entries = list(items)
        return self.rng.sample(entries, min(len(entries), self.rng.randint(1, 3)))

    def place(self) -> do.Place:
        return do.Place(
            x=self.rng.randint(-500, 500),
            y=float(self.rng.randint(-500, 500)),
            flipped=self.rng.random() < 0.3,
            rotation=self.pick((0, 90, 180, 270)),
            name_side=self.pick(NAME_SIDES),
            colour=self.pick(BLOCK_COLOURS),
        )

    def wire(self) -> do.Wire:
        return do.Wire(source=self.pick(self.outputs), target=self.pick(self.inputs))

    def note(self) -> do.SheetNote:
        return do.SheetNote(x=self.rng.random(), y=2.0, text=self.pick(("a", "b\nc", "ä")))


def add(s: Sheet) -> do.DiagramEdit:
    name = s.pick(NEW_NAMES)
    return do.AddBlocks(blocks=[do.NewBlock(name=name, type=s.pick(TYPES), place=s.place())])


def paste(s: Sheet) -> do.DiagramEdit:
    names = s.pick_some(s.blocks)
    new_names = {name: f"{name} copy {s.rng.randrange(100)}" for name in names}
    return do.PasteBlocks(text=clipped(s.diagram, names, [], load_robot), names=new_names, shift=20.0)


def remove(s: Sheet) -> do.DiagramEdit:
    return s.pick(
        (
            do.RemoveBlocks(blocks=[s.pick(s.blocks)] if s.blocks else []),
            do.RemoveBlocks(wires=[s.pick(s.wires)] if s.wires else []),
            do.RemoveBlocks(blocks=s.pick_some(s.blocks), reconnections=[s.wire()]),
            do.RemoveBlocks(notes=s.pick_some(s.diagram.notes)),
        )
    )


def move(s: Sheet) -> do.DiagramEdit:
    places = {name: s.place() for name in s.pick_some(s.blocks)}
    notes = {name: s.note() for name in s.diagram.notes}
    return do.MoveBlocks(places=places, notes=notes, instead=s.pick_some(s.wires)[: s.rng.randint(0, 1)])


def bend(s: Sheet) -> do.DiagramEdit:
    routes = [[], [10.0, 40.0, 90.0], [1.5]]
    return do.BendWires(
        wires=[w.model_copy(update={"bends": tuple(s.pick(routes))}) for w in s.pick_some(s.wires)]
    )


def numbers(s: Sheet) -> list[str]:
    """The numeric parameters of the blocks of a sheet, as ``block.parameter``."""
    return [
        f"{name}.{rule.name}"
        for name, block in s.diagram.blocks.items()
        for rule in block.own_parameters()
        if rule.kind in (ParameterKind.NUMBER, ParameterKind.ARRAY)
    ]


def parameters(s: Sheet) -> do.DiagramEdit:
    block, _, parameter = s.pick(numbers(s)).rpartition(".")
    return do.SetParameters(block=block, values={parameter: s.pick((2.0, "2*pi", "k", "1/3"))})


def mask(s: Sheet) -> do.DiagramEdit:
    declared = [do.MaskParameter(name="k", default=s.pick((1.0, "3*pi")), unit=s.pick(("", "m")))]
    return do.SetMask(block=s.pick(["", *s.subsystems]), parameters=declared[: s.rng.randint(0, 3)])


def keep_tuned(s: Sheet) -> do.DiagramEdit:
    return do.KeepTuned(values={s.pick(numbers(s)): s.rng.random()})


SET_NAMES = ("stiff", "soft")


def save_parameter_set(s: Sheet) -> do.DiagramEdit:
    values = {path: s.pick((0.5, "2*pi", 3)) for path in s.pick_some(numbers(s))}
    flags = {"all_parameters": s.rng.random() < 0.5, "replace": s.rng.random() < 0.3}
    return do.SaveParameterSet(name=s.pick(SET_NAMES), values=values, **flags)


def remove_set_parameter(s: Sheet) -> do.DiagramEdit:
    paths = {path for values in s.diagram.parameter_sets.values() for path in values}
    return do.RemoveSetParameter(path=s.pick(sorted(paths)))


BOOKMARK_NAMES = ("left", "right")


def add_bookmark(s: Sheet) -> do.DiagramEdit:
    x, width = float(s.rng.randint(-500, 500)), s.pick((1.0, 300.5))
    part = do.SheetPart(x=x, y=-20.0, width=width, height=200.0)
    return do.AddBookmark(name=s.pick(BOOKMARK_NAMES), part=part, replace=s.rng.random() < 0.3)


def scope_trigger(s: Sheet) -> do.DiagramEdit:
    settings = do.ScopeTriggerSettings(
        on=s.rng.random() < 0.5,
        signal=s.pick(s.outputs),
        element=s.rng.randrange(3),
        edge=s.pick(("rising", "falling", "either")),
        level=s.rng.random(),
        mode=s.pick(("normal", "auto", "single")),
        span=s.rng.random() + 0.1,
        position=s.rng.random(),
        hold_off=s.rng.random(),
    )
    return do.SetScopeTrigger(trigger=s.pick((settings, settings, None)))


MAKERS: dict[type[do.DiagramEdit], Callable[[Sheet], do.DiagramEdit]] = {
    do.AddBlocks: add,
    do.PasteBlocks: paste,
    do.RemoveBlocks: remove,
    do.Connect: lambda s: do.Connect(
        wire=s.wire(), replace=s.rng.random() < 0.5, instead=s.pick_some(s.wires)[: s.rng.randint(0, 1)]
    ),
    do.MoveBlocks: move,
    do.BendWires: bend,
    do.SetAppearance: lambda s: do.SetAppearance(
        blocks=s.pick_some(s.blocks),
        name_side=s.pick((None, *NAME_SIDES)),
        colour=s.pick((None, *BLOCK_COLOURS)),
    ),
    do.SetNotes: lambda s: do.SetNotes(notes={s.pick(("/1", "/2")): s.note()}),
    do.Rename: lambda s: do.Rename(block=s.pick(s.blocks), name=s.pick(NEW_NAMES)),
    do.SetParameters: parameters,
    do.SetMask: mask,
    do.KeepTuned: keep_tuned,
    do.SaveParameterSet: save_parameter_set,
    do.RenameParameterSet: lambda s: do.RenameParameterSet(
        name=s.pick(SET_NAMES), to=s.pick((*SET_NAMES, "Soft"))
    ),
    do.RemoveParameterSet: lambda s: do.RemoveParameterSet(name=s.pick(SET_NAMES)),
    do.RemoveSetParameter: remove_set_parameter,
    do.ApplyParameterSet: lambda s: do.ApplyParameterSet(name=s.pick(SET_NAMES)),
    do.ArrangeBlocks: lambda s: do.ArrangeBlocks(),
    do.LogSignal: lambda s: do.LogSignal(port=s.pick(s.outputs), logged=s.rng.random() < 0.7),
    do.CommentBlocks: lambda s: do.CommentBlocks(
        blocks=s.pick_some(s.blocks), comment=s.pick(("out", "out", "through", ""))
    ),
    do.NameSignal: lambda s: do.NameSignal(
        port=s.pick(s.outputs), name=s.pick(("speed", "error", "ä b", ""))
    ),
    do.GroundPorts: lambda s: do.GroundPorts(blocks=s.pick_some(s.blocks)),
    do.GroupBlocks: lambda s: do.GroupBlocks(blocks=s.pick_some(s.blocks), name=s.pick(NEW_NAMES)),
    do.BreakLink: lambda s: do.BreakLink(block=s.pick(s.subsystems)),
    do.AddBookmark: add_bookmark,
    do.RenameBookmark: lambda s: do.RenameBookmark(
        name=s.pick(s.diagram.bookmarks), to=s.pick((*BOOKMARK_NAMES, "Left"))
    ),
    do.RemoveBookmark: lambda s: do.RemoveBookmark(name=s.pick(s.diagram.bookmarks)),
    do.SetScopeTrigger: scope_trigger,
    do.SetSettings: lambda s: do.SetSettings(values={"stop_time": s.rng.random() + 0.1}),
    do.Describe: lambda s: do.Describe(text=s.pick(("words", "other words"))),
}

FREQUENT_EDITS = (
    *(do.KeepTuned, do.KeepTuned),
    *(do.AddBookmark, do.AddBookmark, do.RenameBookmark),
    *(do.SaveParameterSet, do.SaveParameterSet, do.SaveParameterSet),
    *(do.ApplyParameterSet, do.ApplyParameterSet, do.RenameParameterSet, do.RenameParameterSet),
    *(do.SaveParameterSet, do.ApplyParameterSet, do.ApplyParameterSet, do.RemoveSetParameter),
)
"""Edits that are chosen more often, because they are seldom valid: tuned values need a model that can run,
and most edits of parameter sets and bookmarks need an existing one."""


def random_edit(document: Document, rng: random.Random) -> tuple[list[str], do.DiagramEdit]:
    """Return the path of a random sheet and a random edit of it."""
    path: list[str] = []
    diagram = document.diagram
    while True:
        inner = {
            name: block.diagram for name, block in diagram.blocks.items() if isinstance(block, DiagramBlock)
        }
        if not inner or rng.random() < 0.6:
            break
        name = rng.choice(sorted(inner))
        path.append(name)
        diagram = inner[name]
    return path, MAKERS[rng.choice([*MAKERS, *FREQUENT_EDITS])](Sheet(diagram, rng))
