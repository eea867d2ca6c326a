"""A corpus of sessions of the scripted roles, made by several processes, which may be stopped and gone on with."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

from dorothie_gym import __version__
from dorothie_gym.envs.config import EnvConfig
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.ontology import AGENT_ROLES
from dorothie_gym.policies import make_policy
from dorothie_gym.rollout.corpus_plan import SessionPlan, plan_corpus
from dorothie_gym.rollout.play import play_session
from dorothie_gym.rollout.processes import share_out
from dorothie_gym.sessions import (
    FORMAT_VERSION,
    Session,
    SessionError,
    SessionState,
    manifest_row,
    session_state,
    write_manifest,
)

if sys.platform != "win32":
    import fcntl

GENERATION_FILE: Final = "generation.json"
"""What a corpus is made from: a folder with another one of these is not gone on with."""

PARTS: Final = ".parts"
"""Folder within the corpus of sessions that are not finished yet; gone when the corpus is."""


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
    on_session: Callable[[int, int], None] | None = None,
) -> Generated:
    """Plays the sessions of a corpus and writes its manifest.

    What lies in the folder depends on neither `workers` nor how often the making was interrupted and begun again: a
    session appears in its fold when it is finished, and one that is there is not played again.

    Args:
        root: folder of the corpus, made if need be.
        sessions: how many, shared out among the folds as the paper's 183.
        seed: of the corpus.
        workers: processes that play; with more than one the caller's main module must be importable.
        config: of the environment.
        on_session: called with the number of sessions that are there, and of those to be, at first and after each.

    Raises:
        ValueError: no sessions or no workers, or a negative seed.
        SessionError: the folder holds something else, or another process is at work in it.
        ProcessError: a session failed in another process.
        OSError: the folder cannot be written.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; it must be at least 1")
    plans, root, config = plan_corpus(sessions, seed), Path(root), config or EnvConfig()
    with _alone_in(root):
        _claim(root, {"sessions": sessions, "seed": seed, "config": asdict(config)})
        shutil.rmtree(root / PARTS, ignore_errors=True)
        (root / PARTS).mkdir()
        rows: dict[int, Mapping[str, Any]] = {}
        played = 0
        if on_session is not None:
            on_session(0, sessions)
        for number, row, is_new in share_out(partial(SessionMaker, root, config), plans, workers=workers):
            rows[number] = row
            played += is_new
            if on_session is not None:
                on_session(len(rows), sessions)
        manifest = write_manifest(root, list(rows.values()))
        (root / PARTS).rmdir()
    return Generated(root=root, manifest=manifest, rows=tuple(rows[plan.number] for plan in plans), played=played)


@dataclass(kw_only=False)
class SessionMaker:
    """Makes sessions of a corpus, one after the other; towns are kept.

    Attributes:
        root: folder of the corpus.
        config: of the environment.
    """

    root: Path
    config: EnvConfig
    _envs: dict[str, DuoWizardEnv] = field(default_factory=dict)

    def __call__(self, plan: SessionPlan) -> tuple[int, dict[str, Any], bool]:
        """Plays a session, unless it is there; returns its number, its row of the manifest, and whether it is new.

        Raises:
            SessionError: something else is there.
        """
        folder = self.root / plan.path
        if session_state(folder) is SessionState.FINISHED:
            session = Session.load(folder)
            if (session.header.town, session.header.seed) != (plan.town, plan.seed):
                raise SessionError(f"{folder}: is another session than this corpus has here; remove it")
            return plan.number, manifest_row(session, folder, self.root), False
        if folder.is_dir() and any(folder.iterdir()):
            raise SessionError(f"{folder}: is in the way, and no finished session; remove it")
        part = self.root / PARTS / folder.name
        env = self._env(plan.town)
        play_session(
            env, {role: make_policy("scripted", role, env.limits) for role in AGENT_ROLES}, seed=plan.seed, folder=part
        )
        row = manifest_row(Session.load(part), folder, self.root)
        folder.parent.mkdir(parents=True, exist_ok=True)
        part.rename(folder)
        return plan.number, row, True

    def _env(self, town: str) -> DuoWizardEnv:
        if town not in self._envs:
            self._envs[town] = DuoWizardEnv(town, config=self.config)
        return self._envs[town]


def finished_sessions(root: Path | str, *, sessions: int, seed: int) -> int:
    """Returns how many sessions of a corpus are finished."""
    return sum(session_state(Path(root) / plan.path) is SessionState.FINISHED for plan in plan_corpus(sessions, seed))


def _claim(root: Path, wanted: Mapping[str, Any]) -> None:
    """Notes what the corpus is made from; raises `SessionError` where the folder holds one made from something else."""
    path = root / GENERATION_FILE
    page = json.dumps({"package_version": __version__, "format_version": FORMAT_VERSION, **wanted}, indent=1) + "\n"
    if not path.exists():
        others = [entry.name for entry in root.iterdir() if entry.name != path.name + ".part"]
        if others:
            raise SessionError(f"{root}: holds something else ({others[0]}); choose a new or an empty folder")
        temporary = path.with_name(path.name + ".part")
        temporary.write_text(page, encoding="utf-8")
        os.replace(temporary, path)
        return
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise SessionError(f"{path}: cannot be read ({error}); choose another folder") from None
    for name, value in json.loads(page).items():
        if not isinstance(found, dict) or found.get(name) != value:
            there = found.get(name) if isinstance(found, dict) else found
            raise SessionError(
                f"{path}: the corpus in this folder has {name} {there!r}, not {value!r}; "
                "choose another folder, or go on with the same settings"
            )


@contextlib.contextmanager
def _alone_in(root: Path) -> Iterator[None]:
    """Holds a folder, made if need be, as long as the block lasts; raises `SessionError` where another process does."""
    root.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(root, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise SessionError(f"{root}: another process makes this corpus now; wait for it, or stop it") from None
    try:
        yield
    finally:
        os.close(descriptor)
