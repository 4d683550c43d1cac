"""Names of blocks and signals: which names are legal, and which names count as equal."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Mapping

from armblocks.diagram.port import PortRef
from armblocks.errors import DiagramError

MAX_NAME_LENGTH = 200
"""Characters."""
NOT_SIGNALS = ("time", "run")
"""Names that signals must not have: data files use them for the times and the description of the run."""


def check_block_name(name: str, where: str, noun: str = "block") -> None:
    """Raise ``DiagramError`` for a name unfit for a path, ``block/port`` or ``block.parameter``."""
    allowed = f"1 to {MAX_NAME_LENGTH} characters, without '/', '.' and control characters"
    check_printable(name, where, noun, allowed, without="/.")


def check_printable(name: str, where: str, noun: str, allowed: str, *, without: str = "") -> None:
    """Raise ``DiagramError`` for a name that is blank or too long, or has a control character or one of
    ``without``."""
    text = repr(name if len(name) <= 60 else name[:57] + "...")
    if not name.strip():
        raise DiagramError(f"a {noun} has an empty name", where=where, allowed=allowed, fix="name it")
    if len(name) > MAX_NAME_LENGTH:
        raise DiagramError(
            f"the {noun} name {text} has {len(name)} characters",
            where=where,
            allowed=allowed,
            fix="shorten it",
        )
    for character in name:
        # Category C: control characters, and invisible marks that change the text direction.
        if character in without or unicodedata.category(character).startswith("C"):
            raise DiagramError(
                f"the {noun} name {text} contains {character!r}",
                where=where,
                allowed=allowed,
                fix="rename it",
            )


def check_new_name(name: str, others: Iterable[str], where: str, *, noun: str, max_count: int) -> None:
    """Raise ``DiagramError`` for a name that is blank, too long, not printable, or used by one of ``others``,
    of which a diagram has at most ``max_count``.
    """
    allowed = (
        f"1 to {MAX_NAME_LENGTH} characters, other than those of another {noun.split()[-1]} "
        "regardless of capitalisation"
    )
    check_printable(name, where, noun, allowed)
    used_names = {folded(other): other for other in others}
    if folded(name) in used_names:
        raise DiagramError(
            f"a {noun} is already named '{used_names[folded(name)]}'",
            where=where,
            allowed=allowed,
            fix="choose another name",
        )
    if len(used_names) >= max_count:
        raise DiagramError(
            f"the diagram has {len(used_names)} {noun}s",
            where=where,
            allowed=f"at most {max_count}",
            fix="remove one of them",
        )


def folded(name: str) -> str:
    """The form in which names are compared: ignores case and Unicode composition."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFKD", name).casefold())


class FreeNames:
    """Chooses names that no block and no signal of a sheet uses."""

    def __init__(self, used_names: Iterable[str]) -> None:
        self._used = {folded(name) for name in used_names}

    def take(self, name: str) -> str:
        """Return the name, with a number where it is used already; it is used from now on."""
        free, number = name, 2
        while folded(free) in self._used:
            free, number = f"{name} {number}", number + 1
        self._used.add(folded(free))
        return free


def check_signal_names(blocks: Iterable[str], names: Mapping[PortRef, str], where: str) -> None:
    """Raise ``DiagramError`` for a signal name that is used twice or that data files do not allow.

    In data files, columns of a vector are named ``signal[0]``, so that brackets are not allowed.
    """
    used_names = {folded(name): f"the block '{name}'" for name in blocks}
    for ref, name in sorted(names.items()):
        check_block_name(name, f"{where}, signal '{ref}'", "signal")
        if folded(name) in NOT_SIGNALS or not {"[", "]"}.isdisjoint(name):
            raise DiagramError(
                f"the signal '{ref}' is named '{name}', a name that data files use for other columns",
                where=where,
                allowed=f"names without brackets, other than {', '.join(NOT_SIGNALS)}",
                fix="choose another name",
            )
        other = used_names.get(folded(name))
        if other is not None:
            raise DiagramError(
                f"the signal '{ref}' is named '{name}', like {other}",
                where=where,
                allowed="names that no other signal and no block of the sheet has",
                fix="choose another name",
            )
        used_names[folded(name)] = f"the signal '{ref}'"
