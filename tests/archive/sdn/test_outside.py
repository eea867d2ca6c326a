"""Hand-written sessions of each layout, with every irregularity that its description names."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from dorothie_gym.archive import Corpus, read_session
from dorothie_gym.archive.sdn import SdnLayout, detect_layout, read_sdn
from dorothie_gym.cli import app
from dorothie_gym.evaluation.analysis import Units, inconsistencies
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import DialogueMove, GoalStatus, LandmarkName, ObjectClass, PhysicalAction, Role, StreetName
from dorothie_gym.session.recording import EventType, Session

TRAJECTORY_TRAP = """frame, x, y, yaw, junction_id, road_id, lane_id
{rows}
frame, x, y, yaw, junction_id, road_id, lane_id
0, 9999.0, 9999.0, 0.0, -1, 0, 0
"""

RELEASE_LOG = r"""[
 {"frame": 4710, "type": "Speech", "from": "dorothy", "to": "wizard", "flag": false, "utterance_filename": "utterance_0.flac", "start_frame": 4705, "end_frame": 4722},
 {"frame": 4705, "type": "Speech ", "from": "dorothy", "utterance_filename": "utterance_0.flac", "start_frame": 4705, "end_frame": 4722},
 {"frame": 4722, "type": "DialogueMove ", "from": "dorothy", "to": "wizard", "flag": true,
  "utterance_gt": "Let’s get going, the corner shop on Baits first.", "utterance": "lets get going the corner shop on bates first",
  "act": {"move": "Instruct", "slots": {"Landmark": ["Seven Eleven"], "StreetName": ["Baits"]}, "exchange": 0, "annotator": "B"}},
 {"frame": 4740, "type": "DialogueMove", "from": "wizard", "to": "dorothy", "flag": true, "utterance_gt": "Will do.",
  "act": {"move": "Acknowledge", "slots": {}, "exchange": 0}},
 {"frame": 4741, "type": "PhysicalAction   ", "from": "wizard", "flag": true, "val": {"act": "Start", "slot_type": null, "slot_val": null}},
 {"frame": 4760.0, "type": "PhysicalAction", "from": "wizard", "flag": true, "val": {"act": "Jturn", "slot_type": "Angle", "slot_val": "-88.5"}},
 {"frame": 4765, "type": "PhysicalAction", "from": "wizard", "flag": true, "val": {"act": "LaneSwitch", "slot_type": "Direction", "slot_val": 1}},
 {"frame": 4766, "type": "PhysicalAction", "from": "wizard", "flag": true, "val": {"act": "LaneSwitch", "slot_type": "Direction", "slot_val": 7}},
 {"frame": "4770", "type": "PhysicalAction", "from": "wizard", "flag": false, "val": {"act": "SpeedChange", "slot_type": "Speed", "slot_val": 5}},
 {"frame": 4771, "type": "PhysicalAction", "from": "agent", "flag": false, "val": {"act": "Stop", "slot_type": null, "slot_val": null}},
 {"frame": 4772, "type": "BeliefUpdate", "from": "wizard", "flag": false, "val": {"act": "LandmarkUpdate", "slot_type": "Location", "slot_val": [12.0, 7.5]}},
 {"frame": 4775, "type": "DialogueMove", "from": "dorothy", "to": "wizard", "flag": true, "utterance_gt": "Mind the van, we have been there.",
  "utterance": "", "act": {"move": "Explain", "slots": {"Object": "Vehicle", "Status": ["Completed"], "Colour": ["red"]}, "exchange": 1}},
 {"frame": 4790, "type": "SystemPrompt", "from": "system", "to": "dorothy", "text": "A prompt that nobody has described."},
 {"frame": 4700, "type": "PhysicalAction", "from": "planner", "flag": false, "val": {"act": "LaneFollow", "slot_type": null, "slot_val": null}}
]"""  # noqa: E501

SAMPLE_LOG = r"""[
 {"frame": 95, "from": "wizard", "to": "dorothy", "type": "dialogue", "val": {"utterance": "Sure thing.", "is_sog": false, "is_eog": true, "is_sot": false, "is_eot": false, "act": "Acknowledge", "slot_type": null, "slot_val": null}},
 {"frame": 60, "from": "dorothy", "to": "wizard", "type": "dialogue", "val": {"utterance": "We’ll try the noodle bar on Fuller.", "is_sog": true, "is_eog": false, "is_sot": true, "is_eot": false, "act": "Instruct", "slot_type": ["Landmark", "Street"], "slot_val": ["Coco", "Fuller"]}},
 {"frame": 100, "from": "wizard", "to": "planner", "type": "physical", "val": {"act": "JTurn", "slot_type": "RoadID", "slot_val": 12}},
 {"frame": 64, "from": "wizard", "to": "planner", "type": "planning", "val": {"act": "GoalUpdate", "slot_type": "Landmark", "slot_val": ["Coco"]}},
 {"frame": 200, "from": "dorothy", "to": "wizard", "type": "dialogue", "val": {"utterance": "Here we are.", "is_sog": true, "is_eog": true, "is_sot": false, "is_eot": true, "act": "Explain", "slot_type": "Status", "slot_val": "Completed"}},
 {"frame": 150, "from": "wizard", "to": "planner", "type": "physical", "val": {"act": "Stop", "slot_type": null, "slot_val": null}},
 {"frame": 151, "from": "kibitzer", "to": "planner", "type": "physical", "val": {"act": "Honk", "slot_type": null, "slot_val": null}}
]"""  # noqa: E501


def places(first: int, count: int = 240) -> str:
    """East for eight seconds, a turn to the right through junction 33, then south."""
    rows, x, y = [], 3.0, 20.0
    for k in range(count):
        yaw = min(max(k - 80, 0) * 3.0, 90.0)
        x, y = x + 0.7 * math.cos(math.radians(yaw)), y + 0.7 * math.sin(math.radians(yaw))
        rows.append(
            f"{first + k}, {x:.3f}, {y:.3f}, {yaw:.2f}, {33 if 78 <= k < 115 else -1}, {2 if k < 78 else 9}, -1"
        )
    return TRAJECTORY_TRAP.format(rows="\r\n".join(rows))


def landmark(name: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    wp = {
        "Transform": {"Location": {"x": x, "y": y, "z": 0.0}, "Rotation": {"pitch": 0.0, "yaw": 180.0, "roll": 0.0}},
        "OpenDriveID": {"lane_id": 1, "road_id": 2, "junction_id": -1},
    }
    return {"asset": f"/Game/Static/{name}", "name": name, "is_hidden": False, "wp": wp, **more}


def put(folder: Path, **files: str | dict[str, Any] | list[Any]) -> Path:
    folder.mkdir(parents=True)
    for name, content in files.items():
        text = content if isinstance(content, str) else json.dumps(content)
        (folder / name.replace("__", ".")).write_bytes(text.encode())
    return folder


def bomb(path: Path) -> bytes:
    """A pickle that makes a file when it is opened."""
    return b"cos\nsystem\n(S'touch " + str(path).encode() + b"'\ntR."


@pytest.fixture
def release(tmp_path: Path) -> Path:
    environment = {
        "map": "/Game/Carla/Maps/Town94",
        "street_names": ["Baits", "Fuller", "Somewhere"],
        "departure": 17,
        "landmarks": [landmark("Seven Eleven", 40.0, 24.0), landmark("House", 60.0, 70.0, is_hidden=True, tint=[1, 2])],
        "trees": True,
    }
    folder = put(
        tmp_path / "SDN" / "val" / "seen" / "log_1640990000",
        config__json={
            "environment": environment,
            "start_frame": 4700,
            "end_frame": 4940,
            "weather": None,
            "build": "x",
        },
        annotated_log__json=RELEASE_LOG,
        plan__json=[
            {"frame": 4940, "landmark": "SevenEleven", "status": "Completed"},
            {"frame": 4722, "landmark": "Seven Eleven", "status": "Ongoing"},
            {"frame": 4730, "landmark": "Moon", "status": "Ongoing"},
        ],
        detailed_plan__json=[{"frame": 4725, "junctions": [33, 4], "objective": None}, {"frame": 4726}],
        ad_wizardlog__csv=(
            "systime, frame, type\n1640990001.5, 4750, set_weather, fog_density, 75.5\n\n"
            "1640990002.5, 4755, prop_create, static.prop.trafficcone01, 7, 1.0, 2.0, 0.0, 0.0, 90.0, 0.0\n"
            "1640990003.5, 4800, message, Somebody rings, asks for bread, and hangs up\n"
            "1640990004.5, x, message, lost\n1640990005.5, 4810, dance, 1, 2\n"
        ),
        trajectory__csv=places(4700),
        carlalog__log="CARLA_RECORDER",
    )
    (folder / "embeddings.pkl").write_bytes(bomb(tmp_path / "exploded"))
    for name in ("utterance", "rgb"):
        (folder / name).mkdir()
    (folder / "utterance" / "utterance_0.flac").write_bytes(b"fLaC")
    (folder / "rgb" / "4700.png").write_bytes(b"no picture")
    return folder


@pytest.fixture
def sample(tmp_path: Path) -> Path:
    marks = [
        {"name": "Coco", "location": [40.0, 24.0, 0.0], "rotation": [0, 0, 0], "s": 31.0, "road_id": 2, "lane_id": 1,
         "junction_id": -1, "hidden": True},
        {"name": "Person", "location": [60.0, 70.0, 0.0], "rotation": [0, 90, 0], "s": 5, "road_id": 9, "lane_id": -1},
    ]  # fmt: skip
    folder = put(
        tmp_path / "sample",
        config__json={
            "map": "Town94",
            "street_names": ["Fuller"],
            "departure": {"s": 0},
            "landmarks": marks,
            "task": {"subgoals": [{"destination": "Coco", "description": "Noodles."}]},
        },
        task__json={
            "template": "noodles",
            "assignments": {"BAR": {"name": "Coco"}},
            "story": "You are hungry.",
            "subgoals": [{"destination": "$BAR", "description": "Eat.", "priority": 3}],
            "hidden_from_wizard": ["$BAR"],
        },
        gamelog__json=SAMPLE_LOG,
        gamelog__csv="frame,from\n",
        trajectory__csv=places(55),
    )
    for name in ("audio", "rgba"):
        (folder / name).mkdir()
    (folder / "rgba" / "55.jpg").write_bytes(b"\xff\xd8")
    return folder


@pytest.fixture
def hub(tmp_path: Path) -> Path:
    return put(
        tmp_path / "log_1650000000", dialog_log__json={"log": json.loads(RELEASE_LOG), "version": 3}, carlalog__log=""
    )


def test_the_release_layout_is_read_with_all_its_traps(release: Path, tmp_path: Path) -> None:
    session = read_session(release)
    first, answer, third = session.utterances()
    assert first.text == "Let's get going, the corner shop on Baits first."
    assert first.moves[0].act.slots == {LandmarkName.SEVEN_ELEVEN, StreetName.BAITS}
    assert (first.start, first.end) == (0.5, 2.2)
    assert first.moves[0].recognised == "lets get going the corner shop on bates first"
    assert answer.moves[0].recognised is None and answer.moves[0].exchange == 0
    assert third.moves[0].act.slots == {ObjectClass.VEHICLES, GoalStatus.COMPLETE}
    # the car turns right where the log has -88.5: positive is left in this one
    done = [(a.action, a.angle, a.up, a.source) for a in session.physical_actions]
    assert done == [
        (PhysicalAction.LANE_FOLLOW, None, None, Role.AGENT),
        (PhysicalAction.START, None, None, Role.CO_WIZARD),
        (PhysicalAction.J_TURN, -88.5, None, Role.CO_WIZARD),
        (PhysicalAction.LANE_SWITCH, 90.0, None, Role.CO_WIZARD),
        (PhysicalAction.LANE_SWITCH, None, None, Role.CO_WIZARD),
        (PhysicalAction.SPEED_CHANGE, None, True, Role.CO_WIZARD),
        (PhysicalAction.STOP, None, None, Role.AGENT),
    ]
    assert len(session.trajectory) == 240 and session.trajectory["x"].max() < 200
    assert [e.data["kind"] for e in session.of_type(EventType.EXCEPTION)] == ["weather", "place_prop"]
    assert [e.data["text"] for e in session.of_type(EventType.MESSAGE)] == [
        "Somebody rings, asks for bread, and hangs up"
    ]
    assert [e.data["status"] for e in session.of_type(EventType.SUBGOAL)] == ["Ongoing", "Complete"]
    assert session.header.town == "Town94" and session.header.street_names == ("Baits", "Fuller", "Unknown")
    assert [row["hidden"] for row in session.header.landmarks] == [False, True]
    assert not (tmp_path / "exploded").exists()


def test_unknown_fields_are_kept_and_reported_by_name(release: Path) -> None:
    session = read_session(release)
    report = "\n".join(session.report.lines())
    for part in (
        "act: field 'annotator'", "slot value Colour=red", "row of type 'SystemPrompt'", "type 'dance'",
        "street 'Somewhere'", "field 'build'", "field 'environment.trees'", "a second header", "U+2019", "1 1, 7 1",
        "lines without a frame", "out of order",
    ):  # fmt: skip
        assert part in report, report
    (kept,) = [e for e in session.events if e.type_name == "sdn:SystemPrompt"]
    assert kept.data["text"] == "A prompt that nobody has described."
    assert "embeddings.pkl" in session.report.facts["files_not_read"]


def test_the_sample_layout_is_read_with_all_its_traps(sample: Path) -> None:
    session = read_session(sample)
    assert detect_layout(sample) is SdnLayout.SAMPLE
    assert [u.text for u in session.utterances()] == [
        "We'll try the noodle bar on Fuller.",
        "Sure thing.",
        "Here we are.",
    ]
    moves = session.moves()
    assert [(m.exchange, m.transaction) for m in moves] == [(0, 0), (0, 0), (1, 0)]
    assert moves[0].act.slots == {LandmarkName.COCO, StreetName.FULLER}
    assert moves[2].act.slots == {GoalStatus.COMPLETE}
    (turn,) = [a for a in session.physical_actions if a.action is PhysicalAction.J_TURN]
    assert turn.angle is None and session.report.facts["turns_into_a_road"] == {"found": 0, "unknown": 1}
    assert session.header.story == "You are hungry." and session.header.storyboard == "noodles"
    assert [row["hidden"] for row in session.header.landmarks] == [True, False]
    assert "kibitzer" in "\n".join(session.report.lines())


@pytest.mark.parametrize(
    "wrap",
    [
        lambda rows: rows,
        lambda rows: {"log": rows, "version": 3},
        lambda rows: {str(k): row for k, row in enumerate(rows)},
    ],
)
def test_hub_layout_is_read_with_any_fields_around_its_rows(hub: Path, wrap: Any) -> None:
    (hub / "dialog_log.json").write_text(json.dumps(wrap(json.loads(RELEASE_LOG))), encoding="utf-8")
    session = read_session(hub)
    assert [m.act.move for m in session.moves()] == [
        DialogueMove.INSTRUCT,
        DialogueMove.ACKNOWLEDGE,
        DialogueMove.EXPLAIN,
    ]


def test_the_hub_layout_may_have_a_row_on_each_line(hub: Path) -> None:
    lines = "\n".join(json.dumps(row) for row in json.loads(RELEASE_LOG))
    (hub / "dialog_log.json").write_text(lines, encoding="utf-8")
    assert len(read_session(hub).moves()) == 3


@pytest.mark.parametrize("layout", ["release", "sample", "hub"])
def test_each_layout_is_converted_both_ways_and_stays_the_same(
    layout: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    folder: Path = request.getfixturevalue(layout)
    for target, to in (("native", "native"), ("sdn", "sdn")):
        result = CliRunner().invoke(app, ["convert", str(folder), str(tmp_path / "out" / target), "--to", to, "--json"])
        assert result.exit_code == 0, result.output
    original, native, sdn = read_session(folder), Session.load(tmp_path / "out/native"), read_sdn(tmp_path / "out/sdn")
    assert native.events == original.events and native.header == original.header
    assert [(m.act, m.text, m.exchange) for m in sdn.moves()] == [(m.act, m.text, m.exchange) for m in original.moves()]
    assert [(a.frame, a.action, a.angle) for a in sdn.physical_actions] == [
        (a.frame, a.action, a.angle) for a in original.physical_actions
    ]
    assert sdn.trajectory["x"].tolist() == original.trajectory["x"].tolist()
    assert native.check() == original.check()


@pytest.mark.parametrize(
    ("layout", "missing"),
    [
        *(("release", name) for name in ("config.json", "plan.json", "detailed_plan.json", "trajectory.csv")),
        *(("release", name) for name in ("ad_wizardlog.csv", "carlalog.log")),
        *(("sample", name) for name in ("config.json", "task.json", "trajectory.csv", "gamelog.csv")),
        ("hub", "carlalog.log"),
    ],
)
def test_every_file_but_the_log_may_be_missing(layout: str, missing: str, request: pytest.FixtureRequest) -> None:
    folder: Path = request.getfixturevalue(layout)
    (folder / missing).unlink()
    session = read_session(folder)
    assert len(session.utterances()) == 3
    never_read = missing in ("carlalog.log", "gamelog.csv")
    assert never_read or any(missing in name for name in session.report.missing)


@pytest.mark.parametrize("layout", ["release", "sample", "hub"])
def test_a_log_that_is_missing_is_no_session(layout: str, request: pytest.FixtureRequest) -> None:
    folder: Path = request.getfixturevalue(layout)
    for name in ("annotated_log.json", "gamelog.json", "dialog_log.json"):
        if (folder / name).exists():
            (folder / name).unlink()
    assert detect_layout(folder) is None


@pytest.mark.parametrize("layout", ["release", "sample"])
def test_it_plays_over_an_imported_town(layout: str, request: pytest.FixtureRequest, tmp_path: Path) -> None:
    from dorothie_gym.pictures.views.playback import Playback

    session = read_session(request.getfixturevalue(layout))
    scenes = list(Playback(session, load_town("brookside")).scenes(1.0))
    assert len(scenes) > 20
    assert scenes[0].car != scenes[-1].car


@pytest.mark.parametrize("layout", ["release", "sample", "hub"])
def test_statistics_keep_annotations_by_people(layout: str, request: pytest.FixtureRequest) -> None:
    session = read_session(request.getfixturevalue(layout))
    units = Units(session)
    assert len(units.exchanges) == 2
    assert inconsistencies(session, units) == ()


@pytest.mark.usefixtures("release")
def test_a_corpus_of_all_layouts_is_one_corpus(sample: Path, hub: Path, tmp_path: Path) -> None:
    for folder in (sample, hub):
        folder.rename(tmp_path / "SDN" / "val" / "seen" / folder.name)
    corpus = Corpus.load(tmp_path / "SDN")
    assert len(corpus) == 3 and sorted(session.report.layout for session in corpus) == ["hub", "release", "sample"]


def test_links_out_of_the_folder_are_read_as_files_and_never_written(release: Path, tmp_path: Path) -> None:
    outside = tmp_path / "outside.json"
    (release / "plan.json").rename(outside)
    os.symlink(outside, release / "plan.json")
    before = outside.read_bytes()
    assert len(read_session(release).of_type(EventType.SUBGOAL)) == 2
    assert outside.read_bytes() == before
