"""Submissions to the leaderboard: a rollout that is checked against its protocol and played again, with hashes.

The checks need the recorded sessions and this package, not the policy. Everything that follows from the protocol is
computed again: sessions are drawn and played from their seeds by the partners of the protocol, with the recorded
actions of the Co-Wizard, or with its own policy if the package has it. Data that cannot be computed are claims
(`claims`).
"""

from __future__ import annotations

import hashlib
import secrets
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from dorothie_gym._version import __version__
from dorothie_gym.errors import RolloutError, short_repr
from dorothie_gym.evaluation.closed_loop.claims import Claim, can_play, claims_of, faults_of_claims, shipped_player
from dorothie_gym.evaluation.closed_loop.protocol import PROTOCOL, LeaderboardProtocol, part_of
from dorothie_gym.evaluation.closed_loop.results import RESULT_FILE, RolloutResult, read_result
from dorothie_gym.evaluation.closed_loop.running import (
    SESSIONS_FOLDER,
    SETTINGS_FILE,
    RolloutPlan,
    RolloutSettings,
)
from dorothie_gym.evaluation.closed_loop.session_check import SessionChecker, SessionFindings, SessionTask
from dorothie_gym.evaluation.rollout.folder import PARTS_FOLDER
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.evaluation.rollout.runner import COST_FILE
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.recording.files import same_json, to_line
from dorothie_gym.session.recording.header import FORMAT_VERSION
from dorothie_gym.support.input_files import MAX_RESULT_JSON, MAX_SMALL_JSON, checked, raising, read_json
from dorothie_gym.support.installation import pip_install

if TYPE_CHECKING:
    from dorothie_gym.policies.policy_loader import Player
    from dorothie_gym.session.scenario import ReferenceDrive
    from dorothie_gym.support.files import JsonValue

FORMAT: Final = "dorothie_gym-submission"
VERSION: Final = "1.1"

SUBMISSION_FILE: Final = "submission.json"
"""Usual name of a submission; such a file in the folder of the rollout is not read."""

MOST_FAULTS: Final = 20
"""Number of faults after which a check ends."""

_FILES: Final = frozenset({SETTINGS_FILE, RESULT_FILE, COST_FILE, SESSIONS_FOLDER, SUBMISSION_FILE})
"""Files of a rollout."""


@dataclass(frozen=True, kw_only=True)
class SubmissionCheck:
    """Outcome of the check of a rollout.

    Attributes:
        faults: faults, one line each; empty for a rollout that can be submitted.
        submission: content of the submission's file; None if there are faults.
        resimulated: numbers of the sessions that were played again and found equal.
        sessions: number of sessions of the protocol.
        seed: seed of the sample; None if all sessions were selected.
        played: whether the Co-Wizard's policy was also played again.
        claims: statements of the rollout that cannot be checked.
    """

    faults: tuple[str, ...]
    submission: Mapping[str, object] | None
    resimulated: tuple[int, ...]
    sessions: int
    seed: int | None = None
    played: bool = False
    claims: tuple[Claim, ...] = ()


def check_submission(
    folder: Path | str,
    *,
    sample: int | None = None,
    seed: int | None = None,
    protocol: LeaderboardProtocol = PROTOCOL,
    workers: int = 1,
    on_session: Callable[[int, int], None] | None = None,
    drives: Mapping[str, ReferenceDrive] | None = None,
) -> SubmissionCheck:
    """Checks the folder of a rollout, and makes its submission.

    Args:
        folder: folder of the rollout, with its sessions.
        sample: number of sessions to simulate again; None for all. The others are drawn, read and measured.
        seed: seed of the sample, which also depends on the content of all sessions; None draws one, so that the sample
            cannot be known beforehand.
        protocol: the protocol.
        workers: number of processes; more than one needs an importable main module of the caller.
        on_session: called with the numbers of checks done and planned: one for each session, and one more for each
            of a sample.
        drives: references that the receiver has measured, by `reference_drives.drive_key`; others are measured now.

    Raises:
        RolloutError: there is no rollout, its files are damaged, or `sample` is below 1.
        ProcessError: a process died.
    """
    if sample is not None and sample < 1:
        raise RolloutError(f"sample is {sample}; simulate at least one session again")
    root = Path(folder)
    result = read_result(root)
    settings = result.settings
    faults = [*protocol.faults_of_conditions(settings)]
    if not faults:
        faults += [*protocol.faults(settings), *faults_of_claims(settings), *_differences_of_settings(root, result)]
        faults += _surplus_files(root)
    if faults:
        return SubmissionCheck(faults=tuple(faults), submission=None, resimulated=(), sessions=protocol.sessions)
    wanted = protocol.settings(settings)
    plans, cast = wanted.plans(), _cast(settings, wanted)
    prepare = partial(SessionChecker, root, wanted, cast, drives or {})
    check = _SessionsCheck(prepare, result, plans, workers, on_session)
    faults += _missing_and_surplus(root, result, plans)
    drawn_by = None
    if sample is None or sample >= len(plans):
        faults += check.run(plans, simulated=True)
    else:
        drawn_by = secrets.randbits(32) if seed is None else seed
        check.planned += sample
        faults += check.run(plans, simulated=False)
        if not faults:
            faults += check.run([plans[number] for number in _draw(check.digests, sample, drawn_by)], simulated=True)
    result = RolloutResult(settings=settings, rows=tuple(sorted(result.rows, key=lambda row: row.number)))
    if not faults:
        faults += _differences_of_result(root, result)
    played = Role.CO_WIZARD in cast
    claims = claims_of(
        settings,
        checked=True,
        played=played,
        persona=check.has_persona,
        usage=bool(result.usage()),
        run_time=(root / COST_FILE).exists(),
    )
    drawn = tuple(sorted(check.simulated))
    found = SubmissionCheck(
        faults=tuple(faults),
        submission=None,
        resimulated=drawn,
        sessions=len(plans),
        seed=drawn_by,
        played=played,
        claims=claims,
    )
    return found if faults else replace(found, submission=_page(result, check.digests, found))


def differences_from(file: Path | str, submission: Mapping[str, object]) -> tuple[str, ...]:
    """Compares the file of a submission with the submission of a folder, as `check_submission` makes it.

    The results of the check are ignored: another seed draws another sample, and a receiver may lack the libraries of a
    model.

    Raises:
        RolloutError: the file is not a submission.
    """
    with raising(RolloutError):
        page = read_json(Path(file), MAX_RESULT_JSON)
    if not isinstance(page, Mapping) or page.get("format") != FORMAT:
        raise RolloutError(f"{file}: is no submission; write one with `dorothie-gym submit DIR`")
    found = []
    if page.get("sha256") != _hash_of(page):
        found.append(f"{file}: its content does not have its hash")
    for name in sorted({*page, *submission} - {"sha256", "check"}):
        if not same_json(page.get(name), submission.get(name)):
            found.append(f"{file}: field {name!r} is not that of the folder")
    return tuple(found)


# --- Checks -----------------------------------------------------------------------------------------------------------


class _SessionsCheck:
    """Check of the sessions of a rollout, in several processes.

    Args:
        prepare: returns the checker of a process.
        result: result of the rollout.
        plans: sessions of the protocol.
        workers: number of processes.
        on_session: called with the numbers of checks done and planned.

    Attributes:
        planned: number of checks that are planned.
        digests: digest of each session that was read, by number.
        simulated: numbers of the sessions that were played again and found equal.
        has_persona: whether a header has a persona that was not drawn again.
    """

    def __init__(
        self,
        prepare: Callable[[], SessionChecker],
        result: RolloutResult,
        plans: Sequence[RolloutPlan],
        workers: int,
        on_session: Callable[[int, int], None] | None,
    ) -> None:
        self._prepare, self._workers = prepare, workers
        self._rows = {row.number: row for row in result.rows}
        self._report = on_session or _no_report
        self._done, self.planned = 0, len(plans)
        self.digests: dict[int, str] = {}
        self.simulated: set[int] = set()
        self.has_persona = False

    def run(self, plans: Sequence[RolloutPlan], *, simulated: bool) -> list[str]:
        """Returns the faults of sessions in their order; ends early if there are `MOST_FAULTS`."""
        tasks = [SessionTask(plan=plan, row=self._rows.get(plan.number), simulated=simulated) for plan in plans]
        self._report(self._done, self.planned)
        faults: dict[int, tuple[str, ...]] = {}
        with closing(_findings(self._prepare, tasks, self._workers)) as findings:
            for found in findings:
                self._take(found)
                faults[found.number] = found.faults
                if sum(map(len, faults.values())) >= MOST_FAULTS:
                    break
        return [fault for number in sorted(faults) for fault in faults[number]]

    def _take(self, found: SessionFindings) -> None:
        self._done += 1
        self._report(self._done, self.planned)
        if found.digest is not None:
            self.digests[found.number] = found.digest
        if found.simulated:
            self.simulated.add(found.number)
        self.has_persona |= found.has_persona


def _findings(
    prepare: Callable[[], SessionChecker], tasks: Sequence[SessionTask], workers: int
) -> Generator[SessionFindings, None, None]:
    yield from run_tasks(prepare, tasks, workers=max(1, min(workers, len(tasks))))


def _cast(settings: Mapping[str, Any], wanted: RolloutSettings) -> dict[Role, Player]:
    """Returns the players that are played again: the partners, and the Co-Wizard if the package can play it.

    Raises:
        RolloutError: a library is missing that a partner needs.
    """
    partners = wanted.players
    del partners[Role.CO_WIZARD]
    for role, player in (*partners.items(), *((Role.PARTICIPANT, each) for each in wanted.pool)):
        if not can_play(player, role):
            raise RolloutError(f"{role}: {player.name} cannot be played again; run: {pip_install('baselines')}")
    own = shipped_player(str(settings[str(Role.CO_WIZARD)]))
    return partners if own is None or not can_play(own) else {**partners, Role.CO_WIZARD: own}


def _missing_and_surplus(root: Path, result: RolloutResult, plans: Sequence[RolloutPlan]) -> list[str]:
    """Returns faults of the list of sessions: repeated and surplus ones."""
    given = [row.number for row in result.rows]
    numbers = {plan.number for plan in plans}
    faults = ["two rows have the same number"] if len(set(given)) < len(given) else []
    faults += [f"row {number} is none of the planned sessions" for number in sorted({*given} - numbers)]
    planned = {Path(plan.path).name for plan in plans}
    below = root / SESSIONS_FOLDER
    names = sorted(path.name for path in below.iterdir()) if below.is_dir() else []
    return faults + [
        f"{SESSIONS_FOLDER}/{name}: is none of the planned sessions" for name in names if name not in planned
    ]


def _surplus_files(root: Path) -> Iterator[str]:
    """Yields files that are not part of a rollout; an empty folder left by a killed run is allowed."""
    for path in sorted(root.iterdir()):
        if path.name not in _FILES and not (path.name == PARTS_FOLDER and path.is_dir() and not any(path.iterdir())):
            yield f"{path}: is no part of a rollout, and nothing checks it; remove it"


def _differences_of_settings(root: Path, result: RolloutResult) -> Iterator[str]:
    """Yields differences between the settings in the result and those under which the folder was played."""
    with raising(RolloutError):
        try:
            page = checked(read_json(root / SETTINGS_FILE, MAX_SMALL_JSON), dict[str, Any], root / SETTINGS_FILE)
        except FileNotFoundError:
            raise RolloutError(f"{root / SETTINGS_FILE}: is missing; submit the whole folder of the rollout") from None
    versions = {"package_version": __version__, "format_version": FORMAT_VERSION}
    for name, value in result.settings.items():
        if not same_json(page.get(name), value):
            yield f"{RESULT_FILE}: {name} is not that of {SETTINGS_FILE}"
    for name, wanted in versions.items():
        if page.get(name) != wanted:
            yield f"{SETTINGS_FILE}: was played by {name} {short_repr(page.get(name))}; this is {wanted}"
    for name in sorted(page.keys() - result.settings.keys() - versions.keys()):
        yield f"{SETTINGS_FILE}: {name} is unknown, and nothing checks it"


def _differences_of_result(root: Path, result: RolloutResult) -> Iterator[str]:
    """Yields differences between the result file and the figures computed from its rows, in session order."""
    with raising(RolloutError):
        page = checked(read_json(root / RESULT_FILE, MAX_RESULT_JSON), dict[str, Any], root / RESULT_FILE)
    wanted = result.to_json()
    if not same_json(page.get("rows"), wanted["rows"]):
        yield f"{RESULT_FILE}: its rows have another order, or fields that nothing checks"
    if not same_json(_tables(page), _tables(wanted)):
        yield f"{RESULT_FILE}: its tables are not those of its rows"


def _tables(page: Mapping[str, Any]) -> dict[str, JsonValue]:
    return {name: value for name, value in page.items() if name != "rows"}


def _draw(digests: Mapping[int, str], sample: int, seed: int) -> list[int]:
    """Returns the numbers of the sessions to be played again."""
    numbers = sorted(digests)
    content = hashlib.sha256("".join(digests[number] for number in numbers).encode()).digest()
    rng = np.random.default_rng([seed, *content])
    return sorted(rng.choice(numbers, size=sample, replace=False).tolist())


# --- Page -------------------------------------------------------------------------------------------------------------


def _page(result: RolloutResult, digests: Mapping[int, str], found: SubmissionCheck) -> dict[str, object]:
    table = result.to_json()
    page: dict[str, object] = {
        "format": FORMAT,
        "version": VERSION,
        "package_version": __version__,
        "settings": dict(result.settings),
        "part": part_of(result.settings),
        "results": {name: value for name, value in table.items() if name not in ("version", "settings", "rows")},
        "sessions": [{**row.to_json(), "sha256": digests.get(row.number)} for row in result.rows],
        "check": {
            "resimulated": list(found.resimulated),
            "share": len(found.resimulated) / found.sessions,
            "seed": found.seed,
            "co_wizard_played": found.played,
            "claims": list(found.claims),
        },
    }
    return {**page, "sha256": _hash_of(page)}


def _hash_of(page: Mapping[str, object]) -> str:
    """Returns the hash of a submission without its own hash."""
    return hashlib.sha256(to_line({name: page[name] for name in sorted(page) if name != "sha256"}).encode()).hexdigest()


def _no_report(checked: int, sessions: int) -> None:
    """Reports nothing."""
