"""Folder of a study's data: the copy of its file, and the opening of its records."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.errors import SessionError
from dorothie_gym.lab.studies.database import LOCK_FILE, RunLock
from dorothie_gym.lab.studies.record_types import DATABASE_FILE, STUDY_FILE
from dorothie_gym.lab.studies.records import StudyRecords
from dorothie_gym.lab.studies.study_file import MAX_STUDY, read_study
from dorothie_gym.support.files import PART, write_atomically

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.study import Study

FIXED: Final = ("conditions", "scenarios", "questionnaires", "assignment", "session")
"""Parts of a study that may not change while data are collected."""

_BEGUN: Final = (LOCK_FILE, STUDY_FILE + PART)
"""Files in the folder of a server that died before it had copied the study file."""


@contextlib.contextmanager
def running_study(file: Path, folder: Path) -> Iterator[tuple[Study, StudyRecords]]:
    """Yields a study and its records for a server, which has the folder for itself.

    The first server copies the study file into the folder. If texts or rules have changed since, the copy is renamed
    (`study.1.yaml`) and replaced.

    Raises:
        InputFileError: the file is not a study file.
        SessionError: the folder is of another study or of a version with other conditions or questions, or a server
            runs there.
    """
    study = read_study(file)
    copy = folder / STUDY_FILE
    if folder.exists() and not copy.exists() and any(each.name not in _BEGUN for each in folder.iterdir()):
        raise SessionError(f"{folder}: holds something else than a study; choose a new or an empty folder")
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    with contextlib.closing(RunLock(folder)):
        _keep(study, file, copy)
        with contextlib.closing(StudyRecords(folder)) as records:
            yield study, records


@contextlib.contextmanager
def open_study(folder: Path) -> Iterator[StudyRecords]:
    """Yields the records of a study for changes, while no server runs; errors as in `running_study`."""
    check_folder(folder)
    with contextlib.closing(RunLock(folder)), contextlib.closing(StudyRecords(folder)) as records:
        yield records


def check_folder(folder: Path) -> None:
    """Raises `SessionError` if a folder is not one of a study's data."""
    if not (folder / STUDY_FILE).is_file() or not (folder / DATABASE_FILE).is_file():
        raise SessionError(f"{folder}: is no folder of a study; give the one of `dorothie-gym study run --out`")


def _keep(study: Study, file: Path, copy: Path) -> None:
    text = file.read_bytes()
    if copy.exists():
        if copy.read_bytes() == text:
            return
        before = read_study(copy)
        changed = [name for name in FIXED if getattr(before, name) != getattr(study, name)]
        if changed:
            raise SessionError(
                f"{copy.parent}: was begun with other {' and '.join(changed)}; use a new folder for the changed study"
            )
        number = 1
        while (older := copy.with_name(f"{copy.stem}.{number}{copy.suffix}")).exists():
            number += 1
        copy.rename(older)
    assert len(text) <= MAX_STUDY
    write_atomically(copy, text)
