import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import LinkType, NoteAction, NoteKind, Town
from dorothie_gym.maps.import_notes import ImportNote
from dorothie_gym.maps.lint import check_town
from dorothie_gym.maps.lint.fault import FaultKind
from dorothie_gym.maps.opendrive import import_opendrive
from dorothie_gym.maps.opendrive.car_paths import Pose, shortest_legs

from .opendrive_text import geometry, lane, linked, opendrive, road, section

LANE = section(0.0, lane(-1, more=linked(before=-1, after=-1)))


def _end(pose: Pose, legs: list[tuple[int, float]], radius: float) -> Pose:
    x, y, heading = pose
    for kind, length in legs:
        if kind == 0:
            x, y = x + length * math.cos(heading), y + length * math.sin(heading)
            continue
        centre = x - kind * radius * math.sin(heading), y + kind * radius * math.cos(heading)
        heading += kind * length / radius
        x, y = centre[0] + kind * radius * math.sin(heading), centre[1] - kind * radius * math.cos(heading)
    return Pose(x, y, heading)


@pytest.mark.parametrize("seed", range(50))
def test_the_shortest_path_ends_where_it_must(seed: int) -> None:
    random = np.random.default_rng(seed)
    begin, end = (Pose(*random.uniform(-15.0, 15.0, 2).tolist(), float(random.uniform(-4.0, 4.0))) for _ in range(2))
    legs = shortest_legs(begin, end, 4.0)
    found = _end(begin, legs, 4.0)
    assert found[:2] == pytest.approx(end[:2], abs=1e-9)
    assert math.remainder(found.heading - end.heading, math.tau) == pytest.approx(0.0, abs=1e-9)
    length = sum(length for _, length in legs)
    assert length >= math.dist(begin[:2], end[:2]) - 1e-9
    back = shortest_legs(Pose(*end[:2], end.heading + math.pi), Pose(*begin[:2], begin.heading + math.pi), 4.0)
    assert sum(length for _, length in back) == pytest.approx(length)


@pytest.mark.parametrize(
    ("end", "length"),
    [
        (Pose(30.0, 0.0, 0.0), 30.0),
        (Pose(4.0, 4.0, 0.5 * math.pi), 2.0 * math.pi),
        (Pose(0.0, 8.0, math.pi), 4.0 * math.pi),
        (Pose(0.0, 18.0, math.pi), 4.0 * math.pi + 10.0),
    ],
)
def test_simple_paths_have_their_lengths(end: Pose, length: float) -> None:
    found = shortest_legs(Pose(0.0, 0.0, 0.0), end, 4.0)
    assert sum(leg for _, leg in found) == pytest.approx(length)


def _link(before: int, after: int) -> str:
    return (
        f'<predecessor elementType="road" elementId="{before}" contactPoint="end"/>'
        f'<successor elementType="road" elementId="{after}" contactPoint="start"/>'
    )


def _to_junction(side: str) -> str:
    return f'<{side} elementType="junction" elementId="1"/>'


def _read(tmp_path: Path, through: bool, gap: float = 0.8) -> tuple[Town, tuple[ImportNote, ...]]:
    """A street of two roads that ends in a turnaround of 3.2 m, which begins beside its lane; with a way on or without.

    Args:
        tmp_path: folder of the file.
        through: whether two more roads lead on and back on the other side of the junction.
        gap: distance of the turnaround from the lanes [m].
    """
    turn = geometry(f'<arc curvature="{2 / 4.0}"/>', math.pi * 2.0, x=100.0 + gap, y=-2.0)
    centred = '<laneOffset s="0" a="2" b="0" c="0" d="0"/>'
    parts = [
        road(1, sections=LANE, link=_to_junction("successor")),
        road(2, sections=LANE, plan=geometry("<line/>", 100.0, x=100.0, hdg=math.pi), link=_to_junction("predecessor")),
        road(3, sections=LANE, length=math.pi * 2.0, plan=turn, junction=1, link=_link(1, 2), offset=centred),
    ]
    ways = [(1, 3)]
    if through:
        back = geometry("<line/>", 100.0, x=220.0, hdg=math.pi)
        parts += [
            road(4, sections=LANE, plan=geometry("<line/>", 100.0, x=120.0), link=_to_junction("predecessor")),
            road(5, sections=LANE, plan=back, link=_to_junction("successor")),
            *(
                road(k, sections=LANE, length=20.0, junction=1, link=_link(*ends), plan=plan)
                for k, ends, plan in (
                    (6, (1, 4), geometry("<line/>", 20.0, x=100.0)),
                    (7, (5, 2), geometry("<line/>", 20.0, x=120.0, hdg=math.pi)),
                )
            ),
        ]
        ways += [(1, 6), (5, 7)]
    connections = "".join(
        f'<connection id="{k}" incomingRoad="{a}" connectingRoad="{b}" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection>'
        for k, (a, b) in enumerate(ways)
    )
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*parts, f'<junction id="1">{connections}</junction>'))
    town, notes = import_opendrive(path)
    return town, notes.sorted()


def test_a_turnaround_at_a_dead_end_is_drawn_so_that_a_car_can_follow(tmp_path: Path) -> None:
    town, notes = _read(tmp_path, through=False)
    (turn,) = (of for of in town.lanes if of.in_junction)
    assert town.predecessors(turn.id) and town.successors(turn.id)
    unsound = {FaultKind.GAP, FaultKind.KINK, FaultKind.TIGHT_CURVE, FaultKind.TURN_TYPE}
    assert not unsound & {fault.kind for fault in check_town(town)}
    (link,) = town.successors(town.predecessors(turn.id)[0])
    assert link.type is LinkType.U_TURN
    assert turn.points[0] == pytest.approx(town.lanes[town.predecessors(turn.id)[0]].points[-1], abs=1e-6)
    (note,) = notes
    assert (note.action, note.kind) == (NoteAction.REPAIRED, NoteKind.LANE)
    assert note.element.startswith("road 3 / ")


def test_a_turnaround_beside_other_ways_is_dropped_if_it_cuts_nothing_off(tmp_path: Path) -> None:
    town, notes = _read(tmp_path, through=True)
    assert 3 not in {of.road_id for of in town.lanes}
    assert [(note.action, note.kind) for note in notes] == [(NoteAction.DROPPED, NoteKind.TURNAROUND)]


def test_a_turnaround_that_can_be_followed_stays_as_it_is(tmp_path: Path) -> None:
    wide = '<arc curvature="0.2"/>'
    turn = geometry(wide, math.pi * 5.0, x=100.0, y=-2.0)
    parts = [
        road(1, sections=LANE, link=_to_junction("successor")),
        road(
            2,
            sections=LANE,
            plan=geometry("<line/>", 100.0, x=100.0, y=6.0, hdg=math.pi),
            link=_to_junction("predecessor"),
        ),
        road(
            3,
            sections=LANE,
            length=math.pi * 5.0,
            plan=turn,
            junction=1,
            link=_link(1, 2),
            offset='<laneOffset s="0" a="2" b="0" c="0" d="0"/>',
        ),
        '<junction id="1"><connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    ]
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*parts))
    town, notes = import_opendrive(path)
    assert notes.sorted() == ()
    (connector,) = (of for of in town.lanes if of.in_junction)
    assert connector.length == pytest.approx(math.pi * 5.0, abs=0.05)


def _corner(folder: Path, angle: float) -> tuple[Town, tuple[ImportNote, ...]]:
    """Two lanes that meet at a corner 1.6 m apart; the curve of the file between them turns back twice."""
    turn = math.radians(angle)
    plan = "".join(
        geometry("<line/>", 2.0, s=2.0 * k, x=100.0, hdg=heading) for k, heading in enumerate((0.0, math.pi, turn))
    )
    x, y = 100.0 + 1.6 * math.cos(0.5 * turn), 1.6 * math.sin(0.5 * turn)
    after = geometry("<line/>", 100.0, x=x, y=y, hdg=turn)
    centred = '<laneOffset s="0" a="2" b="0" c="0" d="0"/>'
    parts = [
        road(1, sections=LANE, link=_to_junction("successor"), offset=centred),
        road(2, sections=LANE, plan=after, link=_to_junction("predecessor"), offset=centred),
        road(3, sections=LANE, length=6.0, plan=plan, junction=1, link=_link(1, 2), offset=centred),
        '<junction id="1"><connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    ]
    path = folder / "town.xodr"
    path.write_text(opendrive(*parts))
    town, notes = import_opendrive(path)
    return town, notes.sorted()


@pytest.mark.parametrize("angle", [60.0, 90.0, 120.0, -90.0])
def test_a_corner_without_room_for_the_car_is_a_bend_without_loops(tmp_path: Path, angle: float) -> None:
    town, notes = _corner(tmp_path, angle)
    (connector,) = (of for of in town.lanes if of.in_junction)
    turns = np.diff(np.unwrap(connector.headings))
    assert np.abs(turns).max() < math.radians(30.0)
    assert np.abs(turns).sum() < math.radians(abs(angle) + 70.0)
    assert {link.target for link in town.links if link.source == connector.id}
    assert NoteAction.REPAIRED in {note.action for note in notes}


def test_a_path_that_would_be_a_loop_is_left_alone(tmp_path: Path) -> None:
    """Two lanes side by side in one direction, linked by a connector across: only a loop could join them."""
    parts = [
        road(1, sections=LANE, link=_to_junction("successor")),
        road(2, sections=LANE, plan=geometry("<line/>", 100.0, x=101.0, y=2.0), link=_to_junction("predecessor")),
        road(3, sections=LANE, length=1.0, plan=geometry("<line/>", 1.0, x=100.0, y=1.0), junction=1, link=_link(1, 2)),
        '<junction id="1"><connection id="0" incomingRoad="1" connectingRoad="3" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    ]
    path = tmp_path / "town.xodr"
    path.write_text(opendrive(*parts))
    town, notes = import_opendrive(path)
    (connector,) = (of for of in town.lanes if of.in_junction)
    assert connector.length == pytest.approx(1.0)
    assert notes.sorted() == ()
