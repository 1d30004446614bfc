"""A way round what the arm must keep away from, by poses between which the joints go straight."""

from itertools import pairwise, product

import numpy as np

from boom_model import Boom, InfeasibleError
from boom_model.arrays import Array
from planner.paths.clearance import clearance, least_clearance, sentence
from planner.paths.path import JointLine

_RANDOM_POSES = 150
_SEED = 0
_MOST_CHECKS = 400


def detour(boom: Boom, start: Array, goal: Array) -> list[Array]:
    """The poses (5,) from start to goal, both included, between which straight joint moves keep clear of every shape.

    The straight move itself where it is clear. Else the shortest way, by the time that the joints' top speeds need, over the
    poses that take some joints' values from the start and the others' from the goal (one joint after the other), and over
    random poses of a fixed seed (a lazy probabilistic roadmap: Bohlin and Kavraki, ICRA 2000). Every pose between limits is
    allowed: the position limits, the coupled one included, are convex, so that no straight move between such poses breaks them.

    Raises:
        InfeasibleError: no way was found; says what the straight move runs into, and where.
    """
    keep = boom.keep_out
    if keep is None:
        return [start, goal]
    straight = least_clearance(boom, JointLine(start, goal))
    if straight.distance >= keep.clearance:
        return [start, goal]
    from scipy.sparse.csgraph import shortest_path

    nodes = np.stack([start, goal, *_between(boom, start, goal, keep.clearance)])
    cost = (np.abs(nodes[:, None] - nodes[None]) / boom.limits.velocity).max(axis=-1)
    for _ in range(_MOST_CHECKS):
        lengths, before = shortest_path(cost, indices=0, return_predecessors=True)
        if not np.isfinite(lengths[1]):
            break
        way = [1]
        while way[0] != 0:
            way.insert(0, int(before[way[0]]))
        for a, b in pairwise(way):
            if least_clearance(boom, JointLine(nodes[a], nodes[b])).distance < keep.clearance:
                cost[a, b] = cost[b, a] = 0.0  # what the graph takes for no edge
                break
        else:
            return [nodes[i] for i in way]
    raise InfeasibleError(
        f"no way round was found: on the straight joint move, at {straight.s:.1%}, {sentence(boom, straight)}"
    )


def _between(boom: Boom, start: Array, goal: Array, room: float) -> list[Array]:
    """Poses within the limits that keep clear: of some joints at the start and the others at the goal, and random ones."""
    rng = np.random.default_rng(_SEED)
    limits = boom.limits
    mixed = [np.where(mask, goal, start) for mask in product((False, True), repeat=5)][1:-1]
    random = rng.uniform(limits.lower, limits.upper, (_RANDOM_POSES, 5))
    poses = np.unique(np.concatenate([np.array(mixed), random]), axis=0)
    poses = poses[limits.contain(poses)]
    return [q for q in poses if clearance(boom, q).distance >= room]
