"""Every Python block of the README and of the pages and notebooks in docs runs, in order and unchanged."""

import contextlib
import io
import json
import os
import re
import runpy
import shlex
import warnings
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from armblocks.cli.main import app
from armblocks.errors import InertiaWarning

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs").glob("*.ipynb"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def python_blocks(page: Path) -> list[tuple[int, str]]:
    """Line and text of each fenced Python block, or position and text of each cell of a notebook."""
    text = page.read_text(encoding="utf-8")
    if page.suffix == ".ipynb":
        cells = enumerate(json.loads(text)["cells"], start=1)
        return [(k, "".join(cell["source"])) for k, cell in cells if cell["cell_type"] == "code"]
    return [(text[: match.start(1)].count("\n") + 1, match.group(1)) for match in BLOCK.finditer(text)]


WITH_CODE = [page for page in PAGES if python_blocks(page)]


@pytest.mark.parametrize("page", WITH_CODE, ids=[page.name for page in WITH_CODE])
def test_the_code_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    namespace: dict[str, object] = {"__name__": page.stem}
    before = Path.cwd()
    os.chdir(tmp_path)
    try:
        with contextlib.redirect_stdout(io.StringIO()), warnings.catch_warnings():
            # The robot of the paper has impossible inertias and issues a warning.
            warnings.simplefilter("ignore", InertiaWarning)
            for line, code in python_blocks(page):
                # Line numbers are those of the page, so that a traceback refers to it.
                exec(compile("\n" * (line - 1) + code, str(page), "exec"), namespace)  # noqa: S102
    finally:
        os.chdir(before)


TEXT = re.compile(r"^```text\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(armblocks [^`\n]+)`")


def commands(page: Path) -> list[str]:
    """Lines of examples, and code inside sentences and tables, that begin with ``armblocks``."""
    text = page.read_text(encoding="utf-8")
    lines = "".join(TEXT.findall(text)).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("armblocks ")] + INLINE.findall(text)


def test_commands_of_the_documents_exist_with_their_options() -> None:
    """Commands of the examples and of the text are parsed, not run."""
    group: Any = get_command(app)
    context = group.make_context("armblocks", ["blocks"], resilient_parsing=True)
    for page in PAGES:
        for line in commands(page):
            words = [word.strip("[]") for word in shlex.split(line, comments=True)[1:]]
            command = group if words[0].startswith("-") else group.get_command(context, words.pop(0))
            assert command is not None, f"{page.name}: {line}"
            try:
                command.make_parser(type(context)(command)).parse_args(words)
            except Exception as error:
                pytest.fail(f"{page.name}: {line}: {error}")


def test_examples_fit_into_the_column_of_a_page() -> None:
    for page in (path for path in PAGES if path.suffix == ".md"):
        for code in re.findall(r"^```.*?^```$", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
            assert [line for line in code.splitlines() if len(line) > 88] == [], page.name


def test_the_readme_begins_with_the_two_commands() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    first = re.search(r"^```\w*\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    assert first is not None
    assert first.group(1).splitlines() == ["python3 scripts/demo.py", "python3 scripts/test.py"]


def test_ci_runs_the_test_command_of_the_readme() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert script.splitlines()[-1] == "python3 scripts/test.py"


def test_links_between_the_documents_have_targets() -> None:
    for page in (*ROOT.glob("*.md"), *PAGES):
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_rows_of_tables_have_a_cell_for_each_column() -> None:
    wrong: list[str] = []
    for page in (*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "benchmarks").glob("*.md")):
        text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
        for table in re.findall(r"(?:^\|.*\n?)+", text, re.MULTILINE):
            # A bar in code or after a backslash does not separate cells.
            rows = [re.sub(r"`[^`]*`", "", row).replace("\\|", "") for row in table.splitlines()]
            wrong += [f"{page.name}: {row}" for row in rows if row.count("|") != rows[0].count("|")]
    assert wrong == []


def test_pictures_of_the_studio_are_shown_in_both_themes() -> None:
    """Each picture has a light and a dark file; a page refers to both, and its theme selects one."""
    shown = " ".join(page.read_text(encoding="utf-8") for page in PAGES)
    pictures = ROOT / "docs" / "pictures"
    for path in pictures.glob("*.webp"):
        assert f'pictures/{path.name}">' in shown, path.name
        assert {f"{path.stem.rpartition('-')[0]}-{theme}.webp" for theme in ("light", "dark")} <= {
            other.name for other in pictures.iterdir()
        }
    namespace = runpy.run_path(str(ROOT / "docs" / "theme_pictures.py"))
    for page in PAGES:
        source = [page.read_text(encoding="utf-8")]
        namespace["show_by_theme"](None, page.stem, source)
        assert "<picture>" not in source[0]
        assert source[0].count("only-light") == source[0].count("only-dark")
