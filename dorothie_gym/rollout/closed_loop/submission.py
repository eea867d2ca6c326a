"""Submissions to the leaderboard: a rollout that is checked against its protocol and simulated again, with hashes.

The checks need the recorded sessions and this package, not the policy. Every session is compared with the plan of the
protocol and measured again; a sample is simulated again from its seed and its recorded actions.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from dorothie_gym._version import __version__
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.errors import DorothieGymError, RolloutError, SessionError
from dorothie_gym.files import JsonValue
from dorothie_gym.input_files import MAX_RESULT_JSON, MAX_SMALL_JSON, checked, raising, read_json
from dorothie_gym.maps import load_town
from dorothie_gym.ontology import Role
from dorothie_gym.recording import Session, SessionState, first_difference, session_state
from dorothie_gym.recording.json_io import canonical, to_line
from dorothie_gym.rollout.closed_loop.results import RESULT_FILE, RolloutResult, RolloutRow, read_result
from dorothie_gym.rollout.closed_loop.running import (
    SESSIONS_FOLDER,
    SETTINGS_FILE,
    RolloutPlan,
    RolloutSettings,
    fold_of_towns,
    parse_towns,
)
from dorothie_gym.rollout.closed_loop.session_record import measure
from dorothie_gym.rollout.closed_loop.usage import read_usage
from dorothie_gym.rollout.replay import resimulate

FORMAT: Final = "dorothie_gym-submission"
VERSION: Final = "1.0"

MOST_FAULTS: Final = 20
"""Number of faults after which a check ends."""


@dataclass(frozen=True, kw_only=True)
class LeaderboardProtocol:
    """What the rows of a leaderboard have in common.

    Attributes:
        folds: folds whose towns a rollout may be played in; it covers one of them as a whole.
        sessions: least number of sessions.
        seed: seed of the rollout.
        config: settings of the engine.
    """

    folds: tuple[str, ...] = ("seen", "unseen")
    sessions: int = 100
    seed: int = 0
    config: EnvConfig = EnvConfig()

    def __post_init__(self) -> None:
        if self.sessions < 1:
            raise ValueError(f"sessions is {self.sessions}; it must be at least 1")

    def faults(self, settings: Mapping[str, Any]) -> Iterator[str]:
        """Yields what a rollout's settings (`RolloutSettings.to_json`) have that the protocol does not allow."""
        towns = [str(town) for town in settings["towns"]]
        whole = {fold: sorted(parse_towns(fold)) for fold in self.folds}
        if fold_of_towns(towns) not in self.folds or sorted(towns) not in whole.values():
            choices = " or ".join(", ".join(towns) for towns in whole.values())
            yield f"towns are {', '.join(towns)}; the protocol has {choices}"
        if settings["sessions_planned"] < self.sessions:
            yield f"{settings['sessions_planned']} sessions; the protocol has at least {self.sessions}"
        if settings["seed"] != self.seed:
            yield f"seed is {settings['seed']}; that of the protocol is {self.seed}"
        for role in (Role.PARTICIPANT, Role.AD_WIZARD):
            if settings[str(role)] != "scripted":
                yield f"{role} is {settings[str(role)]}; that of the protocol is scripted"
        given, wanted = settings["config"], self.config.record()
        for name in sorted({*given, *wanted}):
            if not _same(given.get(name), wanted.get(name)):
                yield f"config, {name} is {given.get(name)!r}; that of the protocol is {wanted.get(name)!r}"


PROTOCOL: Final = LeaderboardProtocol()
"""Protocol of the leaderboard."""


@dataclass(frozen=True, kw_only=True)
class SubmissionCheck:
    """Outcome of the check of a rollout.

    Attributes:
        faults: what is wrong, one line each; empty for a rollout that can be submitted.
        submission: content of the submission's file; None if there are faults.
        resimulated: numbers of the sessions that were simulated again.
    """

    faults: tuple[str, ...]
    submission: Mapping[str, object] | None
    resimulated: tuple[int, ...]


def check_submission(
    folder: Path | str,
    *,
    sample: int | None = 10,
    seed: int = 0,
    protocol: LeaderboardProtocol = PROTOCOL,
    on_session: Callable[[int, int], None] | None = None,
) -> SubmissionCheck:
    """Checks the folder of a rollout, and makes its submission.

    Args:
        folder: folder of the rollout, with its sessions.
        sample: number of sessions to simulate again; None for all of them.
        seed: seed of the sample, which also depends on the content of all sessions: a change draws another one.
        protocol: the protocol.
        on_session: called with the numbers of checked and of all sessions.

    Raises:
        RolloutError: there is no rollout, its files are damaged, or `sample` is below 1.
    """
    if sample is not None and sample < 1:
        raise RolloutError(f"sample is {sample}; simulate at least one session again")
    root = Path(folder)
    result = read_result(root)
    faults = [*protocol.faults(result.settings), *_differences_of_settings(root, result)]
    if faults:
        return SubmissionCheck(faults=tuple(faults), submission=None, resimulated=())
    check = _SessionCheck(root, result)
    plans, report = check.plans, on_session or _no_report
    faults += check.missing_and_surplus()
    report(0, len(plans))
    for number, plan in enumerate(plans, start=1):
        if len(faults) >= MOST_FAULTS:
            break
        faults += check.session(plan)
        report(number, len(plans))
    if not faults and not _same(_tables(result), _tables_of_file(root)):
        faults.append(f"{RESULT_FILE}: its tables are not those of its rows")
    drawn: tuple[int, ...] = ()
    if not faults:
        drawn = _draw(check.digests, sample, seed)
        for number in drawn:
            faults += check.again(plans[number])
    submission = None if faults else _page(result, check.digests, drawn, seed)
    return SubmissionCheck(faults=tuple(faults), submission=submission, resimulated=drawn)


def differences_from(file: Path | str, submission: Mapping[str, object]) -> tuple[str, ...]:
    """Compares the file of a submission with the submission of a folder, as `check_submission` makes it.

    The sample does not count: another seed draws another one.

    Raises:
        RolloutError: the file is no submission.
    """
    with raising(RolloutError):
        page = read_json(Path(file), MAX_RESULT_JSON)
    if not isinstance(page, Mapping) or page.get("format") != FORMAT:
        raise RolloutError(f"{file}: is no submission; write one with `dorothie-gym submit DIR`")
    found = []
    if page.get("sha256") != _hash_of(page):
        found.append(f"{file}: its content does not have its hash")
    for name in sorted({*page, *submission} - {"sha256", "check"}):
        if not _same(page.get(name), submission.get(name)):
            found.append(f"{file}: field {name!r} is not that of the folder")
    return tuple(found)


# --- Checks -----------------------------------------------------------------------------------------------------------


class _SessionCheck:
    """Checks of the sessions of a rollout.

    Attributes:
        plans: the planned sessions, in order.
        digests: digest of each session that was read, by number.
    """

    def __init__(self, root: Path, result: RolloutResult) -> None:
        self._root, self._settings = root, result.settings
        self._rows = {row.number: row for row in result.rows}
        self._repeated = len(self._rows) < len(result.rows)
        planned = RolloutSettings(
            towns=tuple(self._settings["towns"]),
            sessions=int(self._settings["sessions_planned"]),
            seed=int(self._settings["seed"]),
        )
        self.plans = planned.plans()
        self.digests: dict[int, str] = {}

    def missing_and_surplus(self) -> list[str]:
        """Returns faults of the list of sessions: missing, repeated and surplus ones."""
        faults = ["two rows have the same number"] if self._repeated else []
        numbers = {plan.number for plan in self.plans}
        faults += [f"row {number} is none of the planned sessions" for number in sorted(self._rows.keys() - numbers)]
        planned = {Path(plan.path).name for plan in self.plans}
        below = self._root / SESSIONS_FOLDER
        names = sorted(path.name for path in below.iterdir()) if below.is_dir() else []
        return faults + [
            f"{SESSIONS_FOLDER}/{name}: is none of the planned sessions" for name in names if name not in planned
        ]

    def session(self, plan: RolloutPlan) -> list[str]:
        """Returns the faults of a session: of its row, its folder, its header and its measures."""
        row = self._rows.get(plan.number)
        if row is None:
            return [f"{plan}: has no row"]
        if (row.town, row.seed) != (plan.town, plan.seed):
            return [f"{plan}: its row is of {row.town}, seed {row.seed}"]
        if row.record is None:
            there = session_state(self._root / plan.path) is SessionState.FINISHED
            return [f"{plan}: its row has an error, but the session is finished"] if there else []
        try:
            return self._compare(plan, row)
        except DorothieGymError as error:
            return [f"{plan}: {error}"]

    def _compare(self, plan: RolloutPlan, row: RolloutRow) -> list[str]:
        session, town = self._load(plan), load_town(plan.town)
        header = session.header
        if (header.town, header.seed) != (town.name, plan.seed):
            return [f"{plan}: the session is of {header.town}, seed {header.seed}"]
        if not _same(dict(header.config), self._settings["config"]):
            return [f"{plan}: the session has other settings than the rollout"]
        digest = session.digest
        for number, other in self.digests.items():
            if other == digest:
                return [f"{plan}: is the session {number} once more"]
        self.digests[plan.number] = digest
        assert row.record is not None
        wanted, given = measure(session, town).to_json(), row.record.to_json()
        changed = [name for name, value in wanted.items() if not _same(value, given.get(name))]
        faults = [f"{plan}: {name} is {given.get(name)!r}; the session has {wanted.get(name)!r}" for name in changed]
        if read_usage(self._root / plan.path) != dict(row.usage):
            faults.append(f"{plan}: the usage of language models is not that recorded beside the session")
        return faults

    def again(self, plan: RolloutPlan) -> list[str]:
        """Returns the faults of a session that is simulated again from its seed and its actions."""
        try:
            session = self._load(plan)
            difference = first_difference(session, resimulate(session, load_town(plan.town)))
        except DorothieGymError as error:
            return [f"{plan}: cannot be simulated again: {error}"]
        return [] if difference is None else [f"{plan}: simulated again, it differs at {difference}"]

    def _load(self, plan: RolloutPlan) -> Session:
        folder = self._root / plan.path
        if session_state(folder) is not SessionState.FINISHED:
            raise SessionError(f"{folder}: holds no finished session")
        return Session.load(folder)


def _differences_of_settings(root: Path, result: RolloutResult) -> Iterator[str]:
    """Yields where the settings in the result are not those under which the folder was played."""
    with raising(RolloutError):
        try:
            page = checked(read_json(root / SETTINGS_FILE, MAX_SMALL_JSON), dict[str, Any], root / SETTINGS_FILE)
        except FileNotFoundError:
            raise RolloutError(f"{root / SETTINGS_FILE}: is missing; submit the whole folder of the rollout") from None
    for name, value in result.settings.items():
        if not _same(page.get(name), value):
            yield f"{RESULT_FILE}: {name} is not that of {SETTINGS_FILE}"
    if page.get("package_version") != __version__:
        yield f"{SETTINGS_FILE}: was played by version {page.get('package_version')}; this is {__version__}"


def _tables(result: RolloutResult) -> dict[str, Any]:
    return {name: value for name, value in result.to_json().items() if name != "rows"}


def _tables_of_file(root: Path) -> dict[str, JsonValue]:
    page = read_json(root / RESULT_FILE, MAX_RESULT_JSON)
    assert isinstance(page, Mapping)
    return {str(name): value for name, value in page.items() if name != "rows"}


def _draw(digests: Mapping[int, str], sample: int | None, seed: int) -> tuple[int, ...]:
    """Returns the numbers of the sessions to be simulated again."""
    numbers = sorted(digests)
    if sample is None or sample >= len(numbers):
        return tuple(numbers)
    content = hashlib.sha256("".join(digests[number] for number in numbers).encode()).digest()
    rng = np.random.default_rng([seed, *content])
    return tuple(sorted(rng.choice(numbers, size=sample, replace=False).tolist()))


def _page(
    result: RolloutResult, digests: Mapping[int, str], drawn: Sequence[int], seed: int
) -> dict[str, object]:  # fmt: skip
    table = result.to_json()
    page: dict[str, object] = {
        "format": FORMAT,
        "version": VERSION,
        "package_version": __version__,
        "settings": dict(result.settings),
        "part": fold_of_towns(result.settings["towns"]),
        "results": {name: value for name, value in table.items() if name not in ("version", "settings", "rows")},
        "sessions": [
            {**row.to_json(), "sha256": digests.get(row.number)}
            for row in sorted(result.rows, key=lambda row: row.number)
        ],
        "check": {"resimulated": list(drawn), "seed": seed},
    }
    return {**page, "sha256": _hash_of(page)}


def _hash_of(page: Mapping[str, object]) -> str:
    """Returns the hash of a submission without its own hash."""
    return hashlib.sha256(to_line({name: page[name] for name in sorted(page) if name != "sha256"}).encode()).hexdigest()


def _same(first: object, second: object) -> bool:
    """Returns whether two values are the same in JSON; 15 and 15.0 are."""
    return to_line(canonical(first, "value")) == to_line(canonical(second, "value"))


def _no_report(checked: int, sessions: int) -> None:
    """Reports nothing."""
