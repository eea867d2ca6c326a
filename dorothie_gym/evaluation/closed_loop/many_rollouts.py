"""Several rollouts in one folder, played one after another: the rows of a leaderboard, the cells of a cross-play."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.evaluation.closed_loop.results import RESULT_FILE, RolloutResult, read_result
from dorothie_gym.evaluation.closed_loop.running import RolloutSettings, roll_out
from dorothie_gym.session.recording.files import safe_name

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.policies.policy_loader import Player


def roll_out_all(
    plans: Mapping[str, RolloutSettings],
    root: Path | str,
    *,
    workers: int = 1,
    ray: str | None = None,
    on_session: Callable[[int, int], None] | None = None,
) -> dict[str, RolloutResult]:
    """Plays rollouts, each in its own folder; finished ones are read, and interrupted ones resumed.

    Args:
        plans: settings of each rollout by the name of its folder.
        root: folder of all, created if missing.
        workers: number of processes.
        ray: address of a Ray cluster that replaces the workers.
        on_session: called with the numbers of finished and of planned sessions of all rollouts.

    Returns:
        The results by the name of the folder.

    Raises:
        RolloutError: a result is damaged.
        SessionError: a folder contains other files, or a rollout of other settings.
        ProcessError: a process died, or there is no such cluster.
        OSError: a folder cannot be written.
    """
    total, done = sum(settings.sessions for settings in plans.values()), 0
    results: dict[str, RolloutResult] = {}
    for name, settings in plans.items():
        folder, before = Path(root) / name, done
        found = _finished(folder, settings)
        if found is None:

            def report(finished: int, _: int, before: int = before) -> None:
                if on_session is not None:
                    on_session(before + finished, total)

            found = roll_out(settings, folder, workers=workers, ray=ray, on_session=report)
        results[name] = found
        done += settings.sessions
        if on_session is not None:
            on_session(done, total)
    return results


def _finished(folder: Path, settings: RolloutSettings) -> RolloutResult | None:
    """Returns the result in a folder if it is that of a whole rollout with the given settings, without errors."""
    if not (folder / RESULT_FILE).is_file():
        return None
    result = read_result(folder)
    same = dict(result.settings) == json.loads(json.dumps(settings.to_json()))
    return result if same and result.complete and not result.errored else None


def folder_name(player: Player, role: Role) -> str:
    """Returns a name for the folder of a player's sessions; that of a learned one identifies its weights."""
    name = safe_name(player.name.replace("/", "-").replace(":", "-")).strip("-.") or str(role)
    return name if player.sha256 is None else f"{name}-{player.sha256[:8]}"
