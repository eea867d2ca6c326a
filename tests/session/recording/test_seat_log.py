"""Log of the people at the seats of a session."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import SeatEvent, SeatEventKind, SeatLogWriter, Session, read_seat_log
from dorothie_gym.session.recording.files import SEATS_FILE
from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

EVENTS = (
    SeatEvent(frame=0, kind=SeatEventKind.JOINED, role=Role.CO_WIZARD, data={"seconds": None}),
    SeatEvent(frame=30, kind=SeatEventKind.PAUSED, data={"reason": "absence"}),
)


def test_events_are_read_as_they_were_written(tmp_path: Path) -> None:
    with SeatLogWriter(tmp_path) as log:
        for event in EVENTS:
            log.append(event)
    assert read_seat_log(tmp_path) == EVENTS


def test_sessions_without_people_have_no_log(tmp_path: Path) -> None:
    assert read_seat_log(tmp_path) is None


def test_a_torn_last_line_is_left_out(tmp_path: Path) -> None:
    with SeatLogWriter(tmp_path) as log:
        log.append(EVENTS[0])
    path = tmp_path / SEATS_FILE
    path.write_bytes(path.read_bytes() + b'{"frame":3,"kin')
    assert read_seat_log(tmp_path) == EVENTS[:1]


@pytest.mark.parametrize(
    "line",
    [
        '{"frame":-1,"kind":"joined","role":null,"data":{}}',
        '{"frame":0,"kind":"flew","role":null,"data":{}}',
        '{"frame":0,"kind":"joined","role":"agent","data":{}}',
        '{"frame":0,"kind":"joined","role":null,"data":[]}',
        "[]",
    ],
)
def test_damaged_lines_are_named(line: str, tmp_path: Path) -> None:
    (tmp_path / SEATS_FILE).write_text(line + "\n", encoding="utf-8")
    with pytest.raises(SessionError, match=f"{SEATS_FILE}, line 1"):
        read_seat_log(tmp_path)


def test_values_that_no_session_holds_are_refused(tmp_path: Path) -> None:
    with SeatLogWriter(tmp_path) as log, pytest.raises(SessionError):
        log.append(SeatEvent(frame=0, kind=SeatEventKind.SAID, data={"text": object()}))
    with SeatLogWriter(tmp_path / "..") as log, pytest.raises(SessionError, match="frames are in"):
        log.append(SeatEvent(frame=-1, kind=SeatEventKind.SAID))


def test_a_session_with_people_is_read_like_any_other(tmp_path: Path) -> None:
    write(tmp_path / "one", talk())
    before = Session.load(tmp_path / "one").digest
    with SeatLogWriter(tmp_path / "one") as log:
        log.append(EVENTS[0])
    assert Session.load(tmp_path / "one").digest == before
