"""The front end imports the style sheet of each component that it uses."""

from __future__ import annotations

import re
from pathlib import Path

FRONTEND = Path(__file__).parents[3] / "frontend"
STYLES = FRONTEND / "node_modules" / "@mantine" / "core" / "styles"


def test_every_used_component_has_its_style_sheet() -> None:
    used: set[str] = set()
    for source in (FRONTEND / "src").rglob("*.tsx"):
        for names in re.findall(
            r"import \{([^}]*)\} from '@mantine/core'", source.read_text(encoding="utf-8")
        ):
            used |= set(re.findall(r"\w+", names))
    styled = {name for name in used if (STYLES / f"{name}.css").is_file()}
    assert {"Button", "Modal"} <= styled
    sheets = "".join(sheet.read_text(encoding="utf-8") for sheet in (FRONTEND / "src").glob("mantine*.css"))
    imported = re.findall(r"styles/(\w+)\.css", sheets)
    assert sorted(styled - set(imported)) == []
