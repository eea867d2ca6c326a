"""What a reader of figures with language models is warned of."""

from __future__ import annotations

import pytest

from dorothie_gym.evaluation.closed_loop.usage import usage_warnings
from dorothie_gym.policies.language_model.usage import ModelUsage


@pytest.mark.parametrize(
    ("prompt", "completion", "answers", "missing"),
    [(100, 7, 5, ""), (0, 0, 5, "prompts"), (100, 0, 5, "answers"), (0, 0, 0, "")],
)
def test_tokens_that_an_endpoint_does_not_report_are_named(
    prompt: int, completion: int, answers: int, missing: str
) -> None:
    usage = ModelUsage(model="m", calls=answers, answers=answers, prompt_tokens=prompt, completion_tokens=completion)
    warnings = usage_warnings({"co_wizard": usage})
    assert len(warnings) == bool(missing)
    assert not missing or f"the endpoint reports no tokens of {missing}" in warnings[0]
