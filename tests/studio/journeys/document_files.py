"""Saving documents in the page, and reading the saved files."""

from __future__ import annotations

import json
from pathlib import Path

from playwright.sync_api import Page, expect


def save_as(page: Page, path: str) -> None:
    page.keyboard.press("Control+Shift+S")
    page.get_by_role("combobox", name="File").fill(path)
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.get_by_role("dialog")).to_be_hidden()


def names(path: Path) -> list[str]:
    return sorted(json.loads(path.read_text())["blocks"])


def edit_from_outside(path: Path) -> bytes:
    """Write to the file of a model as another program does; return the written bytes."""
    path.write_text(json.dumps({**json.loads(path.read_text()), "description": "theirs"}))
    return path.read_bytes()
