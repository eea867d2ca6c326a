"""Recordings of people at a microphone are the audio of their dialogue moves, and replays are exact."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("soundfile", reason="needs the extra speech")

from dorothie_gym.archive import first_difference
from dorothie_gym.archive.sound import audio_files, sound_track, utterance_audio
from dorothie_gym.evaluation.rollout.replay import begin_replay, resimulate
from dorothie_gym.lab.console.recordings import SpanRecordings
from dorothie_gym.lab.console.resuming import Resumed
from dorothie_gym.lab.console.room import Room, RoomState
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import Event, EventType, Session
from dorothie_gym.support.audio import SAMPLE_RATE, encode_flac
from tests.lab.console.people import Person, Table

ROLES = "participant=human,co_wizard=human,ad_wizard=silent"


def tone(seconds: float) -> bytes:
    return encode_flac((0.3 * np.sin(np.arange(round(seconds * SAMPLE_RATE)) / 5.0)).astype(np.float32))


def speak(table: Table, person: Person, text: str, seconds: float) -> str:
    """Says something with a recording of a length [s]; returns its name."""
    name = table.room.keep_audio(person.seat, tone(seconds))
    assert name is not None
    person.command("say", text=text, audio=name)
    return name


def lengths(session: Session) -> list[tuple[str, list[float]]]:
    """Returns the words of each utterance of a person, and the lengths of its recordings [s]."""
    return [
        (said.text, [len(utterance_audio(session, said.number)) / SAMPLE_RATE] if audio_files(session, said) else [])
        for said in session.utterances()
    ]


def test_recordings_are_the_audio_of_utterances_and_typed_ones_have_none(tmp_path: Path) -> None:
    table = Table(ROLES, folder=tmp_path, max_seconds=30.0)
    participant, co_wizard = table.seat("participant"), table.seat("co_wizard")
    table.run(0.5)
    speak(table, participant, "Hello. Turn left at the corner.", 1.5)
    table.run(8.0)
    co_wizard.command("say", text="Okay.")
    table.run(3.0)
    speak(table, co_wizard, "Okay.", 0.5)
    table.run(3.0)
    participant.command("say", text="Go on.")
    speak(table, participant, "Stop there.", 1.0)
    table.until(lambda: table.room.state is RoomState.OVER)
    assert table.room.keep_audio(participant.seat, tone(0.5)) is None, "the session is over"
    assert table.room.record is not None
    session = Session.load(table.room.record.folder)
    assert lengths(session) == [
        ("Hello. Turn left at the corner.", [1.5]),
        ("Okay.", []),
        ("Okay.", [0.5]),
        ("Go on. Stop there.", [1.0]),
    ]
    last = session.utterances(Role.PARTICIPANT)[-1]
    assert len(audio_files(session, last)[0].spans) == 1, "the second span was spoken, the first one typed"
    track = sound_track(session, 0.0, 30.0)
    start = round(session.utterances()[0].start * SAMPLE_RATE)
    assert np.abs(track[start : start + SAMPLE_RATE]).max() > 0.2 and np.abs(track[: start - 1]).max() == 0.0
    again = resimulate(session, table.room.engine.town)
    assert first_difference(session, again) is None and again.digest == session.digest


def test_recordings_of_an_interrupted_session_go_on_with_it(tmp_path: Path) -> None:
    before = Table(ROLES, folder=tmp_path, max_seconds=30.0)
    participant, _ = before.seat("participant"), before.seat("co_wizard")
    before.run(0.5)
    speak(before, participant, "Hello.", 0.5)
    before.run(3.0)
    speak(before, participant, "Turn left at the corner.", 1.5)
    before.run(0.5)  # it is still being said
    before.room.suspend()
    assert before.room.record is not None
    resumed = Resumed.load(before.room.record.folder)
    table = Table.__new__(Table)
    engine = begin_replay(resumed.session, before.room.engine.town)
    config = resumed.config(before.room.config)
    table.room = Room(engine, parse_roles(resumed.roles), config, seed=7, folder=tmp_path, resumed=resumed)
    table.people, table.now = [], 0.0
    participant, _ = table.seat("participant"), table.seat("co_wizard")
    table.run(5.0)
    assert speak(table, participant, "Thanks.", 1.0) == "participant_3.flac"
    table.until(lambda: table.room.state is RoomState.OVER)
    assert table.room.record is not None
    session = Session.load(table.room.record.folder)
    assert lengths(session) == [("Hello.", [0.5]), ("Turn left at the corner.", [1.5]), ("Thanks.", [1.0])]
    assert resimulate(session, table.room.engine.town).digest == session.digest


def test_spans_are_found_again_in_order_and_those_that_were_refused_are_forgotten() -> None:
    def over(role: Role, text: str) -> object:
        event = Event(frame=3, type=EventType.DIALOGUE_MOVE, source=role, data={"span": text})
        return spans.named([event])[0].data.get("audio")

    spans = SpanRecordings()
    for text, audio in (("Left.", "a"), ("Right.", "b"), ("Left.", "c"), ("Left.", None)):
        spans.say(Role.PARTICIPANT, text, audio)
    assert over(Role.CO_WIZARD, "Left.") is None
    assert over(Role.PARTICIPANT, "By a policy.") is None
    assert [over(Role.PARTICIPANT, "Left.") for _ in range(4)] == ["a", "c", None, None]
    assert over(Role.PARTICIPANT, "Right.") is None, "it was said before, so it was refused"
