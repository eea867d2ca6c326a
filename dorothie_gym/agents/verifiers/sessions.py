"""Taskset and harness for verifiers: tasks of the curriculum, which are played in the process of the run."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from functools import partial
from typing import Any, Final

import verifiers.v1 as vf
from pydantic import Field

from dorothie_gym.agents.curriculum import AgentTask, CurriculumStage, Split, tasks
from dorothie_gym.policies.language_model.chat_endpoint import httpx_module

_SESSION: Final = "session"


class DorothieData(vf.TaskData):
    """A task of the curriculum; fields as those of `AgentTask`."""

    stage: CurriculumStage
    town: str
    seed: int
    reference: float


class DorothieTask(vf.Task[DorothieData]):
    """Scores of a session: its score in [0, 1] is the reward. A session that could not begin has 0."""

    @vf.reward(weight=1.0)
    async def session_score(self, trace: vf.Trace) -> float:
        """Returns the score that was reached, also by a session that a limit of the run has ended."""
        return float(trace.info.get(_SESSION, {}).get("score", 0.0))

    @vf.metric
    async def session(self, trace: vf.Trace) -> dict[str, float]:
        """Returns the other figures of the outcome, and the reference score of the task."""
        found = {name: value for name, value in trace.info.get(_SESSION, {}).items() if name != "score"}
        return {**found, "reference": self.data.reference}


class DorothieConfig(vf.TasksetConfig):
    """Settings of the taskset: the split ("train" or "test"), and one stage of it; all stages without."""

    split: Split = Split.TRAIN
    stage: CurriculumStage | None = None


class DorothieTaskset(vf.Taskset[DorothieTask, DorothieConfig]):
    """Tasks of the curriculum, from the easiest stage to the hardest."""

    def load(self) -> Iterator[DorothieTask]:
        """Yields the tasks of the split and stage."""
        for task in tasks(self.config.split, self.config.stage):
            data = DorothieData(
                name=task.name, prompt="", stage=task.stage, town=task.town, seed=task.seed, reference=task.reference
            )
            yield DorothieTask(data, self.config.task)


class DorothieHarnessConfig(vf.HarnessConfig):
    """Settings of the harness.

    Attributes:
        remember: number of earlier pages, with their answers, in a request; with 0, each page is a sample of its own.
        max_turns: number of answers after which a session is truncated.
    """

    remember: int = Field(0, ge=0)
    max_turns: int = Field(400, ge=1)


class DorothieHarness(vf.Harness[DorothieHarnessConfig]):
    """Plays a session in this process; each answer is requested from the endpoint of the run."""

    APPENDS_SYSTEM_PROMPT = True
    EXECUTES_CODE = False
    NEEDS_CONTAINER = False

    async def launch(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,
        runtime: vf.Runtime,
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],
        data: vf.TaskData,
    ) -> vf.ProgramResult:
        """Plays a session; a refused request ends it, and what was reached counts."""
        task = AgentTask(stage=data.stage, town=data.town, seed=data.seed)
        session = await asyncio.to_thread(partial(task.session, max_turns=self.config.max_turns))
        turn = await asyncio.to_thread(session.reset, task.seed)
        system = {"role": "system", "content": data.system_prompt or session.system}
        past: list[dict[str, Any]] = []
        try:
            async with httpx_module().AsyncClient(
                base_url=endpoint, headers={"Authorization": f"Bearer {secret}"}, timeout=None
            ) as http:
                while not turn.done:
                    page = {"role": "user", "content": turn.page}
                    request = {"model": ctx.model, "messages": [system, *past, page]}
                    reply = await http.post("/chat/completions", json=request)
                    if reply.status_code != 200:  # a fault of the endpoint, or a limit of the run, which is no error
                        return vf.ProgramResult(exit_code=1, stdout="", stderr=reply.text)
                    words = reply.json()["choices"][0]["message"]["content"] or ""
                    past = [*past, page, {"role": "assistant", "content": words}]
                    past = past[-2 * self.config.remember :] if self.config.remember else []
                    turn = await asyncio.to_thread(session.answer, words)
        finally:
            trace.info[_SESSION] = session.finish().numbers()
        return vf.ProgramResult(exit_code=0, stdout="", stderr="")
