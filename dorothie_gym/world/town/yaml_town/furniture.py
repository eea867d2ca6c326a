"""Crosswalks at crossings and pavements beside streets."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from dorothie_gym.world.town.model import Array, Crosswalk, Sidewalk
from dorothie_gym.world.town.yaml_town.approaches import Approach
from dorothie_gym.world.town.yaml_town.layout import Layout
from dorothie_gym.world.town.yaml_town.stretches import Crossing

CROSSWALK_SPAN = (0.5, 3.5)
"""A crosswalk lies between these distances beyond the ends of the lanes, towards the junction [m]."""
CROSSWALK_ASIDE = 0.5
"""A crosswalk reaches this far beyond the edges of the road [m]."""


def crosswalks(layout: Layout, approaches: Callable[[Crossing], Sequence[Approach]]) -> tuple[Crosswalk, ...]:
    """One for each arm of the street at the junction, across all of its lanes and its median."""
    found: list[Crosswalk] = []
    for name, street in layout.plan.crosswalks:
        for crossing in layout.crossings_of(name):
            for approach in approaches(crossing):
                if approach.arm.street is street:
                    found.append(Crosswalk(id=len(found), outline=_outline(approach)))
    return tuple(found)


def _outline(approach: Approach) -> Array:
    """Corners (4, 2) of the crosswalk across an arm [m], clockwise from the left one next to the lanes."""
    outgoing, incoming = approach.outgoing, approach.through
    # Any lane will do to measure from: seen outwards, each ends as far from the centre as the others.
    lane = outgoing[0] if outgoing else incoming[0]
    x, y = lane.points[0 if outgoing else -1, :2]
    heading = float(lane.headings[0]) if outgoing else float(lane.headings[-1]) + math.pi
    arm = approach.arm
    offset = arm.outgoing[0].offset if outgoing else arm.incoming[0].offset
    left, right = -arm.left - offset - CROSSWALK_ASIDE, arm.right - offset + CROSSWALK_ASIDE
    pavement = arm.street.sidewalk
    outward, sideways = (
        np.array((math.cos(heading), math.sin(heading))),
        np.array((-math.sin(heading), math.cos(heading))),
    )
    near, far = CROSSWALK_SPAN
    corners = ((near, left + pavement), (near, right - pavement), (far, right - pavement), (far, left + pavement))
    return np.array([np.array((x, y)) - ahead * outward + aside * sideways for ahead, aside in corners])


def sidewalks(layout: Layout) -> tuple[Sidewalk, ...]:
    """Pavements beside every stretch whose street has them: right of its course, then left of it.

    A ring has one on its outer side only, which is the right one; nobody walks on its island.
    """
    found: list[Sidewalk] = []
    for stretch, course in zip(layout.stretches, layout.courses, strict=True):
        street, width = stretch.street, stretch.street.sidewalk
        if width > 0.0:
            right, left = stretch.section.right + width / 2.0, -stretch.section.left - width / 2.0
            for offset in (right, left) if stretch.arc is None else (right,):
                points = course.beside(offset)
                found.append(Sidewalk(id=len(found), points=points, width=width, street=layout.numbers[street.id]))
    return tuple(found)
