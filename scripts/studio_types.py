"""Write the parts of the front end that are generated from Python: message types and colours.

``python3 scripts/studio_types.py`` writes ``frontend/src/protocol.ts`` and ``frontend/src/tones.css``; with
``--check`` it only reports whether they are up to date.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from armblocks.pictures.style import FONT_STACK, MONO_STACK, PALETTE
from armblocks.studio.protocol.schema import message_schema

FRONTEND = Path(__file__).resolve().parent.parent / "frontend"
BANNER = """/*
 * The types of all messages between server and front end; long, because there are many messages.
 * Made from src/armblocks/studio/protocol/messages by scripts/studio_types.py: do not edit.
 */"""


def types() -> str:
    """Return the TypeScript types of all messages."""
    with tempfile.TemporaryDirectory() as folder:
        schema = Path(folder) / "messages.json"
        schema.write_text(json.dumps(message_schema()), encoding="utf-8")
        command = [
            str(FRONTEND / "node_modules" / ".bin" / "json2ts"),
            *("-i", str(schema), "--bannerComment", BANNER, "--unreachableDefinitions", "false"),
        ]
        return subprocess.run(command, check=True, capture_output=True, text=True, cwd=FRONTEND).stdout


def tones() -> str:
    """Return the colours of all figures as custom properties, and the CSS classes of drawings of blocks."""

    def properties(theme: str) -> str:
        return "\n".join(
            f"  --{tone.value}: {shade.light if theme == 'light' else shade.dark};"
            for tone, shade in PALETTE.items()
        )

    classes = "\n".join(
        f".f-{name} {{ fill: var(--{name}); }}\n.s-{name} {{ stroke: var(--{name}); }}"
        for name in (tone.value for tone in PALETTE)
    )
    banner = "/* Made from armblocks.pictures.style by scripts/studio_types.py: do not edit. */"
    return (
        f"{banner}\n:root {{\n{properties('light')}\n  --font: 'Inter Variable', {FONT_STACK};\n"
        f"  --mono: 'JetBrains Mono', {MONO_STACK};\n}}\n"
        f":root[data-mantine-color-scheme='dark'] {{\n{properties('dark')}\n}}\n{classes}\n"
    )


def main() -> int:
    """Write or check both files."""
    expected = {FRONTEND / "src" / "protocol.ts": types(), FRONTEND / "src" / "tones.css": tones()}
    stale = [
        path
        for path, text in expected.items()
        if not path.exists() or path.read_text(encoding="utf-8") != text
    ]
    if "--check" in sys.argv:
        for path in stale:
            print(f"{path.name} is not up to date: run python3 scripts/studio_types.py")
        return 1 if stale else 0
    for path in stale:
        path.write_text(expected[path], encoding="utf-8")
        print(f"wrote {path.name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
