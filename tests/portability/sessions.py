"""Parts that are towns, sessions and environments."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from dorothie_gym import make_policy
from dorothie_gym.archive import Corpus, first_difference
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv
from dorothie_gym.evaluation.rollout import play_session, resimulate
from dorothie_gym.evaluation.rollout.role_episodes import role_episodes
from dorothie_gym.maps import Town, load_town, town_names
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies.pretrained import pretrained_card, pretrained_names
from dorothie_gym.session.config import CameraConfig, ChannelKind, EnvConfig, PerceptionModel
from dorothie_gym.session.recording import Session
from dorothie_gym.session.recording.files import AUDIO_FOLDER
from dorothie_gym.session.session_engine import SessionEngine
from tests.lab.console.people import Table
from tests.maps.opendrive_text import MAPS
from tests.maps.yaml_text import MIDTOWN, written
from tests.portability.curved_map import curved_map
from tests.portability.parts import Values, group, session_values

SEED = 7

SESSIONS: dict[str, dict[str, Any]] = {
    "text": {"seconds": 120.0},
    "word-errors": {"seconds": 60.0, "word_error_rate": 0.2},
    "speech": {"seconds": 30.0, "channel": ChannelKind.SPEECH},
    "camera": {
        "seconds": 15.0,
        "perception": PerceptionModel.CAMERA,
        "camera": CameraConfig(width=96, height=64),
    },
}
"""Kinds of sessions and their settings."""

COUNTS = {"text": 5, "word-errors": 3, "speech": 2, "camera": 2}
"""Number of sessions of each kind in each town."""

MORE_SITES = "".join(f"  - [{x}, {y}]\n" for x in (50, 75, 125, 150) for y in (14, 188))
"""Places that a town file needs for an errand, besides its own."""

NAVIGATION = ("Navigation-v0", "Navigation-continuous-v0")


@contextmanager
def new_folder() -> Iterator[Path]:
    """A folder that does not exist yet, and is removed afterwards."""
    with tempfile.TemporaryDirectory() as parent:
        yield Path(parent) / "session"


def play(
    town: Town | str,
    *,
    seconds: float,
    seed: int = SEED,
    models: Mapping[Role, str] | None = None,
    folder: Path,
    **options: Any,
) -> None:
    engine = SessionEngine(town, config=EnvConfig(max_seconds=seconds, **options))
    chosen = models or {}
    policies = {role: make_policy(chosen.get(role, "scripted"), role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=seed, folder=folder)
    if (folder / AUDIO_FOLDER).exists():
        # The samples come from the synthesiser's own float32 functions; what is heard of them, and when, is compared.
        shutil.rmtree(folder / AUDIO_FOLDER)


# --- Towns ------------------------------------------------------------------------------------------------------------


def town_values(town: Town) -> Values:
    for lane in town.lanes:
        yield "lanes", (lane.points, lane.widths, lane.stations, lane.headings)
    yield "signals", [(signal.position, signal.kind) for signal in town.signals]
    yield "sites", [(site.position, site.waypoint) for site in town.sites]


@group(*town_names())
def towns(name: str) -> Values:
    yield from town_values(load_town(name))


@group("curved.xodr", "midtown.yaml")
def imported_maps(name: str) -> Values:
    with tempfile.TemporaryDirectory() as folder:
        if name == "midtown.yaml":
            town = load_town(written(Path(folder), MIDTOWN + MORE_SITES))
            play(town, seconds=60.0, folder=Path(folder) / "session")
            yield from session_values(Path(folder) / "session")
        else:
            path = Path(folder) / name
            path.write_text(curved_map())
            town = load_town(path)
    yield from town_values(town)


@group("Town01", "Town02")
def shared_maps(name: str) -> Values:
    """Maps of CARLA, which are not in the repository: their parts are left out where they are missing."""
    town = load_town(MAPS / f"{name}.xodr")
    yield from town_values(town)
    with new_folder() as folder:
        play(town, seconds=40.0, folder=folder)
        yield from session_values(folder)


def missing(part: str) -> bool:
    """Whether a part needs a map that is not here."""
    key, name = part.split("/", 1)
    return key == "shared_maps" and not (MAPS / f"{name}.xodr").exists()


# --- Sessions ---------------------------------------------------------------------------------------------------------


@group(*(f"{town} {kind} {k}" for town in town_names() for kind, count in COUNTS.items() for k in range(count)))
def sessions(name: str) -> Values:
    town, kind, number = name.split()
    with new_folder() as folder:
        play(town, seed=SEED + int(number), folder=folder, **SESSIONS[kind])
        yield from session_values(folder)


@group("brookside")
def console(name: str) -> Values:
    """A session with a person at a seat, played again from its record."""
    with tempfile.TemporaryDirectory() as parent:
        table = Table("participant=human,co_wizard=scripted", folder=Path(parent), max_seconds=30.0)
        participant = table.seat("participant")
        table.run(1.0)
        participant.command("say", text="Hello. Turn left at the next junction.")
        table.run(40.0)
        assert table.room.record is not None
        yield from session_values(table.room.record.folder)
        yield "said", participant.said()
        session = Session.load(table.room.record.folder)
        difference = first_difference(session, resimulate(session, load_town(name)))
        assert difference is None, f"the replay of the console session differs: {difference}"


@group(*AGENT_ROLES)
def role_exports(role: str) -> Values:
    with tempfile.TemporaryDirectory() as folder:
        play("brookside", seconds=20.0, folder=Path(folder) / "session")
        for episode in role_episodes(Corpus.load(folder).entries, Role(role)):
            yield "observations", episode.observations
            yield "actions", episode.actions
            yield "rewards", episode.rewards


@group(*(f"{name} {k}" for name in pretrained_names() for k in range(5)))
def shipped_models(part: str) -> Values:
    name, number = part.rsplit(" ", 1)
    town = town_names()[int(number) % len(town_names())]
    with new_folder() as folder:
        play(
            town, seconds=30.0, seed=SEED + int(number), models={Role(pretrained_card(name).role): name}, folder=folder
        )
        yield "actions", (folder / "actions.jsonl").read_bytes()


# --- Environments -----------------------------------------------------------------------------------------------------


@group("first picture")
def camera_observation(name: str) -> Values:
    camera = CameraConfig(width=96, height=64)
    env = gym.make("dorothie_gym/CoWizard-v0", town="brookside", config=EnvConfig(camera=camera))
    observation, _ = env.reset(seed=SEED)
    yield "camera", observation["camera"]
    env.close()


@group(*NAVIGATION)
def navigation_episodes(name: str) -> Values:
    """64 episodes side by side in all towns, with feasible random actions, until each has ended once."""
    batch: Any = gym.make_vec(
        f"dorothie_gym/{name}",
        num_envs=64,
        vectorization_mode="vector_entry_point",
        town=town_names(),
        max_seconds=45.0,
        traffic="heavy",
        exceptions=2.0,
        patience=20.0,
    )
    rng = np.random.default_rng(SEED)
    observations, infos = batch.reset(seed=SEED)
    yield "observations", observations
    ended = np.zeros(64, bool)
    while not ended.all():
        observations, rewards, terminated, truncated, infos = batch.step(_actions(rng, infos))
        ended |= terminated | truncated
        yield "observations", observations
        yield "rewards", rewards
        yield "ends", (terminated, truncated)
        yield "infos", dict(sorted(infos.items()))
    batch.close()


def _actions(rng: np.random.Generator, infos: Mapping[str, Any]) -> Any:
    if "action_mask" in infos:
        return np.array([rng.choice(np.flatnonzero(mask)) for mask in infos["action_mask"]])
    return np.stack([rng.uniform(0.2, 0.8, 64), rng.uniform(-0.1, 0.1, 64), np.zeros(64)], axis=1, dtype=np.float32)


@group(*NAVIGATION)
def batches(name: str) -> Values:
    batch = gym.make_vec(f"dorothie_gym/{name}", num_envs=4, vectorization_mode="vector_entry_point", town="midtown")
    batch.action_space.seed(SEED)
    yield "observations", batch.reset(seed=SEED)[0]
    for _ in range(40):
        observations, rewards, ends, *_ = batch.step(batch.action_space.sample())
        yield "observations", observations
        yield "rewards", rewards
        yield "ends", ends
    batch.close()


@group("Town-v0", "DuoWizardVectorEnv")
def environments(name: str) -> Values:
    if name == "Town-v0":
        town = gym.make(f"dorothie_gym/{name}", town="midtown")
        town.action_space.seed(SEED)
        yield "observations", town.reset(seed=SEED)[0]
        for _ in range(40):
            observation, reward, *_ = town.step(town.action_space.sample())
            yield "observations", observation
            yield "rewards", reward
        town.close()
    else:
        duo = DuoWizardVectorEnv(2, "brookside")
        yield "observations", duo.reset(seed=SEED)[0]
        duo.close()
