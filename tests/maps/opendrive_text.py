"""Small OpenDRIVE files, written by hand for the tests."""

from __future__ import annotations

from pathlib import Path

import pytest

MAPS = Path(__file__).parents[2] / "../shared/maps"


def shared_map(name: str) -> Path:
    """A real CARLA map; the test is skipped where the maps are not beside the repository."""
    path = MAPS / f"{name}.xodr"
    if not path.exists():
        pytest.skip(f"{name}.xodr is not in ../shared/maps")
    return path


def lane(number: int, *, kind: str = "driving", width: str = 'a="4" b="0" c="0" d="0"', more: str = "") -> str:
    return f'<lane id="{number}" type="{kind}" level="false">{more}<width sOffset="0" {width}/></lane>'


def linked(before: int | None = None, after: int | None = None) -> str:
    rows = (f'<predecessor id="{before}"/>' if before else "") + (f'<successor id="{after}"/>' if after else "")
    return f"<link>{rows}</link>"


def section(s: float, *lanes: str) -> str:
    left = "".join(row for row in lanes if 'id="-' not in row)
    right = "".join(row for row in lanes if 'id="-' in row)
    return (
        f'<laneSection s="{s}">'
        + (f"<left>{left}</left>" if left else "")
        + '<center><lane id="0" type="none" level="false"/></center>'
        + (f"<right>{right}</right>" if right else "")
        + "</laneSection>"
    )


def geometry(shape: str, length: float, *, s: float = 0.0, x: float = 0.0, y: float = 0.0, hdg: float = 0.0) -> str:
    return f'<geometry s="{s}" x="{x}" y="{y}" hdg="{hdg}" length="{length}">{shape}</geometry>'


def road(
    number: int = 1,
    *,
    length: float = 100.0,
    plan: str | None = None,
    sections: str | None = None,
    junction: int = -1,
    link: str = "",
    profile: str = "",
    offset: str = "",
    more: str = "",
    rule: str = "",
) -> str:
    return (
        f'<road name="" length="{length}" id="{number}" junction="{junction}" {rule}><link>{link}</link>'
        + f"<planView>{plan or geometry('<line/>', length)}</planView>"
        + f"<elevationProfile>{profile}</elevationProfile>"
        + f"<lanes>{offset}{sections or section(0.0, lane(-1))}</lanes>{more}</road>"
    )


def opendrive(*elements: str) -> str:
    return f'<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/>{"".join(elements)}</OpenDRIVE>'
