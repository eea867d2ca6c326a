"""Digests of what the package computes, one for each kind of session; `python -m tests.portability.digests`."""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from dorothie_gym import make_policy
from dorothie_gym.engine.camera_config import CameraConfig
from dorothie_gym.engine.config import ChannelKind, EnvConfig, PerceptionModel
from dorothie_gym.engine.session_engine import SessionEngine
from dorothie_gym.envs.duo_wizard_vector_env import DuoWizardVectorEnv
from dorothie_gym.maps import Town, load_town, town_names
from dorothie_gym.ontology import AGENT_ROLES, Role
from dorothie_gym.policies.pretrained import pretrained_card, pretrained_names
from dorothie_gym.recording import Corpus
from dorothie_gym.recording.file_names import AUDIO_FOLDER
from dorothie_gym.rollout import play_session
from dorothie_gym.rollout.role_episodes import role_episodes
from tests.console.people import Table
from tests.maps.opendrive_text import MAPS
from tests.portability.curved_map import curved_map

SEED = 7
KINDS: dict[str, Callable[[], Iterable[object]]] = {}


def kind(function: Callable[[], Iterable[object]]) -> Callable[[], Iterable[object]]:
    KINDS[function.__name__] = function
    return function


def digest(parts: Iterable[object]) -> str:
    found = hashlib.sha256()
    for part in parts:
        _add(found, part)
    return found.hexdigest()


def _add(found: Any, part: object) -> None:
    """Adds a value with its structure; numbers count by their bits."""
    if isinstance(part, Mapping):
        for name, value in part.items():
            found.update(str(name).encode())
            _add(found, value)
    elif isinstance(part, np.ndarray | np.generic):
        array = np.asarray(part)
        if array.dtype == object:
            _add(found, array.tolist())
        else:
            found.update(f"{array.dtype} {array.shape}".encode() + array.tobytes())
    elif isinstance(part, list | tuple):
        for value in part:
            _add(found, value)
    elif isinstance(part, float):
        found.update(part.hex().encode())
    elif isinstance(part, bytes):
        found.update(part)
    else:
        found.update(repr(part).encode())


def play(
    town: Town | str, *, seconds: float, folder: Path, models: Mapping[Role, str] | None = None, **options: Any
) -> Iterator[bytes]:
    engine = SessionEngine(town, config=EnvConfig(max_seconds=seconds, **options))
    chosen = models or {}
    policies = {role: make_policy(chosen.get(role, "scripted"), role, engine.limits) for role in AGENT_ROLES}
    play_session(engine, policies, seed=SEED, folder=folder)
    yield from files(folder)


def files(folder: Path) -> Iterator[bytes]:
    for file in sorted(folder.rglob("*")):
        if file.is_file():
            yield str(file.relative_to(folder)).encode()
            yield file.read_bytes()


@kind
def towns() -> Iterator[object]:
    for name in town_names():
        yield from town_arrays(load_town(name))


def town_arrays(town: Town) -> Iterator[object]:
    for lane in town.lanes:
        yield from (lane.points, lane.widths, lane.stations, lane.headings)
    yield [(signal.position, signal.kind) for signal in town.signals]
    yield [(site.position, site.waypoint) for site in town.sites]


@kind
def imported_map() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "curved.xodr"
        path.write_text(curved_map())
        yield from town_arrays(load_town(path))
    if (MAPS / "Town02.xodr").exists():  # a town in which sessions can be played
        with tempfile.TemporaryDirectory() as folder:
            yield from play(load_town(MAPS / "Town02.xodr"), seconds=40.0, folder=Path(folder) / "session")


@kind
def text() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        for name in town_names():
            yield from play(name, seconds=60.0, folder=Path(folder) / name)


@kind
def word_errors() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        yield from play("brookside", seconds=60.0, folder=Path(folder) / "session", word_error_rate=0.2)


@kind
def speech() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        session = Path(folder) / "session"
        list(play("brookside", seconds=40.0, folder=session, channel=ChannelKind.SPEECH))
        # The samples come from the synthesiser's own float32 functions; what is heard of them, and when, is compared.
        shutil.rmtree(session / AUDIO_FOLDER)
        yield from files(session)


@kind
def camera_perception() -> Iterator[object]:
    camera = CameraConfig(width=96, height=64)
    with tempfile.TemporaryDirectory() as folder:
        yield from play(
            "brookside", seconds=30.0, folder=Path(folder) / "session", perception=PerceptionModel.CAMERA, camera=camera
        )
    env = gym.make("dorothie_gym/CoWizard-v0", town="brookside", config=EnvConfig(camera=camera))
    observation, _ = env.reset(seed=SEED)
    yield observation["camera"]
    env.close()


@kind
def console() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        table = Table("participant=human,co_wizard=scripted", folder=Path(folder), max_seconds=30.0)
        participant = table.seat("participant")
        table.run(1.0)
        participant.command("say", text="Hello. Turn left at the next junction.")
        table.run(40.0)
        assert table.room.record is not None
        yield from files(table.room.record.folder)


@kind
def vector_environments() -> Iterator[object]:
    for name in ("Navigation-v0", "Navigation-continuous-v0", "Town-v0"):
        batch = gym.make_vec(
            f"dorothie_gym/{name}", num_envs=4, vectorization_mode="vector_entry_point", town="midtown"
        )
        batch.action_space.seed(SEED)
        yield batch.reset(seed=SEED)[0]
        for _ in range(40):
            yield batch.step(batch.action_space.sample())[:3]
        batch.close()
    town = gym.make("dorothie_gym/Town-v0", town="midtown")
    town.action_space.seed(SEED)
    yield town.reset(seed=SEED)[0]
    for _ in range(40):
        yield town.step(town.action_space.sample())[:2]
    town.close()
    sessions = DuoWizardVectorEnv(2, "brookside")
    observations, _ = sessions.reset(seed=SEED)
    yield observations
    sessions.close()


@kind
def role_exports() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        list(play("brookside", seconds=20.0, folder=Path(folder) / "session"))
        for role in AGENT_ROLES:
            for episode in role_episodes(Corpus.load(folder).entries, role):
                yield from (episode.observations, episode.actions, episode.rewards)


@kind
def shipped_models() -> Iterator[object]:
    with tempfile.TemporaryDirectory() as folder:
        for name in pretrained_names():
            place, role = Path(folder) / name.replace(":", "_"), Role(pretrained_card(name).role)
            list(play("brookside", seconds=30.0, folder=place, models={role: name}))
            yield from (name, (place / "actions.jsonl").read_bytes())


def main() -> None:
    chosen = sys.argv[1:] or list(KINDS)
    found = {}
    for name in chosen:
        start = time.perf_counter()
        found[name] = digest(KINDS[name]())
        print(f"{name}: {time.perf_counter() - start:.1f} s", file=sys.stderr)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
