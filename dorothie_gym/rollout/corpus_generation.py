"""A corpus of sessions of the scripted roles, made by several processes, which may be stopped and gone on with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.maps import SEEN_TOWNS, UNSEEN_TOWNS
from dorothie_gym.policies import ALL_SCRIPTED
from dorothie_gym.recording import FOLDS, Fold, SessionState, manifest_row, session_state, write_manifest
from dorothie_gym.rollout.folder import making_in
from dorothie_gym.rollout.on_ray import share_out_on_ray
from dorothie_gym.rollout.play import SessionMaker
from dorothie_gym.rollout.processes import share_out

PAPER_FOLDS: Final[Mapping[Fold, int]] = MappingProxyType(
    {Fold.TRAIN: 123, Fold.VAL_SEEN: 14, Fold.VAL_UNSEEN: 6, Fold.TEST_SEEN: 25, Fold.TEST_UNSEEN: 15}
)
"""Sessions of each fold of the original corpus, 183 in all (paper, section 4)."""

PAPER_SESSIONS: Final = sum(PAPER_FOLDS.values())

_UNSEEN: Final = frozenset((Fold.VAL_UNSEEN, Fold.TEST_UNSEEN))


@dataclass(frozen=True, kw_only=True)
class SessionPlan:
    """A session that a corpus is to have.

    Attributes:
        number: its number in the corpus, from 0.
        fold: where it belongs.
        town: name of its town.
        seed: everything in it follows from this.
    """

    number: int
    fold: Fold
    town: str
    seed: int

    @property
    def path(self) -> str:
        """Its folder within the corpus."""
        return f"{self.fold}/{self.number:04d}-{self.town}"


def plan_corpus(sessions: int, seed: int) -> tuple[SessionPlan, ...]:
    """Returns the sessions of a corpus; towns take turns within a fold.

    Args:
        sessions: how many; they are shared out among the folds as the paper's 183.
        seed: the seed of a session follows from it and from the session's number only.

    Raises:
        ValueError: there is to be no session, or the seed is negative.
    """
    if sessions < 1:
        raise ValueError(f"sessions is {sessions}; it must be at least 1")
    if seed < 0:
        raise ValueError(f"seed is {seed}; it must be at least 0")
    plans: list[SessionPlan] = []
    for fold, count in fold_sizes(sessions).items():
        towns = UNSEEN_TOWNS if fold in _UNSEEN else SEEN_TOWNS
        for k in range(count):
            number = len(plans)
            plans.append(SessionPlan(number=number, fold=fold, town=towns[k % len(towns)], seed=_seed(seed, number)))
    return tuple(plans)


def fold_sizes(sessions: int) -> dict[Fold, int]:
    """Returns how many of so many sessions each fold has: the paper's shares, by largest remainders."""
    shares = {fold: sessions * PAPER_FOLDS[fold] for fold in FOLDS}
    sizes = {fold: share // PAPER_SESSIONS for fold, share in shares.items()}
    by_remainder = sorted(FOLDS, key=lambda fold: -(shares[fold] % PAPER_SESSIONS))
    for fold in by_remainder[: sessions - sum(sizes.values())]:
        sizes[fold] += 1
    return sizes


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number]).generate_state(1)[0] >> 1)


# --- A corpus of sessions of the scripted roles, made by several processes, which may be stopped and gone ------------

GENERATION_FILE: Final = "generation.json"
"""What a corpus is made from: a folder with another one of these is not gone on with."""


@dataclass(frozen=True, kw_only=True)
class Generated:
    """How the making of a corpus ended.

    Attributes:
        root: its folder.
        manifest: its manifest.
        rows: the manifest's row of each session, by number.
        played: how many sessions were played now; the others were there already.
    """

    root: Path
    manifest: Path
    rows: tuple[Mapping[str, Any], ...]
    played: int


def generate_corpus(
    root: Path | str,
    *,
    sessions: int,
    seed: int,
    workers: int = 1,
    config: EnvConfig | None = None,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> Generated:
    """Plays the sessions of a corpus and writes its manifest.

    What lies in the folder depends on neither who plays nor how often the making was interrupted and begun again: a
    session appears in its fold when it is finished, and one that is there is not played again.

    Args:
        root: folder of the corpus, made if need be.
        sessions: how many, shared out among the folds as the paper's 183.
        seed: of the corpus.
        workers: processes that play; with more than one the caller's main module must be importable.
        config: of the environment.
        ray: address of a Ray cluster that plays, instead of `workers`; see `on_ray`.
        on_session: called with the number of sessions that are there, and of those to be, at first and after each.

    Raises:
        ValueError: no sessions or no workers, or a negative seed.
        SessionError: the folder holds something else, or another process is at work in it.
        ProcessError: a session failed in another process, or there is no such cluster.
        OSError: the folder cannot be written.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; it must be at least 1")
    plans, root, config = plan_corpus(sessions, seed), Path(root), config or EnvConfig()
    with making_in(root, GENERATION_FILE, {"sessions": sessions, "seed": seed, "config": asdict(config)}):
        rows: dict[int, Mapping[str, Any]] = {}
        played = 0
        if on_session is not None:
            on_session(0, sessions)
        prepare = partial(_CorpusMaker, config=config)
        for number, row, is_new in (
            share_out(partial(prepare, root), plans, workers=workers)
            if ray is None
            else share_out_on_ray(prepare, plans, root, address=ray)
        ):
            rows[number] = row
            played += is_new
            if on_session is not None:
                on_session(len(rows), sessions)
        manifest = write_manifest(root, list(rows.values()))
    return Generated(root=root, manifest=manifest, rows=tuple(rows[plan.number] for plan in plans), played=played)


@dataclass
class _CorpusMaker:
    """Makes sessions of a corpus, and their rows of the manifest.

    Attributes:
        root: folder of the corpus.
        config: of the environment.
    """

    root: Path
    config: EnvConfig

    def __post_init__(self) -> None:
        """Prepares the making of sessions."""
        self._maker = SessionMaker(self.root, self.config, ALL_SCRIPTED)

    def __call__(self, plan: SessionPlan) -> tuple[int, dict[str, Any], bool]:
        """Returns the number of a session, its row of the manifest, and whether it was played now."""
        session, folder, is_new = self._maker(plan)
        return plan.number, manifest_row(session, folder, self.root), is_new


def finished_sessions(root: Path | str, *, sessions: int, seed: int) -> int:
    """Returns how many sessions of a corpus are finished."""
    return sum(session_state(Path(root) / plan.path) is SessionState.FINISHED for plan in plan_corpus(sessions, seed))
