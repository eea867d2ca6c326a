"""Rooms: people come, drive, talk and leave; their sessions are recorded and played again."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.archive import first_difference
from dorothie_gym.evaluation.rollout import resimulate
from dorothie_gym.lab.console.config import AbsenceRules, AfterAbsence, WhileAway
from dorothie_gym.lab.console.connection import CloseCode
from dorothie_gym.lab.console.room import RoomState
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.session.recording import EventType, SeatEventKind, Session, read_seat_log
from tests.lab.console.people import Table
from tests.power_failure import Disk, disk, needs_linux

__all__ = ["disk"]


def load(folder: Path) -> Session:
    (found,) = folder.iterdir()
    return Session.load(found)


def assert_replays(session: Session, table: Table) -> None:
    assert session.complete
    assert first_difference(session, resimulate(session, table.room.engine.town)) is None


def test_session_waits_for_the_people_that_it_needs() -> None:
    table = Table("participant=human,co_wizard=human")
    participant = table.seat("participant")
    table.run(2.0)
    assert table.room.state is RoomState.WAITING and table.time == 0.0
    assert participant.state["state"] == "waiting"
    table.seat("co_wizard")
    table.run(1.0)
    assert table.room.state is RoomState.RUNNING and table.time == pytest.approx(1.0)


def test_open_seats_are_played_by_scripts_until_somebody_sits_down() -> None:
    table = Table("co_wizard=human")
    co_wizard = table.seat("co_wizard")
    table.until(lambda: any(line["who"] == "participant" for line in co_wizard.talk))
    participant = table.seat("participant")
    table.run(20.0)  # what the script had begun to say is over
    spoken = sum(line["who"] == "participant" for line in co_wizard.talk)
    table.run(10.0)
    assert sum(line["who"] == "participant" for line in co_wizard.talk) == spoken, "the script is silent now"
    assert participant.said(), "the talk before is restored for the person who sits down"
    participant.leave()
    table.until(lambda: sum(line["who"] == "participant" for line in co_wizard.talk) > spoken)


def test_two_people_drive_and_talk_and_the_session_replays(tmp_path: Path) -> None:
    table = Table("participant=human,co_wizard=human,ad_wizard=human", folder=tmp_path, max_seconds=20.0)
    participant, co_wizard, ad_wizard = map(table.seat, ("participant", "co_wizard", "ad_wizard"))
    table.run(1.0)
    participant.command("say", text="Please turn left. Then go to KFC.")
    co_wizard.command("drive", action="SpeedChange", up=True)
    co_wizard.command("goal", landmarks=["KFC"])
    x, y, _ = co_wizard.state["pose"]
    co_wizard.command("mark", landmark="Person", x=x, y=y)
    co_wizard.command("plan", junctions=[2, 0])
    co_wizard.command("status", landmark="KFC", status="Ongoing")
    ad_wizard.command("weather", parameter="fog_density", share=0.6)
    ad_wizard.command("fault", sensor="gps", on=True)
    ad_wizard.command("message", text="Hurry up.")
    table.run(6.0)
    assert participant.done == 1 and co_wizard.done == 5 and ad_wizard.done == 3
    assert co_wizard.state["cruise"] == 45
    assert [line["text"] for line in co_wizard.talk] == ["Please turn left. Then go to KFC."]
    assert participant.said()[-1] in ("Please turn left. Then go to KFC.", "Hurry up.")
    assert "Hurry up." in participant.said() and "Hurry up." in ad_wizard.said()
    assert "Hurry up." not in co_wizard.said()
    table.until(lambda: table.room.state is RoomState.OVER)
    assert participant.state["outcome"]["reason"] == "out of time"
    session = load(tmp_path)
    assert session.header.extra["seats"] == dict.fromkeys(("participant", "co_wizard", "ad_wizard"), "human")
    beliefs = [event.data["action"] for event in session.events if event.type is EventType.BELIEF_UPDATE]
    assert beliefs == ["GoalUpdate", "KnowledgeUpdate", "PlanUpdate", "StatusUpdate"]
    driven = [event.data["action"] for event in session.events if event.type is EventType.PHYSICAL_ACTION]
    assert driven == [PhysicalAction.SPEED_CHANGE.label]
    assert_replays(session, table)


def test_a_turn_at_the_junction_ahead_is_taken() -> None:
    table = Table("participant=silent,co_wizard=human,ad_wizard=silent")
    co_wizard = table.seat("co_wizard")
    table.until(lambda: co_wizard.state.get("exits"))
    angle, _, street, _ = co_wizard.state["exits"][0]
    co_wizard.command("drive", action="JTurn", angle=angle)
    table.until(lambda: co_wizard.state["manoeuvre"] == ["JTurn", angle], 1.0)
    lanes = table.room.engine.town.lanes
    world = table.room.engine.session.world
    table.until(lambda: lanes[world.planner.lane].street == street and not lanes[world.planner.lane].in_junction)


def test_refusals_reach_the_person_with_their_reason() -> None:
    table = Table("co_wizard=human")
    co_wizard, ad_wizard = table.seat("co_wizard"), table.seat("ad_wizard")
    table.run(0.5)
    co_wizard.command("drive", action="Start")
    co_wizard.command("drive", action="Fly")
    ad_wizard.command("prop", prop="tree", x=co_wizard.state["pose"][0], y=co_wizard.state["pose"][1])
    ad_wizard.command("prop", prop="tree", x=5000.0, y=0.0)
    table.run(0.5)
    assert any("Start:" in reason for reason in co_wizard.refusals)
    assert any("Fly" in reason for reason in co_wizard.refusals)
    assert any("place_prop:" in reason for reason in ad_wizard.refusals)
    assert any("too far from any road" in reason for reason in ad_wizard.refusals)


def test_a_seat_has_the_commands_of_its_role_only() -> None:
    table = Table()
    participant, spectator = table.seat("participant"), table.seat("spectator")
    table.run(0.3)
    participant.command("drive", action="Stop")
    participant.send("control", act="end")
    spectator.command("say", text="Hello")
    spectator.send("announce", text="Hello")
    table.run(0.3)
    assert len(participant.refusals) == len(spectator.refusals) == 2
    assert table.room.state is RoomState.RUNNING


def test_long_typed_turns_are_spoken_in_several_utterances() -> None:
    table = Table("participant=human,co_wizard=human")
    participant, co_wizard = table.seat("participant"), table.seat("co_wizard")
    table.run(0.5)
    sentences = [f"Turn left at the corner number {k}." for k in ("one", "two", "three", "four", "five", "six")]
    participant.command("say", text=" ".join(sentences))
    table.until(lambda: len(co_wizard.talk) == 2)
    assert " ".join(co_wizard.said()) == " ".join(sentences)
    assert not participant.refusals


# --- acts of typed text -----------------------------------------------------------------------------------------------


def test_acts_are_guessed_and_the_speaker_corrects_them(tmp_path: Path) -> None:
    table = Table("participant=human,co_wizard=silent,ad_wizard=silent", folder=tmp_path, max_seconds=12.0)
    participant = table.seat("participant")
    table.run(0.5)
    participant.send("parse", c=1, text="Left. Is that KFC?")
    table.run(0.2)
    (answer,) = participant.answers
    assert [span["text"] for span in answer["spans"]] == ["Left.", "Is that KFC?"]
    spans = answer["spans"]
    spans[1] = {"text": spans[1]["text"], "move": "Check", "slots": {"Landmark": ["KFC"]}}
    participant.command("say", text="Left. Is that KFC?", spans=spans)
    table.until(lambda: participant.talk)
    (line,) = participant.talk
    assert [span["move"] for span in line["spans"]][1] == "Check"
    participant.send("correct", utterance=line["utterance"], span=0, move="Explain", slots={})
    table.until(lambda: table.room.state is RoomState.OVER)
    session = load(tmp_path)
    moves = session.moves()
    assert [move.act.move.label for move in moves][1] == "Check"
    log = read_seat_log(next(tmp_path.iterdir()))
    assert log is not None
    said = [event.data for event in log if event.kind is SeatEventKind.SAID]
    assert [data["source"] for data in said] == ["classifier", "speaker"]
    assert said[1]["guess"] != {"move": "Check", "slots": {"Landmark": ["KFC"]}}
    (corrected,) = [event.data for event in log if event.kind is SeatEventKind.CORRECTED]
    assert (corrected["utterance"], corrected["move"]) == (line["utterance"], "Explain")
    assert_replays(session, table)


# --- people leave -----------------------------------------------------------------------------------------------------


def test_the_clock_stops_while_a_person_is_away_and_talk_is_restored() -> None:
    table = Table("co_wizard=human")
    co_wizard = table.seat("co_wizard")
    table.until(lambda: co_wizard.talk)
    co_wizard.command("say", text="Hello, I am your car.")
    table.until(lambda: any(line["who"] == "co_wizard" for line in co_wizard.talk))
    co_wizard.leave()
    table.run(0.2)
    stopped = table.time
    table.run(10.0)
    assert table.time == stopped and table.room.state is RoomState.PAUSED
    again = table.seat("co_wizard")
    table.run(1.0)
    assert table.time > stopped
    assert again.talk[: len(co_wizard.talk)] == co_wizard.talk
    assert again.state.keys() == co_wizard.state.keys()


def test_the_session_ends_when_a_person_does_not_come_back(tmp_path: Path) -> None:
    table = Table("co_wizard=human", folder=tmp_path, absence=AbsenceRules(seconds=5.0))
    co_wizard, participant = table.seat("co_wizard"), table.seat("participant")
    table.run(3.0)
    co_wizard.leave()
    table.run(6.0)
    assert table.room.state is RoomState.OVER
    assert participant.state["outcome"]["reason"] == "left"
    session = load(tmp_path)
    assert session.events[-1].data == {"success": False, "reason": "left"}
    log = read_seat_log(next(tmp_path.iterdir()))
    assert log is not None
    assert [event.kind.value for event in log] == ["joined", "joined", "left", "paused"]
    assert_replays(session, table)


@needs_linux
def test_session_that_counts_as_finished_survives_a_power_failure(tmp_path: Path, disk: Disk) -> None:
    table = Table("co_wizard=human,ad_wizard=silent", folder=tmp_path / "sessions", max_seconds=3.0)
    table.seat("co_wizard")
    table.until(lambda: table.room.state is RoomState.OVER)
    (folder,) = (tmp_path / "sessions").iterdir()
    files = [path for path in folder.iterdir() if path.is_file()]
    assert {path.name for path in files} >= {"session.json", "events.jsonl", "actions.jsonl", "seats.jsonl"}
    for path in files:
        assert disk.content(path) == path.read_bytes(), path.name


def test_the_session_goes_on_without_a_person_where_the_rules_say_so() -> None:
    table = Table("co_wizard=human", absence=AbsenceRules(while_away=WhileAway.CONTINUE, then=AfterAbsence.WAIT))
    co_wizard = table.seat("co_wizard")
    table.seat("spectator")
    table.run(2.0)
    co_wizard.leave()
    table.run(3.0)
    assert table.time == pytest.approx(5.0)


@pytest.mark.long
def test_a_script_takes_over_and_finishes_the_errands(tmp_path: Path) -> None:
    rules = AbsenceRules(seconds=2.0, then=AfterAbsence.SCRIPT)
    table = Table("co_wizard=human,ad_wizard=silent", folder=tmp_path, absence=rules, max_seconds=600.0)
    co_wizard = table.seat("co_wizard")
    table.run(20.0)
    co_wizard.leave()
    table.until(lambda: table.room.state is RoomState.OVER, 700.0)
    assert table.room.engine.summary()["success"]
    log = read_seat_log(next(tmp_path.iterdir()))
    assert log is not None
    (taken,) = [event for event in log if event.kind is SeatEventKind.TAKEN_OVER and event.role is Role.CO_WIZARD]
    assert taken.data == {"policy": "scripted"}
    assert_replays(load(tmp_path), table)


def test_a_second_window_takes_the_seat_over_and_the_first_is_told() -> None:
    table = Table("co_wizard=human")
    first = table.seat("co_wizard")
    table.run(1.0)
    second = table.seat("co_wizard")
    table.run(1.0)
    assert first.answers == [{"k": "replaced"}] and first.closed is CloseCode.REPLACED
    first.command("drive", action="Stop")
    first.leave()
    table.run(1.0)
    assert table.room.state is RoomState.RUNNING, "the end of the old connection is no absence"
    assert second.state["motion"] != "stopped", "the old window drives no more"


# --- experimenter -----------------------------------------------------------------------------------------------------


def test_the_experimenter_pauses_writes_and_ends(tmp_path: Path) -> None:
    table = Table("co_wizard=human", folder=tmp_path)
    co_wizard, experimenter = table.seat("co_wizard"), table.seat("experimenter")
    table.run(1.0)
    experimenter.send("control", act="pause")
    table.run(0.2)
    stopped = table.time
    table.run(2.0)
    assert table.time == stopped and co_wizard.state["why"] == "experimenter"
    experimenter.send("announce", text="Short break.")
    experimenter.send("control", act="resume")
    table.run(1.0)
    assert table.time > stopped and "Short break." in co_wizard.said()
    rows = {row["role"]: row for row in experimenter.state["seats"]}
    assert rows["co_wizard"]["by"] == "person" and rows["participant"]["by"] == "policy"
    experimenter.send("control", act="end")
    table.run(0.2)
    assert co_wizard.state["outcome"]["reason"] == "ended"
    assert_replays(load(tmp_path), table)


def test_the_experimenter_starts_without_waiting_for_people() -> None:
    table = Table("participant=human,co_wizard=human")
    experimenter = table.seat("experimenter")
    table.run(1.0)
    assert table.room.state is RoomState.WAITING
    experimenter.send("control", act="start")
    table.until(lambda: experimenter.talk)
    co_wizard = table.seat("co_wizard")
    table.run(1.0)
    rows = {row["role"]: row["by"] for row in experimenter.state["seats"]}
    assert rows == {"participant": "policy", "co_wizard": "person", "ad_wizard": "policy"}
    assert co_wizard.said(), "the talk so far"


def test_the_next_session_begins_at_the_same_seats(tmp_path: Path) -> None:
    table = Table("co_wizard=human", folder=tmp_path, max_seconds=2.0)
    co_wizard = table.seat("co_wizard")
    table.until(lambda: table.room.state is RoomState.OVER)
    co_wizard.send("control", act="again")
    table.run(1.0)
    assert table.room.state is RoomState.RUNNING and table.time < 1.5
    assert co_wizard.state["outcome"] is None and not co_wizard.talk
    assert len(list(tmp_path.iterdir())) == 2
    assert table.room.engine.scenario.seed == 8
    table.room.shut_down()


def test_a_session_that_the_program_stops_is_recorded_to_its_end(tmp_path: Path) -> None:
    table = Table("co_wizard=human", folder=tmp_path)
    table.seat("co_wizard")
    table.run(2.0)
    table.room.shut_down()
    session = load(tmp_path)
    assert session.summary is not None and session.summary["reason"] == "technical"
    assert_replays(session, table)


def test_nobody_there_stops_the_clock() -> None:
    table = Table()
    participant = table.seat("participant")
    table.run(1.0)
    participant.leave()
    table.run(0.2)
    stopped = table.time
    table.run(2.0)
    assert table.time == stopped and table.room.is_quiet


def test_a_session_that_nobody_came_to_leaves_no_record(tmp_path: Path) -> None:
    table = Table("participant=human,co_wizard=human", folder=tmp_path)
    table.seat("participant")
    table.run(1.0)
    table.room.shut_down()
    assert not list(tmp_path.iterdir())
