"""The list of keys contains every key that the front end handles, under the place where it is handled."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[3] / "frontend" / "src"
COMMANDS = ("commands.ts", "command_palette.tsx")
"""Source files that contain the list itself: their key names are data."""
SHORT_NAMES = {"escape": "esc", "delete": "del", " ": "space"}
KEY_HANDLER = re.compile(r"event\.key\b|moved\.key\b|onKeyDown|keydown")
KEY_COMPARISON = re.compile(
    r"""\b(?:event\.key|pressed|key)\s(?:===|!==)\s'([^']+)'   # event.key === 'Enter'
    | [{,]\s*(Arrow\w+|Enter|Escape|Home|End|Delete|Tab):      # { ArrowUp: -1, Enter: 1 }[event.key]
    """,
    re.VERBOSE,
)


def listed() -> list[tuple[list[str], list[str]]]:
    """The source files and the keys of each place in the list."""
    text = (SOURCE / "key_list.ts").read_text(encoding="utf-8")
    places = re.findall(r"sources: \[(.*?)\],\s*keys: \[(.*?)\n    \],", text, re.DOTALL)
    assert len(places) == text.count("    title: '")
    first_texts = re.compile(r"^ *\['(.+?)', '", re.MULTILINE)
    return [
        (
            re.findall(r"'(.+?)'", sources),
            [shortcut for line in first_texts.findall(keys) for shortcut in line.split(", ")],
        )
        for sources, keys in places
    ]


def handled_keys() -> dict[str, set[str]]:
    """The keys that each source file compares with the pressed key."""
    keys_in_file: dict[str, set[str]] = {}
    for path in sorted(SOURCE.rglob("*.ts*")):
        text = path.read_text(encoding="utf-8")
        keys = (
            {one or other for one, other in KEY_COMPARISON.findall(text)}
            if KEY_HANDLER.search(text)
            else set[str]()
        )
        if keys:
            keys_in_file[path.relative_to(SOURCE).as_posix()] = keys
    return keys_in_file


def includes_key(key: str, shortcuts: list[str]) -> bool:
    """Whether one of the shortcuts consists of this key, alone or with Ctrl or Shift."""
    if key.startswith("Arrow"):
        arrow = {"Up": "↑", "Down": "↓", "Left": "←", "Right": "→"}[key.removeprefix("Arrow")]
        return "arrows" in shortcuts or arrow in shortcuts
    written = SHORT_NAMES.get(key.lower(), key.lower())
    return any(
        shortcut.lower() == written or shortcut.lower().endswith(f"+{written}") for shortcut in shortcuts
    )


def test_the_sources_are_read() -> None:
    received = handled_keys()
    assert {"Enter", "Delete", "?", " ", "Escape"} <= received["canvas/sheet_keys.ts"]
    assert {"ArrowUp", "ArrowDown", "Enter"} <= received["robot/editor/table.tsx"]
    assert {"s", "z", "y", "?"} <= received["robot/editor/robot_editor.tsx"]
    assert includes_key("z", ["Ctrl+Z"])
    assert not includes_key("z", ["Ctrl+Y"])


@pytest.mark.parametrize("source", handled_keys())
def test_every_key_is_in_the_list_of_keys(source: str) -> None:
    assert source not in COMMANDS, "the key of a command is declared only in commands.ts"
    places = [keys for sources, keys in listed() if source in sources]
    assert places, f"key_list.ts names no place for the keys of {source}"
    missing = {key for key in handled_keys()[source] if not any(includes_key(key, keys) for keys in places)}
    assert not missing, f"key_list.ts does not list {missing} of {source}"


def test_the_list_names_existing_source_files() -> None:
    received = handled_keys()
    for sources, _ in listed():
        assert set(sources) <= set(received)
