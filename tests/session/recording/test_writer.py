from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.errors import OutputFolderError, SessionError
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.session.recording import Event, EventType, Session, SessionWriter, writer
from tests.session.recording.builders import header, physical, rows, write
from tests.session.recording.dialogues import talk

FILES = ("session.json", "events.jsonl", "frames.parquet")


def test_identical_input_gives_identical_bytes(tmp_path: Path) -> None:
    one = write(tmp_path / "one", talk())
    other = write(tmp_path / "other", talk())
    for name in FILES:
        assert (one / name).read_bytes() == (other / name).read_bytes()


def test_order_of_keys_does_not_reach_the_file(tmp_path: Path) -> None:
    data = {"subgoal": 0, "status": "Ongoing", "cause": "trigger"}
    for folder, content in (("one", data), ("other", dict(reversed(data.items())))):
        event = Event(frame=0, type=EventType.SUBGOAL, source=Role.AGENT, data=content)
        write(tmp_path / folder, [event])
    assert (tmp_path / "one/events.jsonl").read_bytes() == (tmp_path / "other/events.jsonl").read_bytes()


def test_numpy_numbers_are_written_as_plain_ones(tmp_path: Path) -> None:
    event = physical(3, PhysicalAction.J_TURN, angle=np.float64(12.5))  # type: ignore[arg-type]  # a NumPy number instead of a Python one on purpose
    loaded = Session.load(write(tmp_path / "one", [event]))
    assert loaded.physical_actions[0].angle == 12.5


def test_appended_data_is_readable_before_the_session_ends(tmp_path: Path) -> None:
    writer = SessionWriter(tmp_path, header())
    assert Session.load(tmp_path).events == ()
    writer.append(talk()[:2], rows(0, 40))
    halfway = Session.load(tmp_path)
    assert (len(halfway.events), len(halfway.trajectory), halfway.complete) == (2, 40, False)
    writer.append(talk()[2:], rows(40, 260))
    writer.finish({"success": True})
    whole = Session.load(tmp_path)
    assert (len(whole.events), len(whole.trajectory), whole.complete) == (len(talk()), 300, True)


def test_folder_with_a_session_is_refused_unless_it_may_be_overwritten(tmp_path: Path) -> None:
    write(tmp_path, talk())
    with pytest.raises(SessionError, match="holds a session already"):
        SessionWriter(tmp_path, header())
    SessionWriter(tmp_path, header(seed=8), overwrite=True).close()
    fresh = Session.load(tmp_path)
    assert (fresh.header.seed, fresh.events, fresh.complete) == (8, (), False)


def test_malformed_batch_is_rejected_as_a_whole(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        bad = Event(frame=1, type=EventType.MESSAGE, source=Role.AD_WIZARD, data={"distance": math.inf})
        with pytest.raises(SessionError, match=r"data.distance is inf"):
            writer.append([talk()[0], bad], rows(0, 10))
        with pytest.raises(SessionError, match="shape"):
            writer.append([talk()[0]], rows(0, 10)[:, :5])
    assert (Session.load(tmp_path).events, len(Session.load(tmp_path).trajectory)) == ((), 0)


def test_frames_must_rise(tmp_path: Path) -> None:
    with SessionWriter(tmp_path, header()) as writer:
        writer.append((), rows(0, 10))
        with pytest.raises(SessionError, match="above the one before"):
            writer.append((), rows(9, 2))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"action": "Fly", "angle": None, "up": None}, "'action'"),
        ({"action": "Stop", "up": None}, "'angle' is missing"),
        ({"action": "Stop", "angle": "left", "up": None}, "'angle' is 'left'"),
        ({"action": "Stop", "angle": None, "up": 1}, "'up' is 1"),
        ({"action": "Stop", "angle": {1}, "up": None}, "JSON types only"),
        ({"action": "Stop", "angle": None, "up": None, "note": "\ud800"}, "UTF-8"),
    ],
)
def test_event_that_could_not_be_read_back_is_not_written(tmp_path: Path, data: object, message: str) -> None:
    event = Event(frame=1, type=EventType.PHYSICAL_ACTION, source=Role.CO_WIZARD, data=data)  # type: ignore[arg-type]  # values that JSON does not hold on purpose
    with SessionWriter(tmp_path, header()) as writer, pytest.raises(SessionError, match=message):
        writer.append([event])


def test_closed_session_rejects_further_data(tmp_path: Path) -> None:
    writer = SessionWriter(tmp_path, header())
    writer.finish({})
    with pytest.raises(SessionError, match="closed"):
        writer.append(talk())
    with pytest.raises(SessionError, match="closed"):
        writer.finish({})


def test_folder_that_is_deleted_right_after_the_header_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = writer.SessionFile.write

    def write_and_delete(file: writer.SessionFile, folder: Path) -> None:
        written(file, folder)
        shutil.rmtree(folder)

    monkeypatch.setattr(writer.SessionFile, "write", write_and_delete)
    with pytest.raises(OutputFolderError, match="out: the folder was deleted or emptied"):
        SessionWriter(tmp_path / "out", header())
