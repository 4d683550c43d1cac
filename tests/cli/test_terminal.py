"""Messages in the terminal: the parts of an error, warnings once and on one line, narrow and wide."""

import io
import warnings

import pytest
from rich.console import Console

from armblocks.cli import terminal
from armblocks.errors import ArmblocksError, InertiaWarning, InputError, UnknownNameError


def test_an_error_shows_its_four_parts(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.show_error(InputError("the value is -1", where="jtraj.tmax", allowed="> 0", fix="give a time"))
    lines = [line.rstrip() for line in capsys.readouterr().err.splitlines()]
    assert lines == [
        "error: the value is -1",
        "  where    jtraj.tmax",
        "  allowed  > 0",
        "  fix      give a time",
    ]


def test_an_error_shows_only_the_parts_it_has(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.show_error(ArmblocksError("nothing works"))
    assert capsys.readouterr().err.rstrip() == "error: nothing works"


def test_square_brackets_in_a_message_are_not_markup(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.show_error(InputError("the value is [bold]x[/bold]", allowed="[1 2 3]"))
    text = capsys.readouterr().err
    assert "[bold]x[/bold]" in text
    assert "[1 2 3]" in text


def test_lines_of_a_log_are_never_wrapped(capsys: pytest.CaptureFixture[str]) -> None:
    allowed = ", ".join(f"block{number}" for number in range(200))
    terminal.show_error(InputError("there is no such block", allowed=allowed))
    assert any(allowed in line for line in capsys.readouterr().err.splitlines())


@pytest.mark.parametrize("width", [40, 80, 160])
def test_no_line_is_wider_than_the_terminal(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    console = Console(width=width, force_terminal=True, record=True, highlight=False, file=io.StringIO())
    monkeypatch.setattr(terminal, "messages_console", lambda: console)
    terminal.show_error(UnknownNameError("block", "blok7", [f"block{number}" for number in range(50)]))
    lines = console.export_text().splitlines()
    assert max(len(line) for line in lines) <= width
    assert "did you mean" in " ".join(lines)


def test_a_warning_is_one_line_and_comes_once(capsys: pytest.CaptureFixture[str]) -> None:
    with terminal.tidy_warnings(terminal.messages_console()):
        for _ in range(3):
            warnings.warn("link 'link1' has inertia but no mass", InertiaWarning, stacklevel=1)
    assert capsys.readouterr().err == "warning: link 'link1' has inertia but no mass\n"


def test_warnings_of_other_categories_are_left_to_python() -> None:
    with (
        terminal.tidy_warnings(terminal.messages_console()),
        pytest.raises(UserWarning, match="somebody else's"),
    ):
        warnings.warn("somebody else's", UserWarning, stacklevel=1)
