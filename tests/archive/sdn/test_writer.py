from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.archive.sdn import SignVote, read_sdn, settle_sign, write_sdn
from dorothie_gym.archive.sdn.files import SCENE_FILE
from dorothie_gym.errors import SessionError
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType, SceneTable, Session, Surroundings
from dorothie_gym.session.recording.surroundings import light_rows
from tests.archive.sdn.builders import csv as csv_of
from tests.archive.sdn.builders import drive, release, sample
from tests.session.recording.builders import physical, session, utterance
from tests.session.recording.dialogues import TO_KFC, talk
from tests.session.recording.scenes import actors, lights


def event(frame: int, type_: EventType, source: Role = Role.CO_WIZARD, **data: Any) -> Event:
    return Event(frame=frame, type=type_, source=source, data=data)


def everything() -> list[Event]:
    """The talk, and events of every other kind."""
    spoken = utterance(270, Role.PARTICIPANT, 5, ("It's \u201cthere\u201d, isn't it?", TO_KFC))
    more = [replace(e, data={**e.data, "recognised": "its there", "transaction": 2, "mood": "glad"}) for e in spoken]
    return [
        *talk()[:-1],
        *more,
        event(271, EventType.PHYSICAL_ACTION, action="LaneSwitch", angle=90.0, up=None, why="van"),
        physical(272, PhysicalAction.LANE_SWITCH, angle=-90.0),
        physical(273, PhysicalAction.LIGHT_CHANGE, up=True, flagged=False),
        event(274, EventType.BELIEF_UPDATE, action="PlanUpdate", junctions=[4, 8]),
        event(275, EventType.BELIEF_UPDATE, action="GoalUpdate", landmarks=["KFC"]),
        event(276, EventType.BELIEF_UPDATE, action="StatusUpdate", landmark="KFC", status="Complete"),
        event(277, EventType.BELIEF_UPDATE, action="KnowledgeUpdate", landmark="House", x=1.25, y=-3.5),
        event(278, EventType.BELIEF_UPDATE, action="Other"),
        event(279, EventType.SUBGOAL, Role.AGENT, subgoal=0, landmark="KFC", status="Complete", cause="arrival"),
        event(280, EventType.EXCEPTION, Role.AD_WIZARD, kind="weather", parameter="wetness", value=70.0),
        event(281, EventType.EXCEPTION, Role.AD_WIZARD, kind="place_prop", prop="trafficcone", lane=1, x=2.0, y=3.0),
        event(282, EventType.EXCEPTION, Role.AD_WIZARD, kind="task_delete", subgoal=1, landmark="House"),
        event(283, EventType.EXCEPTION, Role.AD_WIZARD, kind="spawn_vehicles", count=2, x0=0.0, x1=1.0, y0=2.0, y1=3.0),
        event(284, EventType.MESSAGE, Role.AD_WIZARD, text="Never mind,\nstay, please."),
        event(285, EventType.REFUSAL, action="UTurn", reason="no room"),
        Event(frame=286, type=EventType.OTHER, source=Role.AGENT, data={"a": 1}, extra={"type": "Yawn", "loud": 2}),
        replace(physical(287, PhysicalAction.START), extra={"hint": [1]}),
        talk()[-1],
    ]


def in_tenths(events: Any) -> list[Event]:
    """Events with the time that SDN's frames can carry."""
    return [replace(event, frame=event.frame // 3 * 3) for event in events]


def written(folder: Path, name: str) -> Any:
    return json.loads((folder / name).read_text(encoding="utf-8"))


@pytest.fixture
def original() -> Session:
    whole = session(everything())
    return replace(whole, summary={"success": True})


def test_round_trip_preserves_everything_that_the_layout_can_hold(original: Session, tmp_path: Path) -> None:
    again = read_sdn(write_sdn(original, tmp_path / "log_1"))
    assert again.header == original.header
    assert list(again.events) == in_tenths(original.events)
    assert (again.summary, again.complete) == ({"success": True}, True)
    tenths = original.trajectory[original.trajectory["frame"] % 3 == 0]
    for name in ("frame", "x", "y"):
        assert np.array_equal(again.trajectory[name], tenths[name])
    assert np.allclose(again.trajectory["heading"], tenths["heading"], rtol=0, atol=1e-12)
    assert not again.report.unknown and not again.report.repaired


def test_unfinished_session_stays_unfinished(original: Session, tmp_path: Path) -> None:
    cut = replace(original, complete=False, summary=None)
    assert not read_sdn(write_sdn(cut, tmp_path / "log_1")).complete


def test_log_has_the_rows_that_the_original_readers_look_for(original: Session, tmp_path: Path) -> None:
    rows = written(write_sdn(original, tmp_path / "log_1"), "annotated_log.json")
    assert [row["frame"] for row in rows] == sorted(row["frame"] for row in rows)
    moves = [row for row in rows if row["type"] == "DialogueMove"]
    assert (moves[0]["from"], moves[0]["to"], moves[0]["flag"]) == ("dorothy", "wizard", True)
    assert moves[0]["utterance_gt"] == "To the KFC please." and "utterance" not in moves[0]
    assert moves[0]["act"]["move"] == "Instruct" and moves[0]["act"]["slots"] == {"Landmark": ["KFC"]}
    assert isinstance(moves[0]["act"]["exchange"], int)
    assert moves[-1]["utterance"] == "its there"
    actions = [row["val"] for row in rows if row["type"] == "PhysicalAction"]
    turns = [val for val in actions if val["act"] == "JTurn"]
    assert [val["slot_val"] for val in turns] == [88.0, -179.0]
    assert [val["slot_val"] for val in actions if val["act"] == "LaneSwitch"] == [3, 2]
    assert [(3 - 2.5) * 180, (2 - 2.5) * 180] == [90, -90], "what the published code makes of them"
    assert [val["slot_val"] for val in actions if val["act"] == "SpeedChange"] == [5.0]
    assert [val["slot_val"] for val in actions if val["act"] == "LightChange"] == ["On"]


def test_speech_has_a_row_for_each_frame(original: Session, tmp_path: Path) -> None:
    rows = written(write_sdn(original, tmp_path / "log_1"), "annotated_log.json")
    first = [row for row in rows if row["type"] == "Speech" and row["utterance_filename"] == "utterance_0.flac"]
    assert [row["frame"] for row in first] == list(range(0, 11))
    assert {(row["from"], row["start_frame"], row["end_frame"]) for row in first} == {("dorothy", 0, 10)}


def test_plan_opens_a_goal_before_it_closes_it(original: Session, tmp_path: Path) -> None:
    folder = write_sdn(original, tmp_path / "log_1")
    rows = [row for row in written(folder, "plan.json") if row["landmark"] == "KFC"]
    assert [(row["frame"], row["status"]) for row in rows] == [(0, "Ongoing"), (93, "Complete")]
    assert written(folder, "detailed_plan.json") == [
        {"frame": 91, "junctions": [4, 8], "objective": None},
        {"frame": 91, "junctions": None, "objective": ["KFC"]},
    ]


def test_ad_wizard_log_is_csv_with_a_space_after_the_comma(original: Session, tmp_path: Path) -> None:
    lines = (write_sdn(original, tmp_path / "log_1") / "ad_wizardlog.csv").read_text().splitlines()
    rows = [line.split(", ") for line in lines]
    assert rows[0] == ["9.3", "93", "set_weather", "wetness", "70.0"]
    assert rows[1][2:6] == ["prop_create", "static.prop.trafficcone", "0", "2.0"] and len(rows[1]) == 11
    assert [row[2] for row in rows[2:]] == ["make_cars", "message"]


def test_trajectory_is_csv_at_ten_frames_a_second(original: Session, tmp_path: Path) -> None:
    text = (write_sdn(original, tmp_path / "log_1") / "trajectory.csv").read_text()
    assert text.splitlines()[0] == "frame, x, y, yaw, junction_id, road_id, lane_id"
    rows = list(csv.DictReader(text.splitlines(), skipinitialspace=True))
    assert [int(row["frame"]) for row in rows] == list(range(100))
    assert float(rows[10]["x"]) == 6.0 and math.isclose(float(rows[10]["yaw"]), math.degrees(0.1))


def test_a_known_town_gives_opendrive_numbers(tmp_path: Path) -> None:
    town = load_town("brookside")
    lane = next(lane for lane in town.lanes if lane.in_junction)
    rows = ({"name": "KFC", "lane": lane.id, "station": 1.0, "x": 0.0, "y": 0.0, "street": -1, "hidden": False},)
    played = session(town="brookside", landmarks=rows, subgoals=(), departure=(lane.id, 2.0))
    played.trajectory["lane"] = lane.id
    played.trajectory["x"], played.trajectory["y"] = lane.position(1.0)
    folder = write_sdn(played, tmp_path / "log_1")
    config = written(folder, "config.json")["environment"]
    numbers = {"lane_id": lane.lane_id, "road_id": lane.road_id, "junction_id": lane.junction_id}
    (landmark,) = config["landmarks"]
    assert config["map"] == "brookside" and landmark["wp"]["OpenDriveID"] == numbers
    x, y = lane.position(1.0)
    location = landmark["wp"]["Transform"]["Location"]
    assert (location["x"], location["y"]) == (pytest.approx(x), pytest.approx(y))
    ids = f"{lane.junction_id}, {lane.road_id}, {lane.lane_id}"
    assert all(line.endswith(ids) for line in (folder / "trajectory.csv").read_text().splitlines()[1:])
    assert (read_sdn(folder).trajectory["lane"] == lane.id).all()


def test_without_our_own_fields_the_layout_still_reads(original: Session, tmp_path: Path) -> None:
    """The same session as another program writes it in this layout."""
    folder = write_sdn(original, tmp_path / "log_1")
    config = written(folder, "config.json")
    del config["dorothie_gym"]
    rows = [row for row in written(folder, "annotated_log.json") if "dorothie_gym" not in row]
    for row in rows:
        for name in ("span", "utterance", "start", "end", "more"):
            row.get("act", {}).pop(name, None)
    (folder / "config.json").write_text(json.dumps(config))
    (folder / "annotated_log.json").write_text(json.dumps(rows))
    again = read_sdn(folder)
    assert [move.act for move in again.moves()] == [move.act for move in original.moves()]
    assert [len(u.moves) for u in again.utterances()] == [len(u.moves) for u in original.utterances()]
    for found, said in zip(again.utterances(), original.utterances(), strict=True):
        assert (found.start, found.end) == pytest.approx((said.start, said.end), abs=0.05)
    assert [(a.action, a.angle, a.up) for a in again.physical_actions] == [
        (a.action, a.angle, a.up) for a in original.physical_actions
    ]
    assert again.header.street_names == original.header.street_names
    assert [row["name"] for row in again.header.landmarks] == ["KFC", "House"]
    assert [e.data["kind"] for e in again.of_type(EventType.EXCEPTION)] == ["weather", "place_prop", "spawn_vehicles"]
    assert again.of_type(EventType.MESSAGE)[0].data["text"] == "Never mind, stay, please."
    assert again.header.config["sdn"]["first_frame"] == 0


@pytest.mark.parametrize("make", [release, sample])
def test_session_of_the_corpus_goes_there_and_back(tmp_path: Path, make: Any) -> None:
    read = read_sdn(make(tmp_path / "log_1"))
    again = read_sdn(write_sdn(read, tmp_path / "log_2"))
    assert again.header == read.header
    assert again.events == read.events
    assert again.trajectory.tobytes() == read.trajectory.tobytes() or np.allclose(
        again.trajectory["heading"], read.trajectory["heading"], rtol=0, atol=1e-12
    )
    assert all(np.array_equal(again.scene.columns[n], column) for n, column in read.scene.columns.items())


def test_our_sessions_have_no_voice_in_the_sign_of_others(tmp_path: Path) -> None:
    ours = [
        write_sdn(replace(read_sdn(release(tmp_path / "log_0")), name=str(k)), tmp_path / f"o{k}") for k in range(3)
    ]
    theirs = release(tmp_path / "log_9", trajectory__csv=csv_of(drive(90.0)))
    sign = settle_sign([*ours, theirs])
    assert sign == SignVote(right=1)
    assert [a.angle for a in read_sdn(ours[0], sign=sign).physical_actions][1] == 90.0


def test_existing_folder_is_kept_and_no_temporary_folder_remains(original: Session, tmp_path: Path) -> None:
    write_sdn(original, tmp_path / "log_1")
    with pytest.raises(SessionError, match="log_1: exists already"):
        write_sdn(session(), tmp_path / "log_1")
    bad = session([event(1, EventType.REFUSAL, reason=math.inf)])
    with pytest.raises(SessionError, match="reason is inf"):
        write_sdn(bad, tmp_path / "log_2")
    assert [path.name for path in tmp_path.iterdir()] == ["log_1"]


def test_surroundings_survive_the_round_trip(tmp_path: Path) -> None:
    frames = np.arange(0, 300, 15)
    around = np.concatenate([actors(k % 3, seed=k) for k in range(len(frames))])
    offsets = np.concatenate(([0], np.cumsum([k % 3 for k in range(len(frames))])))
    shown = [light_rows(lights(int(frame))) for frame in frames]
    scene = Surroundings(
        actors=SceneTable(frames, offsets, around),
        lights=SceneTable(frames, np.arange(len(frames) + 1) * 2, np.concatenate(shown)),
    )
    played = replace(session(talk()), scene=scene)
    again = read_sdn(write_sdn(played, tmp_path / "log_1"))
    assert again.scene.actors.equals(scene.actors)
    assert again.scene.lights.equals(scene.lights)
    assert not again.report.unknown and "files_not_read" not in again.report.facts
    write_sdn(session(talk()), tmp_path / "log_2")
    assert not (tmp_path / "log_2" / SCENE_FILE).exists(), "nothing was recorded, nothing is written"


def test_surroundings_between_the_frames_that_are_left_go_with_them(tmp_path: Path) -> None:
    frames = np.array([3, 4, 6])
    scene = Surroundings(actors=SceneTable(frames, np.array([0, 1, 2, 3]), actors(3)))
    again = read_sdn(write_sdn(replace(session(talk()), scene=scene), tmp_path / "log_1"))
    assert again.scene.actors.frames.tolist() == [3, 6]
    assert again.scene.actors.rows["key"].tolist() == [100, 102]


def test_a_damaged_file_of_surroundings_is_named(tmp_path: Path) -> None:
    scene = Surroundings(actors=SceneTable(np.array([3]), np.array([0, 1]), actors(1)))
    folder = write_sdn(replace(session(talk()), scene=scene), tmp_path / "log_1")
    (folder / SCENE_FILE).write_bytes(b"PAR1 no")
    with pytest.raises(SessionError, match=SCENE_FILE):
        read_sdn(folder)
