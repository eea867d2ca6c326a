"""Checks of towns for faults that affect driving, in shipped towns and imported maps alike.

Entry point: `check_town`. Each module checks one family of faults; its limits are constants of the module.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from dorothie_gym.maps.lint.centre_lines import centre_line_faults, continuity_faults
from dorothie_gym.maps.lint.clearance import clearance_faults
from dorothie_gym.maps.lint.connectivity import connectivity_faults
from dorothie_gym.maps.lint.fault import Fault, FaultKind
from dorothie_gym.maps.lint.kerbs import kerb_faults
from dorothie_gym.maps.lint.samples import sample_lanes
from dorothie_gym.maps.lint.turn_types import turn_type_faults

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

__all__ = ["Fault", "FaultKind", "check_town"]


def check_town(town: Town) -> tuple[Fault, ...]:
    """Runs all checks.

    Returns:
        The faults, sorted by kind, then by lanes; empty for a sound town.
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
