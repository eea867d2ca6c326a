"""Records of a town: lanes, continuations, signals, stop lines and footways, which are never written."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.support.compilation.records import Flag, Float, Int32


class LaneRecord:
    """A lane of a town; indices are -1 if there is none."""

    length: Float  # [m]
    limit: Float  # speed limit [m/s]
    pace: Float  # factor on the desired speeds of cars: the fastest drive at the limit; 1 where traffic is slow
    curve_speed: Float  # speed in its tightest bend [m/s]
    half_width: Float  # [m]
    cos_first: Float  # directions of its two ends
    sin_first: Float
    cos_last: Float
    sin_last: Float
    left_edge: Float  # bounding box [m]
    low_edge: Float
    right_edge: Float
    high_edge: Float
    first: Int32  # first and last row of its points
    last: Int32
    rank: Int32  # position in the order of the network's lanes: breaks ties
    successor: Int32  # start and length of its lists in `neighbours`
    successors: Int32
    predecessor: Int32
    predecessors: Int32
    left: Int32  # lanes that one may change to
    right: Int32
    inner: Int32  # the same lanes, by their side: towards the middle of the road and towards the kerb
    outer: Int32
    junction: Int32  # junction that it crosses
    exit: Int32  # of a connector: the first lane beyond the junction
    place: Int32  # of a connector: its place among those of its junction
    relation: Int32  # of a connector: start of its row of `relations`
    control: Int32  # `TrafficControl`
    cycling: Flag  # whether cyclists use it: it is slow, and does not lead to fast lanes only
    programme: Int32  # light programme, and place of its light in it
    slot: Int32
    sibling: Int32  # rows of `siblings`
    siblings: Int32
    passage: Int32  # rows of `passages`
    passages: Int32


class LaneExitsRecord:
    """Ways on from a lane, and lanes beside it."""

    exit: Int32  # rows of `exits`, from right to left
    exits: Int32
    end: Float  # station up to which it is wide enough for a car [m]
    merge: Int32  # of a lane that ends: the lane beside it to change to, or -1
    onward: Int32  # lane that follows by default, or -1: the only one, or outside junctions the straightest
    chooses: Flag  # whether a turn must be chosen at its end
    offers: Flag  # whether the junction at its end offers a turn, from this lane or from one beside it
    beside: Int32  # rows of `lane_lists`: itself and the lanes that are reached from it by lane changes
    besides: Int32
    oncoming: Int32  # rows of `lane_lists`: lanes that may be oncoming somewhere along it
    oncomings: Int32


class ExitRecord:
    """An exit from the end of a lane, see `maps.model.Exit`."""

    connector: Int32
    lane: Int32
    angle: Int32  # [degrees], positive left
    junction: Int32  # junction of the connector, or -1


class CellEntryRecord:
    """A lane in the list of a cell."""

    cos: Float  # mean direction of the lane near the cell
    sin: Float
    limit: Float  # cosine below which a heading is off that direction by more than `lane_lookup.TURNED`
    along_low: Float  # box around those segments, along that direction and across it [m]
    along_high: Float
    across_low: Float
    across_high: Float
    lane: Int32
    first: Int32  # segments that can be the closest ones from within the cell
    last: Int32


class SiblingRecord:
    """A lane with the same start as another one: bodies on it before `until` [m] also obstruct the other."""

    until: Float
    lane: Int32


class PassageRecord:
    """Stretch of a lane on a crosswalk: its stations, and the distance along the crosswalk [m]."""

    start: Float
    stop: Float
    across: Float
    crossing: Int32


class ProgrammeRecord:
    """A light programme: its phases end at `phase_ends[phase : phase + phases]`; `colours` begin at `colour`."""

    offset: Float
    cycle: Float
    phase: Int32
    phases: Int32
    colour: Int32
    slots: Int32


class WalkwayRecord:
    """A footway: its points, the mouths of crosswalks along it, and the footways beyond its two ends, or -1."""

    length: Float
    first: Int32
    last: Int32
    mouth: Int32
    mouths: Int32
    half_width: Float
    next_walk: Annotated[NDArray[np.int32], "i4", (2,)]
    next_end: Annotated[NDArray[np.int32], "i4", (2,)]
    kind: Int32  # `Footway`
    lane: Int32  # of a footway beside a street: the lane, else -1


class CrossingRecord:
    """A crosswalk: its ends, the direction from the first to the second, and the pavements that it joins."""

    x: Annotated[NDArray[np.float64], "f8", (2,)]
    y: Annotated[NDArray[np.float64], "f8", (2,)]
    cos: Float
    sin: Float
    length: Float
    height: Float
    walk: Annotated[NDArray[np.int32], "i4", (2,)]
    station: Annotated[NDArray[np.float64], "f8", (2,)]
    light: Int32  # rows of `neighbours`: lanes whose lights must be red while a pedestrian crosses
    lights: Int32


class MouthRecord:
    """Place where a crosswalk leaves a pavement."""

    station: Float
    crossing: Int32
    end: Int32


class StopLineRecord:
    """End of a lane with a light or a stop sign: place [m], direction, half of the lane's width and height [m]."""

    x: Float
    y: Float
    cos: Float
    sin: Float
    half_width: Float
    height: Float
    lane: Int32
    signal: Int32  # id of the light or sign
    is_stop: Flag
