"""`train-rl`, killed or interrupted at any moment and started again, leaves the files of an undisturbed run.

Durations differ: "seconds" in `model.json`, `best/model.json` and `progress.jsonl`, and the title of `curve.png`.
`checkpoint.safetensors`, from which a run goes on, holds durations, too.
"""

from __future__ import annotations

import json
import os
import random
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from dorothie_gym.cli.app import app
from tests.forked_commands import start_command

pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")

SHORT = (
    "--environments", "4", "--evaluate-every", "512", "--episodes", "1", "--set", "max_seconds=20",
    "--set", "traffic=none",
)  # fmt: skip


def command(*words: str, out: Path) -> list[str]:
    return ["train-rl", *words, *SHORT, "--out", str(out)]


def finish(words: list[str], folder: Path) -> None:
    process = start_command(words, folder, folder / "errors")
    process.join(240)
    assert process.exitcode == 0, (folder / "errors").read_text()


def interrupt(words: list[str], folder: Path, sent: signal.Signals, when: Callable[[], bool]) -> bool:
    """Starts a command and sends a signal as soon as a condition holds; returns whether that was before its end."""
    process = start_command(words, folder, folder / "errors")
    assert process.pid is not None
    while process.is_alive() and not when():
        time.sleep(0.005)
    if process.is_alive():
        os.kill(process.pid, sent)
    process.join(60)
    errors = (folder / "errors").read_text()
    assert process.exitcode in (0, -sent if sent == signal.SIGKILL else 128 + sent), errors
    assert "Traceback" not in errors, errors
    return process.exitcode != 0


def rows(out: Path) -> int:
    path = out / "progress.jsonl"
    return path.read_text(encoding="utf-8").count("\n") if path.exists() else 0


def another_row(out: Path) -> Callable[[], bool]:
    """Returns whether a run has written a row since this call: a signal then reaches it in the middle."""
    before = rows(out)
    return lambda: rows(out) > before


def results(out: Path) -> dict[str, object]:
    """Returns the content of all result files of a run by name, without durations."""
    found: dict[str, object] = {}
    for path in sorted(out.rglob("*")):
        name = str(path.relative_to(out))
        if path.suffix == ".safetensors" and path.name != "checkpoint.safetensors":
            found[name] = path.read_bytes()
        elif path.suffix == ".json":
            found[name] = {**json.loads(path.read_text(encoding="utf-8")), "seconds": 0}
        elif path.suffix == ".jsonl":
            lines = path.read_text(encoding="utf-8").splitlines()
            found[name] = [{**json.loads(line), "seconds": 0} for line in lines]
        elif path.is_file() and path.suffix not in (".safetensors", ".png"):
            assert "tensorboard" in name, f"{name} was left behind"
    return found


@pytest.mark.long
def test_killed_and_interrupted_training_ends_as_an_undisturbed_one(tmp_path: Path) -> None:
    training = ("a2c", "--steps", "3584", "--workers", "0")  # its rollouts are the shortest
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    finish(command(*training, out=whole), tmp_path)
    words = command(*training, out=cut)
    seen = [
        interrupt(words, tmp_path, signal.SIGKILL, lambda: rows(cut) >= 2),
        interrupt(words, tmp_path, signal.SIGTERM, another_row(cut)),
    ]
    other = CliRunner().invoke(app, [*words, "--seed", "1"])
    assert other.exit_code == 2 and "another seed" in other.stderr and other.stderr.count("\n") == 1
    seen.append(interrupt(words, tmp_path, signal.SIGINT, another_row(cut)))
    assert all(seen)  # each in the middle
    finish(words, tmp_path)
    assert results(cut) == results(whole)
    assert rows(cut) == 7


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "training",
    [
        ("ppo", "--workers", "2"),
        ("maskable_ppo", "--workers", "0"),
        ("a2c", "--workers", "0"),
        ("dqn", "--workers", "2"),
        ("sac", "--env", "dorothie_gym/Navigation-continuous-v0", "--workers", "0"),
        ("maskable_ppo", "--env", "dorothie_gym/AdWizard-v0", "--workers", "2"),
    ],
)
def test_training_killed_at_random_moments_ends_as_an_undisturbed_one(
    training: tuple[str, ...], tmp_path: Path
) -> None:
    rng, whole, cut = random.Random(7), tmp_path / "whole", tmp_path / "cut"
    training = (*training, "--steps", "12000")
    since = time.monotonic()
    finish(command(*training, out=whole), tmp_path)
    longest = time.monotonic() - since
    words = command(*training, out=cut)
    for sent in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGKILL, signal.SIGKILL):
        moment = time.monotonic() + rng.uniform(3.0, longest / 2)
        interrupt(words, tmp_path, sent, lambda moment=moment: time.monotonic() > moment)  # type: ignore[misc]
    finish(words, tmp_path)
    assert results(cut) == results(whole)
