"""Curriculum of tasks for language-model agents: from one street in a minute to whole sessions in the tiers.

A task is a session of the Co-Wizard: a stage, a generated town, a seed, and the score that the rule program of the
tests reaches there from the pages alone. Training and test share neither towns nor seeds. The list is a file of this
package, which `python -m tests.agents.reference_scores` writes.
"""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any, Final

from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import short_repr
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.sim.config import WorldConfig

_EMPTY: Final = WorldConfig(vehicles=0, pedestrians=0)
_TWO_STOPS: Final = (2, 2)
_QUIET: Final[Mapping[str, str]] = MappingProxyType({"ad_wizard": "silent"})


class Split(enum.StrEnum):
    """Purpose of tasks: training or tests."""

    TRAIN = "train"
    TEST = "test"


class CurriculumStage(enum.StrEnum):
    """Stages of the curriculum, from the easiest."""

    STREET = "street"
    """The first 60 s, with an errand on the street of the start, in a town without other traffic."""
    PAIR = "pair"
    """Two errands with short ways, within 300 s."""
    QUIET = "quiet"
    """All errands of a session, without an Ad-Wizard."""
    SESSION = "session"
    """A whole session, with the scripted Ad-Wizard."""
    STANDARD = "standard"
    """A session of the tier `standard`."""
    EARS = "ears"
    """A session of the tier `ears`."""
    ROUGH = "rough"
    """A session of the tier `rough`."""


@dataclass(frozen=True, kw_only=True)
class StageSettings:
    """Settings of the sessions of a stage.

    Attributes:
        config: settings; None for those of the tier, or the usual ones.
        partners: policies of the other roles by name; "scripted", or those of the tier, for others.
        tier: name of the tier; None for none.
    """

    config: EnvConfig | None = None
    partners: Mapping[str, str] = field(default_factory=dict)
    tier: str | None = None


STAGES: Final[Mapping[CurriculumStage, StageSettings]] = MappingProxyType(
    {
        CurriculumStage.STREET: StageSettings(
            config=EnvConfig(max_seconds=60.0, stops=_TWO_STOPS, world=_EMPTY), partners=_QUIET
        ),
        CurriculumStage.PAIR: StageSettings(config=EnvConfig(max_seconds=300.0, stops=_TWO_STOPS), partners=_QUIET),
        CurriculumStage.QUIET: StageSettings(partners=_QUIET),
        CurriculumStage.SESSION: StageSettings(),
        CurriculumStage.STANDARD: StageSettings(tier="standard"),
        CurriculumStage.EARS: StageSettings(tier="ears"),
        CurriculumStage.ROUGH: StageSettings(tier="rough"),
    }
)
"""Settings of each stage."""


@dataclass(frozen=True, kw_only=True)
class AgentTask:
    """Session to be played by an agent.

    Attributes:
        stage: stage of the curriculum.
        town: name of a generated town.
        seed: seed of the session.
        reference: score that the rule program of the tests reaches from the pages, in [0, 1].
    """

    stage: CurriculumStage
    town: str
    seed: int
    reference: float = 0.0

    @property
    def name(self) -> str:
        """Name of the task, such as "street-generated:1,size=small-17"; no other task has it."""
        return f"{self.stage}-{self.town}-{self.seed}"

    def session(self, **settings: Any) -> TextSession:
        """Returns a session in the conditions of the task; `reset(task.seed)` begins it.

        Args:
            settings: further arguments of `TextSession`, such as `pages` or `max_turns`.

        Raises:
            ValueError: a setting is one that the task gives, or out of its range.
        """
        given = [name for name in ("role", "town", "config", "partners", "tier") if name in settings]
        if given:
            raise ValueError(f"{given[0]} is given by the task; choose another task instead")
        stage = STAGES[self.stage]
        return TextSession(
            Role.CO_WIZARD,
            self.town,
            config=stage.config,
            partners=stage.partners,
            tier=stage.tier,
            **settings,
        )


def tasks(split: Split | str, stage: CurriculumStage | str | None = None) -> tuple[AgentTask, ...]:
    """Returns the tasks of a split, from the easiest stage to the hardest.

    Args:
        split: "train" or "test".
        stage: stage of the tasks; None for all.

    Raises:
        ValueError: there is no such split or stage.
    """
    if split not in list(Split):
        raise ValueError(f"split is {short_repr(split)}; it must be one of {', '.join(Split)}")
    if stage is not None and stage not in list(CurriculumStage):
        raise ValueError(f"stage is {short_repr(stage)}; it must be one of {', '.join(CurriculumStage)}")
    return tuple(task for task in _stored()[Split(split)] if stage is None or task.stage == stage)


@lru_cache(maxsize=1)
def _stored() -> Mapping[Split, tuple[AgentTask, ...]]:
    page = json.loads(files(__package__).joinpath("data", "tasks.json").read_text(encoding="utf-8"))
    return {
        split: tuple(
            AgentTask(stage=stage, town=town, seed=seed, reference=reference)
            for stage in CurriculumStage
            for town, seed, reference in page[split].get(stage, ())
        )
        for split in Split
    }
