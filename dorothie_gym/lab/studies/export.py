"""Pseudonymous tables of a study: participants, answers, sessions, and utterances; as CSV, and as Parquet.

They have no ids of the recruiting platform and no dates: times are seconds since the consent.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from dorothie_gym.archive.sound import audio_files
from dorothie_gym.lab.studies.folder import check_folder
from dorothie_gym.lab.studies.record_types import SESSIONS_FOLDER, STUDY_FILE
from dorothie_gym.lab.studies.records import StudyRecords
from dorothie_gym.lab.studies.stages import QUESTIONNAIRES
from dorothie_gym.lab.studies.study_file import read_study
from dorothie_gym.session.recording.files import SessionState
from dorothie_gym.session.recording.session import Session, session_state
from dorothie_gym.support.files import replacing, write_atomically
from dorothie_gym.support.libraries import pa, pq

if TYPE_CHECKING:
    from dorothie_gym.lab.studies.study import Study

Row: TypeAlias = Mapping[str, str | int | float | bool | None]
"""Row of a table."""

COLUMNS: Final[Mapping[str, Mapping[str, str]]] = {
    "participants": {
        "participant": "string", "role": "string", "stage": "string", "outcome": "string", "group": "int64",
        "slot": "int64", "conditions": "string", "seconds": "float64",
    },
    "answers": {
        "participant": "string", "questionnaire": "string", "session": "string", "condition": "string",
        "item": "string", "kind": "string", "value": "string", "number": "float64",
    },
    "stages": {"participant": "string", "stage": "string", "seconds": "float64"},
    "sessions": {
        "session": "string", "group": "int64", "slot": "int64", "position": "int64", "condition": "string",
        "town": "string", "storyboard": "string", "seed": "int64", "participant": "string", "co_wizard": "string",
        "ad_wizard": "string", "reason": "string", "success": "bool_", "seconds": "float64", "folder": "string",
    },
    "utterances": {
        "session": "string", "condition": "string", "speaker": "string", "participant": "string", "start": "float64",
        "end": "float64", "text": "string", "audio": "string",
    },
}  # fmt: skip
"""Columns of the tables and their types."""


def export_study(folder: Path, out: Path) -> dict[str, int]:
    """Writes the tables of a study; may be called while its server runs.

    Args:
        folder: folder of the study's data.
        out: folder of the tables, created if it is missing; older tables are replaced.

    Returns:
        The number of rows of each table.

    Raises:
        SessionError: the folder is of no study, or a session is damaged.
    """
    check_folder(folder)
    records = StudyRecords(folder, writable=False)
    try:
        study = read_study(folder / STUDY_FILE)
        with records.data.snapshot():
            tables = {
                "participants": list(_participants(records)),
                "answers": list(_answers(study, records)),
                "stages": list(_stages(records)),
                "sessions": list(_sessions(study, records)),
            }
        tables["utterances"] = list(_utterances(records))
    finally:
        records.close()
    out.mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        _write_csv(out / f"{name}.csv", list(COLUMNS[name]), rows)
        if find_spec("pyarrow") is not None:
            _write_parquet(out / f"{name}.parquet", COLUMNS[name], rows)
    return {name: len(rows) for name, rows in tables.items()}


# --- Rows -------------------------------------------------------------------------------------------------------------


def _participants(records: StudyRecords) -> Iterator[Row]:
    for found in records.data.rows("SELECT id FROM participants ORDER BY id"):
        person = records.participant(found["id"])
        assert person is not None
        group = records.group_of(person.id)
        seconds = [row["seconds"] for row in _stages(records, person.id)]
        yield {
            "participant": person.id,
            "role": None if person.role is None else person.role.value,
            "stage": person.stage.value,
            "outcome": None if person.outcome is None else person.outcome.value,
            "group": None if group is None else group.id,
            "slot": None if group is None else group.slot,
            "conditions": None if group is None else " ".join(row.condition for row in records.sessions(group.id)),
            "seconds": seconds[-1] if seconds else None,
        }


def _stages(records: StudyRecords, name: str | None = None) -> Iterator[Row]:
    rows = records.data.rows(
        "SELECT * FROM marks WHERE ? IS NULL OR participant = ? ORDER BY participant, at", name, name
    )
    first: dict[str, float] = {}
    for row in rows:
        since = first.setdefault(row["participant"], row["at"])
        yield {"participant": row["participant"], "stage": row["stage"], "seconds": round(row["at"] - since, 1)}


def _answers(study: Study, records: StudyRecords) -> Iterator[Row]:
    kinds = {
        (name, item.id): str(type(item).__struct_config__.tag)
        for name in QUESTIONNAIRES.values()
        for item in study.questionnaire(name)
    }
    query = "SELECT * FROM answers ORDER BY participant, questionnaire, position, rowid"
    for row in records.data.rows(query):
        value: Any = json.loads(row["value"])
        group = records.group_of(row["participant"]) if row["questionnaire"] == "after_session" else None
        session = None if group is None else records.sessions(group.id)[row["position"]]
        yield {
            "participant": row["participant"],
            "questionnaire": row["questionnaire"],
            "session": None if session is None else session.id,
            "condition": None if session is None else session.condition,
            "item": row["item"],
            "kind": kinds.get((row["questionnaire"], row["item"])),
            "value": None if value is None else "; ".join(value) if isinstance(value, list) else str(value),
            "number": float(value) if isinstance(value, int | float) else None,
        }


def _sessions(study: Study, records: StudyRecords) -> Iterator[Row]:
    for row in records.sessions():
        group = records.group(row.group)
        found = records.data.row("SELECT success, seconds FROM sessions WHERE id = ?", row.id)
        assert found is not None
        people = {role.value: name for role, name in group.members.items()}
        players = {role.value: player for role, player in study.condition(row.condition).players.items()}
        yield {
            "session": row.id,
            "group": row.group,
            "slot": group.slot,
            "position": row.position,
            "condition": row.condition,
            "town": row.town,
            "storyboard": row.storyboard,
            "seed": row.seed,
            **{role: people.get(role, player) for role, player in players.items()},
            "reason": row.reason,
            "success": None if found["success"] is None else bool(found["success"]),
            "seconds": found["seconds"],
            "folder": None if row.folder is None else f"{SESSIONS_FOLDER}/{row.folder}",
        }


def _utterances(records: StudyRecords) -> Iterator[Row]:
    for row in records.sessions():
        folder = None if row.folder is None else records.folder / SESSIONS_FOLDER / row.folder
        if folder is None or session_state(folder) is not SessionState.FINISHED:
            continue
        people = records.group(row.group).members
        session = Session.load(folder)
        for spoken in session.utterances():
            files = [each.path.relative_to(records.folder).as_posix() for each in audio_files(session, spoken)]
            yield {
                "session": row.id,
                "condition": row.condition,
                "speaker": spoken.speaker.value,
                "participant": people.get(spoken.speaker),
                "start": spoken.start,
                "end": spoken.end,
                "text": spoken.text,
                "audio": "; ".join(files) or None,
            }


# --- Files ------------------------------------------------------------------------------------------------------------


def _write_csv(path: Path, columns: Sequence[str], rows: Sequence[Row]) -> None:
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: _cell(value) for name, value in row.items()} for row in rows)
    write_atomically(path, text.getvalue())


def _cell(value: object) -> object:
    """Returns the value of a cell; texts that spreadsheets would run as formulas begin with an apostrophe."""
    if isinstance(value, str) and value[:1] in ("=", "+", "-", "@", "\t", "\r"):
        return f"'{value}"
    return value


def _write_parquet(path: Path, columns: Mapping[str, str], rows: Sequence[Row]) -> None:
    schema = pa.schema([(name, getattr(pa, kind)()) for name, kind in columns.items()])
    with replacing(path) as part:
        pq.write_table(pa.Table.from_pylist([dict(row) for row in rows], schema=schema), part, compression="zstd")
