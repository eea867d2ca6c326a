"""OpenDRIVE maps with lanes that end: tapers beside a ring road, dead ends, and one-way roads that leave the map."""

from __future__ import annotations

import math
from pathlib import Path

from tests.maps.opendrive_text import geometry, lane, linked, opendrive, road, section

RADIUS = 90.0
HALF = math.pi * RADIUS
"""Length of the reference line of each half of the ring [m]."""


def taper(number: int, length: float = HALF) -> str:
    """A lane of 3.5 m that tapers away in the last 60 m and has no successor."""
    return (
        f'<lane id="{number}" type="driving" level="false"><link></link>'
        '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
        f'<width sOffset="{length - 60:.3f}" a="3.5" b="{-3.5 / 55:.6f}" c="0" d="0"/>'
        f'<width sOffset="{length - 5:.3f}" a="0" b="0" c="0" d="0"/></lane>'
    )


def plain(number: int) -> str:
    return lane(number, width='a="3.5" b="0" c="0" d="0"', more=linked(number, number))


def ring(path: Path, *more: str, right: str | None = None) -> Path:
    """A two-way ring of two halves; beside the lanes to the right, in each half, a lane that tapers away."""
    halves = []
    for number, other, y, heading in ((1, 2, 0.0, 0.0), (2, 1, 2 * RADIUS, math.pi)):
        link = (
            f'<predecessor elementType="road" elementId="{other}" contactPoint="end"/>'
            f'<successor elementType="road" elementId="{other}" contactPoint="start"/>'
        )
        plan = geometry(f'<arc curvature="{1 / RADIUS}"/>', HALF, y=y, hdg=heading)
        lanes = section(0.0, plain(1), plain(-1), taper(-2) if right is None else right)
        halves.append(road(number, length=HALF, plan=plan, sections=lanes, link=link))
    path.write_text(opendrive(*halves, *more))
    return path


def dead_end(path: Path) -> Path:
    """A straight road with two lanes in each direction, both of which end at either end."""
    lanes = section(0.0, *(lane(number) for number in (2, 1, -1, -2)))
    path.write_text(opendrive(road(1, length=200.0, sections=lanes)))
    return path


def stub(path: Path) -> Path:
    """The ring, and a one-way road elsewhere that leads off the map."""
    plan = geometry("<line/>", 150.0, x=400.0, y=400.0)
    return ring(path, road(7, length=150.0, plan=plan, sections=section(0.0, lane(-1))))
