"""Faults of a town that a driver would meet, in our own towns and imported maps alike.

`check_town` is the way in. Every other module knows one family of faults; its limits are constants there.
"""

from __future__ import annotations

from itertools import chain

from dorothie_gym.maps.lint.centre_lines import centre_line_faults, continuity_faults
from dorothie_gym.maps.lint.clearance import clearance_faults
from dorothie_gym.maps.lint.connectivity import connectivity_faults
from dorothie_gym.maps.lint.fault import Fault, FaultKind
from dorothie_gym.maps.lint.kerbs import kerb_faults
from dorothie_gym.maps.lint.samples import sample_lanes
from dorothie_gym.maps.lint.turn_types import turn_type_faults
from dorothie_gym.maps.town import Town

__all__ = ["Fault", "FaultKind", "check_town"]


def check_town(town: Town) -> tuple[Fault, ...]:
    """Looks for everything that a driver would stumble over.

    Returns:
        The faults in the order of their kinds, then of their lanes; none for a sound town.
    """
    if not town.lanes:
        return ()
    samples = sample_lanes(town)
    faults = chain(
        connectivity_faults(town),
        continuity_faults(town),
        centre_line_faults(town),
        kerb_faults(town, samples),
        clearance_faults(town, samples),
        turn_type_faults(town),
    )
    rank = {kind: k for k, kind in enumerate(FaultKind)}
    return tuple(sorted(faults, key=lambda fault: (rank[fault.kind], fault.lanes, fault.position)))
