"""Each script in examples/ runs with small settings, and prints what its docstring announces."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.session.recording.builders import write
from tests.session.recording.dialogues import talk

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
LONGEST = {"ppo": 150, "rl_co_wizard": 90, "trl_grpo": 100}
"""Lines of an example; 80 where nothing else is said."""

REQUIRED = {"torchrl_ppo": "torchrl", "trl_grpo": "trl"}
"""Libraries that only the extras `integrations` and `trl` bring."""

ARGUMENTS = {
    "corpus_analysis": "--sessions 2 --seconds 20 --out made",
    "custom_agent": "--decisions 40",
    "dialogue_model": "--corpus corpus --out predictions.parquet",
    "own_policy": "--sessions 1 --seconds 10",
    "own_town": "--out mill_end --seconds 10",
    "ppo": "--environments 4 --rollout 16 --steps 128 --batch 32",
    "rl_co_wizard": "--steps 32 --rollout 32 --seconds 20",
    "rl_navigation": "--steps 64 --rollout 32 --rounds 2 --episodes 1 --max-seconds 10",
    "rl_pictures": "--steps 64 --environments 2 --rollout 16 --frames 2 --rounds 2 --max-seconds 5",
    "torchrl_ppo": "--environments 2 --rollout 64 --steps 128",
    "trl_grpo": "--steps 2 --group 2 --calls 4",
}
PRINTED = {
    "corpus_analysis": "words per utterance",
    "custom_agent": "return",
    "dialogue_model": "nfd_action_accuracy",
    "own_policy": "steady speed",
    "own_town": "sites for landmarks",
    "ppo": "128 steps",
    "rl_co_wizard": "mean return",
    "rl_navigation": "64 steps: success",
    "rl_pictures": "64 steps: mean return",
    "torchrl_ppo": "128 steps: mean reward",
    "trl_grpo": "2 steps: mean reward",
}


def test_every_example_is_run() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("*.py")) == sorted(ARGUMENTS) == sorted(PRINTED)


@pytest.mark.parametrize("name", sorted(ARGUMENTS))
def test_example_is_short_and_documented(name: str) -> None:
    source = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    docstring = ast.get_docstring(ast.parse(source))
    assert docstring is not None
    assert f"python examples/{name}.py" in docstring
    assert re.search(r"takes? about", docstring), "the docstring does not say how long the example takes"
    assert len(source.splitlines()) <= LONGEST.get(name, 80)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(ARGUMENTS))
def test_example_runs(name: str, tmp_path: Path) -> None:
    if name in REQUIRED:
        pytest.importorskip(REQUIRED[name])
    for number, fold in enumerate(("train", "test/seen")):
        write(tmp_path / "corpus" / fold / f"session_{number}", talk())
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "SDL_VIDEODRIVER": "dummy"}
    run = subprocess.run(
        [sys.executable, str(EXAMPLES / f"{name}.py"), *ARGUMENTS[name].split()],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert PRINTED[name] in run.stdout
