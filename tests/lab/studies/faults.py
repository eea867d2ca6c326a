"""Faults at the writes of an erasure: errors of the disk, and death of the process.

`python -m tests.lab.studies.faults FOLDER` erases a person in copies of a prepared study, kills each erasure at another
write, and prints what is left after the next start, as JSON.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import shutil
import signal
import sqlite3
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from dorothie_gym.lab.studies.assignment import Slot
from dorothie_gym.lab.studies.erasure import erase, finish_erasures
from dorothie_gym.lab.studies.records import StudyRecords
from dorothie_gym.lab.studies.stages import Stage
from dorothie_gym.lab.studies.study import Scenario
from dorothie_gym.ontology import Role

TRACES = "armalade", "Velvet", "platform-one"
"""What a person has written, and the id of the platform; the number of the person comes on top."""

KEPT = "Shiny", "platform-two"
"""What the partner has written, and the partner's id."""

_READS = "SELECT", "PRAGMA", "BEGIN", "ROLLBACK"


class Faults:
    """Counter of writes.

    Args:
        act: called instead of the writes of which `strikes` is true; raises, or ends the process.
        strikes: whether a write fails, by number.

    Attributes:
        writes: number of writes so far.
    """

    def __init__(self, act: Callable[[bool], None], strikes: Callable[[int], bool]) -> None:
        self.writes = 0
        self._act, self._strikes = act, strikes

    def strike_after(self, further: int) -> None:
        """Lets one write fail, which is so many writes away."""
        self._strikes = (self.writes + further).__eq__

    def write(self, *, database: bool) -> None:
        self.writes += 1
        if self._strikes(self.writes):
            self._act(database)


def fail(database: bool) -> None:
    """Fails as a broken disk does."""
    if database:
        raise sqlite3.OperationalError("disk I/O error")
    raise OSError(errno.EIO, os.strerror(errno.EIO))


def die(database: bool) -> None:
    """Ends the process as `kill -9` does."""
    os.kill(os.getpid(), signal.SIGKILL)


@contextlib.contextmanager
def striking(faults: Faults) -> Iterator[None]:
    """Counts the writes to databases, and the removals of files, of a block; some do not happen."""

    class Connection(sqlite3.Connection):
        def execute(self, statement: str, *values: Any) -> sqlite3.Cursor:
            if not statement.startswith(_READS):
                faults.write(database=True)
            return super().execute(statement, *values)

    def counted(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            faults.write(database=False)
            return function(*arguments, **options)

        return call

    connect, plain = sqlite3.connect, {name: getattr(os, name) for name in ("unlink", "rmdir", "fsync")}
    sqlite3.connect = lambda *given, **options: connect(*given, **options, factory=Connection)  # type: ignore[assignment]
    for name, function in plain.items():
        setattr(os, name, counted(function))
    try:
        yield
    finally:
        sqlite3.connect = connect
        for name, function in plain.items():
            setattr(os, name, function)


def prepare(folder: Path) -> str:
    """Makes a study folder in which two people have played a session; returns the id of the one to be erased."""
    with contextlib.closing(StudyRecords(folder)) as records:
        one, _ = records.add_participant({"PROLIFIC_PID": TRACES[2]})
        two, _ = records.add_participant({"PROLIFIC_PID": KEPT[1]})
        slot = Slot(
            number=0,
            people=(Role.PARTICIPANT, Role.CO_WIZARD),
            conditions=("exact",),
            scenarios=(Scenario(town="brookside"),),
            seeds=(1,),
        )
        records.add_group(slot, {Role.PARTICIPANT: one, Role.CO_WIZARD: two})
        records.set_folder("S00001-01", "S00001-01")
        records.finish_session("S00001-01", "arrived", success=True, seconds=5.0)
        for name, comment in ((one, TRACES[1]), (two, KEPT[0])):
            records.set_stage(name, Stage.DONE)
            records.answer(name, "after", 0, {"comment": comment})
    sessions = folder / "sessions"
    for name in ("S00001-01", "S00001-01.2", ".S00001-01.x.part", "S00002-01"):
        (sessions / name / "utterance").mkdir(parents=True)
        for file in ("events.jsonl", "seats.jsonl", "utterance/1.flac"):
            (sessions / name / file).write_text(f"Marmalade {one}" if "00001" in name else "Certainly")
    (sessions / "S00001-01.zip").write_text(f"Marmalade {one}")
    return one


def remains(folder: Path, name: str) -> list[str]:
    """Returns the files with something of the erased person, and what is missing of the other one."""
    content = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    left = [f"{path}: {text}" for path, held in content.items() for text in (*TRACES, name) if text.encode() in held]
    named = [str(path) for path in folder.rglob("*") if "S00001" in path.name]
    lost = [text for text in KEPT if not any(text.encode() in held for held in content.values())]
    others = [] if (folder / "sessions/S00002-01/utterance/1.flac").is_file() else ["the other session"]
    return [*left, *named, *lost, *others]


def kill_at_each_write(folder: Path) -> dict[str, Any]:
    """Erases a person in copies of a study, and kills each erasure one write later; returns what is left in the end."""
    name = prepare(folder / "whole")
    left, at = list[str](), 0
    while True:
        at += 1
        copy = folder / f"killed-{at}"
        shutil.copytree(folder / "whole", copy)
        child = os.fork()
        if child == 0:
            with striking(Faults(die, at.__eq__)):
                erase(StudyRecords(copy), name)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        with contextlib.closing(StudyRecords(copy)) as records:
            left += finish_erasures(records)
            if records.participant(name) is not None:  # not acknowledged: the person asks again
                left += erase(records, name)[1]
        left += remains(copy, name)
        if status == 0:
            return {"kills": at - 1, "left": left}


if __name__ == "__main__":
    print(json.dumps(kill_at_each_write(Path(sys.argv[1]))))
