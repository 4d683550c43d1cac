"""Code in tables of the documentation breaks at dots, brackets and underscores, not inside words."""

import runpy
from pathlib import Path

BREAKS = runpy.run_path(str(Path(__file__).resolve().parents[2] / "docs" / "code_breaks.py"))


def broken(html: str) -> str:
    context = {"body": html}
    BREAKS["break_code_in_tables"](None, "page", "page.html", context, None)
    return context["body"]


def code(text: str) -> str:
    return f'<td><p><code><span class="pre">{text}</span></code></p></td>'


def test_words_in_cells_get_places_to_break() -> None:
    assert broken(code("ab.load_robot(&quot;arm.urdf&quot;)")) == code(
        "ab.<wbr>load_<wbr>robot(&quot;arm.<wbr>urdf&quot;)"
    )
    assert broken(code("InterpolationUsingPrelookup")) == code("Interpolation<wbr>Using<wbr>Prelookup")


def test_numbers_short_names_and_text_outside_of_tables_are_unchanged() -> None:
    for word in ("1.0", ".slx", "CounterLimited"):
        assert broken(code(word)) == code(word)
    paragraph = '<p><code><span class="pre">ab.load_robot</span></code></p>'
    assert broken(paragraph) == paragraph
