"""The sums on loops that are linear: the signals of such a loop that are solved for.

A loop can be cut at any of its signals. The others follow from the cut, and a sum among them may lose all of
its digits: in a follower with the gain 1e9 the error ``r - y`` is 1e-9 of r. Products keep the relative
accuracy of their factors. Solved for all sums, every signal of the loop is as accurate as its own condition
allows.
"""

from __future__ import annotations

import casadi
from casadi import SX, Function, substitute, which_depends

from armblocks.diagram.block_equations import Group, SlotKind
from armblocks.diagram.components import strongly_connected
from armblocks.diagram.ordering import HELD, Evaluation, Network, Node

MOST_UNKNOWNS = 16
"""Of one tangle of loops: beyond, only as many as cuts are needed, because the work grows with their cube."""
_SUMS = {casadi.OP_ADD, casadi.OP_SUB}


def sums_on_loops(network: Network, evaluation: Evaluation) -> dict[Node, tuple[str, ...]]:
    """The nodes that add, on loops whose equations are linear in what is fed back; each with such a loop."""
    if not evaluation.loops:
        return {}
    place_of = {node: place for place, node in enumerate(evaluation.order)}
    needs = [[place_of[other] for other, _ in network.needs(node)] for node in evaluation.order]
    found: dict[Node, tuple[str, ...]] = {}
    for places in strongly_connected(needs):
        if len(places) == 1 and places[0] not in needs[places[0]]:
            continue
        tangle = {evaluation.order[place] for place in places}
        if not all(_is_linear(network, node, tangle) for node in tangle):
            continue
        loops = [loop for node, loop in evaluation.loops.items() if node in tangle]
        cuts = [node for node in evaluation.loops if node in tangle]
        sums = [node for node in (evaluation.order[place] for place in places) if _adds(network, node)]
        if _unknowns(network, sums) > max(MOST_UNKNOWNS, _unknowns(network, cuts)):
            continue
        for node in sums:
            through = [loop for loop in loops if any(path.rpartition("/")[0] == node.block for path in loop)]
            found[node] = (through or loops)[0]
    return found


def _group(network: Network, node: Node) -> Group:
    return network.equations[node.block].groups[node.group]


def _unknowns(network: Network, nodes: list[Node]) -> int:
    """How many numbers the outputs of nodes are."""
    return sum(
        slot.size for node in nodes for slot in _group(network, node).slots if slot.kind is SlotKind.OUTPUT
    )


def _is_linear(network: Network, node: Node, tangle: set[Node]) -> bool:
    """Whether a node is a value, neither held nor implicit, and linear in what comes out of the tangle."""
    if node.group == HELD or node.order or network.diagram.blocks[node.block].implicit_outputs:
        return False
    if network.diagram.clocked(node.block):
        return False
    group = _group(network, node)
    inner = [network.input(node.block, port).node in tangle for port in group.inputs]
    return not any(inner) or not any(which_depends(group.expression, group.z, 2))


def _adds(network: Network, node: Node) -> bool:
    """Whether terms of several sources are added in a node, or the elements of one to fewer.

    The rows of a square matrix's product with one vector count as products: their rounding is that of the
    matrix's own entries, and as unknowns they would double the size of loops of vectors.
    """
    group = _group(network, node)
    function = Function("f", [group.t, group.p, group.z], [group.expression])
    if not any(function.instruction_id(k) in _SUMS for k in range(function.n_instructions())):
        return False
    if len(group.inputs) > 1 or group.states or group.discrete:
        return True
    rest = substitute(group.expression, group.z, SX.zeros(group.z.numel()))
    return group.expression.numel() < group.z.numel() or not rest.is_zero()
