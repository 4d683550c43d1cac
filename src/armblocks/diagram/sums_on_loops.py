"""Sums in linear algebraic loops become the unknowns that the solver computes.

A loop can be cut at any signal. The other signals are computed from the cut signal, and a sum among them may
lose all significant digits: in a follower with the gain 1e9, the error ``r - y`` is 1e-9 of r. Products keep
the relative accuracy of their factors. With all sums as unknowns, the accuracy of every signal is limited
only by its own condition number.
"""

from __future__ import annotations

import casadi
from casadi import SX, Function, substitute, which_depends

from armblocks.diagram.block_equations import Group
from armblocks.diagram.components import strongly_connected
from armblocks.diagram.features import SlotKind
from armblocks.diagram.ordering import HELD, Evaluation, Network, Node

MAX_UNKNOWNS = 16
"""Maximum number of sums per strongly connected component; beyond it, only the necessary cuts are made,
because the work grows with the cube of the number of unknowns."""
_SUMS = {casadi.OP_ADD, casadi.OP_SUB}


def sums_on_loops(network: Network, evaluation: Evaluation) -> dict[Node, tuple[str, ...]]:
    """The nodes that compute sums in linear algebraic loops, each with the signals of one of its loops."""
    if not evaluation.loops:
        return {}
    index_of = {node: index for index, node in enumerate(evaluation.order)}
    needs = [[index_of[other] for other, _ in network.needs(node)] for node in evaluation.order]
    loop_of: dict[Node, tuple[str, ...]] = {}
    for component in strongly_connected(needs):
        if len(component) == 1 and component[0] not in needs[component[0]]:
            continue
        nodes = {evaluation.order[index] for index in component}
        if not all(_is_linear(network, node, nodes) for node in nodes):
            continue
        loops = [loop for node, loop in evaluation.loops.items() if node in nodes]
        cuts = [node for node in evaluation.loops if node in nodes]
        sums = [node for node in (evaluation.order[index] for index in component) if _is_sum(network, node)]
        if _unknowns(network, sums) > max(MAX_UNKNOWNS, _unknowns(network, cuts)):
            continue
        for node in sums:
            through = [loop for loop in loops if any(path.rpartition("/")[0] == node.block for path in loop)]
            loop_of[node] = (through or loops)[0]
    return loop_of


def _group(network: Network, node: Node) -> Group:
    return network.equations[node.block].groups[node.group]


def _unknowns(network: Network, nodes: list[Node]) -> int:
    """The number of scalars in the outputs of nodes."""
    return sum(
        slot.size for node in nodes for slot in _group(network, node).slots if slot.kind is SlotKind.OUTPUT
    )


def _is_linear(network: Network, node: Node, component: set[Node]) -> bool:
    """Whether a node is an explicit value that is linear in the outputs of its component."""
    if node.group == HELD or node.order or network.diagram.blocks[node.block].implicit_outputs:
        return False
    if network.diagram.clocked(node.block):
        return False
    group = _group(network, node)
    inner = [network.input(node.block, port).node in component for port in group.inputs]
    return not any(inner) or not any(which_depends(group.expression, group.z, 2))


def _is_sum(network: Network, node: Node) -> bool:
    """Whether a node adds terms of several sources, or reduces the elements of one source.

    The product of a square matrix with one vector is not counted as a sum. Its relative rounding errors are
    comparable to the errors of the matrix entries, and its rows would double the number of unknowns of a loop
    of vectors.
    """
    group = _group(network, node)
    function = Function("f", [group.t, group.p, group.z], [group.expression])
    if not any(function.instruction_id(k) in _SUMS for k in range(function.n_instructions())):
        return False
    if len(group.inputs) > 1 or group.states or group.discrete:
        return True
    rest = substitute(group.expression, group.z, SX.zeros(group.z.numel()))
    return group.expression.numel() < group.z.numel() or not rest.is_zero()
