from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import DialogueMove, PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType, Session
from tests.session.recording.builders import header, physical, rows, session, utterance, write
from tests.session.recording.dialogues import OKAY, TO_KFC, TURNING, talk


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("recorded") / "session", talk(), frames=40)


@pytest.fixture
def copy(recorded: Path, tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "copy"
    shutil.copytree(recorded, folder)
    return folder


def test_round_trip_preserves_the_session(recorded: Path) -> None:
    loaded = Session.load(recorded)
    assert loaded.header == header()
    assert list(loaded.events) == talk()
    assert np.array_equal(np.array(loaded.trajectory.tolist()), rows(0, 40))
    assert loaded.summary == {"success": True, "seconds": 1.5}
    assert loaded.complete
    assert loaded.name == "session"
    assert loaded.check() == ()
    assert loaded.report.lines() == []


@given(
    values=st.lists(st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=20)), max_size=4),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_and_number_round_trips(tmp_path: Path, values: list[tuple[float, str]]) -> None:
    events = [
        Event(frame=i, type=EventType.MESSAGE, source=Role.AD_WIZARD, data={"text": text, "number": number})
        for i, (number, text) in enumerate(values)
    ]
    folder = tmp_path / "open"
    shutil.rmtree(folder, ignore_errors=True)
    assert list(Session.load(write(folder, events, frames=1)).events) == events


def test_finished_session_that_lost_the_end_of_its_events_is_incomplete(copy: Path) -> None:
    lines = (copy / "events.jsonl").read_bytes().splitlines(keepends=True)
    for kept in (b"".join(lines[:-1]), b"".join(lines)[:-5]):
        (copy / "events.jsonl").write_bytes(kept)
        loaded = Session.load(copy)
        assert (len(loaded.events), loaded.complete) == (len(talk()) - 1, False)


def test_finished_session_without_its_frames_is_an_error(copy: Path) -> None:
    (copy / "frames.parquet").unlink()
    with pytest.raises(SessionError, match="frames.parquet: is missing, though the session is over"):
        Session.load(copy)


@pytest.mark.parametrize("name", ["session.json", "frames.parquet"])
def test_cut_header_or_frames_are_an_error(copy: Path, name: str) -> None:
    content = (copy / name).read_bytes()
    for cut in range(0, len(content) - 2, 97):
        (copy / name).write_bytes(content[:cut])
        with pytest.raises(SessionError, match=name):
            Session.load(copy)


def test_folder_without_a_session_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="no session here"):
        Session.load(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("events.jsonl", b'"move":"Instruct"', b'"move":"Sing"', r"events.jsonl, line 2, data: .*'move'.*Sing"),
        ("events.jsonl", b'"frame":45', b'"frame":-45', r"events.jsonl, line 3: field 'frame' is -45"),
        ("events.jsonl", b'"frame":45', b'"frame":true', r"line 3: field 'frame' is True"),
        ("events.jsonl", b'"source":"co_wizard"', b'"source":"cat"', r"line 3: field 'source' is 'cat'; .*participant"),
        ("events.jsonl", b'"type":"End"', b'"kind":"End"', r"line \d+: field 'type' is missing"),
        ("events.jsonl", b'{"frame":45', b"{frame:45", r"events.jsonl, line 3, column 2: not JSON"),
        ("events.jsonl", b'"angle":88.0', b'"angle":NaN', r"line 6: not JSON"),
        ("events.jsonl", b"KFC please", b"KF\xff please", r"line 2: not UTF-8"),
        ("events.jsonl", b'["KFC"]', b'"KFC"', r"line 2, data: field 'slots.Landmark'"),
        ("events.jsonl", b'"angle":88.0', b'"angle":1e999', r"line 6: not JSON .*too large"),
        ("events.jsonl", b'"frame":45', b'"frame":4500000000', r"line 3: field 'frame' is 4500000000"),
        ("events.jsonl", b'{"frame":45', b"[" * 100_000, r"line 3: .*nested too deeply"),
        ("session.json", b'"landmark": 1', b'"landmark": 2', r"session.json: .*subgoals\[1\]: field 'landmark'"),
        ("session.json", b'"street_names"', b'"streets"', r"session.json: field 'street_names' is missing"),
        ("session.json", b'"format_version": "2.0"', b'"format_version": "3.0"', r"version 3.0 cannot be read.*update"),
        ("session.json", b'"format_version": "2.0"', b'"format_version": 2.0', r"'format_version' is 2.0"),
        ("session.json", b'"format_version": "2.0"', b'"format_version": "new"', r"'format_version' is 'new'"),
        ("session.json", b'"Fuller"', b'"Elm"', r"street_names.*Elm"),
        ("session.json", b'"events": 16', b'"event": 16', r"session.json, counts: field 'events' is missing"),
    ],
)
def test_damage_is_reported_with_file_line_and_field(
    copy: Path, name: str, old: bytes, new: bytes, message: str
) -> None:
    content = (copy / name).read_bytes()
    assert old in content
    (copy / name).write_bytes(content.replace(old, new, 1))
    with pytest.raises(SessionError, match=message):
        Session.load(copy)


def test_moves_are_grouped_into_utterances() -> None:
    talked = session(talk())
    assert [len(utterance.moves) for utterance in talked.utterances()] == [1, 2, 2, 1, 1]
    spoken = talked.utterances(Role.CO_WIZARD)[0]
    assert (spoken.text, spoken.start, spoken.end) == ("Okay, turning left.", 1.0, 2.0)
    assert [move.act for move in spoken.moves] == [OKAY, TURNING]
    assert next(move.act.move for move in talked.moves(Role.PARTICIPANT)) is DialogueMove.INSTRUCT


def test_duration_is_the_last_frame_or_event() -> None:
    assert session(frames=31).duration == 1.0
    assert session([physical(60, PhysicalAction.STOP)], frames=31).duration == 2.0
    assert session(frames=0).duration == 0.0


def test_events_come_in_order_of_frames() -> None:
    late, early = utterance(90, Role.PARTICIPANT, 0, ("KFC", TO_KFC)), physical(30, PhysicalAction.START)
    assert [event.frame for event in session([*late, early]).events] == [30, 90]


def test_events_are_found_by_type() -> None:
    assert [event.frame for event in session(talk()).of_type(EventType.HAZARD_STOP, EventType.END)] == [155, 299]
