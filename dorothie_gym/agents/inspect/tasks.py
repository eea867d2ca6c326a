"""Tasks for Inspect: `inspect eval dorothie_gym/co_wizard --model ...`."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

import anyio.to_thread
from inspect_ai import Epochs, Task, task
from inspect_ai.dataset import MemoryDataset, Sample
from inspect_ai.model import ChatMessageSystem, ChatMessageUser, GenerateConfig, ResponseSchema, get_model
from inspect_ai.scorer import Score, mean, scorer, stderr
from inspect_ai.solver import solver
from inspect_ai.util import JSONSchema

from dorothie_gym.agents.text_session import TextSession
from dorothie_gym.errors import short_repr
from dorothie_gym.maps.folds import DEFAULT_TOWN
from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from collections.abc import Callable

    from inspect_ai.scorer import Scorer, Target
    from inspect_ai.solver import Generate, Solver, TaskState

FIRST_SEED: Final = 7000
"""Usual seed of the first session."""

_OUTCOME: Final = "outcome"


def _task_of(role: Role) -> Callable[..., Task]:
    @task(name=str(role))
    def sessions(
        samples: int = 10,
        epochs: int = 3,
        town: str = DEFAULT_TOWN,
        first_seed: int = FIRST_SEED,
        remember: int = 0,
        max_turns: int = 400,
    ) -> Task:
        """The model plays a role; scripted policies play the others.

        Args:
            samples: number of sessions.
            epochs: number of times that each is played; `pass_k_N` is the share of those in which all of them succeed.
            town: name of a town.
            first_seed: seed of the first session; the others follow.
            remember: number of earlier pages, with their answers, that the model is shown.
            max_turns: number of answers after which a session is truncated.

        Raises:
            ValueError: a number is out of its range, or there is no such town.
        """
        for name, value, least in (("samples", samples, 1), ("epochs", epochs, 1), ("remember", remember, 0)):
            if not isinstance(value, int) or value < least:
                raise ValueError(f"{name} is {short_repr(value)}; it must be a whole number of at least {least}")
        TextSession(role, town, max_turns=max_turns).reset(first_seed)  # a wrong argument is an error of the task
        dataset = [
            Sample(input="(the pages of the session)", id=f"{town}-{seed}", metadata={"seed": seed})
            for seed in range(first_seed, first_seed + samples)
        ]
        return Task(
            dataset=MemoryDataset(dataset, name=f"dorothie-{role}"),
            solver=play_session(role, town, remember, max_turns),
            scorer=session_score(),
            epochs=Epochs(epochs, ["mean", f"pass_k_{epochs}"] if epochs > 1 else ["mean"]),
        )

    registered: Callable[..., Task] = sessions
    return registered


co_wizard = _task_of(Role.CO_WIZARD)
participant = _task_of(Role.PARTICIPANT)


@solver
def play_session(role: str, town: str, remember: int, max_turns: int) -> Solver:
    """Returns the solver, which plays a session by its pages; arguments as those of the tasks."""

    async def solve(state: TaskState, generate: Generate) -> TaskState:
        in_thread: Any = anyio.to_thread.run_sync
        session = await in_thread(partial(TextSession, role, town, max_turns=max_turns))
        model, system = get_model(), ChatMessageSystem(content=session.system)
        past: list[Any] = []
        turn = await in_thread(session.reset, state.metadata["seed"])
        try:
            while not turn.done:
                page = ChatMessageUser(content=turn.page)
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


@scorer(metrics={"success": [mean(), stderr()], "score": [mean(), stderr()]})
def session_score() -> Scorer:
    """Returns the scorer: success and score; the other figures are metadata, which no reducer reads."""

    async def score(state: TaskState, target: Target) -> Score:
        found: dict[str, float] = state.store.get(_OUTCOME) or {}
        return Score(value={name: found.get(name, 0.0) for name in ("success", "score")}, metadata=dict(found))

    return score
