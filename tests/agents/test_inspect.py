"""Tasks of Inspect, found by their entry point, with the rule program as the model.

They need an environment of their own: `pip install -e '.[inspect]' pytest pytest-timeout hypothesis`, then
`python -m pytest -W default -m integrations tests/agents/test_inspect.py`.
"""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest

from dorothie_gym.agents import TextSession
from tests.agents.players import play, reader_of

inspect_ai = pytest.importorskip("inspect_ai", reason="needs an environment with the extra 'inspect'")
pytestmark = [pytest.mark.integrations, pytest.mark.filterwarnings("default")]

models = pytest.importorskip("inspect_ai.model")


class Rules(models.ModelAPI):
    """The rule program of a role as a model; a share of its answers is spoilt."""

    def __init__(
        self,
        model_name: str,
        base_url: Any = None,
        api_key: Any = None,
        config: Any = None,
        spoilt: float = 0.0,
        **_: Any,
    ) -> None:
        super().__init__(model_name, base_url, api_key, [], config or models.GenerateConfig())
        self.reader, self.spoilt, self.random = reader_of(model_name), spoilt, random.Random(0)

    async def generate(self, input: Any, tools: Any, tool_choice: Any, config: Any) -> Any:
        page = next(message for message in reversed(input) if message.role == "user").text
        wrong = self.random.random() < self.spoilt
        return models.ModelOutput.from_content(self.model_name, "no" if wrong else json.dumps(self.reader(page)))


@models.modelapi(name="rules")
def rules() -> type[Any]:
    return Rules


def run(task: str, tmp_path: Path, spoilt: float = 0.0, **arguments: object) -> Any:
    role = "participant" if task.endswith("participant") else "co_wizard"
    model = models.get_model(f"rules/{role}", spoilt=spoilt)
    (log,) = inspect_ai.eval(task, model=model, task_args=arguments, log_dir=str(tmp_path), display="none")
    assert log.status == "success", log.error
    return log


def test_ten_sessions_succeed_and_are_those_of_the_text_session(tmp_path: Path) -> None:
    log = run("dorothie_gym/co_wizard", tmp_path, samples=10, epochs=1, town="brookside", first_seed=9100)
    values = [next(iter(sample.scores.values())) for sample in log.samples]
    assert sum(score.value["success"] for score in values) >= 9
    expected = play(TextSession("co_wizard", "brookside"), reader_of("co_wizard"), 9100)
    assert values[0].metadata == expected.numbers()


def test_pass_k_is_the_share_of_sessions_that_succeed_every_time(tmp_path: Path) -> None:
    log = run("dorothie_gym/co_wizard", tmp_path, samples=2, epochs=2, town="brookside")
    assert {(score.reducer, score.name): score.metrics["mean"].value for score in log.results.scores} == {
        (reducer, name): pytest.approx(1.0) for reducer in ("mean", "pass_k_2") for name in ("success", "score")
    }


def test_spoilt_answers_and_limits_lower_the_score_and_raise_nothing(tmp_path: Path) -> None:
    log = run("dorothie_gym/co_wizard", tmp_path, spoilt=1.0, samples=1, epochs=1)
    (score,) = (next(iter(sample.scores.values())) for sample in log.samples)
    assert score.value == {"success": 0.0, "score": 0.0} and score.metadata["faults"] == 20
    log = run("dorothie_gym/participant", tmp_path, samples=1, epochs=1, max_turns=3)
    (score,) = (next(iter(sample.scores.values())) for sample in log.samples)
    assert score.metadata["turns"] == 3 and 0.0 <= score.value["score"] < 1.0


@pytest.mark.parametrize("task", ["ask_first", "admit_it"])
def test_tasks_of_talk_are_judged(task: str, tmp_path: Path) -> None:
    log = run(f"dorothie_gym/{task}", tmp_path, samples=3, epochs=1, first_seed=1000)
    values = [next(iter(sample.scores.values())).value for sample in log.samples]
    session = TextSession(tier=task.replace("_", "-"))
    assert values == [
        {"success": float(outcome.success), "score": outcome.score}
        for outcome in (play(session, reader_of("co_wizard"), seed) for seed in range(1000, 1003))
    ]
    assert [sample.id for sample in log.samples] == [f"{task.replace('_', '-')}-{seed}" for seed in range(1000, 1003)]


def test_tier_and_pictures_are_parameters(tmp_path: Path) -> None:
    log = run("dorothie_gym/co_wizard", tmp_path, samples=1, epochs=1, tier="rough", pictures=True, max_turns=2)
    (sample,) = log.samples
    pages = [message for message in sample.messages if message.role == "user"][1:]
    assert len(pages) == 2 and all(page.content[1].type == "image" for page in pages)
    begun = TextSession(tier="rough")
    begun.reset(7000)
    assert pages[0].text == begun.tool("look").page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"samples": 0}, "samples is 0; it must be a whole number of at least 1"),
        ({"epochs": 0}, "epochs is 0"),
        ({"remember": -1}, "remember is -1; it must be a whole number of at least 0"),
        ({"max_turns": 0}, "max_turns is 0"),
        ({"first_seed": -1}, "seed is -1"),
        ({"town": "atlantis"}, "there is no such town"),
        ({"tier": "soft"}, "tier is 'soft'"),
    ],
)
def test_wrong_parameters_are_errors_of_the_task(arguments: dict[str, Any], words: str) -> None:
    from dorothie_gym.agents.inspect.tasks import participant

    with pytest.raises(ValueError, match=words):
        participant(**arguments)
