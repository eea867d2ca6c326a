"""Sessions of the sample layout as its recording programme writes them: assets, objects, placeholders, audio."""

from __future__ import annotations

import json
import struct
import wave
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from dorothie_gym.archive import read_session
from dorothie_gym.archive.sdn import write_sdn
from dorothie_gym.cli import app
from dorothie_gym.maps import Lane, Town, load_town
from dorothie_gym.ontology import ActionValue, LandmarkName, ObjectClass, PhysicalAction, StreetName
from dorothie_gym.ontology import GoalStatus as Status
from dorothie_gym.session.recording import EventType, Session

ASSETS = {
    "static.prop.burgerking": "BurgerKing",
    "static.prop.coco": "Coco",
    "static.prop.ikea": "Ikea",
    "static.prop.kfc": "KFC",
    "static.prop.panera": "Panera",
    "static.prop.qdoba": "Qdoba",
    "static.prop.seveneleven": "SevenEleven",
    "null.shell": "Shell",
    "null.house": "House",
    "walker.pedestrian.0001": "Person",
}
"""Assets that the published loader knows, and the landmarks that they stand for (spec: sdn-format)."""

TOWN = "brookside"


def streets_lane(town: Town, shortest: float = 60.0) -> Lane:
    return next(lane for lane in town.lanes if lane.street >= 0 and not lane.in_junction and lane.length > shortest)


def mark(asset: str, x: float, y: float, **more: Any) -> dict[str, Any]:
    """A landmark with the placeholders 13/-1 instead of the numbers of its lane."""
    row = {
        "asset": asset,
        "location": [x, y, 0.2],
        "rotation": [0.0, 90.0, 0.0],
        "s": 4.0,
        "road_id": 13,
        "lane_id": -1,
    }
    return {**row, "junction_id": -1, "hidden": False, **more}


def said(frame: int, speaker: str, text: str, act: Any, slot_type: Any = None, slot_val: Any = None) -> dict[str, Any]:
    ends = {"is_sog": True, "is_eog": False, "is_sot": False, "is_eot": False}
    val = {"utterance": text, "act": act, "slot_type": slot_type, "slot_val": slot_val, **ends}
    to = "wizard" if speaker == "dorothy" else "dorothy"
    return {"frame": frame, "from": speaker, "to": to, "type": "dialogue", "val": val}


def done(frame: int, kind: str, act: str, slot_type: Any = None, slot_val: Any = None) -> dict[str, Any]:
    val = {"act": act, "slot_type": slot_type, "slot_val": slot_val}
    return {"frame": frame, "from": "wizard", "to": "planner", "type": kind, "val": val}


TASK = {
    "template": "tpl",
    "assignments": {"P1": "static.prop.kfc", "$P2": {"asset": "null.house", "location": [80, 5, 0]}, "I": "fries"},
    "story": "Lunch, then home.",
    "subgoals": [
        {"type": "arrive", "destination": "$P1", "description": "Lunch", "delete": True},
        {"type": "arrive", "destination": "$NOBODY", "description": "Lost"},
        {"destination": "walker.pedestrian.0001", "description": "Pick up", "after": [0], "trigger": True},
        {"type": "arrive", "destination": "$P2", "description": "Home", "after": [0, 1, 2]},
    ],
    "hidden_from_wizard": ["P2"],
}


def session_folder(
    folder: Path, log: list[dict[str, Any]], marks: list[dict[str, Any]], *, task: Any = None, places: Any = None
) -> Path:
    folder.mkdir(parents=True)
    environment = {"map": TOWN, "street_names": ["Baits", "Fuller"], "departure": 3, "landmarks": marks}
    config = {"environment": environment, "task": {"subgoals": []}}
    (folder / "config.json").write_text(json.dumps(config))
    (folder / "task.json").write_text(json.dumps(TASK if task is None else task))
    (folder / "gamelog.json").write_text(json.dumps(log))
    rows = [(k, 500.0 + k, 700.0, 0.0, -1, 0, 0) for k in range(400)] if places is None else places
    lines = ["frame, x, y, yaw, junction_id, road_id, lane_id", *(", ".join(map(str, row)) for row in rows)]
    (folder / "trajectory.csv").write_text("\n".join(lines) + "\n")
    return folder


def all_marks() -> list[dict[str, Any]]:
    return [mark(asset, 10.0 * k, 5.0) for k, asset in enumerate(ASSETS)]


# --- Landmarks --------------------------------------------------------------------------------------------------------


def test_no_landmark_is_unknown_that_its_asset_names(tmp_path: Path) -> None:
    further = [
        mark("walker.pedestrian.0027", 7.0, 7.0),
        mark("static.prop.KFC ", 8.0, 7.0, name="the chicken place"),
        mark("null.house_02", 9.0, 7.0, name="Annabel's house"),
        mark("static.prop.walgreens", 9.0, 9.0),
    ]
    session = read_session(session_folder(tmp_path / "s", [], [*all_marks(), *further]))
    names = [row["name"] for row in session.header.landmarks]
    assert names == [*ASSETS.values(), "Person", "KFC", "House", "Unknown"]
    assert session.report.unknown["config.json: landmark 'static.prop.walgreens'"] == 1


def test_tasks_plans_and_hidden_places_find_landmarks_by_asset_and_variable(tmp_path: Path) -> None:
    log = [
        done(20, "planning", "GoalUpdate", "Landmark", ["static.prop.kfc", {"asset": "null.house"}]),
        done(30, "planning", "StatusUpdate", "Status", ["static.prop.kfc", "Completed"]),
        done(35, "planning", "StatusUpdate", "Status", {"asset": "null.shell", "status": "Pending"}),
    ]
    session = read_session(session_folder(tmp_path / "s", log, all_marks()))
    marks = session.header.landmarks
    assert [row["name"] for row in marks if row["hidden"]] == ["House"]
    subgoals = session.header.subgoals
    assert [marks[row["landmark"]]["name"] for row in subgoals] == ["KFC", "Person", "House"]
    assert [tuple(row["after"]) for row in subgoals] == [(), (0,), (0, 1)]
    assert [(row["delete"], row["trigger"]) for row in subgoals] == [(True, False), (False, True), (False, False)]
    assert session.report.unknown["task: subgoal to '$NOBODY'"] == 1
    assert session.report.unknown["task: after 1 of a subgoal"] == 1
    beliefs = [event.data for event in session.of_type(EventType.BELIEF_UPDATE)]
    assert beliefs[0]["landmarks"] == ["KFC", "House"]
    assert [(b["landmark"], b["status"]) for b in beliefs[1:]] == [("KFC", "Complete"), ("Shell", "Pending")]


def test_of_several_houses_the_place_of_the_variable_decides(tmp_path: Path) -> None:
    houses = [mark("null.house", 0.0, 5.0), mark("null.house", 82.0, 6.0), mark("static.prop.kfc", 9.0, 9.0)]
    session = read_session(session_folder(tmp_path / "s", [], houses))
    assert [row["hidden"] for row in session.header.landmarks] == [False, True, False]


def test_tasks_of_the_config_file_complete_those_of_the_task_file(tmp_path: Path) -> None:
    bare = [{"destination": "$P1"}, {"destination": "$P2", "description": "Home"}]
    marked = [{"description": "Eat", "delete": "true"}, {"after": [0]}]
    folder = session_folder(tmp_path / "s", [], all_marks(), task={**TASK, "subgoals": bare})
    config = json.loads((folder / "config.json").read_text())
    config["task"]["subgoals"] = marked
    (folder / "config.json").write_text(json.dumps(config))
    first, last = read_session(folder).header.subgoals
    assert (first["description"], first["delete"], tuple(last["after"])) == ("Eat", True, (0,))


def test_plan_of_the_release_layout_names_assets(tmp_path: Path) -> None:
    folder = session_folder(tmp_path / "s", [], all_marks())
    (folder / "gamelog.json").rename(folder / "annotated_log.json")
    plan = [
        {"frame": 5, "landmark": "static.prop.kfc", "status": "Ongoing"},
        {"frame": 50, "landmark": "null.house", "status": "Completed"},
    ]
    (folder / "plan.json").write_text(json.dumps(plan))
    session = read_session(folder)
    assert [event.data["landmark"] for event in session.of_type(EventType.SUBGOAL)] == ["KFC", "House"]


@pytest.mark.parametrize("name", ASSETS.values())
def test_written_assets_are_those_that_the_published_loader_looks_up(tmp_path: Path, name: str) -> None:
    own = next(asset for asset, label in ASSETS.items() if label == name)
    read = read_session(session_folder(tmp_path / "s", [], [mark(own, 1.0, 2.0)]))
    plain = Session.load(read.save(tmp_path / "native"))
    config = dict(plain.header.config)
    config.pop("sdn", None)
    ours = replace(plain, header=replace(plain.header, config=config))
    written = json.loads((write_sdn(ours, tmp_path / "log_1") / "config.json").read_text())
    (row,) = written["environment"]["landmarks"]
    assert (row["asset"], row["name"]) == (own, name)


# --- Slots ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("slot_type", "slot_val", "values"),
    [
        ("Action", {"act": "JTurn", "slot_type": None, "slot_val": None}, {ActionValue.J_TURN}),
        (
            "Action",
            {"act": "Jturn", "slot_type": "Street", "slot_val": "Fuller"},
            {ActionValue.J_TURN, StreetName.FULLER},
        ),
        (None, {"act": "UTurn"}, {ActionValue.U_TURN}),
        ("Landmark", {"asset": "static.prop.kfc", "name": "our chicken"}, {LandmarkName.KFC}),
        ("Landmark", "walker.pedestrian.0001", {LandmarkName.PERSON}),
        ("Landmark", ["static.prop.ikea", "Seven Eleven"], {LandmarkName.IKEA, LandmarkName.SEVEN_ELEVEN}),
        ("Status", {"landmark": "null.house", "status": "Completed"}, {LandmarkName.HOUSE, Status.COMPLETE}),
        (["Landmark", "Street"], {"Landmark": "Coco", "StreetName": "Baits"}, {LandmarkName.COCO, StreetName.BAITS}),
        (["Landmark", "Status"], ["Coco", {"value": "Ongoing"}], {LandmarkName.COCO, Status.ONGOING}),
        ("Object", 10, {ObjectClass.VEHICLES}),
        ("Street", None, {StreetName.UNKNOWN}),
    ],
)
def test_no_slot_is_lost_that_the_ontology_knows(tmp_path: Path, slot_type: Any, slot_val: Any, values: Any) -> None:
    log = [said(30, "dorothy", "There.", "Instruct", slot_type, slot_val)]
    session = read_session(session_folder(tmp_path / "s", log, all_marks()))
    (move,) = session.moves()
    assert move.act.slots == values
    assert not [name for name in session.report.unknown if name.startswith(("slot", "act"))]


def test_what_no_slot_can_hold_is_kept_and_counted_once_for_each_kind(tmp_path: Path) -> None:
    odd = {"act": "JTurn", "slot_type": "RoadID", "slot_val": 12}
    log = [said(30 + k, "dorothy", f"There, {k}.", "Instruct", "Action", odd) for k in range(3)]
    log.append(said(40, "dorothy", "To State Street.", "Instruct", "Street", "State Street"))
    log.append(said(41, "dorothy", "Ahem.", "Instruct", "Street", {"street": "Fuller", "side": "left"}))
    session = read_session(session_folder(tmp_path / "s", log, all_marks()))
    acts = [move.act.slots for move in session.moves()]
    assert acts == [*[{ActionValue.J_TURN}] * 3, {StreetName.UNKNOWN}, {StreetName.FULLER}]
    assert session.report.unknown["slot value RoadID=12 (left out)"] == 3
    assert session.report.unknown["slot value Street=State Street (left out)"] == 1
    assert session.report.unknown["slot value Street.side=left (left out)"] == 1
    kept = [event.data["sdn_act"] for event in session.of_type(EventType.DIALOGUE_MOVE)]
    assert kept[0] == {"slots_left_out": {"RoadID": [12]}}
    again = read_session(write_sdn(session, tmp_path / "log_1"))
    assert again.events == session.events


def test_release_slots_may_be_objects_too(tmp_path: Path) -> None:
    act = {"move": 1, "slots": {"Action": [{"act": "JTurn"}, "Start"], "Landmark": "static.prop.kfc"}, "exchange": 0}
    row = {"frame": 30, "type": "DialogueMove", "from": "dorothy", "flag": True, "utterance_gt": "Go.", "act": act}
    folder = session_folder(tmp_path / "s", [row], all_marks())
    (folder / "gamelog.json").rename(folder / "annotated_log.json")
    (move,) = read_session(folder).moves()
    assert move.act.slots == {ActionValue.J_TURN, ActionValue.START, LandmarkName.KFC}


def test_arguments_of_actions_may_be_objects(tmp_path: Path) -> None:
    log = [
        done(10, "physical", "LaneSwitch", "Direction", "Left"),
        done(11, "physical", "LaneSwitch", None, {"Direction": 2}),
        done(12, "physical", "JTurn", "Angle", {"angle": 90.0, "label": "left"}),
        done(13, "physical", "SpeedChange", None, {"slot_type": "Speed", "slot_val": -5}),
    ]
    actions = read_session(session_folder(tmp_path / "s", log, all_marks())).physical_actions
    assert [(action.angle, action.up) for action in actions] == [(90, None), (-90, None), (90, None), (None, False)]


# --- Places -----------------------------------------------------------------------------------------------------------


def test_position_places_a_landmark_despite_placeholder_numbers(tmp_path: Path) -> None:
    town = load_town(TOWN)
    lane = streets_lane(town)
    far = max(town.lanes, key=lambda other: float(np.hypot(*(other.position(0.0) - lane.position(0.0)))))
    x, y = lane.position(30.0, lateral=0.4)
    row = mark("static.prop.kfc", float(x), float(y), road_id=far.road_id, lane_id=far.lane_id)
    (found,) = read_session(session_folder(tmp_path / "s", [], [row])).header.landmarks
    assert found["lane"] == lane.id and found["station"] == pytest.approx(30.0, abs=0.5)
    assert found["street"] == lane.street


def test_numbers_choose_between_lanes_that_are_equally_close(tmp_path: Path) -> None:
    town = load_town(TOWN)
    lane = streets_lane(town)
    other = next(each for each in town.lanes if each.road_id == lane.road_id and each.lane_id != lane.lane_id)
    middle = (lane.position(30.0) + other.position(other.project(lane.position(30.0))[0])) / 2
    for wanted in (lane, other):
        numbers = {"road_id": wanted.road_id, "lane_id": wanted.lane_id}
        row = mark("static.prop.kfc", float(middle[0]), float(middle[1]), **numbers)
        (found,) = read_session(session_folder(tmp_path / f"s{wanted.id}", [], [row])).header.landmarks
        assert found["lane"] == wanted.id


def test_turn_into_a_road_with_one_approach_is_resolved_wherever_the_car_is(tmp_path: Path) -> None:
    town = load_town(TOWN)
    approaches: dict[int, set[tuple[int, int]]] = {}
    for lane in town.lanes:
        for way in town.exits(lane.id):
            if way.junction_id >= 0:
                road = town.lanes[way.connector].road_id
                approaches.setdefault(road, set()).add((lane.road_id, way.angle))
    road, ((_, angle),) = next((road, tuple(found)) for road, found in approaches.items() if len(found) == 1)
    log = [done(20, "physical", "JTurn", "RoadID", road), done(60, "physical", "JTurn", "RoadID", 99999)]
    session = read_session(session_folder(tmp_path / "s", log, all_marks()))
    turns = [action for action in session.physical_actions if action.action is PhysicalAction.J_TURN]
    assert [turn.angle for turn in turns] == [angle, None]
    assert session.report.facts["turns_into_a_road"] == {"found": 1, "unknown": 1}


# --- Audio ------------------------------------------------------------------------------------------------------------


def flac(seconds: float, rate: int = 16000) -> bytes:
    """Header of a FLAC file of silence; the samples are not needed."""
    bits = (rate << 44) | (0 << 41) | (15 << 36) | round(seconds * rate)
    info = struct.pack(">HH", 4096, 4096) + b"\0" * 6 + bits.to_bytes(8, "big") + b"\0" * 16
    return b"fLaC" + b"\x80" + len(info).to_bytes(3, "big") + info


def test_audio_headers_give_durations_and_no_start_is_negative(tmp_path: Path) -> None:
    log = [
        said(10, "dorothy", "Well, let us go to the chicken place on Fuller then.", "Instruct"),
        said(100, "dorothy", "Left here.", "Instruct"),
        said(200, "wizard", "Left it is.", "Acknowledge"),
        said(300, "dorothy", "Fine.", "Acknowledge"),
        said(350, "dorothy", "Stop.", "Instruct"),
    ]
    folder = session_folder(tmp_path / "s", log, all_marks())
    audio = folder / "audio"
    audio.mkdir()
    (audio / "100.flac").write_bytes(flac(2.5))
    with wave.open(str(audio / "200.wav"), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(b"\0\0" * 12000)
    (audio / "300.flac").write_bytes(flac(200.0))
    (audio / "350.flac").write_bytes(b"fLaC cut off")
    session = read_session(folder)
    times = [(said.start, said.end) for said in session.utterances()]
    assert times == [(0.0, 1.0), (7.5, 10.0), (18.5, 20.0), (0.0, 30.0), (34.6, 35.0)]
    files = [event.data.get("audio") for event in session.of_type(EventType.DIALOGUE_MOVE)]
    assert files == [None, "100.flac", "200.wav", "300.flac", None]
    assert session.report.repaired["audio: audio files without a usable header were not used"] == 1
    assert session.report.repaired["times of utterances without audio were guessed from their words"] == 2


# --- The whole command line -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("folders", "options"), [(("train/s0", "test/seen/s1"), []), (("s1",), ["--split", "all"])], ids=["folds", "alone"]
)
def test_evaluate_runs_on_a_sample_session(tmp_path: Path, folders: tuple[str, ...], options: list[str]) -> None:
    log = [
        said(90, "wizard", "Which way?", "QueryW", "Action", "Queried"),
        said(60, "dorothy", "To the KFC.", "Instruct", "Landmark", {"asset": "static.prop.kfc"}),
        done(70, "physical", "Start"),
        said(120, "dorothy", "Left.", "ReplyW", "Action", {"act": "JTurn", "slot_type": None, "slot_val": None}),
        done(130, "physical", "JTurn", "RoadID", 5),
        done(250, "physical", "Stop"),
    ]
    for folder in folders:
        session_folder(tmp_path / folder, log, all_marks())
    result = CliRunner().invoke(app, ["evaluate", "--corpus", str(tmp_path), *options, "--json"])
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["nfd_points"] == 3
