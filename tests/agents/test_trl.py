"""Environment of TRL: sessions by its tools, with the rule program as the model, and two steps of GRPO.

The first tests need no TRL. The last one needs an environment of its own:
`pip install -c constraints.txt '.[trl]' pytest pytest-timeout hypothesis`, then
`python -m pytest -W default -m integrations tests/agents/test_trl.py`.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import pytest

from dorothie_gym.agents import Outcome, tasks
from dorothie_gym.agents.curriculum import AgentTask, CurriculumStage
from dorothie_gym.agents.trl.environment import DorothieEnvironment, rows
from dorothie_gym.errors import AgentSessionError
from tests.agents.players import Answerer, play, reader_of

TOOLS = {"drive": "drive", "goal": "set_goal", "mark": "set_goal", "say": "say"}
STREET = tasks("train", "street")[0]
ROW = {"seed": STREET.seed, "town": STREET.town, "stage": "street"}


class Driver:
    """The rule program with the fields that the tools fill; it keeps its note itself."""

    def __init__(self) -> None:
        self.reader, self.note = reader_of("co_wizard"), ""

    def __call__(self, page: str) -> Mapping[str, str]:
        note = f"\nYour note: {self.note}\nConversation" if self.note else "\nConversation"
        answer = self.reader(page.replace("\nConversation", note, 1))
        self.note = answer.get("note", "")
        return {name: answer[name] for name in (*TOOLS, "again") if name in answer}


def by_tools(env: DorothieEnvironment, page: str, driver: Answerer) -> None:
    while not page.startswith("The session is over"):
        answer = driver(page)
        for field, name in TOOLS.items():
            if answer.get(field) and (field, answer[field]) != ("mark", "none"):
                assert "Noted" in getattr(env, name)(answer[field])
        page = env.wait(float(answer["again"]))


@pytest.mark.long
def test_ten_sessions_by_tools_succeed_and_are_those_of_the_text_session() -> None:
    env, chosen = DorothieEnvironment(), tasks("train", "pair")
    outcomes: list[Outcome] = []
    assert len(chosen) >= 10
    for task in chosen:
        by_tools(env, env.reset(seed=task.seed, town=task.town, stage=task.stage), Driver())
        session = env._session
        assert session is not None
        outcomes.append(session.finish())
        assert env.get_reward() == outcomes[-1].score
        expected, whole = task.session(), Driver()
        play(expected, lambda page, driver=whole: {"note": "", **driver(page)}, task.seed)
        assert session.engine.summary() == expected.engine.summary()
    assert sum(outcome.success for outcome in outcomes) >= 9


def test_tools_are_five_and_are_described() -> None:
    methods = dict(inspect.getmembers(DorothieEnvironment, predicate=inspect.isfunction))
    public = {name for name in methods if not name.startswith("_")}
    assert public == {"reset", "get_reward", "say", "drive", "set_goal", "wait", "look"}
    for name in public - {"reset", "get_reward"}:
        words = inspect.getdoc(methods[name]) or ""
        assert all(
            f"{argument}: " in words for argument in inspect.signature(methods[name]).parameters if argument != "self"
        )


def test_mistakes_of_the_model_are_words() -> None:
    env = DorothieEnvironment()
    for call in (env.look, env.get_reward):
        with pytest.raises(AgentSessionError, match=r"call reset\(\) first"):
            call()
    page = env.reset(**ROW, prompt=[], reference=1.0)
    assert "it must be one of" in env.drive("Fly") and "number of seconds" in env.wait(float("nan"))
    assert "must be a text" in env.say(5)  # type: ignore[arg-type]
    assert "at most 20000 characters" in env.say("x" * 10**6)
    assert env.look() == page and env.get_reward() == 0.0


@pytest.mark.parametrize(("changed", "words"), [({"stage": "town"}, "town"), ({"seed": -1}, "seed is -1")])
def test_wrong_rows_are_refused(changed: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        DorothieEnvironment().reset(**{**ROW, **changed})


def test_rows_of_a_group_give_equal_sessions_and_have_the_seed() -> None:
    row = rows("train", "street")[0]
    assert {name: row[name] for name in ROW} == ROW and row["reference"] == STREET.reference
    assert AgentTask(stage=CurriculumStage(row["stage"]), town=row["town"], seed=row["seed"]).name == STREET.name
    first, second = DorothieEnvironment(), DorothieEnvironment()
    assert first.reset(**row) == second.reset(**row)
    assert first.wait(20.0) == second.wait(20.0)
    assert "call the tools" in row["prompt"][0]["content"]


@pytest.mark.integrations
@pytest.mark.skipif(find_spec("trl") is None, reason="needs an environment with the extra 'trl'")
def test_example_takes_two_steps_of_grpo(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "trl_grpo.py"
    command = [sys.executable, str(example), "--steps", "2", "--group", "2", "--calls", "4", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "2 steps: mean reward" in done.stdout
