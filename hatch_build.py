"""Builds the page of the studio and the documentation while a wheel of armblocks is built, which brings both.

An editable installation builds neither: there ``armblocks studio`` and ``armblocks docs`` build what they
show when they are first asked for. Nothing is built either where it is there and its sources are as they
were, or where the sources are not there. A source distribution brings both as they were built, or builds
them again. ``ARMBLOCKS_SKIP_WEB=1`` leaves the page of the studio out, ``ARMBLOCKS_SKIP_DOCS=1`` the
documentation: everything else works without.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

ROOT = Path(__file__).resolve().parent
FRONTEND = ROOT / "frontend"
DOCS = ROOT / "docs"
DOCS_IN_WHEEL = "armblocks/shipped/docs"
sys.path[:0] = [str(FRONTEND), str(DOCS)]


class PageBuild(BuildHookInterface):
    """The hook that hatchling calls for every wheel, editable ones too, and every source distribution."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """What the builds need: Node.js as a wheel where the system has none, Sphinx, and armblocks' own."""
        # Of an editable build hatchling tells this method nothing; pip calls the hook by this name.
        if "get_requires_for_build_editable" in sys.argv:
            return []
        needed: list[str] = []
        if _page_needed():
            from node import NODE_WHEEL, system_npm

            needed += [] if system_npm() else [NODE_WHEEL]
        if self.target_name == "wheel" and _docs_needed():
            # The pages are written from the code: it is imported, and the examples of the blocks run.
            needed += [*self.metadata.core.dependencies, *self.metadata.core.optional_dependencies["docs"]]
        return needed

    def initialize(self, version: str, build_data: dict[str, dict[str, str]]) -> None:
        """Build what is not there as it should be, and put the documentation into the wheel."""
        if version == "editable":
            return
        if _page_needed():
            from build_page import build

            build()
        if self.target_name == "wheel":
            if _docs_needed():
                import build_site

                build_site.build()
            if _docs_wanted():
                build_data["force_include"]["docs/_build/html"] = DOCS_IN_WHEEL


class ReadmeOfThePackage(MetadataHookInterface):
    """The hook that hatchling calls for the metadata of a package: it sets the text for a package index."""

    PLUGIN_NAME = "custom"

    def update(self, metadata: dict[str, object]) -> None:
        """Set the readme."""
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        metadata["readme"] = {"content-type": "text/markdown", "text": for_package_index(text)}


def for_package_index(readme: str) -> str:
    """The README without pictures and links to files of the repository, which a package index does not have.

    The text of a link stays. Links to web sites are unchanged.
    """
    without_pictures = re.sub(
        r"<picture>.*?</picture>\n+|!\[[^\]]*\]\([^)]*\)\n+", "", readme, flags=re.DOTALL
    )
    return re.sub(r"\[([^\]]+)\]\((?!https?:)[^)]*\)", r"\1", without_pictures)


def _page_needed() -> bool:
    """Whether the page of the studio is to be built."""
    if os.environ.get("ARMBLOCKS_SKIP_WEB") == "1" or not FRONTEND.is_dir():
        return False
    from build_page import needed

    return needed()


def _docs_wanted() -> bool:
    """Whether the wheel gets the documentation."""
    return os.environ.get("ARMBLOCKS_SKIP_DOCS") != "1" and DOCS.is_dir()


def _docs_needed() -> bool:
    """Whether the documentation is to be built."""
    if not _docs_wanted():
        return False
    import build_site

    return build_site.needed()


if __name__ == "__main__":
    from build_page import main

    main()
