"""The worked examples of the blocks, each built once for all tests of a process that ask for it."""

from __future__ import annotations

from functools import cache

import armblocks as ab
from armblocks.diagram import Block, Diagram


@cache
def worked_example(kind: type[Block]) -> Diagram:
    """The worked example of a block: its equations and native code are kept with it."""
    return ab.block_example(kind)
