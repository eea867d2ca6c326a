"""Erasures that fail or are killed at any write: nothing is half done for ever, and what is left is named."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from dorothie_gym.lab.studies.database import StorageError
from dorothie_gym.lab.studies.erasure import erase, find_traces, finish_erasures, is_unfinished, remove_attempts
from dorothie_gym.lab.studies.records import StudyRecords
from tests.full_disk import full_disk
from tests.lab.studies.faults import TRACES, Faults, fail, prepare, remains, striking


def strike_at_each_write(folder: Path, strikes: Callable[[int, int], bool]) -> int:
    """Lets writes of an erasure fail, the first failure one write later each time; returns the number of trials."""
    name, at, refused = prepare(folder / "whole"), 0, 0
    while True:
        at += 1
        copy = folder / f"failed-{at}"
        shutil.copytree(folder / "whole", copy)
        faults = Faults(fail, partial(strikes, at))
        with striking(faults), contextlib.closing(StudyRecords(copy)) as records:
            try:
                _, left = erase(records, name)
            except StorageError:
                refused += 1
                left = ["everything"]
                assert records.participant(name) is not None, "the person is there as before"
            else:
                assert records.participant(name) is None, "the databases come first"
                assert left or faults.writes < at, "a failure is named"
            if faults.writes < at:
                assert not left and refused > 0
                return at - 1
        with contextlib.closing(StudyRecords(copy)) as records:  # the next start
            assert finish_erasures(records) == []
            if records.participant(name) is not None:
                assert erase(records, name)[1] == []
            assert not is_unfinished(records)
        assert remains(copy, name) == [], at


@pytest.mark.long
def test_an_erasure_goes_on_after_any_write_that_fails(tmp_path: Path) -> None:
    assert strike_at_each_write(tmp_path, lambda at, number: number == at) > 25


@pytest.mark.long
def test_an_erasure_is_finished_by_the_next_start_after_the_disk_has_died(tmp_path: Path) -> None:
    assert strike_at_each_write(tmp_path, lambda at, number: number >= at) > 25


@pytest.mark.long
def test_an_erasure_that_is_killed_at_any_write_is_finished_by_the_next_start(tmp_path: Path) -> None:
    found = subprocess.run(
        [sys.executable, "-m", "tests.lab.studies.faults", str(tmp_path)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )
    assert found.returncode == 0, found.stderr
    result = json.loads(found.stdout)
    assert result["left"] == [] and result["kills"] > 25


def test_a_full_disk_leaves_a_person_whole_or_erased(tmp_path: Path) -> None:
    name, erased = prepare(tmp_path / "whole"), list[int]()
    for limit in (0, 512, 4096, 8192, 16384, 40960, 65536, 1 << 20):
        copy = tmp_path / f"full-{limit}"
        shutil.copytree(tmp_path / "whole", copy)
        with contextlib.closing(StudyRecords(copy)) as records:
            try:
                with full_disk(limit):  # SQLite gets the error of the system
                    erase(records, name)
                erased.append(limit)
            except StorageError as error:
                assert "check the space on the disk" in str(error)
            assert (records.participant(name) is None) == (limit in erased)
            erase(records, name)
        assert remains(copy, name) == [], limit
    assert 0 not in erased and 1 << 20 in erased


def store_two(records: StudyRecords) -> None:
    with records.transaction():
        records.erase_later(["first", "second"])


def test_a_transaction_that_cannot_be_stored_does_not_swallow_the_next_one(tmp_path: Path) -> None:
    faults = Faults(fail, lambda number: False)
    with striking(faults), contextlib.closing(StudyRecords(tmp_path / "data")) as records:
        faults.strike_after(3)  # its COMMIT
        with pytest.raises(StorageError):
            store_two(records)
        records.erase_later(["third"])
    with contextlib.closing(StudyRecords(tmp_path / "data")) as records:
        assert records.pending_erasures() == ["third"]


def test_links_are_removed_and_not_what_they_lead_to(tmp_path: Path) -> None:
    name = prepare(tmp_path / "data")
    other = tmp_path / "other"
    other.mkdir()
    (other / "precious").write_text("stays")
    (tmp_path / "data/sessions/S00001-01.link").symlink_to(other)
    (tmp_path / "data/sessions/S00001-01/link").symlink_to(other)
    with contextlib.closing(StudyRecords(tmp_path / "data")) as records:
        assert erase(records, name) == (["S00001-01"], [])
    assert remains(tmp_path / "data", name) == [] and (other / "precious").read_text() == "stays"


def test_a_backup_is_no_interrupted_attempt(tmp_path: Path) -> None:
    prepare(tmp_path / "data")
    with contextlib.closing(StudyRecords(tmp_path / "data")) as records:
        remove_attempts(records, "S00001-01", keep="S00001-01.2")
    names = {path.name for path in (tmp_path / "data/sessions").iterdir()}
    assert names == {"S00001-01.2", "S00001-01.zip", "S00002-01"}


def test_files_that_people_have_put_into_the_folder_are_named(tmp_path: Path) -> None:
    data = tmp_path / "data"
    name = prepare(data)
    (data / "tables").mkdir()
    (data / "tables/answers.csv").write_text(f"participant,value\n{name},Velvet\n")
    (data / "tables/towns.csv").write_text("brookside\n")
    (data / "tables/answers.parquet").write_bytes(b"PAR1")
    (data / "large.txt").write_bytes(b"x" * ((1 << 20) - 5) + TRACES[2].encode())
    (data / "backup").mkdir()
    (data / "backup/S00001-01.tar").touch()
    with contextlib.closing(StudyRecords(data)) as records:
        sessions, left = erase(records, name)
        found = find_traces(records, [name, TRACES[2]], sessions)
    assert left == []
    named = {line.partition(": ")[0].removeprefix(f"{data}/") for line in found}
    assert named == {"tables/answers.csv", "tables/answers.parquet", "large.txt", "backup/S00001-01.tar"}
