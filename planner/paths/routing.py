"""Detours around the shapes to keep away from, made of straight joint moves."""

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
    """Return poses (5,) from start to goal, with straight joint moves between them that are clear.

    Start and goal are included. If the straight move between them is clear, there are no others.
    Else a lazy probabilistic roadmap (Bohlin and Kavraki, ICRA 2000) gives the shortest route, by
    the time that the joints need at top speed. Its nodes are the poses that take some joints from
    the start and the others from the goal (one joint moves after the other), and random poses from
    a fixed seed. The position limits, the coupled one included, are convex, so every straight move
    between poses within the limits stays within them.

    Raises:
        InfeasibleError: no route was found; the message says where the straight move comes too near
            to which shape.
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
                cost[a, b] = cost[b, a] = 0.0  # SciPy's graph takes 0 for "no edge"
                break
        else:
            return [nodes[i] for i in way]
    raise InfeasibleError(f"no detour was found; at {straight.s:.1%} of the straight joint move {sentence(boom, straight)}")


def _between(boom: Boom, start: Array, goal: Array, room: float) -> list[Array]:
    """Return clear poses within the limits: mixtures of start and goal, and random poses."""
    rng = np.random.default_rng(_SEED)
    limits = boom.limits
    mixed = [np.where(mask, goal, start) for mask in product((False, True), repeat=5)][1:-1]
    random = rng.uniform(limits.lower, limits.upper, (_RANDOM_POSES, 5))
    poses = np.unique(np.concatenate([np.array(mixed), random]), axis=0)
    poses = poses[limits.contain(poses)]
    return [q for q in poses if clearance(boom, q).distance >= room]
