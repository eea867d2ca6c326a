"""Chooses the tasks of the curriculum, and measures their reference scores: `python -m tests.agents.reference_scores`.

The rule program plays each task from its pages. In the first two stages, the way to the first errand is short and, in
the first, along one street; a score below `LEAST` leaves the seed out. The file is written after each stage, and stages
that it has are not played again.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Final

import typer

from dorothie_gym.agents.curriculum import AgentTask, CurriculumStage, Split
from dorothie_gym.maps.generated.specification import FIRST_TEST_SEED, TownSize, TownSpecification
from dorothie_gym.policies.navigation.cost_to_go import CostToGo
from tests.agents.players import play, reader_of

TOWNS: Final = {
    split: tuple(str(TownSpecification(seed=first + number, size=TownSize.SMALL)) for number in range(2))
    for split, first in ((Split.TRAIN, 0), (Split.TEST, FIRST_TEST_SEED))
}
"""Towns of each split; those for tests are of the fold `unseen`."""

FIRST_SEED: Final = {Split.TRAIN: 10_000, Split.TEST: 900_000}
"""Seed from which on the sessions of a split are chosen."""

COUNTS: Final = {
    CurriculumStage.STREET: (12, 4), CurriculumStage.PAIR: (10, 2), CurriculumStage.QUIET: (4, 2),
    CurriculumStage.SESSION: (4, 2),
    CurriculumStage.STANDARD: (2, 2), CurriculumStage.EARS: (2, 2), CurriculumStage.ROUGH: (2, 2),
}  # fmt: skip
"""Numbers of tasks for training and for test."""

STREET_WAY: Final = 200.0
"""Longest way on one street [m]."""

PAIR_WAY: Final = 400.0
"""Longest way to the first of two errands [m]."""

LEAST: Final = {CurriculumStage.STREET: 0.4, CurriculumStage.PAIR: 1.0}
"""Score that the rule program must reach, by stage: one errand of two, or a success."""


def suits(task: AgentTask) -> bool:
    """Whether the way to the first errand suits the stage."""
    if task.stage not in LEAST:
        return True
    session = task.session()
    session.reset(task.seed)
    live = session.engine.session
    car, town = live.world.planner, session.engine.town
    cost, first = CostToGo(town), next(i for i in live.task.live if live.task.allowed(i))
    mark = live.task.storyboard.landmarks[live.task.landmark_of(first)]
    cost.aim((mark.lane, mark.station))
    way = cost.from_place(car.lane, car.station)
    if task.stage is CurriculumStage.PAIR:
        return way <= PAIR_WAY
    return way <= STREET_WAY and town.lanes[car.lane].street == town.lanes[mark.lane].street


def candidates(split: Split, stage: CurriculumStage, index: int) -> Iterator[AgentTask]:
    """The tasks of one town and stage that suit, by seed."""
    town = TOWNS[split][index]
    seed = FIRST_SEED[split] + 1000 * list(CurriculumStage).index(stage) + 10_000 * index
    while True:
        task = AgentTask(stage=stage, town=town, seed=seed)
        if suits(task):
            yield task
        seed += 1


def measured(split: Split, stage: CurriculumStage, count: int) -> Iterator[AgentTask]:
    """The tasks of a stage with their scores; towns take turns."""
    streams = [candidates(split, stage, index) for index in range(len(TOWNS[split]))]
    found = 0
    while found < count:
        task = next(streams[found % len(streams)])
        score = play(task.session(), reader_of("co_wizard"), task.seed).score
        if score >= LEAST.get(stage, 0.0):
            found += 1
            yield AgentTask(stage=stage, town=task.town, seed=task.seed, reference=round(score, 4))


def main(out: Annotated[Path | None, typer.Option(help="file; by default that of the package")] = None) -> None:
    """Measures the stages that the file does not have yet."""
    path = Path(str(files("dorothie_gym.agents") / "data" / "tasks.json")) if out is None else out
    page = json.loads(path.read_text()) if path.exists() else {}
    for stage, counts in COUNTS.items():
        for split, count in zip(Split, counts, strict=True):
            rows = page.setdefault(split, {}).setdefault(stage, [])
            if len(rows) == count:
                continue
            rows.clear()
            for task in measured(split, stage, count):
                rows.append([task.town, task.seed, task.reference])
                print(split, task.name, task.reference, flush=True)
            path.write_text(layout(page))


def layout(page: dict[str, dict[str, list[list[object]]]]) -> str:
    """JSON with a line for each task."""
    splits = []
    for split, stages in page.items():
        lines = [
            f'  "{stage}": [\n' + ",\n".join(f"   {json.dumps(row)}" for row in rows) + "\n  ]"
            for stage, rows in stages.items()
        ]
        splits.append(f' "{split}": {{\n' + ",\n".join(lines) + "\n }")
    return "{\n" + ",\n".join(splits) + "\n}\n"


if __name__ == "__main__":
    typer.run(main)
