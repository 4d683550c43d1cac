"""The worked examples of the blocks, each built once per test process."""

from __future__ import annotations

from functools import cache

import armblocks as ab
from armblocks.diagram import Block, Diagram


@cache
def worked_example(kind: type[Block]) -> Diagram:
    """Return the worked example of a block, cached together with its equations and native code."""
    return ab.block_example(kind)
