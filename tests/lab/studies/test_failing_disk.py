"""Servers of studies whose disk fails at one write: people can go on, and nobody is in two places."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="needs the extra console")
pytest.importorskip("websockets", reason="needs the extra console")

from dorothie_gym.lab.studies.database import Database, StorageError
from dorothie_gym.lab.studies.folder import running_study
from dorothie_gym.lab.studies.records import StudyRecords
from dorothie_gym.lab.studies.room_building import RoomBuilder
from tests.lab.studies.content import SOLO, STUDY, write_study
from tests.lab.studies.faults import Faults, fail, striking
from tests.lab.studies.serving import Client, ServedStudy, seat


def test_an_entry_that_fails_at_any_write_is_repeated_and_found_again(tmp_path: Path) -> None:
    platform, writes = {"PROLIFIC_PID": "platform-one"}, 0
    for at in count(1):
        faults, refused = Faults(fail, lambda number: False), False
        with striking(faults), contextlib.closing(StudyRecords(tmp_path / f"failed-{at}")) as records:
            faults.strike_after(at)
            try:
                name, _ = records.add_participant(platform)
            except StorageError:
                refused, writes = True, at
                assert records.participants() == [], "nobody is in by half"
                name, _ = records.add_participant(platform)
            assert records.find_platform_id("PROLIFIC_PID", "platform-one") == name, "the check for repeats holds"
        if not refused:
            break
    assert writes > 4


@pytest.mark.long
def test_a_group_that_cannot_be_stored_binds_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    broken, add_group, run = [False], StudyRecords.add_group, Database.run

    def adding(self: StudyRecords, *group: Any) -> Any:
        broken[0] = not failures
        return add_group(self, *group)

    def running(self: Database, statement: str, *values: object) -> None:
        if broken[0] and statement == "COMMIT":
            broken[0] = False
            failures.append(statement)
            raise StorageError("disk I/O error")
        run(self, statement, *values)

    failures = list[str]()
    monkeypatch.setattr(StudyRecords, "add_group", adding)
    monkeypatch.setattr(Database, "run", running)
    with ServedStudy(write_study(tmp_path, STUDY), tmp_path / "data") as served:
        one, two, three = (Client(served.port) for _ in range(3))
        one.enter()
        two.enter()
        while not failures:
            two.do("news")
            time.sleep(0.2)  # as a browser does; a person has no more requests than that
        one.do("withdraw", {"sure": True})
        three.enter()
        seat(two, three)
        with two.sit(), three.sit():
            two.follow(lambda: two.view.get("over"))


def test_a_room_that_fails_with_its_disk_does_not_hold_a_withdrawal_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, gone = threading.Event(), threading.Event()

    def building(*row: object) -> None:
        asked.set()
        assert gone.wait(20.0)
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    def failing(*row: object, **values: object) -> None:
        raise StorageError("disk I/O error")

    monkeypatch.setattr(RoomBuilder, "session", building)
    with ServedStudy(write_study(tmp_path, {**SOLO, "tutorial": None}), tmp_path / "data") as served:
        one = Client(served.port)
        one.do("join")
        one.do("consent", {"agreed": [True, True]})
        one.do("answers", {"stage": "before", "answers": {"age": 30}})
        one.do("proceed", {"stage": "instructions"})
        assert asked.wait(20.0)
        with ThreadPoolExecutor(1) as threads:
            withdrawn = threads.submit(one.post, "withdraw", {"sure": True})
            while not _is_erased(served, one.view["id"]):
                assert not withdrawn.done()
            monkeypatch.setattr(StudyRecords, "finish_session", failing)
            gone.set()
            assert withdrawn.result(20.0) == 200
        assert "deleted" in one.view["gone"]


def _is_erased(served: ServedStudy, name: str) -> bool:
    with contextlib.closing(StudyRecords(served.data, writable=False)) as records:
        return records.participant(name) is None


def test_a_server_that_died_at_its_first_start_starts_again(tmp_path: Path) -> None:
    file, data = write_study(tmp_path, SOLO), tmp_path / "data"
    data.mkdir()
    for name in ("run.lock", "study.yaml.part"):
        (data / name).touch()
    with running_study(file, data) as (_, records):
        assert records.participants() == []
    assert sorted(path.name for path in data.iterdir()) == [
        "recruitment.sqlite",
        "run.lock",
        "sessions",
        "study.sqlite",
        "study.yaml",
    ]
