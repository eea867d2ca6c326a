"""Reference drives: how long the reference pair takes for a scenario, and how many exchanges it needs.

The reference pair is the scripted participant and the scripted Co-Wizard, whose words and acts arrive exactly, without
an Ad-Wizard, in the usual traffic. The reference belongs to the scenario (town, storyboard, seed) and is the same for
all tiers. References of the published scenarios are stored with the package, so that a new version of the scripts does
not move the scale; those of other scenarios are measured when they are played.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypedDict

from dorothie_gym._version import __version__
from dorothie_gym.evaluation.analysis.units import Units
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.evaluation.rollout.processes import run_tasks
from dorothie_gym.maps.catalogue import town_at
from dorothie_gym.maps.generated.specification import parse_series
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.recording.files import to_page
from dorothie_gym.session.recording.session import Session
from dorothie_gym.session.scenario import ReferenceDrive, ReferencePage, Scenario, draw_scenario
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.session.time_allowed import reference_seconds
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_MODEL_JSON, checked, read_json

if TYPE_CHECKING:
    from dorothie_gym.maps.town import Town

REFERENCE_CONFIG: Final = EnvConfig(observe_acts=True, word_error_rate=0.0, max_seconds=3600.0)
"""Settings of reference drives."""

REFERENCE_CAST: Final[Mapping[Role, str]] = {
    Role.PARTICIPANT: "scripted",
    Role.CO_WIZARD: "scripted",
    Role.AD_WIZARD: "silent",
}
"""Policies of reference drives."""

STORED_FILE: Final = Path(str(files("dorothie_gym.evaluation.rollout"))) / "data" / "reference_drives.json"
"""References that are stored with the package."""


class _FilePage(TypedDict):
    version: str
    drives: dict[str, ReferencePage]


def drive_key(scenario: Scenario, town: str) -> str:
    """Returns the key of a scenario among stored references: town, storyboard and seed."""
    return f"{town}/{scenario.storyboard.name}/{scenario.seed}"


def reference_of(
    town: Town, scenario: Scenario, known: Mapping[str, ReferenceDrive] = MappingProxyType({})
) -> ReferenceDrive:
    """Returns the reference of a scenario: a known or stored one, else that of a drive that is played now.

    Where the reference pair does not reach the destination, its time is the expected one of the routes
    (`time_allowed.reference_seconds`), and it has no exchanges.

    Args:
        town: town of the scenario.
        scenario: the scenario.
        known: references that were measured before (`reference-times`), by `drive_key`.
    """
    key = drive_key(scenario, town.name)
    stored = known.get(key) or stored_drives().get(key)
    return measure_drive(town, scenario) if stored is None else stored


def scenario_with_reference(
    engine: SessionEngine, seed: int, known: Mapping[str, ReferenceDrive] = MappingProxyType({})
) -> Scenario:
    """Returns the scenario that an engine draws from a seed, with its reference (`reference_of`)."""
    town = engine.town_of(seed)
    config = engine.config
    drawn = draw_scenario(town, engine.template, seed, config.stops, config.talk, config.storyboards)
    return replace(drawn, reference=reference_of(town, drawn, known))


def measure_drive(town: Town, scenario: Scenario) -> ReferenceDrive:
    """Plays the reference drive of a scenario; see `reference_of`."""
    engine = SessionEngine(town, config=REFERENCE_CONFIG)
    policies = {role: make_policy(REFERENCE_CAST[role], role, engine.limits) for role in AGENT_ROLES}
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as root:
        folder = Path(root) / "drive"
        summary = play_session(
            engine, policies, seed=scenario.seed, folder=folder, scenario=replace(scenario, reference=None)
        )
        session = Session.load(folder)
    live = engine.session.task.live
    if not summary["success"]:
        expected = float(round(reference_seconds(town, scenario)))
        return ReferenceDrive(seconds=expected, exchanges=0, subgoals=len(live))
    return ReferenceDrive(
        seconds=round(session.duration, 3), exchanges=len(Units(session).exchanges), subgoals=len(live)
    )


def measure_drives(
    scenarios: Iterable[tuple[str, int]],
    config: EnvConfig,
    known: Mapping[str, ReferenceDrive],
    *,
    workers: int = 1,
) -> Iterator[tuple[str, ReferenceDrive]]:
    """Yields key and reference of scenarios, in any order.

    Args:
        scenarios: town and seed of each scenario.
        config: settings of the sessions, of which those of their storyboards count.
        known: references that need not be measured again, by `drive_key`.
        workers: number of processes; more than one needs an importable main module of the caller.

    Raises:
        ProcessError: a process died.
    """
    yield from run_tasks(partial(_DriveTask, config, dict(known)), scenarios, workers=workers)


class _DriveTask:
    """Measures references in one process."""

    def __init__(self, config: EnvConfig, known: Mapping[str, ReferenceDrive]) -> None:
        self._config, self._known = config, known

    def __call__(self, task: tuple[str, int]) -> tuple[str, ReferenceDrive]:
        name, seed = task
        town = town_at(parse_series(name) or name, seed)
        scenario = draw_scenario(town, None, seed, self._config.stops, storyboards=self._config.storyboards)
        key = drive_key(scenario, town.name)
        return key, self._known[key] if key in self._known else measure_drive(town, scenario)


@functools.cache
def stored_drives() -> Mapping[str, ReferenceDrive]:
    """Returns the stored references by `drive_key`."""
    return read_drives(STORED_FILE) if STORED_FILE.is_file() else {}


def read_drives(file: Path) -> dict[str, ReferenceDrive]:
    """Reads a file of references.

    Raises:
        InputFileError: the file is damaged.
        OSError: it cannot be read.
    """
    page = checked(read_json(file, MAX_MODEL_JSON), _FilePage, file)
    return {key: ReferenceDrive.from_json(drive) for key, drive in page["drives"].items()}


def write_drives(file: Path, drives: Mapping[str, ReferenceDrive]) -> None:
    """Writes references, sorted by key, so that equal ones give equal bytes."""
    rows = {key: drives[key].to_json() for key in sorted(drives)}
    write_atomically(file, to_page({"version": __version__, "drives": rows}))
