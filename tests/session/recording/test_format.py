"""Other versions of the format, files that are none, and how a session is packed."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from dorothie_gym.errors import SessionError
from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import Event, EventType, Session, SessionWriter
from dorothie_gym.session.recording.files import MAX_EVENTS, safe_name
from tests.session.recording.builders import header, physical, rows, session, utterance, write
from tests.session.recording.dialogues import OKAY, talk


def edit(folder: Path, **changes: Any) -> None:
    page = json.loads((folder / "session.json").read_text())
    (folder / "session.json").write_text(json.dumps({**page, **changes}))


def add_column(folder: Path, name: str, values: pa.Array) -> None:
    table = pq.read_table(folder / "frames.parquet")
    pq.write_table(table.append_column(name, values), folder / "frames.parquet")


def test_additions_of_a_newer_minor_version_are_kept_and_reported(tmp_path: Path) -> None:
    folder = write(tmp_path / "one", talk()[:2], frames=30)
    edit(folder, format_version="2.7", mood={"happy": True}, counts={"events": 3, "frames": 30})
    line = {"frame": 40, "type": "Yawn", "source": "participant", "flagged": False, "data": {"width": 2}, "loud": 1}
    with (folder / "events.jsonl").open("a") as file:
        file.write(json.dumps(line) + "\n")
    add_column(folder, "gear", pa.array(range(30)))
    add_column(folder, "note", pa.array(["a", None] * 15))
    loaded = Session.load(folder)
    assert loaded.complete and loaded.check() == ()
    assert loaded.header.extra == {"mood": {"happy": True}}
    last = loaded.events[-1]
    assert (last.type, last.type_name, last.data) == (EventType.OTHER, "Yawn", {"width": 2})
    assert loaded.scene.columns["gear"].tolist() == list(range(30))
    assert set(loaded.report.unknown) == {
        "session.json: field 'mood'",
        "events.jsonl: type 'Yawn'",
        "events.jsonl: field 'loud' of Yawn",
        "frames.parquet: column 'gear'",
        "frames.parquet: column 'note'",
    }
    again = Session.load(loaded.save(tmp_path / "again"))
    assert (again.events, again.header, again.digest) == (loaded.events, loaded.header, loaded.digest)
    assert json.loads((tmp_path / "again/events.jsonl").read_text().splitlines()[-1]) == line


def test_a_type_that_this_very_version_lacks_is_a_fault(tmp_path: Path) -> None:
    event = Event(frame=1, type=EventType.OTHER, source=Role.AGENT, extra={"type": "Yawn"})
    (fault,) = Session.load(write(tmp_path / "one", [event], frames=3)).check()
    assert fault == "events[0] (Yawn, frame 1): no type of event of version 2.0"


@pytest.mark.parametrize("version", ["1.0", "1.4", "3.0"])
def test_another_major_version_is_rejected(tmp_path: Path, version: str) -> None:
    folder = write(tmp_path / "one", talk(), frames=3)
    edit(folder, format_version=version)
    message = rf"session.json: format version {version} cannot be read; this dorothie_gym reads 2.x"
    with pytest.raises(SessionError, match=message):
        Session.load(folder)


def test_saved_session_is_equal_and_overwrites_no_folder(tmp_path: Path) -> None:
    loaded = Session.load(write(tmp_path / "one", talk()))
    again = Session.load(loaded.save(tmp_path / "far/copy"))
    assert (again.digest, again.events, again.complete) == (loaded.digest, loaded.events, True)
    with pytest.raises(SessionError, match="copy: exists already"):
        loaded.save(tmp_path / "far/copy")
    assert [path.name for path in (tmp_path / "far").iterdir()] == ["copy"]


def test_unknown_values_of_the_car_stay_unknown(tmp_path: Path) -> None:
    unknown = rows(0, 4)
    unknown[1:, 5:8] = np.nan
    with SessionWriter(tmp_path, header()) as writer:
        writer.append((), unknown)
        writer.finish({})
    loaded = Session.load(tmp_path)
    assert np.isnan(loaded.trajectory["steer"]).tolist() == [False, True, True, True]
    assert pq.read_table(tmp_path / "frames.parquet").column("steer").null_count == 3


def test_hash_changes_with_the_content_alone(tmp_path: Path) -> None:
    one = Session.load(write(tmp_path / "one", talk()))
    assert Session.load(write(tmp_path / "other", talk())).digest == one.digest
    table = pq.read_table(tmp_path / "other/frames.parquet")
    pq.write_table(table, tmp_path / "other/frames.parquet", compression="gzip")
    assert Session.load(tmp_path / "other").digest == one.digest
    assert Session.load(write(tmp_path / "third", talk()[1:])).digest != one.digest
    moved = table.set_column(1, "x", pa.array(np.asarray(table.column("x")) + 1e-12))
    pq.write_table(moved, tmp_path / "other/frames.parquet")
    assert Session.load(tmp_path / "other").digest != one.digest


def damaged(table: pa.Table, fault: str) -> pa.Table:
    frames = table.column("frame").to_numpy().copy()
    if fault == "column":
        return table.drop_columns(["speed"])
    if fault == "order":
        frames[3] = 1
        return table.set_column(0, "frame", pa.array(frames))
    if fault == "text":
        return table.set_column(1, "x", pa.array(["?"] * len(frames)))
    if fault == "infinite":
        return table.set_column(1, "x", pa.array(frames * np.inf + 1.0))
    return table.append_column("actors", pa.array([1] * len(frames)))


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("column", "column 'speed' is missing"),
        ("order", "column 'frame': frame 1 after 2"),
        ("text", "column 'x' holds .*it must hold numbers"),
        ("infinite", "column 'x' has"),
        ("actors", "column 'actors' must hold lists of structs, not int64"),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_damaged_frames_are_reported_by_column(tmp_path: Path, fault: str, message: str) -> None:
    folder = write(tmp_path / "one", frames=10)
    pq.write_table(damaged(pq.read_table(folder / "frames.parquet"), fault), folder / "frames.parquet")
    with pytest.raises(SessionError, match=f"frames.parquet: {message}"):
        Session.load(folder)


def test_too_many_events_are_rejected_before_they_are_decoded(tmp_path: Path) -> None:
    folder = write(tmp_path / "one", frames=2)
    line = (folder / "events.jsonl").read_bytes() or b'{"frame":1}\n'
    (folder / "events.jsonl").write_bytes(line * 1_000_000)
    with pytest.raises(SessionError, match=f"events.jsonl: holds more than {MAX_EVENTS} lines"):
        Session.load(folder)


def test_named_pipe_instead_of_a_file_does_not_block(tmp_path: Path) -> None:
    folder = write(tmp_path / "one", frames=2)
    (folder / "events.jsonl").unlink()
    os.mkfifo(folder / "events.jsonl")
    with pytest.raises(SessionError, match="events.jsonl: cannot be read: it is a pipe, socket or device"):
        Session.load(folder)


def test_writing_never_follows_a_link(tmp_path: Path) -> None:
    (tmp_path / "outside").write_text("precious")
    folder = tmp_path / "one"
    folder.mkdir()
    for name in ("events.jsonl", "session.json.part", "frames.journal", "frames.parquet.part"):
        (folder / name).symlink_to(tmp_path / "outside")
    with pytest.raises(SessionError, match="holds a session already"):
        SessionWriter(folder, header())
    with SessionWriter(folder, header(), overwrite=True) as writer:
        writer.append(talk(), rows(0, 3))
        writer.finish({})
    assert (tmp_path / "outside").read_text() == "precious"
    assert Session.load(folder).complete


@pytest.mark.parametrize("text", ["../../etc/passwd", "/", "..", "", "a\0b", "x" * 500, "\u202eevil", "C:\\x"])
def test_names_of_folders_stay_in_their_folder(text: str) -> None:
    name = safe_name(text)
    assert name and len(name) <= 100 and not name.startswith(".") and not set("/\\\0:") & set(name)
    assert "/" not in session(town=text, name="").name


def test_faults_that_the_reader_accepts_are_reported_by_check() -> None:
    first = utterance(30, Role.PARTICIPANT, 0, ("Go on.", OKAY))
    other = utterance(60, Role.CO_WIZARD, 0, ("Fine.", OKAY), seconds=-1.0)
    events = [
        Event(frame=0, type=EventType.SUBGOAL, source=Role.AGENT, data={"subgoal": 9}),
        *first,
        *other,
        physical(70, physical_action("JTurn"), angle=400.0),
        physical(71, physical_action("SpeedChange")),
        Event(frame=80, type=EventType.END, source=Role.AGENT),
        Event(frame=81, type=EventType.MESSAGE, source=Role.AD_WIZARD),
    ]
    faults = "\n".join(session(events).check())
    for part in (
        "events[0] (Subgoal, frame 0): subgoal 9 is none of the 2",
        "events[2] (utterance 0): has another speaker than events[1]",
        "events[2] (utterance 0): is over at 2 s, before it begins at 3 s",
        "events[3] (JTurn): angle 400 is not an angle in [-180, 180)",
        "events[4] (SpeedChange): does not say whether up or down",
        "events[6] (Message, frame 81): comes after the end",
    ):
        assert part in faults


def test_frames_that_are_missing_are_a_fault_and_another_rate_is_none() -> None:
    whole = replace(session(frames=30), summary={})
    assert whole.check() == ()
    assert replace(whole, trajectory=whole.trajectory[::3]).check() == ()
    gap = replace(whole, trajectory=np.delete(whole.trajectory, [7, 8]))
    assert gap.check() == ("frames[7]: frames 7 to 8 are missing",)


def physical_action(label: str) -> Any:
    from dorothie_gym.ontology import parse_physical_action

    return parse_physical_action(label)
