"""Rollouts: sessions of given players in given towns, measured where they are played."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from dorothie_gym.evaluation.closed_loop.plan import RolloutPlan, RolloutSettings
from dorothie_gym.evaluation.closed_loop.record import measure
from dorothie_gym.evaluation.closed_loop.results import RESULT_FILE, RolloutResult, Row
from dorothie_gym.rollout.folder import making_in, write_whole
from dorothie_gym.rollout.making import SessionMaker
from dorothie_gym.rollout.on_ray import share_out_on_ray
from dorothie_gym.rollout.processes import share_out
from dorothie_gym.sessions import SessionError
from dorothie_gym.sessions.encoding import to_page

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
    write_whole(root / RESULT_FILE, to_page(result.to_json()))
    return result


def _add_cost(file: Path, wall: float, processor: float, workers: int) -> None:
    """Adds what was spent to what the runs before have spent; a file that cannot be read counts as none."""
    try:
        before = json.loads(file.read_text(encoding="utf-8"))
        wall, processor = wall + before["wall_seconds"], processor + before["cpu_seconds"]
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        _LOG.debug("%s: is begun anew", file)
    cost = {"wall_seconds": round(wall, 3), "cpu_seconds": round(processor, 3), "workers": workers}
    write_whole(file, to_page(cost))


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
        record = measure(session, self._maker.env(plan.town).town)
        return Row(number=row.number, town=row.town, seed=row.seed, record=record), time.process_time() - begun


def _with_error(row: Row, error: Exception) -> Row:
    return Row(number=row.number, town=row.town, seed=row.seed, error=f"{type(error).__name__}: {error}")
