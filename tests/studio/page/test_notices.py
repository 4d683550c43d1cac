"""The front end contains the licences of all its packages."""

import json
import re
import sys
from pathlib import Path

import pytest

import armblocks as ab

ROOT = Path(__file__).resolve().parents[3]
WEB = Path(ab.__file__).parent / "studio" / "web"
sys.path.insert(0, str(ROOT / "frontend"))

import notices  # noqa: E402

ENTRY = re.compile(r"^-{80}\n(?P<name>\S+) [^ \n]+ \([^\n]+\)\n-{80}\n\n", re.MULTILINE)


def test_every_package_of_the_page_is_listed_with_its_licence() -> None:
    text = (WEB / notices.NOTICES_FILE).read_text(encoding="utf-8")
    entries = list(ENTRY.finditer(text))
    ends = [entry.start() for entry in entries[1:]] + [len(text)]
    licences = {entry["name"]: text[entry.end() : end] for entry, end in zip(entries, ends, strict=True)}
    dependencies = json.loads((ROOT / "frontend" / "package.json").read_text(encoding="utf-8"))[
        "dependencies"
    ]
    assert licences.keys() >= dependencies.keys()
    # Dependencies of the imported packages.
    assert licences.keys() >= {
        "@xyflow/system",
        "d3-zoom",
        "dockview-core",
        "scheduler",
        "react-remove-scroll-bar",
    }
    for name, licence in licences.items():
        assert len(licence) > 400, name
    lock = json.loads((ROOT / "frontend" / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    tools = {path.rpartition("node_modules/")[2] for path, entry in lock.items() if entry.get("dev")}
    assert not tools & licences.keys()
    for font in ("@fontsource-variable/inter", "@fontsource/jetbrains-mono"):
        assert "SIL OPEN FONT LICENSE" in licences[font].upper()
    assert not list(WEB.rglob(notices.PACKAGE_LIST))


def test_a_package_without_a_licence_text_stops_the_build(tmp_path: Path) -> None:
    folder = tmp_path / "node_modules" / "bare"
    folder.mkdir(parents=True)
    (folder / "package.json").write_text('{"name": "bare", "version": "1.0.0", "license": "MIT"}')
    with pytest.raises(SystemExit, match=r"package bare .* has no licence text"):
        notices.package("node_modules/bare", tmp_path)
    (folder / "LICENSE").write_text("Do what you like.")
    assert notices.package("node_modules/bare", tmp_path).text == "Do what you like."
