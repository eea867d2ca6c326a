from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.maps import NoteKind, SignalKind, Town
from dorothie_gym.maps.opendrive import import_opendrive
from dorothie_gym.maps.opendrive.ids import MAX_ID, IdNumbers

from .opendrive_text import geometry, lane, linked, opendrive, road, section


def test_numeric_ids_keep_their_numbers_and_others_follow_in_the_order_of_the_file() -> None:
    numbers = IdNumbers(["12", "north", "3", "A1_10", "north", "1_0", str(MAX_ID + 1)])
    texts = ["12", "3", "north", "A1_10", "1_0", str(MAX_ID + 1)]
    assert [numbers.get(text) for text in texts] == [12, 3, 13, 14, 15, 16]
    assert list(numbers.renamed) == texts[2:]


def test_a_reference_may_write_a_number_in_another_way() -> None:
    numbers = IdNumbers(["7", "x", "08"])
    assert (numbers.get("007"), numbers.get(" 7"), numbers.get("8"), numbers.get("9"), numbers.get("y")) == (
        7,
        7,
        8,
        None,
        None,
    )


def test_two_texts_of_one_number_are_two_ids() -> None:
    numbers = IdNumbers(["1", "01"])
    assert (numbers.get("1"), numbers.get("01")) == (1, 2)


def test_numbers_fit_the_arrays_of_the_simulation() -> None:
    numbers = IdNumbers(["a", str(MAX_ID), "0", "b", str(2 * MAX_ID)])
    assert [numbers.get(text) for text in ("a", "b", str(2 * MAX_ID), str(MAX_ID))] == [1, 2, 3, MAX_ID]
    assert np.iinfo(np.int32).max >= MAX_ID


def test_ids_without_any_number_begin_at_zero() -> None:
    assert [IdNumbers(["a", "b"]).get(text) for text in "ab"] == [0, 1]


def _town(names: dict[str, str]) -> str:
    """Two roads with a junction and a light between them; the ids are replaced by names."""
    lanes = section(0.0, lane(-1, more=linked(before=-1, after=-1)))
    to_junction = '<successor elementType="junction" elementId="70"/>'
    from_junction = '<predecessor elementType="junction" elementId="70"/>'
    inside = (
        '<predecessor elementType="road" elementId="10" contactPoint="end"/>'
        '<successor elementType="road" elementId="30" contactPoint="start"/>'
    )
    light = (
        '<signals><signal id="50" s="95" t="-5" orientation="+" dynamic="yes" type="1000001" subtype="-1"/></signals>'
    )
    parts = [
        road(10, sections=lanes, link=to_junction, more=light),
        road(20, sections=lanes, junction=70, length=20.0, plan=geometry("<line/>", 20.0, x=100.0), link=inside),
        road(30, sections=lanes, plan=geometry("<line/>", 100.0, x=120.0), link=from_junction),
        '<junction id="70"><connection id="0" incomingRoad="10" connectingRoad="20" contactPoint="start">'
        '<laneLink from="-1" to="-1"/></connection></junction>',
    ]
    text = opendrive(*parts)
    for number, name in names.items():
        text = text.replace(f'"{number}"', f'"{name}"')
    return text


@pytest.mark.parametrize(
    "names",
    [
        {"10": "north", "20": "exit-2", "30": "100000000000010004", "70": "J-east", "50": "A1_10"},
        {"10": "#1", "30": ":C_0"},
        {"50": "A1_10"},
        {"70": "J"},
    ],
)
def test_ids_may_be_any_text_in_all_places_that_refer_to_them(tmp_path: Path, names: dict[str, str]) -> None:
    path = tmp_path / "town.xodr"
    path.write_text(_town({}))
    plain, notes = import_opendrive(path)
    assert notes.sorted() == ()
    path.write_text(_town(names))
    town, notes = import_opendrive(path)
    assert {note.kind for note in notes.sorted()} == {NoteKind.ID}
    assert {note.element.split()[1] for note in notes.sorted()} == set(names.values())
    assert _ways(town) == _ways(plain) == [(20.0, 100.0, "straight"), (100.0, 20.0, "straight")]
    (junction,), (signal,) = town.junctions, town.signals
    assert [town.lanes[k].length for k in junction.connectors] == pytest.approx([20.0])
    (ruled,) = signal.lanes
    assert signal.kind is SignalKind.TRAFFIC_LIGHT
    assert town.lanes[town.successors(ruled)[0].target].id == junction.connectors[0]


def _ways(town: Town) -> list[tuple[float, float, str]]:
    lengths = [round(lane_.length, 3) for lane_ in town.lanes]
    return sorted((lengths[link.source], lengths[link.target], str(link.type)) for link in town.links)


def test_numbers_of_a_file_are_those_of_the_town(tmp_path: Path) -> None:
    path = tmp_path / "town.xodr"
    path.write_text(_town({}))
    town, _ = import_opendrive(path)
    assert [lane_.road_id for lane_ in town.lanes] == [10, 20, 30]
    assert (town.junctions[0].id, town.signals[0].id) == (70, 50)
