"""Generation of corpora: sessions of the scripted roles, divided into folds, with resume."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, Final

import numpy as np

from dorothie_gym.archive.corpus import FOLDS, PAPER_FOLDS, Fold, ManifestRow, manifest_row, write_manifest
from dorothie_gym.evaluation.rollout.runner import PlayedSession, SessionJob, run_sessions
from dorothie_gym.maps.folds import SEEN_TOWNS, UNSEEN_TOWNS, VALIDATION_TOWNS, check_training_towns
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import ALL_SCRIPTED, Player
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import SessionState, safe_name
from dorothie_gym.session.recording.session import session_state

PAPER_SESSIONS: Final = sum(PAPER_FOLDS.values())
"""Sessions of the paper's corpus."""

UNSEEN_FOLDS: Final[Mapping[Fold, tuple[str, ...]]] = MappingProxyType(
    {Fold.VAL_UNSEEN: VALIDATION_TOWNS, Fold.TEST_UNSEEN: UNSEEN_TOWNS}
)
"""Towns of the unseen folds, which take turns."""


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """Session of a corpus to be played.

    Attributes:
        number: number of the session in the corpus, from 0.
        fold: fold of the session.
        town: name of the town.
        seed: seed of the session, which determines it.
    """

    number: int
    fold: Fold
    town: str
    seed: int

    trial: ClassVar[int] = 0
    partners: ClassVar[Mapping[Role, Player]] = MappingProxyType({})

    @property
    def path(self) -> str:
        """Folder of the session within the corpus."""
        return f"{self.fold}/{self.number:04d}-{safe_name(self.town)}"

    def __str__(self) -> str:
        return f"session {self.number} ({self.town}, seed {self.seed})"


def plan_corpus(sessions: int, seed: int, towns: Sequence[str] = SEEN_TOWNS) -> tuple[SessionPlan, ...]:
    """Returns the plans of the sessions of a corpus; the towns of a fold take turns.

    Args:
        sessions: number of sessions, divided among the folds in the proportions of the paper's 183.
        seed: seed of the corpus; with the number of a session it gives the seed of the session.
        towns: names of the towns of the seen folds; "generated" is another town for each session.

    Raises:
        ValueError: `sessions` is below 1, `seed` is negative, or there is no town.
        TownError: a town is for validation or tests.
    """
    if not towns:
        raise ValueError("towns is empty; give at least one")
    check_training_towns(towns)
    if sessions < 1:
        raise ValueError(f"sessions is {sessions}; it must be at least 1")
    if seed < 0:
        raise ValueError(f"seed is {seed}; it must be at least 0")
    plans: list[SessionPlan] = []
    for fold, count in fold_sizes(sessions).items():
        there = UNSEEN_FOLDS.get(fold, towns)
        for k in range(count):
            number = len(plans)
            plans.append(SessionPlan(number=number, fold=fold, town=there[k % len(there)], seed=_seed(seed, number)))
    return tuple(plans)


def fold_sizes(sessions: int) -> dict[Fold, int]:
    """Returns the number of sessions of each fold: the shares of the paper, rounded by largest remainders."""
    shares = {fold: sessions * PAPER_FOLDS[fold] for fold in FOLDS}
    sizes = {fold: share // PAPER_SESSIONS for fold, share in shares.items()}
    by_remainder = sorted(FOLDS, key=lambda fold: -(shares[fold] % PAPER_SESSIONS))
    for fold in by_remainder[: sessions - sum(sizes.values())]:
        sizes[fold] += 1
    return sizes


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0] >> 1)


# --- generation -----------------------------------------------------------------------------------------------------

GENERATION_FILE: Final = "generation.json"
"""Settings of a corpus; a folder with other settings is refused."""


@dataclass(frozen=True, kw_only=True)
class Generated:
    """Generated corpus.

    Attributes:
        root: folder of the corpus.
        manifest: file of the manifest.
        rows: row of each session in the manifest, by number.
        played: number of sessions played in this run; the others were finished before.
    """

    root: Path
    manifest: Path
    rows: tuple[ManifestRow, ...]
    played: int


def generate_corpus(
    root: Path | str,
    *,
    sessions: int,
    seed: int,
    towns: Sequence[str] = SEEN_TOWNS,
    workers: int = 1,
    config: EnvConfig | None = None,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> Generated:
    """Plays the sessions of a corpus with the scripted roles and writes its manifest.

    The bytes in the folder depend neither on the number of workers nor on interruptions: a session appears in its fold
    when it is finished, and a finished session is not played again.

    Args:
        root: folder of the corpus, created if missing.
        sessions: number of sessions, divided among the folds in the proportions of the paper's 183.
        seed: seed of the corpus.
        towns: see `plan_corpus`.
        workers: number of processes; more than one needs an importable main module of the caller.
        config: settings of the engine.
        ray: address of a Ray cluster that replaces the workers; see `on_ray`.
        on_session: called with the numbers of finished and of planned sessions, first with 0 and after each session.

    Raises:
        ValueError: no sessions or no workers, or a negative seed.
        TownError: a town of the seen folds is for validation or tests.
        SessionError: the folder contains other files, or another process holds its lock.
        ProcessError: a session failed in another process, or there is no such cluster.
        OutputFolderError: the folder was deleted or replaced during the run.
        OSError: the folder cannot be written.
    """
    plans, root, config = plan_corpus(sessions, seed, towns), Path(root), config or EnvConfig()
    job = SessionJob(
        settings_file=GENERATION_FILE,
        settings={"sessions": sessions, "seed": seed, "config": config.record(), **named_towns(towns)},
        config=config,
        cast=ALL_SCRIPTED,
        evaluate=_manifest_row,
    )
    rows: dict[int, ManifestRow] = {}
    played = 0
    with run_sessions(job, plans, root, workers=workers, ray=ray, on_session=on_session) as outcomes:
        for outcome in outcomes:
            rows[outcome.plan.number] = outcome.success
            played += outcome.played
        manifest = write_manifest(root, list(rows.values()))
    return Generated(root=root, manifest=manifest, rows=tuple(rows[plan.number] for plan in plans), played=played)


def _manifest_row(played: PlayedSession) -> ManifestRow:
    return manifest_row(played.session, played.folder, played.root)


def named_towns(towns: Sequence[str] = SEEN_TOWNS) -> dict[str, object]:
    """Returns the towns of a corpus as settings: those of the seen folds, and those of each unseen fold."""
    return {"towns": list(towns), "unseen_towns": {str(fold): list(there) for fold, there in UNSEEN_FOLDS.items()}}


def finished_sessions(root: Path | str, *, sessions: int, seed: int, towns: Sequence[str] = SEEN_TOWNS) -> int:
    """Returns the number of finished sessions of a corpus."""
    plans = plan_corpus(sessions, seed, towns)
    return sum(session_state(Path(root) / plan.path) is SessionState.FINISHED for plan in plans)
