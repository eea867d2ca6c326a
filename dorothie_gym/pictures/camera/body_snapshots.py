"""Bodies of a world at a moment, and between two moments."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from dorothie_gym.sim.state.records import PedestrianRecord, PropRecord, VehicleRecord
from dorothie_gym.support import portable_arrays as pn
from dorothie_gym.support.compilation.records import Record, RecordArray, empty_records, plain
from dorothie_gym.support.portable_math import wrap_radians

if TYPE_CHECKING:
    from dorothie_gym.pictures.camera.body_placing import Bodies

_CONTINUOUS = ("x", "y", "height", "speed", "acceleration", "odometer")


class BodySnapshot(NamedTuple):
    """Bodies of a world."""

    vehicles: RecordArray[VehicleRecord]
    pedestrians: RecordArray[PedestrianRecord]
    props: RecordArray[PropRecord]


def snapshot_of(bodies: Bodies) -> BodySnapshot:
    """Returns a copy of the bodies of a world."""
    return BodySnapshot(
        _copy(VehicleRecord, bodies.vehicles),
        _copy(PedestrianRecord, bodies.pedestrians),
        _copy(PropRecord, bodies.props),
    )


def bodies_between(before: BodySnapshot, after: BodySnapshot, share: float) -> BodySnapshot:
    """Returns the bodies at a share of the time between two snapshots of one world, moved along straight lines.

    Bodies that have appeared in between, whose row had another key or none before, stay where they appeared.
    """
    return BodySnapshot(
        _between(VehicleRecord, before.vehicles, after.vehicles, share),
        _between(PedestrianRecord, before.pedestrians, after.pedestrians, share),
        _between(PropRecord, before.props, after.props, share),
    )


def _copy(kind: type[Record], records: RecordArray[Record]) -> RecordArray[Record]:
    copied = empty_records(kind, len(records))
    plain(copied)[:] = plain(records)
    return copied


def _between(
    kind: type[Record], before: RecordArray[Record], after: RecordArray[Record], share: float
) -> RecordArray[Record]:
    found = _copy(kind, after)
    first, last = plain(before), plain(found)[: len(before)]
    same = np.flatnonzero(first["key"] == last["key"])
    names = last.dtype.names or ()
    moved = last[same]
    for name in (*_CONTINUOUS, "heading"):
        if name in names:
            change = moved[name] - first[name][same]
            if name == "heading":
                change = wrap_radians(change)
            moved[name] = first[name][same] + share * change
    moved["cos"], moved["sin"] = pn.cos(moved["heading"]), pn.sin(moved["heading"])
    last[same] = moved
    return found
