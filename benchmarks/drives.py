"""Driving tests: sentences said to the scripted Co-Wizard in a running car, judged by what the car does and replies."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from benchmarks.drive_judgement import PlanJudge, judge_reply
from benchmarks.drive_log import DriveLog, Moment
from benchmarks.drive_starts import Start, find_start
from benchmarks.timing import Figures, Progress
from dorothie_gym.dialogue import DrivingPlan
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import SettingsError
from dorothie_gym.ontology import DialogueAct, DialogueMove, Role
from dorothie_gym.policies import ScriptedCoWizard
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.spaces import CoWizardAction, ParticipantAction, Speech, noop

RECORDS: Final = Path(__file__).parent / "people" / "drives.jsonl"
"""Driving tests of the people-like test set."""

TOWNS: Final = ("brookside", "midtown")

WATCHED: Final = 90.0
"""Time for which the car is watched after the last utterance, standing for hazards not counted [s]."""

LONGEST: Final = 240.0
"""Longest drive [s]."""

FIRST_WORD: Final = 2.0
"""Time at which an utterance "at the start" begins [s]."""

NO_REPLY: Final = 9.0
"""Time after which an utterance that waits for a reply is made without one [s]."""


@dataclass(frozen=True, kw_only=True)
class DriveTest:
    """Driving test.

    Attributes:
        id: identifier.
        kind: kind of the test.
        needs: numbers of junctions and lights ahead, and whether landmarks and streets are needed.
        says: utterances with the time at which they are made.
        plan: expected steps, with placeholders for names.
        reply: expected kind of reply.
        about: topic of the expected reply; None for any.
    """

    id: str
    kind: str
    needs: Mapping[str, Any]
    says: tuple[tuple[str, str], ...]
    plan: tuple[Mapping[str, Any], ...]
    reply: str
    about: str | None


@dataclass(frozen=True, kw_only=True)
class DriveResult:
    """Judgement of a test: what is wrong with the drive and with the reply, None for nothing; and the talk."""

    test: DriveTest
    drive: str | None
    reply: str | None
    talk: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Returns whether the car did and said what was expected."""
        return self.drive is None and self.reply is None


def read_tests(path: Path, split: str) -> tuple[DriveTest, ...]:
    """Returns the tests of a split.

    Raises:
        SettingsError: the file cannot be read, or a line is malformed; names file and line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise SettingsError(f"{path}: cannot be read ({error.strerror}); pass the file of the driving tests") from error
    found = []
    for number, line in enumerate(lines, start=1):
        try:
            row = json.loads(line)
            if row["split"] != split:
                continue
            expected = row["expected"]
            found.append(
                DriveTest(
                    id=row["id"],
                    kind=row["kind"],
                    needs=row["needs"],
                    says=tuple((said["at"], said["text"]) for said in row["says"]),
                    plan=tuple(expected["plan"]),
                    reply=expected["reply"],
                    about=expected.get("about"),
                )
            )
        except (ValueError, KeyError, TypeError) as error:
            raise SettingsError(f"{path}, line {number}: {error!r}; it must be a driving test as JSON") from error
    return tuple(found)


def filled(data: Any, names: Mapping[str, str]) -> Any:
    """Returns JSON data with the placeholders of its strings replaced by names."""
    if isinstance(data, str):
        for name, value in names.items():
            data = data.replace(f"{{{name}}}", value)
        return data
    if isinstance(data, Mapping):
        return {key: filled(value, names) for key, value in data.items()}
    return [filled(value, names) for value in data] if isinstance(data, Sequence) else data


def measure(
    *, records: Path = RECORDS, split: str = "dev", only: str | None = None, towns: Sequence[str] = TOWNS,
    progress: Progress,
) -> Figures:  # fmt: skip
    """Plays and judges all driving tests of a split.

    Args:
        records: file of the tests.
        split: "dev" or "test".
        only: beginning of the ids of the tests to play; None for all.
        towns: towns in which a start is looked for; each test begins with another one.
        progress: called with a name and the share that is done.

    Raises:
        SettingsError: the file is malformed, or has no such test.
    """
    tests = [test for test in read_tests(records, split) if only is None or test.id.startswith(only)]
    if not tests:
        named = "" if only is None else f" whose id begins with {only!r}"
        raise SettingsError(
            f"{records}: has no driving test of the split {split!r}{named}; the splits are dev and test"
        )
    results, unplaced = [], []
    for number, test in enumerate(tests):
        progress(test.id, number / len(tests))
        first = number % len(towns)
        tries = (play(test, town) for town in (*towns[first:], *towns[:first]))
        result = next((result for result in tries if result is not None), None)
        if result is None:
            unplaced.append(test.id)
        else:
            results.append(result)
    return _figures(results, unplaced)


def _figures(results: Sequence[DriveResult], unplaced: Sequence[str]) -> Figures:
    count = max(len(results), 1)
    kinds = Counter(result.test.kind for result in results)
    passed = Counter(result.test.kind for result in results if result.passed)
    return {
        "tests": len(results),
        "as_expected": sum(result.passed for result in results) / count,
        "driven": sum(result.drive is None for result in results) / count,
        "replied": sum(result.reply is None for result in results) / count,
        "kinds": {kind: [passed[kind], kinds[kind]] for kind in sorted(kinds)},
        "without_start": list(unplaced),
        "failures": [
            {"id": result.test.id, "drive": result.drive, "reply": result.reply, "talk": list(result.talk)}
            for result in results
            if not result.passed
        ],
    }


def play(test: DriveTest, town: str) -> DriveResult | None:
    """Plays a test from a start where its needs hold; None where there is none in the town.

    Args:
        test: the test.
        town: name of the town.
    """
    env = DuoWizardEnv(town=town, config=EnvConfig(observe_acts=False, word_error_rate=0.0, max_seconds=LONGEST + 60.0))
    start = find_start(env, test.needs, test.plan, [text for _, text in test.says])
    if start is None:
        return None
    plan = DrivingPlan.from_json(filled(list(test.plan), start.labels))
    says = [(at, filled(text, start.words)) for at, text in test.says]
    log = _drive(env, start, says)
    judge = PlanJudge(log=log, landmarks=start.landmarks, streets=start.streets)
    drive = None if test.reply == "reason" else judge.judge(plan)
    talk = [f"{said.time:5.1f} {said.move.label}: {said.text}" for said in log.said]
    spoken = [f"participant: {text}" for _, text in says]
    return DriveResult(test=test, drive=drive, reply=judge_reply(log, test.reply, test.about), talk=(*spoken, *talk))


def _drive(env: DuoWizardEnv, start: Start, says: Sequence[tuple[str, str]]) -> DriveLog:
    """Drives from a start, says what is to be said, and watches the car."""
    observations, _ = env.reset(seed=start.seed)
    policy = ScriptedCoWizard(env.limits)
    state = policy.initial_state(start.seed, env.town)
    log, waiting = DriveLog(town=env.town), list(says)
    due, watched, asked = _first_time(waiting), 0.0, False
    while waiting or watched < WATCHED:
        moment = Moment.of(observations)
        log.moments.append(moment)
        if moment.time > LONGEST or not env.agents:
            break
        if observations["co_wizard"]["participant_text"]:
            log.told, watched, asked = moment.time, 0.0, False
            due = _next_time(waiting, moment.time)
        silent = float(observations["co_wizard"]["speaking"][0]) <= 0.0
        answered = silent and any(said.time >= log.told for said in log.said)
        speech = None
        if waiting and not asked and (moment.time >= due or (waiting[0][0] == "after_reply" and answered)):
            speech = Speech(act=DialogueAct.of(DialogueMove.INSTRUCT), text=waiting.pop(0)[1])
            log.began, asked = min(log.began, moment.time), True
        watched += 0.0 if moment.held or asked else 1.0 / env.config.decision_frequency
        action, state = policy.step(observations["co_wizard"], state)
        log.note(CoWizardAction.decode(action, env.limits), moment.time)
        actions = {
            "participant": ParticipantAction(speech=speech).encode(env.limits),
            "co_wizard": action,
            "ad_wizard": noop(Role.AD_WIZARD, env.limits),
        }
        observations, *_ = env.step(actions)
    return log


def _first_time(says: Sequence[tuple[str, str]]) -> float:
    """Returns the time of the first utterance [s]."""
    at = says[0][0]
    return float(at.partition(":")[2]) if at.startswith("seconds:") else FIRST_WORD


def _next_time(says: Sequence[tuple[str, str]], now: float) -> float:
    """Returns the time of the next utterance after the end of one [s]."""
    if not says:
        return now
    at = says[0][0]
    return now + (float(at.partition(":")[2]) if at.startswith("seconds:") else NO_REPLY)
