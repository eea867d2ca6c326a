import math
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps.model import LinkType
from dorothie_gym.maps.yaml.arms import POCKET
from dorothie_gym.maps.yaml.centrelines import SMALLEST_BEND
from dorothie_gym.maps.yaml.movements import BEND_RADIUS, CORNER_RADIUS, SLIP_RADIUS, SMALLEST_TRIM, kinds_of
from tests.maps.yaml_plans import AVENUES, CIRCUS, INTERCHANGE, PAIR, laid_out, star

PLANS = {"avenues": AVENUES, "circus": CIRCUS, "pair": PAIR, "interchange": INTERCHANGE}


@pytest.mark.parametrize("text", PLANS.values(), ids=PLANS.keys())
def test_ways_through_junctions_are_wide_enough(tmp_path: Path, text: str) -> None:
    layout = laid_out(tmp_path, text)
    for ways in layout.ways.values():
        for way in ways:
            movement = way.movement
            least = SLIP_RADIUS if movement.slip else CORNER_RADIUS
            if not movement.slip and not movement.source.on_ring and abs(movement.turn) < math.radians(35.0):
                least = BEND_RADIUS
            assert way.path.smallest_radius >= least - 1e-6


@pytest.mark.parametrize("arms", [{0: "lanes: 3, median: 8", 135: ""}, {0: "", 140: "lanes: 3, median: 8"}])
def test_ways_round_a_bend_do_not_swing_out_where_the_street_gets_narrower(
    tmp_path: Path, arms: dict[int, str]
) -> None:
    for way in laid_out(tmp_path, star(arms)).ways[0]:
        bends = [piece.curvature for piece in way.path.pieces if piece.curvature]
        assert min(bends) * max(bends) > 0.0  # to one side only
        assert way.path.smallest_radius >= CORNER_RADIUS - 1e-6


@pytest.mark.parametrize("text", PLANS.values(), ids=PLANS.keys())
def test_roads_do_not_overlap_beside_a_junction(tmp_path: Path, text: str) -> None:
    layout = laid_out(tmp_path, text)
    for row in layout.arms.values():
        outlines = [_mouth(layout, arm) for arm in row]
        for k, one in enumerate(outlines):
            for other in outlines[:k]:
                assert _apart(one, other)


def _mouth(layout, arm):
    """Corners (4, 2) of the first ten metres of an arm's road."""
    segment, centreline = layout.segments[arm.segment], layout.centrelines[arm.segment]
    span = (0.0, 10.0) if arm.at_start else (centreline.path.length - 10.0, centreline.path.length)
    right, left = (
        centreline.beside(offset, span)[[0, -1], :2] for offset in (segment.section.right, -segment.section.left)
    )
    return np.concatenate((right, left[::-1]))


def _apart(one, other) -> bool:
    """Whether a line separates two convex outlines."""
    for outline in (one, other):
        for edge in np.roll(outline, -1, axis=0) - outline:
            normal = np.array([-edge[1], edge[0]]) / np.hypot(*edge)
            a, b = one @ normal, other @ normal
            if a.max() <= b.min() + 1e-6 or b.max() <= a.min() + 1e-6:
                return True
    return False


def test_lanes_lie_beside_the_course_as_the_cross_section_says(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, AVENUES)
    avenue, lane = layout.segments[0].section, layout.segments[2].section
    assert avenue.forward == pytest.approx((3.75, 7.25, 10.75)) and avenue.backward == pytest.approx(
        (-3.75, -7.25, -10.75)
    )
    assert (avenue.right, avenue.left, avenue.pocket) == pytest.approx((12.5, 12.5, 0.25))
    assert lane.forward == pytest.approx((1.75, 5.25)) and lane.backward == pytest.approx((-1.75,))
    one_way = laid_out(tmp_path, PAIR).segments[0].section
    assert one_way.forward == pytest.approx((-1.75, 1.75)) and one_way.backward == ()
    assert (one_way.right, one_way.left) == pytest.approx((3.5, 3.5))


def test_turn_lanes_open_only_where_there_is_a_way_to_the_left(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, AVENUES)
    assert list(layout.pockets.values()) == [40.0, 40.0]
    tee = AVENUES.replace("[north, cross, south], lanes: [2, 1]", "[cross, south], lanes: [2, 1]").replace(
        "north: [0, -150], ", "north: [10, -150], "
    )
    layout = laid_out(tmp_path, tee.replace("stops: [[north, Lane]]", ""))
    assert list(layout.pockets) == [(1, True)]  # only from the east one can turn left into what is in the south


def test_turn_lanes_share_a_short_block(tmp_path: Path) -> None:
    text = AVENUES.replace("turn_lanes: [cross]", "turn_lanes: [cross, west]").replace(
        "west: [-150, 0]", "west: [-100, 0]"
    )
    text = text.replace("[-150, 150], west, [-150, -150]", "[-100, 150], west, [-100, -150]")
    layout = laid_out(tmp_path, text)
    length = layout.centrelines[0].path.length
    assert layout.pockets[0, False] == layout.pockets[0, True] == pytest.approx((length - 4.0) / 2.0)


def test_the_straightest_of_several_ways_ahead_goes_straight() -> None:
    turns = {1: math.radians(-30.0), 2: math.radians(5.0), 3: math.radians(30.0), 4: math.radians(-90.0)}
    left, straight, right = LinkType.LEFT, LinkType.STRAIGHT, LinkType.RIGHT
    assert kinds_of(turns) == {1: left, 2: straight, 3: right, 4: left}
    assert kinds_of({1: math.radians(36.0), 2: math.radians(-36.0)}) == {1: right, 2: left}


def test_a_ramp_exchanges_cars_with_the_carriageway_beside_it_only(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, INTERCHANGE)
    names = {
        (way.movement.source.street.name, way.movement.target.street.name)
        for way in layout.ways[layout.plan.junctions["hw"].id]
    }
    assert names == {("Highway", "Highway"), ("Highway", "Off East"), ("On West", "Highway")}
    for way in layout.ways[layout.plan.junctions["hw"].id]:
        if way.movement.slip:
            highway = way.movement.source_lane if way.movement.target.street.ramp else way.movement.target_lane
            assert highway.number == 1  # the outermost of two
            assert abs(math.degrees(way.turn)) < 25.0


def test_a_way_onto_a_ramp_leaves_its_lane_to_the_right_only(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, INTERCHANGE)
    way = next(w for w in layout.ways[layout.plan.junctions["hw"].id] if w.movement.target.street.name == "Off East")
    points, _ = way.path.sample()
    assert np.all(points[:, 1] >= 4.0 / 2.0 + 1.5 * 3.5 - 1e-9)  # eastwards: south of the outermost lane's middle
    assert np.all(np.diff(points[:, 1]) >= -1e-9)


def test_a_ring_is_made_of_exact_arcs_driven_counter_clockwise(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, CIRCUS)
    ring = [(s, c) for s, c in zip(layout.segments, layout.centrelines, strict=True) if s.arc is not None]
    assert len(ring) == 4 and {s.street.name for s, _ in ring} == {"circus"}
    for _, centreline in ring:
        points = centreline.beside(0.0)
        assert np.hypot(*points[:, :2].T) == pytest.approx(30.0, abs=1e-6)
        bearing = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
        assert np.all(np.diff(bearing) < 0.0)  # y points south
    assert [c.name for c in layout.crossings[-4:]] == ["circus/1", "circus/2", "circus/3", "circus/4"]
    assert len({c.id for c in layout.crossings}) == len(layout.crossings)


def test_streets_meet_a_ring_radially(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, CIRCUS)
    for crossing in layout.crossings[-4:]:
        assert math.hypot(*crossing.centre) == pytest.approx(30.0)
        (arm,) = (arm for arm in layout.arms[crossing.id] if not arm.on_ring)
        bearing = math.atan2(crossing.centre[1], crossing.centre[0])
        assert math.cos(arm.heading - bearing) == pytest.approx(1.0)


def test_streets_climb_between_level_junctions(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, INTERCHANGE)
    for segment, centreline in zip(layout.segments, layout.centrelines, strict=True):
        points = centreline.beside(0.0)
        assert points[[0, -1], 2] == pytest.approx((segment.start.height, segment.end.height))
        if np.ptp(points[:, 2]) > 0.0:
            assert np.hypot(*np.diff(points[:, :2], axis=0).T).max() <= 5.0 + 1e-9
            assert np.all(np.diff(points[:, 2]) * (segment.end.height - segment.start.height) >= -1e-9)


def test_an_unmarked_crossing_is_fine_only_with_headroom(tmp_path: Path) -> None:
    assert laid_out(tmp_path, INTERCHANGE)
    with pytest.raises(
        TownError, match="'Bridge': between 'tn' and 'ts' it touches street 'Highway' near .* 4.5 m above"
    ):
        laid_out(tmp_path, INTERCHANGE.replace("[0, -30, 6], [0, 30, 6]", "[0, -30, 4], [0, 30, 4]"))
    tunnel = INTERCHANGE.replace("[0, -30, 6], [0, 30, 6]", "[0, -20, -5], [0, 20, -5]")
    with pytest.raises(TownError, match="'Bridge': between 'tn' and 'ts' it climbs too steeply"):
        laid_out(tmp_path, tunnel)


def test_wide_streets_take_more_room_at_the_streets_that_cross_them(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, AVENUES)
    ends = {}
    for arm in layout.arms[0]:
        path = layout.centrelines[arm.segment].path
        ends.setdefault(arm.street.name, math.hypot(*(path.start if arm.at_start else path.end)[:2]))
    assert ends["Lane"] == pytest.approx(8.0 + 10.75)  # a corner and the outermost lane of the avenue
    assert ends["Avenue"] == pytest.approx(8.0 + 5.25)
    assert min(ends.values()) >= SMALLEST_TRIM


def test_a_curve_may_be_as_tight_as_its_innermost_lane_allows(tmp_path: Path) -> None:
    def bent(radius: float) -> str:
        return AVENUES.replace("Loop: {", "Loop: {lanes: 3, median: 2, ").replace("radius: 60", f"radius: {radius}")

    least = SMALLEST_BEND + 1.0 + 2.5 * 3.5
    assert laid_out(tmp_path, bent(least + 0.01))
    with pytest.raises(TownError, match=f"tighter than its lanes are wide: .* at least {least:.1f} m"):
        laid_out(tmp_path, bent(least - 0.5))


ON_WEST = "  On West: {through: [tn, [-120, -80], [-210, -32], hw], ramp: true, speed: 60}\n"
REFUSED = {
    "ramp on the left": (
        INTERCHANGE.replace("hw, [-210, 32], [-120, 80], ts", "hw, [-210, -32], [-100, -32], [-60, 80], ts").replace(
            ON_WEST, ""
        ),
        "street 'Off East': the ramp leaves 'Highway' on its left",
    ),
    "ramp too flat": (
        INTERCHANGE.replace("[-210, 32], [-120, 80], ts], ramp", "[-200, 15], [-120, 80], ts], ramp"),
        "junction 'hw': streets 'Highway' and 'Off East' leave it only 9 degrees apart; 12 are needed",
    ),
    "ramp where the street ends": (
        INTERCHANGE.replace("[west, hw, he, east]", "[hw, he, east]").replace(
            "[tn, [-120, -80], [-210, -32], hw]", "[tn, [-120, -80], [-210, -32], hw, west]"
        ),
        "ramps leave and join on the right of a street that runs straight through",
    ),
    "arms too close on a ring": (
        CIRCUS.replace("s: [0, 150]", "s: [90, 120]").replace("[150, 150], s, [-150, 150]", "s, [0, 160], [-150, 150]"),
        "junction 'circus': the streets that meet its ring at 'circus/3' and 'circus/2' are too close together",
    ),
    "turn lane without room": (
        AVENUES.replace("west: [-150, 0]", "west: [-58, 0]")
        .replace("[-150, 150], west, [-150, -150]", "[-58, 150], west, [-58, -150]")
        .replace("radius: 60", "radius: 40"),
        "street 'Avenue': between 'west' and 'cross' there is no room for the turn lane before 'cross'",
    ),
}


@pytest.mark.parametrize(("text", "reason"), REFUSED.values(), ids=REFUSED.keys())
def test_a_plan_that_does_not_fit_is_refused(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(TownError) as caught:
        laid_out(tmp_path, text)
    assert reason in str(caught.value)


def test_pockets_are_the_innermost_of_the_lanes_that_come_in(tmp_path: Path) -> None:
    layout = laid_out(tmp_path, AVENUES)
    pockets = [arm for arm in layout.arms[0] if arm.pocket is not None]
    assert len(pockets) == 2
    for arm in pockets:
        offsets = [lane.offset for lane in arm.incoming]
        assert arm.incoming[-1].number == POCKET and offsets == sorted(offsets)
        assert offsets[-1] < 0.0  # left of the middle as one looks outwards: right of it for those who come in
