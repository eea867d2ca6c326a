"""Commands with a damaged cache folder, in processes of their own: damaged machine code would end this one."""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from dorothie_gym.support.compilation import compiled_folder
from dorothie_gym.support.user_cache import KEY_FILE, read_signed
from tests.support.cache_damage import DAMAGES, damage_some, files_in

ROOT = Path(__file__).parents[2]

WARM_UP = [sys.executable, "-m", "dorothie_gym", "warm-up", "--json"]

LOOK_UP = """
import numpy as np
from dorothie_gym.maps import load_town
from dorothie_gym.maps.routing import router
from dorothie_gym.sim.network.network import TownNetwork
town = load_town("brookside")
print(np.nansum(router(town).costs_to((0, 0.0))), TownNetwork(town).lane_of(0).local_coordinates(np.zeros(2)))
"""
"""Program that reads a town from the cache, and runs compiled functions that are compiled in a second."""

OTHERS = """
from dataclasses import replace
from pathlib import Path
import pocketsphinx
from dorothie_gym.baselines.encoders import HashingEncoder, text_table
from dorothie_gym.baselines.vision.frames import FrameSampling, load_frames
from dorothie_gym.evaluation.teacher_forced.features import build
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.archive import Corpus
from dorothie_gym.evaluation.rollout import default_corpus
from dorothie_gym.speech import language, sphinx_recognizer
from dorothie_gym.support.user_cache import cache_folder
language.transcripts = lambda: (("turn left", "then stop"), ("okay",))
language.grammar_sentences = lambda: ("go to the KFC",)
folder = default_corpus(sessions=2, seed=3, config=EnvConfig(max_seconds=12.0))
columns = build(folder)
vectors = text_table(HashingEncoder(dim=16), columns.texts, cache_folder() / "texts")
frames = load_frames(Corpus.load(folder), FrameSampling(width=64, height=32, most=2))
dictionary = Path(pocketsphinx.get_model_path()) / "en-us" / "cmudict-en-us.dict"
spoken = language.load_language(dictionary, sphinx_recognizer._phonemes)
print(columns.content, vectors.sum(), [found.pixel_counts.sum() for found in frames.values()], len(spoken.arpa))
"""
"""Program that uses all other kinds of entries: corpus, features, vectors of texts, pictures, spoken language."""

OUTPUT = "output"
"""File with the output of that program."""


def environment(cache: Path) -> dict[str, str]:
    """Returns the environment of a process with a cache folder, machine code included."""
    inherited = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    return {**inherited, "DOROTHIE_GYM_CACHE": str(cache), "PYTHONPATH": str(ROOT)}


def run(cache: Path, command: Sequence[str]) -> tuple[str, str]:
    """Runs a command with a cache folder; returns its output and what it says about damage."""
    ran = subprocess.run(command, env=environment(cache), capture_output=True, text=True, check=False, timeout=900)
    assert ran.returncode == 0, ran.stderr[-2000:]
    lines = ran.stderr.splitlines()
    assert all("is damaged (" in line for line in lines), ran.stderr[-2000:]
    assert len(lines) <= 1, "once in a process"
    return ran.stdout, ran.stderr


def warmed(folder: Path, command: Sequence[str]) -> Path:
    """Returns a cache folder with all that a command needs, and nothing else; machine code is that of this run."""
    found = compiled_folder()
    if found is not None and found.is_dir():
        shutil.copytree(found, folder / "compiled")
    folder.mkdir(mode=0o700, exist_ok=True)
    run(folder, command)
    for path in files_in(folder):
        os.utime(path, (0.0, 0.0))
    run(folder, command)
    for path in files_in(folder / "compiled"):
        if path.stat().st_mtime == 0.0 and path.name != KEY_FILE:
            path.unlink()
    return folder


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_command_makes_again_what_is_damaged(tmp_path: Path) -> None:
    command = [sys.executable, "-c", LOOK_UP]
    cache = warmed(tmp_path / "cache", command)
    expected = run(cache, command)[0]
    machine_code = [path for path in files_in(cache / "compiled") if path.name != KEY_FILE]
    assert len(machine_code) >= 4
    for shift in range(0, len(DAMAGES), 5):
        for number, path in enumerate(machine_code):
            DAMAGES[sorted(DAMAGES)[(number + shift) % len(DAMAGES)]](path, random.Random(number))
        (town,) = (cache / "towns").iterdir()
        DAMAGES["flipped bits"](town, random.Random(shift))
        output, said = run(cache, command)
        assert output == expected and said.count("\n") == 1
        assert run(cache, command) == (expected, ""), "all is whole again"


@pytest.fixture(scope="module")
def warm_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cache folder with all that `warm-up` makes."""
    return warmed(tmp_path_factory.mktemp("warm") / "cache", WARM_UP)


@pytest.fixture(scope="module")
def filled_cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cache folder with all other kinds of entries."""
    pytest.importorskip("torch")
    pytest.importorskip("pocketsphinx")
    command = [sys.executable, "-c", OTHERS]
    cache = warmed(tmp_path_factory.mktemp("filled") / "cache", command)
    (cache / OUTPUT).write_text(run(cache, command)[0])
    return cache


@pytest.fixture
def work() -> Iterator[Path]:
    """Folder that is removed at once: two hundred copies of a cache take gigabytes."""
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("seed", range(200))
def test_no_damage_ends_a_command(warm_cache: Path, work: Path, seed: int) -> None:
    cache = shutil.copytree(warm_cache, work / "cache")
    done = damage_some(cache, seed)
    assert json.loads(run(cache, WARM_UP)[0])["folder"] == str(cache / "compiled"), done
    for path in files_in(warm_cache):
        again = cache / path.relative_to(warm_cache)
        keys = cache / "compiled" if again.parent.name == "compiled" else cache
        assert again.name == KEY_FILE or read_signed(again, keys) is not None, (again, done)


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
@pytest.mark.parametrize("seed", range(40))
def test_no_damage_changes_what_is_kept(filled_cache: Path, work: Path, seed: int) -> None:
    command, expected = [sys.executable, "-c", OTHERS], (filled_cache / OUTPUT).read_text()
    cache = shutil.copytree(filled_cache, work / "cache")
    done = damage_some(cache, seed, without=("compiled", "assets", "scenes", OUTPUT))
    assert run(cache, command)[0] == expected, done
    assert run(cache, command) == (expected, ""), done
