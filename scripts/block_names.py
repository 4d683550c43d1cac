"""Write ``src/armblocks/blocks/__init__.pyi``: the names of all blocks, for type checkers and editors.

The package finds its blocks in its folders at import time. Type checkers cannot follow this and read the file
instead. A test fails if the file is not up to date.
"""

from __future__ import annotations

from pathlib import Path

from armblocks.blocks import BLOCKS

STUB = Path(__file__).resolve().parent.parent / "src" / "armblocks" / "blocks" / "__init__.pyi"
BANNER = "# Made by scripts/block_names.py: do not edit."


def stub() -> str:
    """Return the text of the stub file, with one import for each block class."""
    imports = sorted((kind.__module__, name) for name, kind in BLOCKS.items())
    lines = [
        BANNER,
        "from armblocks.diagram import BlockLibrary",
        *(f"from {module} import {name} as {name}" for module, name in imports),
        "",
        "FAMILIES: tuple[str, ...]",
        "BLOCKS: BlockLibrary",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    STUB.write_text(stub(), encoding="utf-8")
