"""Recorded sessions as datasets of one role: what it observed, did and was rewarded with, for Minari and Hugging Face.

The sessions are simulated again from their seeds and actions. A dataset contains the observations of its role and
nothing of the other roles: no hidden landmarks for the Co-Wizard, no story.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from dorothie_gym._version import __version__
from dorothie_gym.errors import SessionError
from dorothie_gym.files import new_folder, write_atomically
from dorothie_gym.ontology import Role
from dorothie_gym.recording import CorpusEntry
from dorothie_gym.rollout.replay import ReplaySources, begin_replay, recorded_actions
from dorothie_gym.spaces import ActionDict, Observation, SpaceLimits, action_fields, observation_fields

MINARI_FOLDER: Final = "MINARI_DATASETS_PATH"
"""Environment variable with the folder of Minari's datasets."""

_PARQUET: Final = "data/train-00000-of-00001.parquet"
"""File of the decisions in a folder for Hugging Face, where `datasets.load_dataset` finds it."""


@dataclass(frozen=True, kw_only=True)
class RoleEpisode:
    """Session as one role lived through it.

    Attributes:
        session: name of the session.
        town: name of its town.
        seed: its seed.
        limits: sizes of the spaces.
        observe_acts: whether acts of utterances are observed.
        observations: n + 1 observations, the last one after the last action.
        actions: n actions.
        rewards: reward of each action.
        terminated: whether the session ended with the task, at its last decision.
    """

    session: str
    town: str
    seed: int
    limits: SpaceLimits
    observe_acts: bool
    observations: tuple[Observation, ...]
    actions: tuple[ActionDict, ...]
    rewards: tuple[float, ...]
    terminated: bool


def role_episodes(
    entries: Iterable[CorpusEntry], role: Role, sources: ReplaySources | None = None
) -> Iterator[RoleEpisode]:  # fmt: skip
    """Yields the sessions of a corpus as a role lived through them.

    Args:
        entries: sessions that this package has recorded.
        role: participant, Co-Wizard or Ad-Wizard.
        sources: maps that are not shipped.

    Raises:
        SessionError: a session cannot be read, or has no recorded actions.
        TownError: a map cannot be read.
    """
    found = sources or ReplaySources()
    for entry in entries:
        session = entry.load()
        engine = begin_replay(session, found.town_of(session))
        agent = str(role)
        observations, actions, rewards, terminated = [engine.observations.of((role,))[agent]], [], [], False
        for taken in recorded_actions(engine, session):
            outcome = engine.step(taken)
            observations.append(engine.observations.of((role,))[agent])
            actions.append(taken[agent])
            rewards.append(float(sum(outcome.reward_terms[role].values())))
            terminated = outcome.terminated
        assert session.header.seed is not None
        yield RoleEpisode(
            session=session.name,
            town=session.header.town,
            seed=session.header.seed,
            limits=engine.limits,
            observe_acts=engine.config.observe_acts,
            observations=tuple(observations),
            actions=tuple(actions),
            rewards=tuple(rewards),
            terminated=terminated,
        )


# --- Hugging Face -----------------------------------------------------------------------------------------------------


def export_hugging_face(
    episodes: Iterable[RoleEpisode], role: Role, folder: Path | str, on_session: Callable[[], None] | None = None
) -> Path:  # fmt: skip
    """Writes a folder that `datasets.load_dataset` reads: a row for each decision, and a dataset card.

    Columns are `session`, `town`, `seed`, `decision`, `reward`, `terminated`, `truncated`, and the fields of
    observation and action with the prefixes `observation.` and `action.`; tables are nested lists.

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
    target, towns, sessions, decisions = Path(folder), set[str](), 0, 0
    limits = SpaceLimits()
    with new_folder(target, hidden=True) as part:
        (part / _PARQUET).parent.mkdir(parents=True)
        writer: pq.ParquetWriter | None = None
        try:
            for episode in episodes:
                table = pa.table(_columns(episode))
                writer = writer or pq.ParquetWriter(part / _PARQUET, table.schema, compression="zstd")
                if not table.schema.equals(writer.schema):
                    raise SessionError(f"{episode.session}: has other fields than the sessions before it")
                writer.write_table(table)
                towns.add(episode.town)
                limits = episode.limits
                sessions, decisions = sessions + 1, decisions + len(episode.actions)
                if on_session is not None:
                    on_session()
        finally:
            if writer is not None:
                writer.close()
        if not sessions:
            raise SessionError("there are no sessions to export")
        write_atomically(part / "README.md", _hub_card(role, sessions, decisions, sorted(towns), limits))
    return target


def _columns(episode: RoleEpisode) -> dict[str, pa.Array]:
    count = len(episode.actions)
    ends = [k == count - 1 for k in range(count)]
    columns: dict[str, pa.Array] = {
        "session": pa.array([episode.session] * count, pa.string()),
        "town": pa.array([episode.town] * count, pa.string()),
        "seed": pa.array([episode.seed] * count, pa.int64()),
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
        *_card(role, sessions, decisions, towns, limits, "observation.", "action."),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def _card(
    role: Role, sessions: int, decisions: int, towns: Sequence[str], limits: SpaceLimits, observed: str, acted: str
) -> list[str]:  # fmt: skip
    lines = [
        f"# Sessions of dorothie_gym as the {role} lived through them", "",
        f"{sessions} sessions with {decisions} decisions in {', '.join(towns)}, recorded with dorothie_gym "
        f"{__version__} and simulated again from their seeds and actions. The dataset contains what this role "
        "observed, and nothing that only the other roles know. Rewards are those of the recorded settings.", "",
        "| field | shape | unit | meaning |", "|---|---|---|---|",
    ]  # fmt: skip
    for prefix, fields in ((observed, observation_fields(role, limits)), (acted, action_fields(role, limits))):
        for field in fields:
            shape = "x".join(map(str, field.shape)) or "1"
            lines.append(f"| `{prefix}{field.name}` | {shape} | {field.unit or '-'} | {field.meaning} |")
    return lines


# --- Minari -----------------------------------------------------------------------------------------------------------


def export_minari(
    episodes: Iterable[RoleEpisode], role: Role, folder: Path | str, on_session: Callable[[], None] | None = None
) -> str:  # fmt: skip
    """Writes a dataset for Minari, an episode for each session, with its card as description.

    Args:
        episodes: sessions of the role, with spaces of the same sizes.
        role: the role.
        folder: folder of Minari's datasets (`MINARI_DATASETS_PATH`).
        on_session: called after each session.

    Returns:
        Name of the dataset: "dorothie-gym/ROLE-v0".

    Raises:
        SessionError: Minari is not installed, there are no sessions, their spaces differ, or the dataset exists.
    """
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError:
        raise SessionError("Minari is not installed; run: pip install 'dorothie-gym[minari]'") from None
    from dorothie_gym.spaces import action_space, observation_space

    name, found = f"dorothie-gym/{str(role).replace('_', '-')}-v0", list[RoleEpisode]()
    for episode in episodes:
        if not episode.actions:
            raise SessionError(f"{episode.session}: has no decisions")
        found.append(episode)
        if on_session is not None:
            on_session()
    if not found:
        raise SessionError("there are no sessions to export")
    limits, acts = found[0].limits, found[0].observe_acts
    other = next((each for each in found if (each.limits, each.observe_acts) != (limits, acts)), None)
    if other is not None:
        raise SessionError(f"{other.session}: its spaces have other sizes than those of {found[0].session}")
    if (Path(folder) / name).exists():
        raise SessionError(f"{Path(folder) / name}: exists already; choose another folder, or remove it first")
    buffers = [
        EpisodeBuffer(
            id=number,
            seed=episode.seed,
            observations=_stacked(episode.observations),
            actions=_stacked(episode.actions),
            rewards=list(episode.rewards),
            terminations=[False] * (len(episode.actions) - 1) + [episode.terminated],
            truncations=[False] * (len(episode.actions) - 1) + [not episode.terminated],
        )
        for number, episode in enumerate(found)
    ]
    towns = sorted({episode.town for episode in found})
    decisions = sum(len(episode.actions) for episode in found)
    Path(folder).mkdir(parents=True, exist_ok=True)
    with _environment(MINARI_FOLDER, str(Path(folder).resolve())), warnings.catch_warnings():
        # it misses an environment, which is not needed: the spaces are given
        warnings.filterwarnings("ignore", category=UserWarning, module="minari")
        minari.create_dataset_from_buffers(
            name,
            buffers,
            observation_space=observation_space(role, limits, acts),
            action_space=action_space(role, limits),
            algorithm_name="recorded sessions",
            author="dorothie_gym",
            author_email="none",
            code_permalink=f"dorothie-gym {__version__}",
            description="\n".join(_card(role, len(found), decisions, towns, limits, "", "")),
            data_format="arrow",
            jpeg_encoding=False,
        )
    return name


def _stacked(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Returns the values of each field of several rows: arrays, and lists of texts."""
    return {
        name: [row[name] for row in rows]
        if isinstance(value, str)
        else np.stack([np.asarray(row[name]) for row in rows])
        for name, value in rows[0].items()
    }


@contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    """Sets an environment variable as long as the block lasts."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        if before is None:
            del os.environ[name]
        else:
            os.environ[name] = before
