"""Check of an installation: whether the package plays, repeats, records, replays and draws on this machine."""

from __future__ import annotations

import platform
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, requires, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import gymnasium as gym
import numpy as np

from dorothie_gym._version import __version__
from dorothie_gym.envs.duo_wizard_v0 import DuoWizardEnv
from dorothie_gym.errors import one_line
from dorothie_gym.evaluation.rollout.play import play_session
from dorothie_gym.ontology.roles import AGENT_ROLES
from dorothie_gym.policies.policy_loader import make_policy
from dorothie_gym.session.config import EnvConfig
from dorothie_gym.session.session_engine import SessionEngine
from dorothie_gym.support.user_cache import CACHE_VARIABLE, cache_folder
from dorothie_gym.testing.checks import check_session, check_town
from dorothie_gym.testing.playing import first_unequal, play_scripted

TOWN: Final = "brookside"
SECONDS: Final = 20.0
"""Town and length [s] of the sessions that are played."""

EXTRAS: Final[Mapping[str, tuple[str, ...]]] = {
    "baselines": ("torch", "stable_baselines3", "sb3_contrib"),
    "console": ("starlette", "uvicorn", "websockets"),
    "llm": ("httpx",),
    "speech": ("hibari", "onnxruntime", "pocketsphinx", "soundfile"),
    "video": ("imageio", "imageio_ffmpeg"),
}
"""Modules of the extras that most users install."""


def check_requirements() -> str:
    """Returns the number of required packages; raises `AssertionError` if one is missing."""
    try:
        wanted = [line for line in requires("dorothie-gym") or () if "extra ==" not in line]
    except PackageNotFoundError:
        return "not installed, imported from a folder"
    missing = []
    for line in wanted:
        name = line.split(";")[0].strip()
        for sign in "[<>=!~ ":
            name = name.split(sign)[0]
        try:
            version(name)
        except PackageNotFoundError:
            missing.append(name)
    assert not missing, f"missing: {', '.join(missing)}; run: pip install {' '.join(missing)}"
    return f"{len(wanted)} packages"


def check_cache() -> str:
    """Returns the folder for compiled functions and towns."""
    folder = cache_folder()
    return f"none: every start compiles anew; set {CACHE_VARIABLE} to a folder" if folder is None else str(folder)


def check_repetition() -> str:
    """Plays a session twice; raises `AssertionError` if they differ."""
    decisions = int(2 * SECONDS)
    first, second = (list(play_scripted(DuoWizardEnv(TOWN), seed=1, decisions=decisions)) for _ in range(2))
    for number, (one, other) in enumerate(zip(first, second, strict=True)):
        place = first_unequal((one.observations, one.actions), (other.observations, other.actions))
        assert place is None, f"two sessions of one seed differ at decision {number}: {place}"
    return f"{decisions} decisions, twice the same"


def check_recording() -> str:
    """Records a session and replays it; raises `AssertionError` if the replay differs."""
    engine = SessionEngine(TOWN, config=EnvConfig(max_seconds=SECONDS))
    policies = {role: make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    with tempfile.TemporaryDirectory(prefix="dorothie_gym-") as folder:
        play_session(engine, policies, seed=1, folder=Path(folder) / "session")
        check_session(Path(folder) / "session")
    return "recorded, read, replayed"


def check_picture() -> str:
    """Draws a picture; raises `AssertionError` if it is of one colour."""
    env: Any = gym.make("dorothie_gym/CoWizard-v0", town=TOWN, render_mode="rgb_array")
    env.reset(seed=1)
    picture = env.render()
    env.close()
    assert np.ptp(picture) > 0, "the picture is of one colour"
    return f"{picture.shape[1]} x {picture.shape[0]} pixels"


def check_map() -> str:
    """Checks a shipped town; raises `AssertionError` if it has a fault."""
    check_town(TOWN, sessions=1, decisions=4)
    return TOWN


CHECKS: Final[Mapping[str, Callable[[], str]]] = {
    "requirements": check_requirements,
    "cache": check_cache,
    "town": check_map,
    "session": check_repetition,
    "recording": check_recording,
    "picture": check_picture,
}
"""Checks by name; each returns what it has found, and raises an error if it fails."""


def check_installation(checks: Mapping[str, Callable[[], str]] = CHECKS) -> bool:
    """Runs checks and prints a line for each; returns whether all passed."""
    system = f"{platform.system()} {platform.machine()}"
    print(f"dorothie_gym {__version__}, Python {platform.python_version()}, {system}")
    failed = 0
    for name, check in checks.items():
        begun = time.perf_counter()
        try:
            state, found = "ok", check()
        except Exception as error:  # whatever fails is what the user wants to know
            state, found, failed = "FAILED", one_line(f"{type(error).__name__}: {error}"), failed + 1
        print(f"{state:7}{name:13}{found} ({time.perf_counter() - begun:.1f} s)", flush=True)
    there = [name for name, modules in EXTRAS.items() if all(map(find_spec, modules))]
    print(f"extras: {', '.join(there) or 'none'} (of {', '.join(EXTRAS)})")
    print(f"{failed} of {len(checks)} checks failed" if failed else "The installation works.")
    return not failed


def main() -> None:
    """Checks the installation, and exits with 1 if something does not work."""
    sys.exit(0 if check_installation() else 1)
