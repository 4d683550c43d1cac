"""The size of the first download of the front end stays below its limit."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import armblocks as ab

WEB = Path(ab.__file__).parent / "studio" / "web"
MAX_KB = 400
COMMON_FONTS = re.compile(r"(inter-latin-wght|jetbrains-mono-latin-400)-normal-.*\.woff2")
"""Font files that every page needs: browsers fetch only the files with characters on the page."""


def test_the_first_download_is_below_400_kb() -> None:
    page = (WEB / "index.html").read_text(encoding="utf-8")
    files = sorted((WEB / "assets").iterdir())
    named = [file for file in files if file.name in page]
    fonts = [file for file in files if COMMON_FONTS.fullmatch(file.name)]
    assert {file.suffix for file in named} == {".js", ".css"}
    assert len(fonts) == 2
    sizes = {file.name: len(gzip.compress(file.read_bytes(), 9)) for file in (*named, *fonts)}
    total = sum(sizes.values()) + len(gzip.compress(page.encode(), 9))
    assert total < 1000 * MAX_KB, f"{total / 1000:.0f} kB: {sizes}"


def test_3d_code_and_dialogs_are_loaded_on_demand() -> None:
    page = (WEB / "index.html").read_text(encoding="utf-8")
    for part in ("stage", "all_dialogs", "scopes", "robot_editor"):
        assert not re.search(rf"/{part}-[^/]*\.js", page), part
        assert list((WEB / "assets").glob(f"{part}-*.js")), part
