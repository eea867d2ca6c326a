"""The examples of docs/integrations.md run as written, where the library is installed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from dorothie_gym.archive import Corpus
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.evaluation.rollout.minari_export import MINARI_FOLDER, export_minari
from dorothie_gym.evaluation.rollout.role_episodes import role_episodes
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine

PAGE = Path(__file__).parents[2] / "docs" / "integrations.md"
LIBRARIES = {
    "SuperSuit": "supersuit",
    "RLlib": "ray.rllib",
    "TorchRL": "torchrl",
    "BenchMARL": "benchmarl",
    "skrl": "skrl",
    "Tianshou": "tianshou",
}
READERS = {"Minari in TorchRL": "torchrl", "d3rlpy": "d3rlpy"}


def example(section: str) -> str:
    """The first Python example under a heading; of the page's beginning where the heading is empty."""
    text = PAGE.read_text(encoding="utf-8")
    part = text.split(f"\n## {section}\n", 1)[1] if section else text
    found = re.search(r"```python\n(.*?)```", part, flags=re.DOTALL)
    assert found is not None
    return found.group(1)


def run(code: str, folder: Path) -> str:
    """Runs code in a process of its own: these libraries start threads and processes, and warn a lot."""
    file = folder / "example.py"
    file.write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, str(file)],
        capture_output=True,
        text=True,
        timeout=280,
        check=False,
        cwd=folder,
        env={**os.environ, MINARI_FOLDER: str(folder / "datasets")},
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("corpus")
    engine = SessionEngine("brookside", config=EnvConfig(max_seconds=30.0))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    for seed in (3, 4, 5):
        play_session(engine, policies, seed=seed, folder=root / f"seed_{seed}")
    return root


def exported(corpus: Path, folder: Path) -> None:
    """Writes the dataset of the examples; its vectors have the physical action only."""
    episodes = role_episodes(Corpus.load(corpus).entries, Role.CO_WIZARD)
    export_minari(episodes, Role.CO_WIZARD, folder / "datasets", fields=["physical"])


def skip_without(*libraries: str) -> None:
    for library in libraries:
        pytest.importorskip(library, reason=f"needs {library}: see docs/integrations.md", exc_type=ImportError)


@pytest.mark.long
def test_the_first_example_runs(tmp_path: Path) -> None:
    assert run(example(""), tmp_path).splitlines()[0] == "True"


@pytest.mark.long
def test_the_example_of_a_mask_for_town_runs_which_is_refused_without_it(tmp_path: Path) -> None:
    pytest.importorskip("sb3_contrib", reason="needs the extra 'baselines'")
    code = example("sb3-contrib")
    run(code, tmp_path)
    bare = code.replace("ActionMasker(gym.make", "(gym.make").replace(", effective)", ")")
    assert bare != code
    with pytest.raises(AssertionError, match="Environment does not support action masking"):
        run(bare, tmp_path)


@pytest.mark.integrations
@pytest.mark.parametrize("library", LIBRARIES)
def test_the_library_runs_its_example(library: str, tmp_path: Path) -> None:
    skip_without(LIBRARIES[library].split(".")[0])
    run(example(library), tmp_path)


# --- Datasets ---------------------------------------------------------------------------------------------------------


@pytest.mark.integrations
def test_minari_runs_its_example(tmp_path: Path) -> None:
    skip_without("minari", "jax", "h5py")
    (tmp_path / "datasets").mkdir()
    assert run(example("Minari"), tmp_path).startswith("40 ")


@pytest.mark.integrations
@pytest.mark.parametrize("section", READERS)
def test_readers_of_minari_run_their_examples(section: str, corpus: Path, tmp_path: Path) -> None:
    skip_without("minari", "h5py", READERS[section])
    exported(corpus, tmp_path)
    run(example(section), tmp_path)


RECORD = """
import gymnasium as gym
import minari
import numpy as np
import dorothie_gym
from dorothie_gym import EnvConfig

settings = {settings}
env = minari.DataCollector(gym.make("dorothie_gym/{name}", **settings), record_infos=True)
infos = []
for seed in range(2):
    infos.append(env.reset(seed=seed)[1])
    over = False
    while not over:
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        infos.append(info)
        over = terminated or truncated
dataset = env.create_dataset("test/recorded-v0")
kept = [episode.infos for episode in dataset.iterate_episodes()]
again = dataset.recover_environment()
assert (again.observation_space, again.action_space) == (env.observation_space, env.action_space)
again.reset(seed=0)
again.step(again.action_space.sample())
if "reward_terms" in infos[0]:
    for name in infos[0]["reward_terms"]:
        read = np.concatenate([each["reward_terms"][name] for each in kept])
        np.testing.assert_array_equal(read, [info["reward_terms"][name] for info in infos])
if "refused" in infos[0]:
    for kind in infos[0]["refused"]:
        read = np.concatenate([each["refused"][kind] for each in kept])
        np.testing.assert_array_equal(read, [info["refused"][kind] for info in infos])
env.close()
"""

SETTINGS = {
    "Participant-v0": "dict(config=EnvConfig(max_seconds=8.0, observe_acts=False))",
    "CoWizard-v0": "dict(config=EnvConfig(max_seconds=8.0))",
    "AdWizard-v0": "dict(config=EnvConfig(max_seconds=8.0))",
    "Navigation-v0": 'dict(max_seconds=8.0, reward=dorothie_gym.NavigationWeights(), guidance="goals")',
    "Navigation-continuous-v0": "dict(max_seconds=8.0)",
    "Town-v0": 'dict(config={"duration": 5})',
    "UfN-v0": 'dict(corpus="{corpus}", limits=dorothie_gym.SpaceLimits(objects=8))',
    "RfN-v0": 'dict(corpus="{corpus}")',
    "NfD-v0": 'dict(corpus="{corpus}")',
}


@pytest.mark.integrations
@pytest.mark.parametrize("name", SETTINGS)
def test_minari_records_every_id_with_its_infos(name: str, corpus: Path, tmp_path: Path) -> None:
    skip_without("minari", "jax", "h5py")
    (tmp_path / "datasets").mkdir()
    settings = SETTINGS[name].replace("{corpus}", str(corpus))
    run(RECORD.replace("{name}", name).replace("{settings}", settings), tmp_path)


REPLAY = """
import numpy as np
from torchrl.data.datasets.minari_data import MinariExperienceReplay
import minari

NAME = "dorothie-gym/co-wizard-v0"
data = MinariExperienceReplay(NAME, batch_size=4, load_from_local_minari=True, download=False, root="replay")
episodes = list(minari.load_dataset(NAME).iterate_episodes())
for name, rows in (
    ("observation", [episode.observations[:-1] for episode in episodes]),
    (("next", "observation"), [episode.observations[1:] for episode in episodes]),
    ("action", [episode.actions for episode in episodes]),
    (("info", "action_mask"), [episode.infos["action_mask"][:-1] for episode in episodes]),
):
    np.testing.assert_array_equal(data[:][name].numpy(), np.concatenate(rows))
assert len(data) == sum(len(episode.actions) for episode in episodes)
"""


@pytest.mark.integrations
def test_torchrl_reads_what_is_exported(corpus: Path, tmp_path: Path) -> None:
    skip_without("minari", "h5py", "torchrl")
    if not version("torchrl").startswith("0.10."):
        pytest.skip("TorchRL 0.11.0 to 0.14.1 return zeros for every Minari dataset")
    exported(corpus, tmp_path)
    run(REPLAY, tmp_path)


D3RLPY = """
import numpy as np
import minari
from d3rlpy.datasets import get_minari

data, env = get_minari("dorothie-gym/co-wizard-v0")
episodes = list(minari.load_dataset("dorothie-gym/co-wizard-v0").iterate_episodes())
assert data.size() == len(episodes)
first = data.episodes[0]
np.testing.assert_array_equal(first.observations, episodes[0].observations[:-1])
np.testing.assert_array_equal(first.actions, episodes[0].actions)
"""


@pytest.mark.integrations
def test_d3rlpy_reads_what_is_exported(corpus: Path, tmp_path: Path) -> None:
    skip_without("minari", "h5py", "d3rlpy")
    exported(corpus, tmp_path)
    run(D3RLPY, tmp_path)
