"""Panels of a Scope: grouping of signals by unit, and display units."""

import armblocks as ab
from armblocks.blocks import Clock, Constant, Integrator, Mux, Saturation, Scope, SineWave, Step
from armblocks.diagram import Diagram, DiagramBuilder
from armblocks.pictures.picture import text_marks
from armblocks.report.figures import view_figures


def diagram() -> Diagram:
    builder = DiagramBuilder("scopes")
    time = builder.add("time", Clock())
    late = builder.add("late", Saturation(lower=0.0, upper=1e-5), time)
    vector = builder.add("vector", SineWave(phase=(0.0, 1.0)))
    number = builder.add("number", Integrator(), builder.add("one", Constant()))
    builder.add("scope", Scope(inputs=4), time, vector, late, number)
    return builder.build()


def test_scalars_of_one_unit_share_a_panel_and_its_prefix() -> None:
    model = diagram()
    result = ab.simulate(model, stop_time=1.0)
    paths = ("time/y", "vector/y", "late/y", "number/y")
    assert [result.units[path] for path in paths] == ["s", "", "s", ""]
    (figure,) = view_figures(model, result)
    headings = [mark.text for mark in text_marks(figure.picture) if mark.bold]
    assert headings == ["time/y, late/y, s", "vector/y", "number/y"]


def test_a_figure_has_the_requested_width() -> None:
    model = diagram()
    (figure,) = view_figures(model, ab.simulate(model, stop_time=1.0), 500.0)
    assert figure.picture.width == 500.0
    assert all(mark.x <= 500.0 for mark in text_marks(figure.picture))


def test_entries_of_a_mux_have_the_names_of_their_blocks() -> None:
    builder = ab.DiagramBuilder("mux")
    pair = builder.add("pair", Constant(value=(1.0, 2.0)))
    both = builder.add("both", Mux(inputs=2), builder.add("reference", Step()), pair)
    builder.add("Scope", Scope(), both)
    diagram = builder.build()
    (figure,) = view_figures(diagram, ab.simulate(diagram))
    message = {mark.text for mark in text_marks(figure.picture)}
    assert {"reference", "pair[0]", "pair[1]"} <= message


def test_signals_with_long_names_have_different_labels() -> None:
    builder = ab.DiagramBuilder("long names")
    names = [f"the torque of the second joint, measured at the {side} side" for side in ("motor", "link")]
    builder.add("scope", Scope(inputs=2), *(builder.add(name, SineWave()) for name in names))
    diagram = builder.build()
    (figure,) = view_figures(diagram, ab.simulate(diagram))
    labels = [mark.text for mark in text_marks(figure.picture) if "…" in mark.text and not mark.bold]
    assert len(set(labels)) == 2
    assert [label[-8:] for label in labels] == ["r side/y", "k side/y"]
