"""Rollouts: sessions of given players in given towns, measured where they are played."""

from __future__ import annotations

import json
import logging
import shlex
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.errors import SessionError
from dorothie_gym.files import write_atomically
from dorothie_gym.maps import SEEN_TOWNS, UNSEEN_TOWNS, load_town
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import ALL_SCRIPTED, Player
from dorothie_gym.recording import safe_name
from dorothie_gym.recording.json_io import to_page
from dorothie_gym.rollout.closed_loop.results import RESULT_FILE, RolloutResult, Row
from dorothie_gym.rollout.closed_loop.session_record import measure
from dorothie_gym.rollout.folder import making_in
from dorothie_gym.rollout.on_ray import share_out_on_ray
from dorothie_gym.rollout.play import SessionMaker
from dorothie_gym.rollout.processes import share_out

SESSIONS_FOLDER: Final = "sessions"
"""Within the folder of a rollout: the sessions, for replay."""

_ROLLOUTS: Final = 7
"""Branch of the seed; corpora draw from another, so that nobody is tested on a session that it was trained on."""

_GROUPS: Final[Mapping[str, tuple[str, ...]]] = {
    "seen": SEEN_TOWNS, "unseen": UNSEEN_TOWNS, "all": (*SEEN_TOWNS, *UNSEEN_TOWNS),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class RolloutPlan:
    """A session of a rollout.

    Attributes:
        number: in the rollout, from 0.
        town: name or file of its town.
        seed: everything in it follows from this, and from who plays.
    """

    number: int
    town: str
    seed: int

    @property
    def path(self) -> str:
        """Its folder within that of the rollout."""
        return f"{SESSIONS_FOLDER}/{self.number:04d}-{safe_name(Path(self.town).stem)}"


@dataclass(frozen=True, kw_only=True)
class RolloutSettings:
    """Everything that a rollout's table follows from.

    Attributes:
        cast: who plays the three roles.
        towns: names or files of towns, which take turns.
        sessions: how many in all.
        seed: the seed of a session follows from it and from the session's number only, whoever plays.
        config: of the environment.
    """

    cast: Mapping[Role, Player] = field(default_factory=lambda: ALL_SCRIPTED)
    towns: tuple[str, ...] = UNSEEN_TOWNS
    sessions: int = 20
    seed: int = 0
    config: EnvConfig = field(default_factory=EnvConfig)

    def __post_init__(self) -> None:
        """Checks the fields."""
        if self.sessions < 1:
            raise ValueError(f"sessions is {self.sessions}; it must be at least 1")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; it must be at least 0")
        if not self.towns:
            raise ValueError("towns is empty; give at least one")
        missing = [str(role) for role in AGENT_ROLES if role not in self.cast]
        if missing:
            raise ValueError(f"cast has nobody for {', '.join(missing)}; each of the three roles needs a player")

    def plans(self) -> tuple[RolloutPlan, ...]:
        """Returns the sessions, in order."""
        return tuple(
            RolloutPlan(number=number, town=self.towns[number % len(self.towns)], seed=_seed(self.seed, number))
            for number in range(self.sessions)
        )

    def to_json(self) -> dict[str, Any]:
        """Returns what the table follows from, in JSON types; of learned players their SHA-256 and their cost, too."""
        return {
            **{str(role): self.cast[role].name for role in AGENT_ROLES},
            "sha256": {str(role): self.cast[role].sha256 for role in AGENT_ROLES if self.cast[role].sha256},
            "training": {str(role): dict(self.cast[role].training) for role in AGENT_ROLES if self.cast[role].training},
            "towns": list(self.towns),
            "sessions_planned": self.sessions,
            "seed": self.seed,
            "config": asdict(self.config),
        }


def command_of(settings: Mapping[str, Any]) -> str:
    """Returns the command that plays a rollout again, from what `RolloutSettings.to_json` returned.

    Settings of the environment that no option has are left out.
    """
    usual, config = EnvConfig(), settings["config"]
    words = ["dorothie-gym", "rollout"]
    for role in (Role.CO_WIZARD, Role.PARTICIPANT, Role.AD_WIZARD):
        words += [f"--{str(role).replace('_', '-')}", str(settings[str(role)])]
    words += ["--towns", ",".join(settings["towns"])]
    words += ["--sessions", str(settings["sessions_planned"]), "--seed", str(settings["seed"])]
    for option, name in (("--max-seconds", "max_seconds"), ("--word-errors", "word_error_rate")):
        if config[name] != getattr(usual, name):
            words += [option, f"{config[name]:g}"]
    return shlex.join(words)


def parse_towns(text: str) -> tuple[str, ...]:
    """Returns the towns that are meant by "seen", "unseen", "all", or names or files with commas between them.

    Raises:
        TownError: there is no such town.
        ValueError: none is named.
    """
    found: list[str] = []
    for name in filter(None, (part.strip() for part in text.split(","))):
        if name not in _GROUPS:
            load_town(name)
        found += [town for town in _GROUPS.get(name, (name,)) if town not in found]
    if not found:
        raise ValueError(f"towns is {text!r}; give seen, unseen, all, or names with commas between them")
    return tuple(found)


def fold_of_towns(towns: Sequence[str]) -> str | None:
    """Returns "seen" or "unseen" where all towns are of the one fold; None where they are of both, or of none."""
    return next((fold for fold in ("seen", "unseen") if towns and set(towns) <= set(_GROUPS[fold])), None)


def _seed(seed: int, number: int) -> int:
    return int(np.random.SeedSequence([seed, number, _ROLLOUTS]).generate_state(1)[0] >> 1)


# --- Rollouts: sessions of given players in given towns, measured where they are played ------------------------------

SETTINGS_FILE: Final = "settings.json"
"""What a rollout is made from: a folder with another one of these is not gone on with."""

COST_FILE: Final = "cost.json"
"""What it took on this machine; apart from the result, which does not depend on it."""

_LOG = logging.getLogger(__name__)


def roll_out(
    settings: RolloutSettings,
    folder: Path | str,
    *,
    workers: int = 1,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> RolloutResult:
    """Plays the sessions of a rollout, measures them, and writes the result into the folder.

    The result depends on neither who plays nor how often the making was interrupted and begun again: a session that is
    there is measured and not played again. Where the play is interrupted, the result of the sessions that are there
    is written. A session whose policy fails is a row with an error; it is played anew by the next run.

    Args:
        settings: what is played.
        folder: where sessions and result are kept, made if need be.
        workers: processes that play; with more than one the caller's main module must be importable.
        ray: address of a Ray cluster that plays, instead of `workers`; see `dorothie_gym.rollout.on_ray`.
        on_session: called with the number of sessions that are there, and of those to be, at first and after each.

    Raises:
        ValueError: there are no workers.
        SessionError: the folder holds something else, or another process is at work in it.
        ProcessError: a process died, or there is no such cluster.
        OSError: the folder cannot be written.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; it must be at least 1")
    root, plans, rows = Path(folder), settings.plans(), list[Row]()
    begun, processor = time.perf_counter(), 0.0
    wanted = settings.to_json()
    if on_session is not None:
        on_session(0, len(plans))
    with making_in(root, SETTINGS_FILE, wanted):
        try:
            prepare = partial(_Player, settings=settings)
            for row, seconds in (
                share_out(partial(prepare, root), plans, workers=workers)
                if ray is None
                else share_out_on_ray(prepare, plans, root, address=ray)
            ):
                rows.append(row)
                processor += seconds
                if on_session is not None:
                    on_session(len(rows), len(plans))
        finally:
            result = write_result(root, settings, rows)
            _add_cost(root / COST_FILE, time.perf_counter() - begun, processor, workers)
    return result


def write_result(root: Path, settings: RolloutSettings, rows: Iterable[Row]) -> RolloutResult:
    """Writes `rollout.json` from the rows of the sessions that were played; returns what it says."""
    result = RolloutResult(settings=settings.to_json(), rows=tuple(sorted(rows, key=lambda row: row.number)))
    write_atomically(root / RESULT_FILE, to_page(result.to_json()))
    return result


def _add_cost(file: Path, wall: float, processor: float, workers: int) -> None:
    """Adds what was spent to what the runs before have spent; a file that cannot be read counts as none."""
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
        wall, processor = wall + before["wall_seconds"], processor + before["cpu_seconds"]
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        _LOG.debug("%s: is begun anew", file)
    cost = {"wall_seconds": round(wall, 3), "cpu_seconds": round(processor, 3), "workers": workers}
    write_atomically(file, to_page(cost))


@dataclass
class _Player:
    """Plays and measures sessions in one process."""

    root: Path
    settings: RolloutSettings

    def __post_init__(self) -> None:
        """Prepares the making of sessions."""
        self._maker = SessionMaker(self.root, self.settings.config, self.settings.cast)

    def __call__(self, plan: RolloutPlan) -> tuple[Row, float]:
        """Returns the row of a session, and what it took of the processor [s]."""
        begun = time.process_time()
        row = Row(number=plan.number, town=plan.town, seed=plan.seed)
        try:
            session, _, _ = self._maker(plan)
        except (SessionError, OSError):
            raise  # of the folder, not of the session
        except Exception as error:  # whatever a policy does wrong: it is counted, and told in the row
            return _with_error(row, error), time.process_time() - begun
        record = measure(session, self._maker.engine(plan.town).town)
        return Row(number=row.number, town=row.town, seed=row.seed, record=record), time.process_time() - begun


def _with_error(row: Row, error: Exception) -> Row:
    return Row(number=row.number, town=row.town, seed=row.seed, error=f"{type(error).__name__}: {error}")
