"""Input features of the Junction Reader: exits of junctions, named slot values, and the most recent events."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from dorothie_gym.baselines.encoders.byte_pairs import words
from dorothie_gym.maps.lane_graph import EDGE_TYPES, FEATURES, LENGTH, EdgeType
from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove

if TYPE_CHECKING:
    from dorothie_gym.baselines.point_tensors import Inputs
    from dorothie_gym.evaluation.teacher_forced.features.columns import TownGraph

_PARTS: Final = re.compile(r"[A-Z]+(?![a-z])|[A-Z][a-z]*|[a-z]+")


_WAYS: Final = ({"left"}, {"right"}, {"straight", "ahead", "across", "forward"})


def label_words(label: str) -> tuple[str, ...]:
    """Returns the words of a label in lower case: "BurgerKing" is "burger", "king"."""
    return tuple(part.lower() for part in _PARTS.findall(label))


def mentions(texts: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which slot values each text names (n, 69): it contains all words of the label in sequence."""
    table = np.zeros((len(texts), len(LABELS)), dtype=bool)
    for row, text in zip(table, texts, strict=True):
        row[list(_named(text))] = True
    return table


def ways(texts: Sequence[str]) -> NDArray[np.bool_]:
    """Returns which directions each text names (n, 3): left, right, straight on."""
    table = np.zeros((len(texts), len(_WAYS)), dtype=bool)
    for row, text in zip(table, texts, strict=True):
        row[:] = _named_ways(text)
    return table


@lru_cache(maxsize=16384)
def _named_ways(text: str) -> tuple[bool, ...]:
    said = set(words(text))
    return tuple(bool(said & names) for names in _WAYS)


@lru_cache(maxsize=16384)
def _named(text: str) -> tuple[int, ...]:
    said = f" {' '.join(words(text))} "
    return tuple(k for k, spellings in enumerate(_spellings()) if any(f" {name} " in said for name in spellings))


@cache
def _spellings() -> tuple[tuple[str, str], ...]:
    names = (" ".join(label_words(value.label)) for value in LABELS)
    return tuple((name, name.replace(" ", "")) for name in names)


# --- Recent moves and motion ------------------------------------------------------------------------------------------

RECENT_MOVES: Final = 3
"""Number of last moves with features of their own."""

DECAYS: Final = (1.0, 4.0, 15.0)
"""Time constants of the exponential decays that encode an age [s]."""

_WHO_AND_WHAT: Final = 2 * len(DialogueMove)

RECENT_SIZE: Final = RECENT_MOVES * _WHO_AND_WHAT + len(LABELS) + len(PhysicalAction) + 3 * len(DECAYS)
"""Numbers that `recent` gives."""


def recent(inputs: Inputs) -> Tensor:
    """Returns features of the most recent events before B points (B, RECENT_SIZE), in 0..1; zeros for missing events.

    The last moves with their speakers; the slots of the last; the last physical action; decays of the age of the last
    move of each speaker and of the last action.
    """
    mask, actions = inputs["move_mask"], inputs["action_mask"]
    moves = inputs["move"] * 2 + inputs["move_speaker"]
    parts = [_last_kind(moves, mask, back, _WHO_AND_WHAT) for back in range(1, RECENT_MOVES + 1)]
    newest = (mask.sum(1) - 1).clamp(min=0)[:, None, None].expand(-1, 1, len(LABELS))
    parts.append(inputs["move_slots"].gather(1, newest)[:, 0].float() * mask.any(1, keepdim=True))
    parts.append(_last_kind(inputs["action"], actions, 1, len(PhysicalAction)))
    for speaker in range(2):
        own = mask & (inputs["move_speaker"] == speaker)
        parts.append(_freshness(inputs["time"], inputs["move_time"], own))
    parts.append(_freshness(inputs["time"], inputs["action_time"], actions))
    return torch.cat(parts, dim=-1)


def _last_kind(kinds: Tensor, mask: Tensor, back: int, count: int) -> Tensor:
    """Returns the kind of an element counted from a sequence's end, one-hot (B, count); zeros for none."""
    place = mask.sum(1, keepdim=True) - back
    kind = kinds.gather(1, place.clamp(min=0))[:, 0].clamp(0, count - 1)
    return F.one_hot(kind, count).float() * (place >= 0)


def _freshness(now: Tensor, times: Tensor, mask: Tensor) -> Tensor:
    """Returns exponential decays of the age of a sequence's newest element (B, 3), 1 for now; zeros for none."""
    age = (now[:, None] - times).clamp(min=0.0).masked_fill(~mask, torch.inf).amin(1)
    return torch.stack([torch.exp(-age / decay) for decay in DECAYS], dim=-1)


# --- Exits of the next junction, from the lane graph of a town --------------------------------------------------------

EXITS: Final = 5
"""Maximum number of exits; a crossing has three."""

_HOPS: Final = 24
_START_YAW, _END_YAW = FEATURES.index("start_yaw"), FEATURES.index("end_yaw")

LANE_END: Final = slice(FEATURES.index("end_x"), FEATURES.index("end_y") + 1)
"""Columns of the place where a lane ends."""


@dataclass(frozen=True, eq=False)
class ExitTable:
    """Exits at the next junction with a choice, for each lane of a town (L,).

    Attributes:
        angle: (L, X) angle of the turn to each exit [degrees, positive left].
        lane: (L, X) lane of the car after the junction, -1 for none.
        place: (L, X, 2) end of that lane [m].
        there: (L, X) whether the exit exists.
        distance: (L,) from the end of the lane to the junction along the lanes between [m].
    """

    angle: NDArray[np.float32]
    lane: NDArray[np.int64]
    place: NDArray[np.float32]
    there: NDArray[np.bool_]
    distance: NDArray[np.float32]


def exit_table(graph: TownGraph) -> ExitTable:
    """Returns the exits from every lane: follows single successors until there are several."""
    count = len(graph.lanes)
    successors = _successors(graph)
    angle, lane = np.zeros((count, EXITS), np.float32), np.full((count, EXITS), -1)
    distance = np.zeros(count, np.float32)
    for row in range(count):
        ways, distance[row] = _ways(graph, successors, row)
        ways = sorted(ways)[:EXITS]
        for column, (turn, target) in enumerate(ways):
            angle[row, column], lane[row, column] = turn, target
    place = graph.lanes[np.maximum(lane, 0)][..., LANE_END] if count else np.zeros((0, EXITS, 2))
    return ExitTable(angle, lane, place.astype(np.float32), lane >= 0, distance)


def _successors(graph: TownGraph) -> list[list[int]]:
    found: list[list[int]] = [[] for _ in graph.lanes]
    onward = graph.edge_types == EDGE_TYPES.index(EdgeType.CONCAT)
    for source, target in graph.edges.T[onward].tolist():
        found[source].append(target)
    return found


def _ways(graph: TownGraph, successors: list[list[int]], lane: int) -> tuple[list[tuple[float, int]], float]:
    """Returns turns and lanes at the next choice from a lane, and its distance from the end of the lane [m]."""
    gone = 0.0
    for _ in range(_HOPS):
        following = successors[lane]
        if len(following) > 1:
            return [_turn(graph, successors, lane, way) for way in following], gone
        if not following:
            return [], gone
        lane = following[0]
        gone += float(graph.lanes[lane, LENGTH])
    return [], gone


def _turn(graph: TownGraph, successors: list[list[int]], lane: int, way: int) -> tuple[float, int]:
    """Returns the change of yaw from a lane's end to the exit of the junction, and the lane after it."""
    for _ in range(_HOPS):
        if graph.junction[way] == 0 or len(successors[way]) != 1:
            break
        way = successors[way][0]
    turned = float(graph.lanes[lane, _END_YAW] - graph.lanes[way, _START_YAW])  # yaw is clockwise, angles are not
    return (turned + 180.0) % 360.0 - 180.0, way
