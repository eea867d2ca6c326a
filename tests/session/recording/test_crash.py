"""After the death of the process, the folder holds a finished session or one that loads up to its last record."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from dorothie_gym.ontology import Role
from dorothie_gym.session.recording import (
    SeatEvent,
    SeatEventKind,
    SeatLogWriter,
    Session,
    SessionState,
    SessionWriter,
    session_state,
)
from dorothie_gym.session.recording.files import AUDIO_FOLDER
from tests.power_failure import Disk, disk, needs_linux
from tests.session.recording.builders import header, rows
from tests.session.recording.dialogues import talk
from tests.session.recording.scenes import actors

__all__ = ["disk"]

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def cut_off(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("crash") / "session"
    with SessionWriter(folder, header()) as writer:
        for k in range(4):
            writer.append(talk()[4 * k : 4 * k + 4], rows(15 * k, 15))
            writer.add_actors(15 * k + 14, actors(2, seed=k))
    return folder


@pytest.mark.long
@pytest.mark.parametrize("name", ["events.jsonl", "frames.journal"])
def test_session_cut_off_at_any_byte_loads_up_to_the_last_complete_record(
    cut_off: Path, tmp_path: Path, name: str
) -> None:
    whole = Session.load(cut_off)
    copy = shutil.copytree(cut_off, tmp_path / "copy")
    content = (copy / name).read_bytes()
    for cut in range(0, len(content), 7):
        (copy / name).write_bytes(content[:cut])
        loaded = Session.load(copy)
        assert not loaded.complete and session_state(copy) is SessionState.PARTIAL
        if name == "events.jsonl":
            assert loaded.events == whole.events[: content[:cut].count(b"\n")]
        else:
            assert len(loaded.trajectory) % 15 == 0
            assert np.array_equal(loaded.trajectory, whole.trajectory[: len(loaded.trajectory)])
            decisions = len(loaded.trajectory) // 15
            assert decisions - 1 <= len(loaded.scene.actors) <= decisions


@needs_linux
def test_finished_session_survives_a_power_failure(tmp_path: Path, disk: Disk) -> None:
    folder = tmp_path / "session"
    with SessionWriter(folder, header()) as writer, SeatLogWriter(folder) as seats:
        writer.append(talk(), rows(0, 60))
        writer.add_decision(3, {Role.CO_WIZARD: {"navigation": 1}})
        writer.add_audio("one.flac", b"fLaC and more")
        assert disk.content(folder / AUDIO_FOLDER / "one.flac") == b"fLaC and more"
        seats.append(SeatEvent(frame=0, kind=SeatEventKind.JOINED, role=Role.CO_WIZARD, data={"seconds": None}))
        seats.close()
        writer.finish({"success": True})
    assert not disk.early
    files = [path for path in folder.iterdir() if path.is_file()]
    assert {path.name for path in files} >= {"session.json", "events.jsonl", "frames.parquet", "seats.jsonl"}
    for path in files:
        assert disk.content(path) == path.read_bytes(), path.name


def test_damaged_block_of_the_journal_ends_it(cut_off: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(cut_off, tmp_path / "copy")
    content = bytearray((copy / "frames.journal").read_bytes())
    content[len(content) // 2] ^= 1
    (copy / "frames.journal").write_bytes(content)
    assert 0 < len(Session.load(copy).trajectory) < 60


class Died(BaseException):
    """Simulated death of the process."""


def die_after(calls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets so many calls that rename or delete a file pass; the next one is the process's last."""
    left = iter(range(calls))

    def limited(real: Callable[..., None]) -> Callable[..., None]:
        def call(*arguments: object) -> None:
            if next(left, None) is None:
                raise Died
            real(*arguments)

        return call

    for name in ("replace", "unlink"):
        monkeypatch.setattr(os, name, limited(getattr(os, name)))


def test_death_at_each_step_of_the_end_leaves_a_session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    states = []
    for calls in range(20):
        folder = tmp_path / str(calls)
        writer = SessionWriter(folder, header())
        writer.append(talk(), rows(0, 30))
        die_after(calls, monkeypatch)
        with suppress(Died):
            writer.finish({"success": True})
        monkeypatch.undo()
        loaded = Session.load(folder)
        assert (len(loaded.events), len(loaded.trajectory)) == (len(talk()), 30)
        assert loaded.complete is (session_state(folder) is SessionState.FINISHED)
        states.append(session_state(folder))
    first = states.index(SessionState.FINISHED)
    assert first >= 3 and states == [SessionState.PARTIAL] * first + [SessionState.FINISHED] * (20 - first)
    assert sorted(path.name for path in folder.iterdir()) == ["events.jsonl", "frames.parquet", "session.json"]


@pytest.mark.long
def test_killed_process_leaves_a_session_and_a_second_one_ends_in_the_same_bytes(tmp_path: Path) -> None:
    code = """
        import sys
        from pathlib import Path
        from dorothie_gym.session.recording import SessionWriter
        from tests.session.recording.builders import header, rows
        from tests.session.recording.dialogues import talk
        with SessionWriter(Path(sys.argv[1]), header(), overwrite=True) as writer:
            for k in range(int(sys.argv[2])):
                writer.append(talk() if k == 0 else (), rows(15 * k, 15))
                print(k, flush=True)
            writer.finish({"success": True})
    """
    arguments = [sys.executable, "-c", textwrap.dedent(code)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    undisturbed = tmp_path / "undisturbed"
    subprocess.run([*arguments, str(undisturbed), "40"], cwd=ROOT, env=environment, check=True, capture_output=True)
    killed = tmp_path / "killed"
    process = subprocess.Popen(
        [*arguments, str(killed), "1000000"], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for _ in range(20):
        process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.communicate()
    loaded = Session.load(killed)
    assert session_state(killed) is SessionState.PARTIAL
    assert list(loaded.events) == talk() and len(loaded.trajectory) >= 300
    subprocess.run([*arguments, str(killed), "40"], cwd=ROOT, env=environment, check=True, capture_output=True)
    assert session_state(killed) is SessionState.FINISHED
    assert [path.name for path in sorted(killed.iterdir())] == [path.name for path in sorted(undisturbed.iterdir())]
    assert all((killed / path.name).read_bytes() == path.read_bytes() for path in undisturbed.iterdir())


def test_folder_without_a_header_holds_no_session(tmp_path: Path) -> None:
    assert session_state(tmp_path) is SessionState.ABSENT
    (tmp_path / "session.json.part").write_text("{")
    assert session_state(tmp_path) is SessionState.ABSENT
    SessionWriter(tmp_path, header()).close()
    assert session_state(tmp_path) is SessionState.PARTIAL
