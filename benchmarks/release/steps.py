"""Steps that measure the figures of README and docs: their commands, and how their results are read."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, TypeAlias

from benchmarks.release.figures import Figure
from benchmarks.timing import rounded

Figures: TypeAlias = dict[str, Figure]

SESSIONS: Final = 100
"""Sessions of a row of a tier; its intervals are then about 10 points wide."""

TALK_SESSIONS: Final = 30
"""Sessions of a row of a tier of talk."""

GYM: Final = "python -m dorothie_gym.cli"
BENCHMARKS: Final = "python -m benchmarks"

TIERS: Final = ("standard", "ears", "rough", "strangers")
TALK_TIERS: Final = ("ask-first", "admit-it")
TALK_ROWS: Final = ("always-asks", "never-asks", "says-yes", "keyword-rule")

DRIVER_SEEDS: Final = (0, 1, 2)


@dataclass(frozen=True, kw_only=True)
class Step:
    """Measurement by commands.

    Attributes:
        name: name; its figures are "NAME.FIGURE".
        commands: commands, run in the folder of the step. `--json` of command K is stored as K.json.
        read: reads the figures from that folder.
        minutes: approximate time on two idle cores [min].
    """

    name: str
    commands: tuple[str, ...]
    read: Callable[[Path], Figures]
    minutes: float


def _json(folder: Path, number: int = 0) -> Any:  # each step knows what its command writes
    return json.loads((folder / f"{number}.json").read_text(encoding="utf-8"))


# --- rollouts -------------------------------------------------------------------------------------------------------

_ROLLOUT_FIGURES: Final = (
    "timely_completion", "success", "goal_condition_success", "driving_score", "talk_success",
)  # fmt: skip


def rollout_figures(folder: Path) -> Figures:
    """Returns the figures of a rollout: sessions, successes, and the metrics of the tables with their intervals."""
    result = _json(folder)
    found = {"sessions": Figure(value=float(result["sessions"]))}
    for name in _ROLLOUT_FIGURES:
        figure = result.get(name)
        if figure is not None and figure["mean"] is not None:
            ends = {key: rounded(figure[key]) for key in ("low", "high") if figure.get(key) is not None}
            found[name] = Figure(value=rounded(figure["mean"]), **ends)
    records = [row["record"] for row in result["rows"] if row["record"] is not None]
    if records:
        red = sum(record["infractions"].get("red_light", 0) for record in records) / len(records)
        found["successes"] = Figure(value=float(sum(record["success"] for record in records)))
        found["red_lights"] = Figure(value=round(red, 2))
    return found


def _rollout(name: str, options: str, minutes: float) -> Step:
    return Step(
        name=name,
        commands=(f"{GYM} rollout {options} --out rollout --json",),
        read=rollout_figures,
        minutes=minutes,
    )


def _tiers() -> Iterator[Step]:
    for tier in TIERS:
        minutes = 20.0 if tier in ("standard", "ears") else 90.0
        yield _rollout(f"tier-{tier}", f"--tier {tier} --sessions {SESSIONS}", minutes)
        yield _rollout(f"tier-{tier}-oracle", f"--tier {tier} --oracle --sessions {SESSIONS}", minutes)
    for tier in TALK_TIERS:
        usual = f"--tier {tier} --towns brookside,midtown --seed 1000 --sessions {TALK_SESSIONS}"
        yield _rollout(f"tier-{tier}-oracle", f"{usual} --oracle", 3.0)
        for row in TALK_ROWS:
            yield _rollout(f"tier-{tier}-{row}", f"{usual} --co-wizard {row}", 3.0)


# --- speed ----------------------------------------------------------------------------------------------------------


def speed_figures(folder: Path, *, paths: Mapping[str, str]) -> Figures:
    """Returns figures of a benchmark.

    Args:
        folder: folder of the step.
        paths: keys that lead to each figure in the JSON, joined by dots.
    """
    found = {}
    for name, path in paths.items():
        value: Any = _json(folder)
        for key in path.split("."):
            value = value[key]
        found[name] = Figure(value=rounded(float(value)))
    return found


def _speed(name: str, options: str, minutes: float, *keys: str, **paths: str) -> Step:
    return Step(
        name=name,
        commands=(f"{BENCHMARKS} {options} --json",),
        read=partial(speed_figures, paths={**{key: key for key in keys}, **paths}),
        minutes=minutes,
    )


_WORLD: Final = ("substeps_per_second", "stock_substeps_per_second", "vehicles", "pedestrians")


def _speeds() -> Iterator[Step]:
    yield _speed("speed-world", "world", 2.0, *_WORLD, "lanes", "cyclists")
    yield _speed("speed-world-100", "world --vehicles 100 --pedestrians 50", 3.0, *_WORLD)
    yield _speed("speed-env", "env", 3.0, "steps_per_second", "stock_steps_per_second", "two_processes_scaling")
    yield _speed("speed-vector", "vector", 2.0, "substeps_per_second", "scaling")
    yield _speed(
        "speed-import", "import", 1.0, "highway_env_seconds", "ratio",
        package="seconds.package", first_environment="seconds.first_environment",
    )  # fmt: skip


# --- understanding and driving of sentences ---------------------------------------------------------------------------


def _sentences() -> Iterator[Step]:
    yield _speed("drives", "drives --split dev", 5.0, "tests", "as_expected", "driven", "replied")
    yield _speed(
        "speech", "speech", 3.0, "wer_clean", "wer_20db", "wer_10db", "slots_f1", "slots_f1_annotated", "names",
        "moves", "moves_written", "recognition_rtf", "synthesis_milliseconds",
    )  # fmt: skip


# --- learned players --------------------------------------------------------------------------------------------------


def driver_figures(folder: Path) -> Figures:
    """Returns the training time after which every seed has exceeded 90 % success [s], and the least last success."""
    reached, last = [], []
    for seed in DRIVER_SEEDS:
        lines = (folder / f"seed-{seed}" / "progress.jsonl").read_text(encoding="utf-8").splitlines()
        rows = [json.loads(line) for line in lines]
        good = next(k for k, row in enumerate(rows) if row["success"] > 0.9)
        reached.append(float(rows[good]["seconds"]))
        last.append(float(rows[-1]["success"]))
    return {
        "seconds_to_90_percent": Figure(value=float(round(max(reached)))),
        "least_success": Figure(value=rounded(min(last))),
        "seeds": Figure(value=float(len(DRIVER_SEEDS))),
    }


def _learned() -> Iterator[Step]:
    driver = f"{GYM} train-rl maskable_ppo --set town=brookside --steps 800000"
    yield Step(
        name="driver",
        commands=tuple(f"{driver} --seed {seed} --out seed-{seed}" for seed in DRIVER_SEEDS),
        read=driver_figures,
        minutes=5.0,
    )
    yield _rollout(
        "learned-co-wizard",
        "--tier standard --co-wizard pretrained:co-wizard --towns all --seed 5150 --sessions 48",
        10.0,
    )


# --- language models ------------------------------------------------------------------------------------------------

SPOILT: Final = (0.0, 0.05, 0.2)
"""Rates of answers that are drawn at random."""


def spoilt_figures(folder: Path) -> Figures:
    """Returns the success and Pass^3 of the rule program by the rate of its spoilt answers [%]."""
    rows = {row["player"]: row for row in _json(folder)}
    found: Figures = {}
    for rate in SPOILT:
        row = rows["reader" if rate == 0.0 else f"reader, {rate:.0%} spoilt"]
        keys = "sessions", "success", "pass_k", "reached", "live"
        found |= {f"rate_{100 * rate:.0f}_{key}": Figure(value=rounded(float(row[key]))) for key in keys}
    return found


def _readers() -> Iterator[Step]:
    usual = "--tiers standard --roles co_wizard --sessions 6 --trials 3"
    rates = ",".join(f"{rate:g}" for rate in SPOILT)
    yield Step(
        name="spoilt-answers",
        commands=(f"python -m tests.agents.ceilings {usual} --spoilt {rates} --json",),
        read=spoilt_figures,
        minutes=10.0,
    )


STEPS: Final[Mapping[str, Step]] = {
    step.name: step for part in (_tiers(), _speeds(), _sentences(), _learned(), _readers()) for step in part
}
"""Steps by name."""
