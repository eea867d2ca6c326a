"""Tasks for Inspect: `inspect eval dorothie_gym/co_wizard --model ...`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import anyio.to_thread
from inspect_ai import Epochs, Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import (
    ChatMessageSystem,
    ChatMessageUser,
    ContentImage,
    ContentText,
    GenerateConfig,
    ResponseSchema,
    get_model,
)
from inspect_ai.scorer import Score, mean, scorer, stderr
from inspect_ai.solver import solver
from inspect_ai.util import JSONSchema

from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import short_repr
from dorothie_gym.evaluation.tier_settings import tier_settings
from dorothie_gym.evaluation.tiers import ADMIT_IT, ASK_FIRST
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.ontology.roles import Role
from dorothie_gym.session.config import CameraConfig, EnvConfig

if TYPE_CHECKING:
    from collections.abc import Callable

    from inspect_ai.scorer import Scorer, Target
    from inspect_ai.solver import Generate, Solver, TaskState

    from dorothie_gym.agents.turn import Turn

FIRST_SEED: Final = 7000
"""Usual seed of the first session."""

_OUTCOME: Final = "outcome"


def _task_of(name: str, role: Role, usual_tier: str | None = None) -> Callable[..., Task]:
    @task(name=name)
    def sessions(
        samples: int = 10,
        epochs: int = 3,
        town: str | None = None,
        first_seed: int = FIRST_SEED,
        tier: str | None = usual_tier,
        pictures: bool = False,
        remember: int = 0,
        max_turns: int = 400,
    ) -> Task:
        """The model plays a role; scripted policies, or those of the tier, play the others.

        Args:
            samples: number of sessions.
            epochs: number of times that each is played; `pass_k_N` is the share of those in which all of them succeed.
            town: name of a town; by default that of the tier.
            first_seed: seed of the first session; the others follow.
            tier: name of a tier of the benchmark; None for the usual sessions.
            pictures: whether the model is shown the picture of the car's camera with each page.
            remember: number of earlier pages, with their answers, that the model is shown.
            max_turns: number of answers after which a session is truncated.

        Raises:
            ValueError: a number is out of its range, or there is no such town or tier.
        """
        for label, value, least in (("samples", samples, 1), ("epochs", epochs, 1), ("remember", remember, 0)):
            if not isinstance(value, int) or value < least:
                raise ValueError(f"{label} is {short_repr(value)}; it must be a whole number of at least {least}")
        _session(role, town, tier, pictures, max_turns).reset(first_seed)  # a wrong argument is an error of the task
        where = "-".join(part for part in (tier, town) if part) or DEFAULT_TOWN
        dataset = [
            Sample(input="(the pages of the session)", id=f"{where}-{seed}", metadata={"seed": seed})
            for seed in range(first_seed, first_seed + samples)
        ]
        return Task(
            dataset=MemoryDataset(dataset, name=f"dorothie-{name}"),
            solver=play_session(str(role), town, tier, pictures, remember, max_turns),
            scorer=session_score(),
            epochs=Epochs(epochs, ["mean", f"pass_k_{epochs}"] if epochs > 1 else ["mean"]),
        )

    registered: Callable[..., Task] = sessions
    return registered


co_wizard = _task_of("co_wizard", Role.CO_WIZARD)
participant = _task_of("participant", Role.PARTICIPANT)
ask_first = _task_of("ask_first", Role.CO_WIZARD, ASK_FIRST.name)
admit_it = _task_of("admit_it", Role.CO_WIZARD, ADMIT_IT.name)


def _session(role: str, town: str | None, tier: str | None, pictures: bool, max_turns: int) -> TextSession:
    """Returns a session of a tier, with a camera if there are to be pictures."""
    config = tier_settings(tier, Role(role)).config
    if pictures:
        config = replace(config or EnvConfig(), camera=CameraConfig())
    return TextSession(role, town, config=config, tier=tier, max_turns=max_turns)


@solver
def play_session(
    role: str, town: str | None, tier: str | None, pictures: bool, remember: int, max_turns: int
) -> Solver:
    """Returns the solver, which plays a session by its pages; arguments as those of the tasks."""

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        in_thread: Any = anyio.to_thread.run_sync
        session = await in_thread(_session, role, town, tier, pictures, max_turns)
        model, system = get_model(), ChatMessageSystem(content=session.system)
        past: list[Any] = []
        turn = await in_thread(session.reset, state.metadata["seed"])
        try:
            while not turn.done:
                page = ChatMessageUser(content=_content(turn))
                answers = ResponseSchema(name="answer", json_schema=JSONSchema.model_validate(turn.schema))
                output = await model.generate([system, *past, page], config=GenerateConfig(response_schema=answers))
                past = [*past, page, output.message][-2 * remember :] if remember else []
                state.messages += [page, output.message]
                turn = await in_thread(session.answer, output.completion)
        finally:  # a limit of the sample ends the solver by an exception: what was reached counts
            state.store.set(_OUTCOME, session.finish().numbers())
        state.completed = True
        return state

    return solve


def _content(turn: Turn) -> Any:
    """Returns the page, with its picture if it has one."""
    return [ContentText(text=turn.page), ContentImage(image=turn.picture)] if turn.picture else turn.page


@scorer(metrics={"success": [mean(), stderr()], "score": [mean(), stderr()]})
def session_score() -> Scorer:
    """Returns the scorer: success and score; the other figures are metadata, which no reducer reads."""

    async def score(state: TaskState, target: Target) -> Score:
        found: dict[str, float] = state.store.get(_OUTCOME) or {}
        return Score(value={name: found.get(name, 0.0) for name in ("success", "score")}, metadata=dict(found))

    return score
