"""Deletion of all data of people, as a list of steps that survives failures and crashes.

Deleted data: the person's answers, stages, role and secret, the ids of the recruiting platform, and the whole recording
of each session that the person took part in: its dialogue and actions belong to both people, and it could not be
replayed without one of them. Kept data of a partner: answers, stages, and the fact that there was a session, with its
condition and the reason "withdrawn".

The first step deletes the person from the pseudonymous data, and records in the same transaction which sessions have to
be removed. It is done or not done. From then on the deletion cannot be undone: `finish_erasures` does each further
step, continues after failures, and returns the remaining steps. The next server or command completes the remaining
steps.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from dorothie_gym.lab.studies.database import StorageError
from dorothie_gym.lab.studies.record_types import SESSIONS_FOLDER
from dorothie_gym.lab.studies.records import WITHDRAWN, StudyRecords
from dorothie_gym.support.files import sync

PACKED: Final = frozenset((".zip", ".gz", ".tgz", ".bz2", ".xz", ".zst", ".7z", ".parquet"))
"""Endings of the names of files whose content is compressed, so that nothing can be found in them."""

_CHUNK: Final = 1 << 20
"""Part of a file that is searched at once [bytes]."""


def erase(records: StudyRecords, *names: str) -> tuple[list[str], list[str]]:
    """Deletes all data of participants.

    Sessions of the participants must not be in progress.

    Args:
        records: records of the study.
        names: ids of the participants.

    Returns:
        The ids of the sessions whose records are deleted, and the data that could not be deleted yet, with the reason.

    Raises:
        StorageError: the first step failed, so that nothing is deleted.
    """
    sessions = erase_from_data(records, *names)
    return sessions, finish_erasures(records)


def erase_from_data(records: StudyRecords, *names: str) -> list[str]:
    """Deletes participants from the pseudonymous data, and records the data to remove from other files.

    Args:
        records: records of the study.
        names: ids of the participants.

    Returns:
        The ids of the sessions whose records must be removed.

    Raises:
        StorageError: nothing is deleted.
    """
    data, erased = records.data, list[str]()
    with records.transaction():
        for name in names:
            groups = [row["group_id"] for row in data.rows("SELECT group_id FROM members WHERE participant = ?", name)]
            sessions = [row for group in groups for row in records.sessions(group)]
            records.erase_later([row.id for row in sessions])
            for row in sessions:
                records.set_folder(row.id, None)
                records.finish_session(row.id, WITHDRAWN, success=None, seconds=None)
            for group in groups:
                records.set_group_state(group, "broken")
            data.run("DELETE FROM participants WHERE id = ?", name)
            erased += [row.id for row in sessions]
    return erased


def finish_erasures(records: StudyRecords) -> list[str]:
    """Removes the data of deleted participants from other files, as far as possible.

    May be called at any time; failed steps are retried by the next call, also after a crash.

    Returns:
        Remaining data, with the reason; empty if there are none.
    """
    left: list[str] = []
    _attempt(left, lambda: _forget_platform_ids(records))
    _attempt(left, records.recruitment.compact)
    _attempt(left, records.data.compact)
    for session in records.pending_erasures():
        failures = list(_remove_records(records, session, attempts_only=False))
        left += failures
        if not failures:
            _attempt(left, partial(_note_removal, records, session))
    return left


def _attempt(left: list[str], step: Callable[[], None]) -> None:
    try:
        step()
    except (StorageError, OSError) as error:
        left.append(str(error))


def is_unfinished(records: StudyRecords) -> bool:
    """Returns whether an erasure was interrupted, so that `finish_erasures` has work to do."""
    return bool(records.pending_erasures() or _forgotten(records))


def _forgotten(records: StudyRecords) -> list[str]:
    """Returns the ids with parameters of links that belong to no participant, or no longer to one."""
    known = {row["id"] for row in records.data.rows("SELECT id FROM participants")}
    rows = records.recruitment.rows("SELECT DISTINCT participant FROM parameters")
    return [row["participant"] for row in rows if row["participant"] not in known]


def _forget_platform_ids(records: StudyRecords) -> None:
    with records.recruitment.transaction():
        for name in _forgotten(records):
            records.recruitment.run("DELETE FROM parameters WHERE participant = ?", name)


def _note_removal(records: StudyRecords, session: str) -> None:
    """Records that all data of a session are deleted, once the deletion is durable."""
    sync(records.folder / SESSIONS_FOLDER)
    records.erased(session)


# --- Files ------------------------------------------------------------------------------------------------------------


def remove_attempts(records: StudyRecords, session: str, *, keep: str | None = None) -> None:
    """Removes the folders of interrupted attempts of a session; files, such as backups, stay.

    Args:
        records: records of the study.
        session: id of the session.
        keep: name of a folder that stays.

    Raises:
        StorageError: one cannot be removed.
    """
    for failure in _remove_records(records, session, attempts_only=True, keep=keep):
        raise StorageError(failure)


def _remove_records(
    records: StudyRecords, session: str, *, attempts_only: bool, keep: str | None = None
) -> Iterator[str]:
    """Removes files and folders named like a session; yields those that cannot be removed, with the reason.

    Parts of files and folders that were being written begin with a dot.
    """
    try:
        entries = sorted((records.folder / SESSIONS_FOLDER).iterdir())
    except OSError as error:
        yield _reason(records.folder / SESSIONS_FOLDER, error)
        return
    for entry in entries:
        if entry.name == keep or not entry.name.removeprefix(".").startswith(session):
            continue
        if attempts_only and (entry.is_symlink() or not entry.is_dir()):
            continue
        yield from _remove(entry)


def _remove(entry: Path) -> Iterator[str]:
    """Removes a file, a link (not its target), or a folder and its content; yields the failures."""
    try:
        if entry.is_symlink() or not entry.is_dir():
            entry.unlink(missing_ok=True)
            return
        below = sorted(entry.iterdir())
    except OSError as error:
        yield _reason(entry, error)
        return
    failed = False
    for each in below:
        for failure in _remove(each):
            failed = True
            yield failure
    if failed:
        return
    try:
        entry.rmdir()
    except OSError as error:
        yield _reason(entry, error)


def _reason(path: Path, error: OSError) -> str:
    return f"{path}: cannot be removed ({error.strerror})"


# --- Search -----------------------------------------------------------------------------------------------------------


def find_traces(records: StudyRecords, traces: Sequence[str], sessions: Sequence[str]) -> list[str]:
    """Returns other files in a study folder that may still contain data of a person.

    Databases and the recordings of other sessions are not searched, because the deleted data there are known.

    Args:
        records: records of the study.
        traces: texts that only files about the person have, such as the id of the participant.
        sessions: ids of the sessions whose records were deleted.

    Returns:
        The files, with the text found there.
    """
    root, found = records.folder, list[str]()
    own = {root / SESSIONS_FOLDER / row.folder for row in records.sessions() if row.folder is not None}
    wanted = [text.encode() for text in traces if text]
    for folder, folders, files in os.walk(root):
        folders[:] = sorted(name for name in folders if Path(folder, name) not in own)
        for path in (Path(folder, name) for name in sorted(files)):
            if path.is_symlink() or not path.is_file() or path in (records.data.path, records.recruitment.path):
                continue
            named = any(text in path.name for text in (*traces, *sessions) if text)
            if named or _holds(path, wanted):
                found.append(f"{path}: has something of the person; delete it, or write it again")
            elif path.suffix.lower() in PACKED:
                found.append(f"{path}: is compressed and was not searched; delete it if it has something of the person")
    return found


def _holds(path: Path, wanted: Sequence[bytes]) -> bool:
    """Returns whether a file contains any of the given texts; False if it is unreadable, which other checks report."""
    longest, rest = max(map(len, wanted), default=0), b""
    with contextlib.suppress(OSError), path.open("rb") as file:
        while part := file.read(_CHUNK):
            rest += part
            if any(text in rest for text in wanted):
                return True
            rest = rest[-longest:]
    return False
