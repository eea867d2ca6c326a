"""Bends that are tighter than the distance between samples: centre lines keep within a centimetre, also read back."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import write_opendrive
from dorothie_gym.maps.opendrive import import_opendrive
from tests.maps.equal_towns import CENTIMETRE, farthest, same_lines
from tests.maps.opendrive_text import geometry, lane, opendrive, road, section

ANGLE = 1.7  # of the bends [rad]


def bent(radius: float, width: float) -> str:
    """Returns a road whose lane is outside of its reference line, which turns to the left between two straights."""
    along = radius * ANGLE
    x, y = 30.0 + radius * math.sin(ANGLE), radius * (1.0 - math.cos(ANGLE))
    plan = (
        geometry("<line/>", 30.0)
        + geometry(f'<arc curvature="{1.0 / radius}"/>', along, s=30.0, x=30.0)
        + geometry("<line/>", 30.0, s=30.0 + along, x=x, y=y, hdg=ANGLE)
    )
    lanes = section(0.0, lane(-1, width=f'a="{width}" b="0" c="0" d="0"'))
    return opendrive(road(length=60.0 + along, plan=plan, sections=lanes))


@pytest.mark.parametrize(("radius", "width"), [(0.4, 0.2), (0.7, 1.0), (1.1, 3.0), (1.6, 6.5)])
def test_lanes_keep_to_the_arcs_of_tight_bends(radius: float, width: float, tmp_path: Path) -> None:
    (tmp_path / "bend.xodr").write_text(bent(radius, width), encoding="utf-8")
    town, _ = import_opendrive(tmp_path / "bend.xodr")
    (read,) = town.lanes
    angles = np.linspace(0.0, ANGLE, 200)
    outer = radius + 0.5 * width
    arc = np.column_stack((30.0 + outer * np.sin(angles), outer * np.cos(angles) - radius, np.zeros(200)))
    assert farthest(arc, read.points) < CENTIMETRE

    write_opendrive(town, tmp_path / "again.xodr")
    again, _ = import_opendrive(tmp_path / "again.xodr")
    assert same_lines([read.points], [again.lanes[0].points]) == [0]
