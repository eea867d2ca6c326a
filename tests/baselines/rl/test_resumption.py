"""A run that is interrupted at any step and started again ends as an undisturbed one, to the bit."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, SupportsFloat

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra 'baselines'")
pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")

from stable_baselines3.common.vec_env import VecMonitor

from dorothie_gym.baselines.rl import ALGORITHMS, Training, TrainingSettings
from dorothie_gym.baselines.rl import training as training_module
from dorothie_gym.baselines.rl.resumption import CHECKPOINT
from dorothie_gym.errors import ModelFileError, SettingsError
from tests.baselines.rl.test_training import settings_for

POLE: dict[str, Any] = {"env": "CartPole-v1", "env_settings": {}, "evaluate_every": 128, "steps": 512, "episodes": 2}


@pytest.fixture(autouse=True)
def _frequent_checkpoints(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training_module, "CHECKPOINT_SHARE", 1e9)


def interrupt_after(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the step of a vector environment after a number of them raise `KeyboardInterrupt`."""
    step, left = VecMonitor.step_wait, iter(range(steps))

    def interrupted(self: VecMonitor) -> Any:
        if next(left, None) is None:
            raise KeyboardInterrupt
        return step(self)

    monkeypatch.setattr(VecMonitor, "step_wait", interrupted)


def train_with_interruptions(
    settings: TrainingSettings, folder: Path, steps: Iterator[int], monkeypatch: pytest.MonkeyPatch
) -> list[int]:
    """Trains and interrupts after these numbers of steps; returns the steps at which the run was resumed."""
    resumed = []
    for count in steps:
        with monkeypatch.context() as patched:
            interrupt_after(count, patched)
            run = Training(settings, folder).run()
        if run.finished:
            return resumed
        resumed.append(run.steps)
    assert Training(settings, folder).run().finished
    return resumed


def assert_same_run(one: Path, two: Path) -> None:
    """Compares all that a run leaves, except durations ("seconds", and in the title of the curve)."""
    for name in ("model.safetensors", "best/model.safetensors"):
        assert (one / name).read_bytes() == (two / name).read_bytes(), name
    for name in ("model.json", "best/model.json", "progress.jsonl"):
        mine, theirs = (
            [{**json.loads(line), "seconds": 0} for line in _objects(folder / name)] for folder in (one, two)
        )
        assert mine == theirs, name


def _objects(path: Path) -> list[str]:
    text = path.read_text(encoding="utf-8")
    return text.splitlines() if path.suffix == ".jsonl" else [text]


@pytest.mark.long
@pytest.mark.parametrize("algorithm", sorted(ALGORITHMS))
def test_interrupted_run_ends_as_an_undisturbed_one(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_for(algorithm, steps=256, evaluate_every=128)
    Training(settings, tmp_path / "whole").run()
    resumed = train_with_interruptions(settings, tmp_path / "cut", iter([5, 45, 30]), monkeypatch)
    assert len(resumed) == 3 and 0 < resumed[1] < resumed[2]
    assert_same_run(tmp_path / "whole", tmp_path / "cut")


def test_episodes_of_any_gymnasium_environment_are_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_for("ppo", **POLE)
    Training(settings, tmp_path / "whole").run()
    train_with_interruptions(settings, tmp_path / "cut", iter([100, 1, 30, 70]), monkeypatch)
    assert_same_run(tmp_path / "whole", tmp_path / "cut")


@pytest.mark.long
def test_run_with_worker_processes_is_resumed_in_this_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_for("ppo", **POLE)
    Training(settings, tmp_path / "whole").run()
    train_with_interruptions(replace(settings, workers=1), tmp_path / "cut", iter([70]), monkeypatch)
    Training(settings, tmp_path / "cut").run()
    for name in ("model.safetensors", "best/model.safetensors"):  # the descriptions name the number of workers
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "cut" / name).read_bytes()


def test_failure_while_a_checkpoint_is_written_leaves_the_one_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = settings_for("ppo", **POLE)
    Training(settings, tmp_path / "whole").run()
    with monkeypatch.context() as patched:
        patched.setattr("dorothie_gym.support.files.os.replace", _failing_from(9))
        with pytest.raises(OSError, match="No space left"):
            Training(settings, tmp_path / "cut").run()
    Training(settings, tmp_path / "cut").run()
    assert_same_run(tmp_path / "whole", tmp_path / "cut")


def _failing_from(number: int) -> Any:
    import os

    replace_file, calls = os.replace, iter(range(number))

    def failing(one: Any, two: Any) -> None:
        if next(calls, None) is None:
            raise OSError(28, "No space left on device")
        replace_file(one, two)

    return failing


class Forgetful(gym.Env[np.ndarray, np.int64]):
    """Environment whose observations depend on more than its seed."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), dtype=np.float32)
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[np.ndarray, dict[str, Any]]:
        super().reset(seed=seed)
        return np.random.default_rng().random(2, dtype=np.float32), {}

    def step(self, action: np.int64) -> tuple[np.ndarray, SupportsFloat, bool, bool, dict[str, Any]]:
        return np.random.default_rng().random(2, dtype=np.float32), 0.0, bool(action), False, {}


def test_environment_that_cannot_be_repeated_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if "Forgetful-v0" not in gym.registry:
        gym.register("Forgetful-v0", Forgetful)
    settings = settings_for("ppo", **{**POLE, "env": "Forgetful-v0"})
    with monkeypatch.context() as patched:
        interrupt_after(40, patched)
        assert not Training(settings, tmp_path).run().finished
    with pytest.raises(ModelFileError, match=r"checkpoint\.safetensors.*do not repeat"):
        Training(settings, tmp_path)


def test_changed_setting_damaged_and_missing_checkpoint_are_refused(tmp_path: Path) -> None:
    settings = settings_for("ppo", **POLE)
    Training(settings, tmp_path).run()
    for changed, named in (
        ({"seed": 1}, "seed"),
        ({"network": (9,)}, "network"),
        ({"environments": 1}, "environments"),
    ):
        with pytest.raises(SettingsError, match=f"another {named}"):
            Training(replace(settings, **changed), tmp_path)
    content = (tmp_path / CHECKPOINT).read_bytes()
    (tmp_path / CHECKPOINT).write_bytes(content[:-100])
    with pytest.raises(ModelFileError, match=r"checkpoint\.safetensors: cannot be read"):
        Training(settings, tmp_path)
    (tmp_path / CHECKPOINT).unlink()
    with pytest.raises(ModelFileError, match=r"has no checkpoint\.safetensors"):
        Training(settings, tmp_path)


def test_tensorboard_shows_each_record_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    numbers = itertools.count(1000)  # files of one second are read in the order of their names
    writer = "tensorboard.summary.writer.event_file_writer._global_uid"
    monkeypatch.setattr(writer, SimpleNamespace(getnext=lambda: next(numbers)))
    monkeypatch.setattr(training_module, "LOGGED_STEPS", 64)
    settings = settings_for("ppo", **POLE)
    Training(settings, tmp_path / "whole").run()
    train_with_interruptions(settings, tmp_path / "cut", iter([20, 55, 60]), monkeypatch)
    found = []
    for run in ("whole", "cut"):
        events = accumulator.EventAccumulator(str(tmp_path / run / "tensorboard" / "ppo"))
        events.Reload()
        tags = [tag for tag in events.Tags()["scalars"] if not tag.startswith("time/")]
        found.append({tag: [(event.step, event.value) for event in events.Scalars(tag)] for tag in tags})
    assert repr(found[0]) == repr(found[1])  # some values are NaN
