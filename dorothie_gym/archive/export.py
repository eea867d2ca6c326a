"""Export of a corpus as two tables for pandas and `datasets`: utterances and navigation decisions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from dorothie_gym.archive.prediction_points import PointView, history_angle, nfd_points
from dorothie_gym.ontology.dialogue_acts import VECTOR_SLOTS
from dorothie_gym.ontology.roles import Role
from dorothie_gym.support.files import replacing
from dorothie_gym.support.libraries import pa, pq

if TYPE_CHECKING:
    from dorothie_gym.session.recording.session import Session

UTTERANCES_FILE: Final = "utterances.parquet"
DECISIONS_FILE: Final = "decision_points.parquet"

PAST_ACTIONS: Final = 10
"""Past actions in a row of the decision points."""


def export_tables(sessions: Iterable[tuple[str | None, Session]], folder: Path) -> tuple[Path, Path]:
    """Writes both tables, reading one session at a time; each file appears when it is complete.

    Args:
        sessions: the sessions with the names of their folds.
        folder: folder of the tables, created if it is missing; older tables are replaced.

    Returns:
        Paths of the utterances and of the decision points.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = (folder / UTTERANCES_FILE, folder / DECISIONS_FILE)
    schemas = (_utterance_schema(), _decision_schema())
    with (
        replacing(paths[0]) as first,
        replacing(paths[1]) as second,
        pq.ParquetWriter(first, schemas[0], compression="zstd") as utterances,
        pq.ParquetWriter(second, schemas[1], compression="zstd") as decisions,
    ):
        for fold, session in sessions:
            utterances.write_table(pa.Table.from_pylist(list(_utterance_rows(fold, session)), schema=schemas[0]))
            decisions.write_table(pa.Table.from_pylist(list(_decision_rows(fold, session)), schema=schemas[1]))
    return paths


def _shared() -> list[tuple[str, pa.DataType]]:
    return [("fold", pa.string()), ("session", pa.string()), ("town", pa.string()), ("event", pa.int64())]


def _utterance_schema() -> pa.Schema:
    texts = pa.list_(pa.string())
    return pa.schema(
        [
            *_shared(),
            ("frame", pa.int64()),
            ("utterance", pa.int64()),
            ("act", pa.int64()),
            ("speaker", pa.string()),
            ("start", pa.float64()),
            ("end", pa.float64()),
            ("text", pa.string()),
            ("recognised", pa.string()),
            ("span", pa.string()),
            ("move", pa.string()),
            *((slot.label.lower(), texts) for slot in VECTOR_SLOTS),
            ("exchange", pa.int64()),
            ("transaction", pa.int64()),
            ("flagged", pa.bool_()),
        ]
    )


def _utterance_rows(fold: str | None, session: Session) -> Iterator[dict[str, object]]:
    for utterance in session.utterances():
        for number, move in enumerate(utterance.moves):
            labels = move.act.slot_labels()
            yield {
                **_start(fold, session, move.index),
                "frame": move.frame,
                "utterance": move.utterance,
                "act": number,
                "speaker": str(move.speaker),
                "start": move.start,
                "end": move.end,
                "text": move.text,
                "recognised": move.recognised,
                "span": move.span,
                "move": move.act.move.label,
                **{slot.label.lower(): labels.get(slot.label, []) for slot in VECTOR_SLOTS},
                "exchange": move.exchange,
                "transaction": move.transaction,
                "flagged": move.flagged,
            }


def _decision_schema() -> pa.Schema:
    return pa.schema(
        [
            *_shared(),
            ("frame", pa.int64()),
            ("time", pa.float64()),
            ("action", pa.string()),
            ("angle", pa.float64()),
            *((name, pa.float64()) for name in ("x", "y", "heading", "speed")),
            ("participant_said", pa.string()),
            ("co_wizard_said", pa.string()),
            ("past_actions", pa.list_(pa.string())),
            ("past_angles", pa.list_(pa.float64())),
        ]
    )


def _decision_rows(fold: str | None, session: Session) -> Iterator[dict[str, object]]:
    for point in nfd_points(session):
        view, past = point.view, point.view.actions[-PAST_ACTIONS:]
        car = view.car
        yield {
            **_start(fold, session, point.index),
            "frame": view.frame,
            "time": view.time,
            "action": point.action.label,
            "angle": None if math.isnan(point.angle) else point.angle,
            **{name: None if car is None else getattr(car, name) for name in ("x", "y", "heading", "speed")},
            "participant_said": _last_said(view, Role.PARTICIPANT),
            "co_wizard_said": _last_said(view, Role.CO_WIZARD),
            "past_actions": [record.action.label for record in past],
            "past_angles": [history_angle(record) for record in past],
        }


def _start(fold: str | None, session: Session, event: int) -> dict[str, object]:
    return {"fold": fold, "session": session.name, "town": session.header.town, "event": event}


def _last_said(view: PointView, speaker: Role) -> str | None:
    return next((move.text for move in reversed(view.moves) if move.speaker is speaker), None)
