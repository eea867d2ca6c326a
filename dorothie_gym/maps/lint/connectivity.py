"""Connectivity: checks for lanes without a route from or to the rest of the town."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from dorothie_gym.maps.lint.fault import Fault, FaultKind

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

_LANES_NAMED = 8  # in a message


def connectivity_faults(town: Town) -> Iterator[Fault]:
    """Yields dead ends, and lanes outside the largest strongly connected part of the town, lane changes included.

    A dead end is not also reported as a lane without a route back; lanes that only lead to dead ends are.
    """
    dead_ends = _dead_ends(town)
    for lane in dead_ends:
        x, y = town.lanes[lane].points[-1, :2]
        message = f"lane {lane} ends here: neither it nor a lane beside it has a successor"
        yield Fault(kind=FaultKind.DEAD_END, lanes=(lane,), position=(float(x), float(y)), message=message)
    onward = _matrix(town)
    reached, returns = _from_largest(onward)
    trapped = reached & ~returns
    trapped[dead_ends] = False
    for lanes in _groups(onward, trapped):
        yield _fault(town, FaultKind.NO_RETURN, lanes, "be left for the rest of the town")
    for lanes in _groups(onward, ~reached & returns):
        yield _fault(town, FaultKind.UNREACHABLE, lanes, "be reached from the rest of the town")
    for lanes in _groups(onward, ~reached & ~returns):
        yield _fault(town, FaultKind.UNREACHABLE, lanes, "be reached from the rest of the town, nor left for it")


_REMEDIES: Final = {
    FaultKind.UNREACHABLE: "add a junction or a place to turn round that leads there (both directions of a loop need "
    "one between them), or leave the lanes out",
    FaultKind.NO_RETURN: "add a junction or a place to turn round behind them, or leave the lanes out",
}


def _name(lanes: Sequence[int]) -> str:
    """Returns the names of lanes for messages: "lane 3", "lanes 3, 5, 8 and 20 more"."""
    named = ", ".join(map(str, lanes[:_LANES_NAMED]))
    more = f" and {len(lanes) - _LANES_NAMED} more" if len(lanes) > _LANES_NAMED else ""
    return f"lane{'s' if len(lanes) > 1 else ''} {named}{more}"


def _matrix(town: Town) -> csr_array:
    pairs = np.array([(link.source, link.target) for link in town.links], dtype=np.intp).reshape(-1, 2)
    count = len(town.lanes)
    return coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count)).tocsr()


def _dead_ends(town: Town) -> list[int]:
    """Returns the lanes without successors from which no lane changes lead to a lane with successors."""
    ends = [lane.id for lane in town.lanes if not town.successors(lane.id)]
    beside: dict[int, list[int]] = {}
    for link in town.links:
        if link.type.is_lane_change:
            beside.setdefault(link.source, []).append(link.target)
    dead = []
    for end in ends:
        seen, todo = {end}, [end]
        while todo:
            new = [lane for lane in beside.get(todo.pop(), []) if lane not in seen]
            seen.update(new)
            todo.extend(new)
        if not any(town.successors(lane) for lane in seen):
            dead.append(end)
    return dead


def _from_largest(onward: csr_array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Returns which lanes the largest strongly connected part reaches, and which lanes reach it."""
    _, part = connected_components(onward, directed=True, connection="strong")
    start = int(np.argmax(part == np.argmax(np.bincount(part))))
    found = []
    for graph in (onward, onward.T.tocsr()):
        mask = np.zeros(onward.shape[0], dtype=np.bool_)
        mask[breadth_first_order(graph, start, directed=True, return_predecessors=False)] = True
        found.append(mask)
    return found[0], found[1]


def _groups(onward: csr_array, members: NDArray[np.bool_]) -> Iterator[tuple[int, ...]]:
    """Yields the connected groups among `members`, in order of their smallest lane id."""
    lanes = np.flatnonzero(members)
    if len(lanes) == 0:
        return
    _, part = connected_components(onward[lanes][:, lanes], directed=True, connection="weak")
    for number in dict.fromkeys(part.tolist()):
        yield tuple(lanes[part == number].tolist())


def _fault(town: Town, kind: FaultKind, lanes: tuple[int, ...], what: str) -> Fault:
    first = town.lanes[lanes[0]]
    x, y = first.position(0.5 * first.length)
    return Fault(
        kind=kind,
        lanes=lanes,
        position=(float(x), float(y)),
        message=f"{_name(lanes)} cannot {what}; {_REMEDIES[kind]}",
    )
