from pathlib import Path

import pytest

from dorothie_gym.errors import TownError
from dorothie_gym.maps.yaml import entries as source
from dorothie_gym.maps.yaml.plan import Bend, GreenPlan, StreetPlan, TownPlan
from dorothie_gym.maps.yaml.schema import read_plan
from dorothie_gym.maps.yaml.street_schema import approaches
from tests.maps.yaml_text import MIDTOWN, written

TWO = "junctions: {a: [0, 0], b: [200, 0]}\n"


@pytest.fixture
def midtown(tmp_path: Path) -> TownPlan:
    return read_plan(written(tmp_path, MIDTOWN))


def street(plan: TownPlan, name: str) -> StreetPlan:
    return next(street for street in plan.streets if street.name == name)


def only_street(tmp_path: Path, text: str, *, top: str = "") -> StreetPlan:
    return read_plan(written(tmp_path, f"{top}{TWO}streets:\n  Road: {text}\n")).streets[0]


def test_junctions_are_numbered_and_named_in_order(midtown: TownPlan) -> None:
    assert list(midtown.junctions) == ["cross", "market", "gate", "corner", "hill", "circus"]
    assert [junction.id for junction in midtown.junctions.values()] == list(range(6))
    assert midtown.junctions["gate"].centre == (0.0, 200.0)
    assert midtown.junctions["gate"].entry.line == 6


def test_a_roundabout_has_radius_lanes_and_speed(midtown: TownPlan) -> None:
    ring = midtown.junctions["circus"].roundabout
    assert ring is not None and (ring.radius, ring.lanes, ring.speed) == (30.0, 1, 25.0)
    assert midtown.junctions["cross"].roundabout is None


@pytest.mark.parametrize(("top", "expected"), [("", 30.0), ("speed: 60\n", 30.0), ("speed: 20\n", 20.0)])
def test_a_roundabout_is_not_faster_than_the_town(tmp_path: Path, top: str, expected: float) -> None:
    text = f"{top}junctions: {{a: [0, 0], b: {{at: [200, 0, 3], roundabout: 20}}}}\nstreets: {{Road: [a, b]}}\n"
    junction = read_plan(written(tmp_path, text)).junctions["b"]
    assert junction.height == 3.0
    assert junction.roundabout is not None and (junction.roundabout.lanes, junction.roundabout.speed) == (1, expected)


def test_a_street_takes_missing_properties_from_the_town(tmp_path: Path) -> None:
    top = "speed: 45\nwidth: 3\nsidewalk: 0\n"
    plain, own = (
        only_street(tmp_path, text, top=top)
        for text in ("[a, b]", "{through: [a, b], speed: 30, width: 4, sidewalk: 1}")
    )
    assert (plain.speed, plain.width, plain.sidewalk) == (45.0, 3.0, 0.0)
    assert (own.speed, own.width, own.sidewalk) == (30.0, 4.0, 1.0)


def test_a_street_without_properties_has_a_lane_each_way_and_pavements(tmp_path: Path) -> None:
    road = only_street(tmp_path, "[a, b]")
    assert (road.forward, road.backward, road.median, road.turn_lanes, road.ramp) == (1, 1, 0.0, (), False)
    assert (road.speed, road.width, road.radius, road.sidewalk) == (40.0, 3.5, None, 2.0)


@pytest.mark.parametrize(
    ("keys", "lanes"),
    [
        ("lanes: 3", (3, 3)),
        ("lanes: [2, 1]", (2, 1)),
        ("one_way: true", (1, 0)),
        ("one_way: yes, lanes: 2", (2, 0)),
        ("one_way: false", (1, 1)),
        ("ramp: true", (1, 0)),
        ("ramp: true, one_way: true, lanes: 2", (2, 0)),
        ("ramp: false", (1, 1)),
    ],
)
def test_lanes_forward_and_backward(tmp_path: Path, keys: str, lanes: tuple[int, int]) -> None:
    road = only_street(tmp_path, f"{{through: [a, b], {keys}}}")
    assert (road.forward, road.backward) == lanes


def test_a_ramp_has_pavements_only_where_it_asks_for_them(tmp_path: Path) -> None:
    assert only_street(tmp_path, "{through: [a, b], ramp: true}").sidewalk == 0.0
    assert only_street(tmp_path, "{through: [a, b], ramp: true, sidewalk: 2}").sidewalk == 2.0


def test_heights_are_read_where_they_are_written(tmp_path: Path) -> None:
    text = "junctions: {a: [0, 0], b: [200, 0, 6.5]}\nstreets: {Road: [a, [50, 9], [100, -9, 4], b]}\n"
    plan = read_plan(written(tmp_path, text))
    assert (plan.junctions["a"].height, plan.junctions["b"].height) == (0.0, 6.5)
    assert plan.streets[0].course == ("a", Bend(at=(50.0, 9.0)), Bend(at=(100.0, -9.0), height=4.0), "b")


def test_a_ring_may_end_where_it_began(tmp_path: Path) -> None:
    road = only_street(tmp_path, "[a, [50, 90], b, [50, -90], a]")
    assert road.course[0] == road.course[-1] == "a"


def test_an_avenue_has_turn_lanes_in_its_median(midtown: TownPlan) -> None:
    avenue = street(midtown, "Grand Avenue")
    assert (avenue.forward, avenue.backward, avenue.median, avenue.turn_lanes) == (2, 2, 4.0, ("market",))


def test_lights_with_and_without_phases(midtown: TownPlan) -> None:
    plain, written_out = midtown.lights
    assert (plain.junction, plain.phases, plain.offset) == ("cross", (), 0.0)
    assert (written_out.junction, written_out.offset) == ("market", 10.0)
    assert written_out.phases == (
        GreenPlan(streets=("Grand Avenue",), seconds=25.0),
        GreenPlan(streets=(), turn_lanes_only=("Grand Avenue",), seconds=8.0),
        GreenPlan(streets=("Market Street",), seconds=15.0),
    )


def test_signs_and_crosswalks_are_pairs_of_junction_and_street(midtown: TownPlan) -> None:
    assert midtown.stops == (("corner", street(midtown, "South Road")),)
    assert midtown.yields == (("hill", street(midtown, "Market Street")),)
    assert midtown.crosswalks == (("cross", street(midtown, "Ford Lane")),)


def test_sites_know_their_lines(midtown: TownPlan) -> None:
    assert [(place, entry.line) for place, entry in midtown.sites] == [((100.0, 14.0), 31), ((100.0, 188.0), 32)]


def test_a_one_way_street_approaches_all_junctions_but_its_first(midtown: TownPlan) -> None:
    king, ford = street(midtown, "King Street"), street(midtown, "Ford Lane")
    assert [approaches(king, name) for name in ("market", "corner", "cross")] == [False, True, False]
    assert [approaches(ford, name) for name in ("cross", "gate", "market")] == [True, True, False]


@pytest.mark.parametrize(
    "name", ["No", "Off", "12", "12:30", "1_000", "'~'", "'null'", "Straße", "Rue d'Été", "'a: b'"]
)
def test_names_are_texts_even_where_yaml_sees_something_else(tmp_path: Path, name: str) -> None:
    text = f"junctions: {{{name}: [0, 0], b: [200, 0]}}\nstreets: {{{name}: [{name}, b]}}\n"
    plan = read_plan(written(tmp_path, text))
    assert plan.streets[0].name == name.strip("'") == plan.streets[0].course[0]


@pytest.mark.parametrize(
    ("digits", "value"), [("60", 60), ("-6.5", -6.5), ("+6", 6), (".5", 0.5), ("1e2", 100), ("0.0", 0)]
)
def test_numbers_are_plain_decimal_digits(tmp_path: Path, digits: str, value: float) -> None:
    plan = read_plan(written(tmp_path, f"junctions: {{a: [{digits}, 7], b: [200, 0]}}\nstreets: {{Road: [a, b]}}\n"))
    assert plan.junctions["a"].centre == (value, 7.0)


def test_a_file_without_a_name_is_called_after_itself(tmp_path: Path) -> None:
    assert read_plan(written(tmp_path, TWO + "streets: {Road: [a, b]}")).name == "midtown"


def test_byte_order_mark_and_windows_line_ends_are_accepted(tmp_path: Path) -> None:
    text = MIDTOWN.replace("\n", "\r\n").encode("utf-8-sig")
    assert read_plan(written(tmp_path, text)).sites[-1][1].line == 32


def test_brookside_is_written_in_the_language(tmp_path: Path) -> None:
    import dorothie_gym.maps as package

    plan = read_plan(Path(str(package.__file__)).parent / "data" / "brookside.yaml")
    assert len(plan.junctions) == 8 and len(plan.streets) == 10 and len(plan.lights) == 3 and len(plan.crosswalks) == 5


def test_without_libyaml_the_same_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, MIDTOWN)
    fast = read_plan(path)
    monkeypatch.setattr(source, "_LOADER", source.yaml.SafeLoader)
    slow = read_plan(path)
    assert [one.course for one in fast.streets] == [one.course for one in slow.streets]
    assert [one.entry.line for one in fast.streets] == [one.entry.line for one in slow.streets] == list(range(11, 18))
    assert fast.lights[1].phases == slow.lights[1].phases


@pytest.mark.parametrize(
    ("text", "line"),
    [("a: [\n1,\n2\n", 1), ("a:\n  b: 'x\nc: 1\n", 2), ("a:\n\tb: 1\n", 2), ("a: 1\nb: c: d\n", 2), ("a: *b\n", 1)],
)
def test_both_loaders_find_the_same_line_of_broken_yaml(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, line: int
) -> None:
    path = written(tmp_path, text)
    for loader in (source._LOADER, source.yaml.SafeLoader):
        monkeypatch.setattr(source, "_LOADER", loader)
        with pytest.raises(TownError, match=rf"midtown\.yaml: line {line}: "):
            read_plan(path)
