from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dorothie_gym.archive import nfd_points, rfn_points, ufn_points
from dorothie_gym.archive.sdn import SdnLayout, SignVote, detect_layout, read_sdn, settle_sign
from dorothie_gym.ontology import LandmarkName, ObjectClass, PhysicalAction, Role, StreetName
from dorothie_gym.session.recording import EventType, Session
from tests.archive.sdn.builders import (
    DETAILED_PLAN,
    FIRST,
    PLAN,
    belief,
    config,
    csv,
    deed,
    drive,
    edited,
    hub,
    landmark,
    log,
    move,
    release,
    sample,
    speech,
)

MAPS = Path(__file__).parents[3] / "../shared/maps"


def angles(session: Session) -> list[float | None]:
    return [a.angle for a in session.physical_actions if a.action is PhysicalAction.J_TURN]


def test_layouts_are_detected_by_their_files(tmp_path: Path) -> None:
    assert detect_layout(release(tmp_path / "r")) is SdnLayout.RELEASE
    assert detect_layout(sample(tmp_path / "s")) is SdnLayout.SAMPLE
    assert detect_layout(hub(tmp_path / "h")) is SdnLayout.HUB
    assert detect_layout(tmp_path) is None


# --- Release layout -------------------------------------------------------------------------------------------------


def test_moves_come_in_order_with_their_acts_and_both_transcripts(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    moves = session.moves()
    assert [m.act.move.label for m in moves] == ["Instruct", "Acknowledge", "Explain", "Explain", "ReplyN"]
    assert moves[3].act.slots == {ObjectClass.VEHICLES, StreetName.FULLER}
    assert (moves[1].text, moves[1].recognised) == ("Sure, it's noted.", "sure, it's noted.")
    assert session.report.repaired["transcripts: U+2019 was read as an apostrophe"] == 4
    assert session.report.repaired["annotated_log.json: rows were out of order by frame, and were put in order"] >= 1
    assert all(m.flagged and m.exchange == 1 for m in moves)


def test_rows_of_one_utterance_are_one_utterance(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    assert [len(u.moves) for u in session.utterances()] == [1, 2, 1, 1]
    assert [u.number for u in session.utterances()] == [0, 1, 2, 3]


def test_speech_gives_an_utterance_its_times_and_no_events(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    spoken = session.moves()[0]
    assert (spoken.start, spoken.end, spoken.frame) == (1.0, 2.2, 66)
    assert session.events[spoken.index].data["audio"] == "utterance_0.flac"
    assert session.report.facts["stretches_of_speech"] == 1
    assert not [event for event in session.events if event.type is EventType.OTHER and "Speech" in event.type_name]
    guessed = session.moves()[-1]
    assert guessed.end == 19.5 and guessed.start == pytest.approx(19.5 - 3 / 2.5)


def test_actions_have_our_arguments(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    assert [(a.action.label, a.angle, a.up) for a in session.physical_actions] == [
        ("Start", None, None),
        ("JTurn", 90.0, None),
        ("LaneSwitch", -90.0, None),
        ("LaneSwitch", 90.0, None),
        ("SpeedChange", None, False),
        ("LightChange", None, True),
        ("Stop", None, None),
    ]
    assert session.physical_actions[-1].source is Role.AGENT
    assert session.report.facts["lane_switch_values"] == {"2": 1, "3": 1}
    assert len(list(nfd_points(session))) == 4
    assert (len(list(ufn_points(session))), len(list(rfn_points(session)))) == (3, 2)


def test_beliefs_are_read_once_though_two_files_tell_of_them(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    beliefs = [(event.frame, dict(event.data)) for event in session.of_type(EventType.BELIEF_UPDATE)]
    assert beliefs == [
        (75, {"action": "GoalUpdate", "landmarks": ["KFC"]}),
        (78, {"action": "PlanUpdate", "junctions": [7, 9]}),
        (360, {"action": "PlanUpdate", "junctions": [9]}),
        (600, {"action": "StatusUpdate", "landmark": "KFC", "status": "Complete"}),
        (630, {"action": "KnowledgeUpdate", "x": 3.5, "y": -2.0}),
    ]


def test_the_plan_gives_subgoals_and_their_changes(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    assert [row["landmark"] for row in session.header.subgoals] == [0]
    changes = [(e.frame, e.data["subgoal"], e.data["status"]) for e in session.of_type(EventType.SUBGOAL)]
    assert changes == [(60, 0, "Ongoing"), (600, 0, "Complete")]


def test_deeds_of_the_ad_wizard_are_exceptions(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    exceptions = [dict(event.data) for event in session.of_type(EventType.EXCEPTION)]
    assert exceptions[0] == {"kind": "weather", "parameter": "fog_density", "value": 80.0}
    assert (exceptions[1]["kind"], exceptions[1]["prop"], exceptions[1]["x"]) == ("place_prop", "streetbarrier", 10.0)
    assert exceptions[2] == {"kind": "spawn_pedestrians", "count": 5, "x0": -10.0, "x1": 10.0, "y0": -20.0, "y1": 20.0}
    assert exceptions[3]["kind"] == "spawn_vehicles"
    (message,) = session.of_type(EventType.MESSAGE)
    assert (message.frame, message.data["text"]) == (270, "Your friend calls, buy milk.")
    assert session.report.unknown["ad_wizardlog.csv: type 'camera_shake'"] == 1
    assert any(event.type_name == "sdn:camera_shake" for event in session.events)


def test_header_has_the_town_its_streets_and_landmarks(tmp_path: Path) -> None:
    header = read_sdn(release(tmp_path / "log_1")).header
    assert (header.town, header.source, header.seed) == ("Town97", "sdn-release", None)
    assert header.street_names == ("Baits", "Fuller")
    assert [(row["name"], row["hidden"], row["x"]) for row in header.landmarks] == [
        ("KFC", False, 5.0),
        ("SevenEleven", True, 0.0),
    ]
    assert header.config["sdn"]["first_frame"] == FIRST


def test_speed_of_a_frame_does_not_depend_on_later_frames(tmp_path: Path) -> None:
    rows = drive()
    stops = [*rows[:100], *((FIRST + k, *rows[99][1:]) for k in range(100, 300))]
    one, other = (
        read_sdn(release(tmp_path / name, **{"trajectory.csv": csv(way)})) for name, way in (("a", rows), ("b", stops))
    )
    np.testing.assert_array_equal(one.trajectory["speed"][:100], other.trajectory["speed"][:100])
    assert one.trajectory["speed"][99] == pytest.approx(6.0, rel=1e-3)


def test_the_car_goes_where_the_file_says(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    assert session.trajectory["frame"].tolist() == list(range(0, 900, 3))
    assert session.trajectory["heading"][-1] == pytest.approx(-math.pi / 2)
    assert session.trajectory["speed"][10] == pytest.approx(6.0, rel=1e-3)
    assert np.isnan(session.trajectory["steer"]).all() and (session.trajectory["lane"] == -1).all()
    assert session.scene.columns["junction_id"][[0, 90, 200]].tolist() == [-1, 7, -1]


def test_session_is_sound_and_survives_being_saved(tmp_path: Path) -> None:
    session = read_sdn(release(tmp_path / "log_1"))
    assert session.check() == () and session.complete
    again = Session.load(session.save(tmp_path / "native"))
    assert (again.digest, again.events) == (session.digest, session.events)


def test_yaw_in_radians_is_recognised(tmp_path: Path) -> None:
    rows = [(f, x, y, math.radians(yaw), *ids) for f, x, y, yaw, *ids in drive()]
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv=csv(rows)))
    assert session.trajectory["heading"][-1] == pytest.approx(-math.pi / 2)


# --- Sign of angles -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("turn", "angle", "positive"), [(-90.0, 90.0, "left"), (90.0, -90.0, "right")])
def test_the_sign_is_settled_by_where_the_car_went(tmp_path: Path, turn: float, angle: float, positive: str) -> None:
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv=csv(drive(turn))))
    assert angles(session) == [angle]
    assert session.report.facts["turn_angles"] == {"positive": positive, "agreement": 1.0, "turns": 1}


def test_the_whole_corpus_determines_the_sign(tmp_path: Path) -> None:
    folders = [release(tmp_path / f"log_{k}", trajectory__csv=csv(drive(90.0))) for k in range(3)]
    folders.append(release(tmp_path / "log_9"))
    (tmp_path / "log_8").mkdir()
    sign = settle_sign([*folders, tmp_path / "log_8"])
    assert sign == SignVote(left=1, right=3)
    assert angles(read_sdn(folders[-1], sign=sign)) == [-90.0]
    assert sign.to_json() == {"positive": "right", "agreement": 0.75, "turns": 4}


def test_without_a_junction_positive_is_left(tmp_path: Path) -> None:
    rows = [(f, x, y, yaw, -1, road, lane) for f, x, y, yaw, _, road, lane in drive(90.0)]
    session = read_sdn(release(tmp_path / "log_1", trajectory__csv=csv(rows)))
    assert angles(session) == [90.0]
    assert session.report.facts["turn_angles"]["agreement"] is None


def test_lane_switches_of_other_values_have_no_angle_and_are_reported(tmp_path: Path) -> None:
    rows = [deed(5 * k, "LaneSwitch", "Direction", value) for k, value in enumerate([1, "2", 0, None])]
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=rows))
    assert [a.angle for a in session.physical_actions] == [90.0, -90.0, None, None]
    assert session.report.facts["lane_switch_values"] == {"0": 1, "1": 1, "2": 1, "None": 1}
    assert session.report.missing["argument of LaneSwitch"] == 2


# --- Other layouts --------------------------------------------------------------------------------------------------


def test_sample_layout_is_read(tmp_path: Path) -> None:
    session = read_sdn(sample(tmp_path / "one"))
    header = session.header
    assert (header.story, header.storyboard, header.source) == ("Eat, then go home.", "errand", "sdn-sample")
    assert [(row["landmark"], row["description"]) for row in header.subgoals] == [(0, "Eat."), (1, "Rest.")]
    assert [row["hidden"] for row in header.landmarks] == [False, True]
    assert header.landmarks[0]["station"] == 12.5
    moves = session.moves()
    assert [(m.act.move.label, m.exchange, m.transaction) for m in moves] == [
        ("Instruct", 0, 0),
        ("Acknowledge", 0, 0),
        ("Irrelevant", None, 0),
    ]
    assert moves[0].act.slots == {StreetName.FULLER}
    assert all(m.flagged for m in moves) and session.check() == ()
    (goal,) = session.of_type(EventType.BELIEF_UPDATE)
    assert goal.data["landmarks"] == ["KFC"]


def test_turn_into_a_road_is_unknown_and_counted_without_the_map(tmp_path: Path) -> None:
    session = read_sdn(sample(tmp_path / "one"))
    assert angles(session) == [None]
    assert session.report.facts["turns_into_a_road"] == {"found": 0, "unknown": 1}
    (point, _) = nfd_points(session)
    assert math.isnan(point.angle)


def test_turn_into_a_road_has_the_angle_of_the_map(tmp_path: Path) -> None:
    from dorothie_gym.maps import load_town

    if not (MAPS / "Town02.xodr").exists():
        pytest.skip("the map Town02.xodr is not on this machine")
    town = load_town(MAPS / "Town02.xodr")
    checked = 0
    for lane in town.lanes:
        ways = [way for way in town.exits(lane.id) if way.junction_id >= 0]
        roads = [town.lanes[way.lane].road_id for way in ways]
        if lane.in_junction or len(set(roads)) < 2 or len(roads) != len(set(roads)) or lane.length < 20:
            continue
        x, y = lane.position(5.0)
        where = csv([(90, x, y, math.degrees(lane.heading_at(5.0)), -1, lane.road_id, lane.lane_id)])
        rows = [{**deed(0, "JTurn", "RoadID", road), "frame": 90 + k} for k, road in enumerate(roads)]
        settings = config()
        settings["environment"]["map"] = "Town02"
        folder = sample(tmp_path / str(lane.id), config__json=settings, trajectory__csv=where, gamelog__json=rows)
        session = read_sdn(folder, maps=MAPS)
        assert angles(session) == [float(way.angle) for way in ways]
        assert session.trajectory["lane"][0] == lane.id
        checked += 1
        if checked == 3:
            break
    assert checked == 3


@pytest.mark.parametrize("wrapped", [False, True])
def test_hub_layout_is_read_as_far_as_it_is_understood(tmp_path: Path, wrapped: bool) -> None:
    value: Any = {"events": log(), "worker": {"id": 3}, "version": 2} if wrapped else log()
    session = read_sdn(hub(tmp_path / "log_1", value))
    assert (len(session.moves()), len(session.physical_actions)) == (5, 7)
    assert len(session.trajectory) == 0 and session.header.town == "unknown"
    named = set(session.report.unknown)
    assert ({"dialog_log.json: field 'worker'", "dialog_log.json: field 'version'"} <= named) is wrapped
    assert session.check() == ()
    assert Session.load(session.save(tmp_path / "native")).digest == session.digest


# --- Unknown values -------------------------------------------------------------------------------------------------


def test_unknown_values_are_kept_and_named(tmp_path: Path) -> None:
    def change(rows: list[dict[str, Any]]) -> None:
        rows.append(move(50, "dorothy", "Hm.", "Hum"))
        rows.append(move(51, "dorothy", "To Mars.", "Instruct", {"Landmark": ["Mars", "KFC"]}, mood="odd"))
        rows.append({"frame": FIRST + 52, "type": "Heartbeat", "from": "agent", "rate": 70})
        rows.append(move(53, "narrator", "Once upon a time.", "Explain"))
        rows.append(belief(54, "GoalUpdate", ["Mars"]))
        rows[0]["act"] = None

    settings = config(operator="x")
    settings["environment"]["landmarks"].append(landmark("Mars", 1.0, 1.0))
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=edited(change), config__json=settings))
    unknown = "\n".join(session.report.unknown)
    for part in (
        "row of type 'DialogueMove' (dialogue move: 'Hum' is unknown",
        "slot value Landmark=Mars (left out)",
        "field 'mood' of DialogueMove",
        "row of type 'Heartbeat'",
        "from 'narrator' is unknown",
        "argument of GoalUpdate",
        "config.json: field 'operator'",
        "config.json: landmark 'Mars'",
    ):
        assert part in unknown
    kept = {event.type_name: event.data for event in session.of_type(EventType.OTHER)}
    assert kept["sdn:Heartbeat"]["rate"] == 70
    (mars,) = [m for m in session.moves() if m.text == "To Mars."]
    assert mars.act.slots == {LandmarkName.KFC}
    assert session.events[mars.index].data["sdn"] == {"mood": "odd"}
    again = Session.load(session.save(tmp_path / "native"))
    assert again.events == session.events


def test_missing_files_and_fields_are_named(tmp_path: Path) -> None:
    rows = [{name: value for name, value in row.items() if name not in ("utterance", "flag")} for row in log()]
    nothing = {"plan__json": None, "detailed_plan__json": None, "ad_wizardlog__csv": None, "trajectory__csv": None}
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=rows, config__json={"npc_count": 1}, **nothing))
    missing = "\n".join(session.report.missing)
    for part in (
        "plan.json",
        "detailed_plan.json",
        "ad_wizardlog.csv",
        "trajectory.csv",
        "config.json: environment.map",
        "config.json: environment.landmarks",
        "utterance (the recogniser's transcript)",
        "annotated_log.json: flag",
        "map of",
    ):
        assert part in missing
    assert len(list(ufn_points(session))) == 3, "the flag is taken from the kind of event"
    assert all(move.recognised is None for move in session.moves())


def test_unflagged_events_are_no_points(tmp_path: Path) -> None:
    rows = [{**row, "flag": False} for row in log()]
    session = read_sdn(release(tmp_path / "log_1", annotated_log__json=rows))
    assert len(session.moves()) == 5 and not list(ufn_points(session)) and not list(nfd_points(session))


def test_pickles_are_never_opened(tmp_path: Path) -> None:
    folder = release(tmp_path / "log_1")
    (folder / "features.pkl").symlink_to("/dev/zero")  # a reader of the pipe never returns
    session = read_sdn(folder)
    assert session.report.facts["files_not_read"] == "carlalog.log, features.pkl"


def test_report_is_json_and_words(tmp_path: Path) -> None:
    report = read_sdn(release(tmp_path / "log_1")).report
    assert json.loads(json.dumps(report.to_json(), allow_nan=False))["layout"] == "release"
    assert "turn angles: positive left, agreement 1.0, turns 1" in report.lines()
    assert all("\n" not in line for line in report.lines())


def test_speech_of_another_speaker_gives_no_times(tmp_path: Path) -> None:
    rows = [*speech(10, 22, "wizard", 0), move(22, "dorothy", "Go on then.", "Instruct")]
    session = read_sdn(
        release(tmp_path / "log_1", annotated_log__json=rows, plan__json=PLAN, detailed_plan__json=DETAILED_PLAN)
    )
    assert "audio" not in session.events[session.moves()[0].index].data
