"""Recorded sessions as datasets of one role for Hugging Face, and the card of such datasets.

A dataset contains the observations of its role and nothing of the other roles: no hidden landmarks for the Co-Wizard,
no story, and nothing from which these could be derived (`role_episodes`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dorothie_gym._version import __version__
from dorothie_gym.errors import SessionError
from dorothie_gym.evaluation.rollout.role_episodes import RoleEpisode, distinct_ids
from dorothie_gym.session.spaces.actions import action_fields
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.session.spaces.observations import observation_fields
from dorothie_gym.support.files import new_folder, write_atomically

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role

_PARQUET: Final = "data/train-00000-of-00001.parquet"
"""File of the decisions in a folder for Hugging Face, where `datasets.load_dataset` finds it."""


def export_hugging_face(
    episodes: Iterable[RoleEpisode], role: Role, folder: Path | str, on_session: Callable[[], None] | None = None
) -> Path:
    """Writes a folder that `datasets.load_dataset` reads: a row for each decision, and a dataset card.

    Columns are `session` (an opaque id), `town`, `decision`, `reward`, `terminated`, `truncated`, and the fields of
    observation and action with the prefixes `observation.` and `action.`; tables are nested lists. Sessions are in the
    order of their ids.

    Args:
        episodes: sessions of the role.
        role: the role.
        folder: folder to write; it must not exist, or be empty.
        on_session: called after each session.

    Returns:
        The folder.

    Raises:
        SessionError: there are no sessions, or they have different fields.
        OSError: the folder cannot be written.
    """
    target = Path(folder)
    with new_folder(target, hidden=True) as part, tempfile.TemporaryDirectory(dir=part) as unsorted:
        towns, decisions, limits, ids = set[str](), 0, SpaceLimits(), list[tuple[str, int]]()
        for number, episode in enumerate(episodes):
            pq.write_table(pa.table(_columns(episode)), Path(unsorted) / f"{number}.parquet")
            ids.append((episode.id, number))
            towns.add(episode.town)
            limits, decisions = episode.limits, decisions + len(episode.actions)
            if on_session is not None:
                on_session()
        if not ids:
            raise SessionError("there are no sessions to export")
        ids.sort()
        names = distinct_ids([name for name, _ in ids])
        (part / _PARQUET).parent.mkdir(parents=True)
        parts = (
            (name, pq.read_table(Path(unsorted) / f"{number}.parquet"))
            for name, (_, number) in zip(names, ids, strict=True)
        )
        _write_sessions(part / _PARQUET, parts)
        write_atomically(part / "README.md", _hub_card(role, len(ids), decisions, sorted(towns), limits))
    return target


def _write_sessions(path: Path, parts: Iterable[tuple[str, pa.Table]]) -> None:
    """Writes the rows of sessions, with the id of each; raises `SessionError` if they have different fields."""
    writer: pq.ParquetWriter | None = None
    try:
        for name, table in parts:
            whole = table.add_column(0, "session", pa.array([name] * len(table), pa.string()))
            writer = writer or pq.ParquetWriter(path, whole.schema, compression="zstd")
            if not whole.schema.equals(writer.schema):
                raise SessionError("the sessions have different fields: export those of equal settings only")
            writer.write_table(whole)
    finally:
        if writer is not None:
            writer.close()


def _columns(episode: RoleEpisode) -> dict[str, pa.Array]:
    count = len(episode.actions)
    ends = [k == count - 1 for k in range(count)]
    columns: dict[str, pa.Array] = {
        "town": pa.array([episode.town] * count, pa.string()),
        "decision": pa.array(range(count), pa.int32()),
        "reward": pa.array(episode.rewards, pa.float64()),
        "terminated": pa.array([end and episode.terminated for end in ends], pa.bool_()),
        "truncated": pa.array([end and not episode.terminated for end in ends], pa.bool_()),
    }
    for prefix, rows in (("observation", episode.observations[:-1]), ("action", episode.actions)):
        for name in rows[0] if rows else ():
            columns[f"{prefix}.{name}"] = _column([row[name] for row in rows])
    return columns


def _column(values: Sequence[Any]) -> pa.Array:
    """Returns the values of a field; of tables as nested lists of the field's own type."""
    if isinstance(values[0], str):
        return pa.array(values, pa.string())
    stacked = np.stack([np.asarray(value) for value in values])  # (n, ...)
    array = pa.array(stacked.reshape(-1))
    for size in reversed(stacked.shape[1:]):
        array = pa.FixedSizeListArray.from_arrays(array, size)
    return array


def _hub_card(role: Role, sessions: int, decisions: int, towns: Sequence[str], limits: SpaceLimits) -> str:
    """Returns the dataset card: front matter for the hub, and the fields with their shapes, units and meanings."""
    lines = [
        "---", "license: mit", "language: en", "task_categories: [reinforcement-learning]",
        "tags: [dialogue, autonomous-driving, dorothie_gym]", "configs:", "- config_name: default",
        f"  data_files: {_PARQUET}", "---", "",
        *dataset_card(role, sessions, decisions, towns, limits, "observation.", "action."),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def dataset_card(
    role: Role, sessions: int, decisions: int, towns: Sequence[str], limits: SpaceLimits, observed: str, acted: str
) -> list[str]:
    """Returns the lines of a card: description of the dataset, and its fields with shapes, units and meanings.

    Args:
        role: the role.
        sessions: number of sessions.
        decisions: number of decisions.
        towns: names of the towns.
        limits: sizes of the spaces.
        observed: prefix of the fields of the observation.
        acted: prefix of the fields of the action.
    """
    lines = [
        f"# Sessions of dorothie_gym as the {role} lived through them",
        "",
        f"{sessions} sessions with {decisions} decisions in {', '.join(towns)}, recorded with dorothie_gym "
        f"{__version__} and simulated again from their seeds and actions. The dataset contains what this role "
        "observed, and nothing that only the other roles know. Rewards are those of the recorded settings. Ids of "
        "sessions, and their order, follow from what the role observed and did.",
        "",
        "| field | shape | unit | meaning |",
        "|---|---|---|---|",
    ]
    for prefix, fields in ((observed, observation_fields(role, limits)), (acted, action_fields(role, limits))):
        for field in fields:
            shape = "x".join(map(str, field.shape)) or "1"
            lines.append(f"| `{prefix}{field.name}` | {shape} | {field.unit or '-'} | {field.meaning} |")
    return lines
