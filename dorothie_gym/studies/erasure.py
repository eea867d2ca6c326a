"""Deletion of everything of a person, in one step that a crash cannot leave half done.

What goes: the person's answers, stages, role and secret, the ids of the recruiting platform, and the whole record of
each session that the person took part in: its talk and actions belong to both people, and it could not be replayed
without one of them. What stays of a partner: answers, stages, and the fact that there was a session, with its
condition and the reason "withdrawn".
"""

from __future__ import annotations

import shutil
from typing import Final

from dorothie_gym.studies.record_types import SESSIONS_FOLDER
from dorothie_gym.studies.records import StudyRecords

WITHDRAWN: Final = "withdrawn"
"""Reason of the end of a session whose record was deleted."""


def erase(records: StudyRecords, name: str) -> list[str]:
    """Deletes everything of a participant; returns the ids of the sessions whose records are deleted.

    Sessions of the participant must not be in progress.

    Args:
        records: records of the study.
        name: id of the participant.
    """
    data = records.data
    with records.transaction():
        groups = [row["group_id"] for row in data.rows("SELECT group_id FROM members WHERE participant = ?", name)]
        sessions = [row for group in groups for row in records.sessions(group)]
        records.erase_later([row.id for row in sessions])
        for row in sessions:
            records.set_folder(row.id, None)
            records.finish_session(row.id, WITHDRAWN, success=None, seconds=None)
        for group in groups:
            records.set_group_state(group, "broken")
        data.run("DELETE FROM participants WHERE id = ?", name)
    finish_erasures(records)
    return [row.id for row in sessions]


def finish_erasures(records: StudyRecords) -> None:
    """Removes what deleted participants have left in other files; after a crash, the next call goes on."""
    data, recruitment = records.data, records.recruitment
    for row in data.rows("SELECT folder FROM erasures"):
        remove_folders(records, row["folder"])
    known = {row["id"] for row in data.rows("SELECT id FROM participants")}
    with recruitment.transaction():
        for row in recruitment.rows("SELECT DISTINCT participant FROM parameters"):
            if row["participant"] not in known:
                recruitment.run("DELETE FROM parameters WHERE participant = ?", row["participant"])
    recruitment.compact()
    data.compact()
    data.run("DELETE FROM erasures")


def remove_folders(records: StudyRecords, session: str, *, keep: str | None = None) -> None:
    """Removes the folders of a session: its record, and those of interrupted attempts.

    Args:
        records: records of the study.
        session: id of the session.
        keep: name of a folder that stays.
    """
    for folder in (records.folder / SESSIONS_FOLDER).glob(f"{session}*"):
        if folder.name != keep:
            shutil.rmtree(folder)
