"""Turn types of the links into a junction's connectors: OpenDRIVE has no names for them, geometry tells."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace

import numpy as np

from dorothie_gym.world.town.model import Lane, LaneLink, LinkType, wrap_degrees
from dorothie_gym.world.town.opendrive.topology import Topology

# Changes of heading that separate the types of turn [degrees].
STRAIGHT_BELOW, U_TURN_ABOVE = 35.0, 150.0


def turn_type(angle: float) -> LinkType:
    """Type of a turn by its angle [degrees], positive left."""
    if abs(angle) > U_TURN_ABOVE:
        return LinkType.U_TURN
    if abs(angle) < STRAIGHT_BELOW:
        return LinkType.STRAIGHT
    return LinkType.LEFT if angle > 0 else LinkType.RIGHT


def successor_links(lanes: tuple[Lane, ...], topology: Topology) -> tuple[LaneLink, ...]:
    """Links by which lanes go on at their ends, with their types; a turn is typed where it enters the junction.

    Where a road forks so that several ways are nearly straight, only the straightest is called so, and the others are
    called by the side that they turn to from it.
    """
    after: defaultdict[int, list[int]] = defaultdict(list)
    for source, target in topology.links:
        after[source].append(target)
    turns = {
        k: _turn(lanes, after, target)
        for k, (source, target) in enumerate(topology.links)
        if lanes[target].in_junction and not lanes[source].in_junction
    }
    links = [
        LaneLink(source, target, turn_type(turns[k][0]) if k in turns else LinkType.STRAIGHT)
        for k, (source, target) in enumerate(topology.links)
    ]
    straight: defaultdict[int, list[int]] = defaultdict(list)
    for k in turns:
        if links[k].type is LinkType.STRAIGHT:
            straight[links[k].source].append(k)
    for fork in straight.values():
        best = min(fork, key=lambda k: abs(sum(turns[k])))
        for k in fork:
            if k != best:
                side = LinkType.LEFT if sum(turns[k]) > sum(turns[best]) else LinkType.RIGHT
                links[k] = replace(links[k], type=side)
    return tuple(links)


def _turn(lanes: tuple[Lane, ...], after: dict[int, list[int]], connector: int) -> tuple[float, float]:
    """Change of heading across a junction, and that from its entry to the way to its exit [degrees], positive left.

    The second one tells ways apart that lead into lanes side by side. A connector may go on in another one.
    """
    turned, last, seen = 0.0, connector, {connector}
    while True:
        turned += float(np.degrees(lanes[last].headings[0] - lanes[last].headings[-1]))
        onward = after.get(last, [])
        if len(onward) != 1 or not lanes[onward[0]].in_junction or onward[0] in seen:
            break
        last = onward[0]
        seen.add(last)
    x, y = lanes[last].points[-1, :2] - lanes[connector].points[0, :2]
    aside = float(np.degrees(lanes[connector].headings[0] - np.arctan2(y, x)))
    return turned if abs(turned) < 180.0 else wrap_degrees(turned), wrap_degrees(aside)
