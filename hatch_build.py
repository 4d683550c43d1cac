"""Builds the page of the studio while a wheel of armblocks is built, so that the wheel brings it.

An editable installation builds no page: there ``armblocks studio`` builds it when it is first asked for.
Nothing is built either where the page is there and its sources are as they were, where the sources are not
there (a source distribution brings the built page), or with ``ARMBLOCKS_SKIP_WEB=1``: then everything but the
studio works.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FRONTEND = Path(__file__).resolve().parent / "frontend"
sys.path.insert(0, str(FRONTEND))


class PageBuild(BuildHookInterface):
    """The hook that hatchling calls for every wheel, editable ones too."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Node.js as a wheel where it is needed and the system has none."""
        # Of an editable build hatchling tells this method nothing; pip calls the hook by this name.
        if "get_requires_for_build_editable" in sys.argv or not _needed():
            return []
        from node import NODE_WHEEL, system_npm

        return [] if system_npm() else [NODE_WHEEL]

    def initialize(self, version: str, build_data: dict[str, object]) -> None:
        """Build the page if it is not there as it should be."""
        if version != "editable" and _needed():
            from build_page import build

            build()


def _needed() -> bool:
    """Whether there is something to build."""
    if os.environ.get("ARMBLOCKS_SKIP_WEB") == "1" or not FRONTEND.is_dir():
        return False
    from build_page import needed

    return needed()


if __name__ == "__main__":
    from build_page import main

    main()
