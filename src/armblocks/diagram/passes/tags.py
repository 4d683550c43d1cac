"""Pass: Goto and From blocks are replaced by connections.

Input: Goto and From blocks.

Result: replacements. A From has the contents of the input of the nearest visible Goto with its tag.
"""

from __future__ import annotations

from armblocks.diagram.levels import level_of
from armblocks.diagram.passes.netlist import Netlist, Replacement, Replacements
from armblocks.diagram.port import PortRef
from armblocks.diagram.virtual_wiring import From, Goto
from armblocks.errors import DiagramError


def resolve_tags(net: Netlist) -> Netlist:
    """The netlist with replacements for all tags.

    Raises ``DiagramError`` for two Goto blocks of one tag in one scope, and for a From without a Goto.
    """
    tags = _Tags(net)
    replaced: dict[str, Replacements] = {}
    for path, block in net.blocks.items():
        if isinstance(block, Goto):
            replaced[path] = {}
        elif isinstance(block, From):
            replaced[path] = {"y": Replacement((net.drivers[PortRef(tags.goto(path, block), "u")],))}
    return net.with_replaced(replaced)


class _Tags:
    """Finds the Goto of a From."""

    def __init__(self, net: Netlist) -> None:
        self._known: dict[tuple[str, str, str], str] = {}
        for path, block in net.blocks.items():
            if not isinstance(block, Goto):
                continue
            level = "" if block.visibility == "global" else level_of(path)
            # A reader of a diagram cannot distinguish local and scoped Goto blocks of one tag.
            scopes = [(level, block.tag, block.visibility)]
            if block.visibility != "global":
                scopes.append((level, block.tag, "scoped" if block.visibility == "local" else "local"))
            for scope in scopes:
                other = self._known.get(scope)
                if other is not None:
                    raise DiagramError(
                        f"the Goto blocks '{other}' and '{path}' both send '{block.tag}'",
                        where=net.where,
                        allowed="one Goto for each tag in its scope",
                        fix="rename the tag of one of them, or make its visibility local",
                    )
            self._known[scopes[0]] = path

    def goto(self, path: str, block: From) -> str:
        """The path of the nearest visible Goto with the tag of a From."""
        level = level_of(path)
        nearest = self._known.get((level, block.tag, "local"))
        outer = level
        while nearest is None:
            nearest = self._known.get((outer, block.tag, "scoped"))
            if not outer:
                break
            outer = level_of(outer)
        nearest = nearest or self._known.get(("", block.tag, "global"))
        if nearest is None:
            visible = sorted(
                {
                    tag
                    for goto_level, tag, visibility in self._known
                    if self._is_visible(level, goto_level, visibility)
                }
            )
            hidden = [goto for (_, tag, _), goto in self._known.items() if tag == block.tag]
            raise DiagramError(
                f"no visible Goto sends '{block.tag}'",
                where=f"block '{path}' (From)",
                allowed="one of " + ", ".join(visible) if visible else "a tag that a Goto sends",
                fix=f"make the visibility of '{hidden[0]}' scoped or global" if hidden else "add a Goto",
            )
        return nearest

    def _is_visible(self, level: str, goto_level: str, visibility: str) -> bool:
        if visibility == "local":
            return level == goto_level
        return (
            visibility == "global"
            or not goto_level
            or level == goto_level
            or level.startswith(goto_level + "/")
        )
