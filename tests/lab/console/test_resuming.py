"""Sessions that a crash interrupted go on."""

from __future__ import annotations

from pathlib import Path

import pytest

from dorothie_gym.archive import first_difference
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.replay import begin_replay, resimulate
from dorothie_gym.lab.console.resuming import Resumed, interrupted_sessions
from dorothie_gym.lab.console.room import Room, RoomState
from dorothie_gym.lab.console.seating import parse_roles
from dorothie_gym.session.recording import SeatEventKind, Session, read_seat_log
from tests.lab.console.people import Table


def crashed(folder: Path) -> tuple[Path, Table, list[str]]:
    """Returns the folder of a session whose program died, its table, and the talk of the Co-Wizard."""
    table = Table("co_wizard=human,ad_wizard=silent", folder=folder, max_seconds=60.0)
    co_wizard = table.seat("co_wizard")
    table.run(1.0)
    co_wizard.command("say", text="Hello, I am your car.")
    table.until(lambda: len(co_wizard.talk) >= 2)
    assert table.room.record is not None
    table.room.record.close()
    return table.room.record.folder, table, co_wizard.said()


def test_a_session_goes_on_where_the_program_died(tmp_path: Path) -> None:
    folder, before, said = crashed(tmp_path)
    assert interrupted_sessions(tmp_path) == [folder]
    resumed = Resumed.load(folder)
    town = before.room.engine.town
    engine = begin_replay(resumed.session, town)
    config = resumed.config(before.room.config)
    table = Table.__new__(Table)
    table.room = Room(engine, parse_roles(resumed.roles), config, seed=7, folder=tmp_path, resumed=resumed)
    table.people, table.now = [], 0.0
    assert table.time == before.time and table.room.state is RoomState.WAITING
    co_wizard = table.seat("co_wizard")
    table.until(lambda: table.room.state is RoomState.OVER, 120.0)
    assert co_wizard.said()[: len(said)] == said
    assert table.room.record is not None
    session = Session.load(table.room.record.folder)
    assert session.complete and first_difference(session, resimulate(session, town)) is None
    assert first_difference(resumed.session, session) is None, "it begins like the interrupted one"
    log = read_seat_log(table.room.record.folder)
    assert log is not None
    assert [event.kind for event in log].count(SeatEventKind.JOINED) == 2


def test_only_interrupted_sessions_with_people_go_on(tmp_path: Path) -> None:
    with pytest.raises(SessionError):
        Resumed.load(tmp_path)
    table = Table("co_wizard=human", folder=tmp_path)
    table.seat("co_wizard")
    table.run(1.0)
    table.room.shut_down()
    assert table.room.record is not None
    with pytest.raises(SessionError, match="is complete"):
        Resumed.load(table.room.record.folder)
    assert interrupted_sessions(tmp_path) == [] == interrupted_sessions(tmp_path / "missing")
