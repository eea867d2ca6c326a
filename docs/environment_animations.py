"""Animations on the pages in docs/environments, one for each environment: `python docs/pictures.py environments`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import gymnasium as gym
import numpy as np
import pettingzoo
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import dorothie_gym
from dorothie_gym.archive import Task
from dorothie_gym.evaluation.rollout import play_session
from dorothie_gym.maps import Town
from dorothie_gym.ontology import AGENT_ROLES, PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueMove
from dorothie_gym.pictures.views.playback import Playback
from dorothie_gym.pictures.views.session_views import SessionRenderer
from dorothie_gym.session.config import RenderView
from dorothie_gym.session.recording import Session
from dorothie_gym.session.session_engine import SessionEngine

sys.path.append(str(Path(__file__).parents[1]))  # the tests are a folder of the checkout and not installed
from tests.envs.navigation_drivers import obey, pursue

FOLDER: Final = Path(__file__).parent / "environments"

WIDTH: Final = 640
"""Width of the animations [px]."""

FRAMES: Final = 30
"""Number of frames of the animations of sessions and drives."""

EVERY: Final = 4
"""Decisions between two frames; a decision lasts half a second."""

SEED: Final = 7
"""Seed of the sessions."""

CAPTION: Final = 64
"""Height of the caption below the map in the animations of the three tasks [px]."""

Frame = NDArray[np.uint8]


def _of_all_roles() -> Iterator[Frame]:
    """Yields a session of scripted policies."""
    env: Any = pettingzoo.make("parallel", "dorothie_gym/DuoWizard-v0", render_mode="rgb_array")
    observations, _ = env.reset(seed=SEED)
    limits, town = env.unwrapped.limits, env.unwrapped.town
    policies: dict[Any, Any] = {role: dorothie_gym.make_policy("scripted", role, limits) for role in AGENT_ROLES}
    states = {role: policy.initial_state(SEED, town) for role, policy in policies.items()}
    for decision in range(EVERY * FRAMES):
        actions = {}
        for role, policy in policies.items():
            actions[str(role)], states[role] = policy.step(observations[str(role)], states[role])
        observations, *_ = env.step(actions)
        if decision % EVERY == 0:
            yield env.render()


def _of_role(name: str) -> Callable[[], Iterator[Frame]]:
    def frames() -> Iterator[Frame]:
        env: Any = gym.make(f"dorothie_gym/{name}-v0", render_mode="rgb_array")
        role, engine = env.get_wrapper_attr("role"), env.get_wrapper_attr("engine")
        policy: Any = dorothie_gym.make_policy("scripted", role, engine.limits)
        observation, _ = env.reset(seed=SEED)
        state = policy.initial_state(SEED, engine.town)
        for decision in range(EVERY * FRAMES):
            action, state = policy.step(observation, state)
            observation, *_ = env.step(action)
            if decision % EVERY == 0:
                yield env.render()

    return frames


def _of_drive(name: str, driver: Callable[[Any, Any], Any]) -> Callable[[], Iterator[Frame]]:
    def frames() -> Iterator[Frame]:
        env = gym.make(f"dorothie_gym/{name}", render_mode="rgb_array")
        rate = env.metadata["render_fps"]
        observation, info = env.reset(seed=3)
        between = round(EVERY * rate / 4)  # two frames for each second of simulation
        for decision in range(between * FRAMES):
            observation, _, terminated, truncated, info = env.step(driver(observation, info.get("action_mask")))
            if decision % between == 0:
                yield env.render()  # type: ignore[misc]  # an array in this render mode
            if terminated or truncated:
                return

    return frames


def _recorded() -> tuple[Session, Town]:
    """Returns a session of scripted policies, and its town."""
    engine = SessionEngine("brookside")
    policies = {role: dorothie_gym.make_policy("scripted", role, engine.limits) for role in AGENT_ROLES}
    with TemporaryDirectory() as folder:
        play_session(engine, policies, seed=SEED, folder=Path(folder) / "session")
        return Session.load(Path(folder) / "session"), engine.town


def _of_task(task: Task) -> Callable[[], Iterator[Frame]]:
    """Yields the points of a recorded session: what is to be predicted, and then the answer."""

    def frames() -> Iterator[Frame]:
        session, town = _recorded()
        env: Any = gym.make(f"dorothie_gym/{_TASKS[task][0]}-v0", corpus=[session], render_mode="ansi")
        playback, renderer = Playback(session, town), SessionRenderer(RenderView.MAP)
        env.reset(seed=SEED)
        for _ in range(FRAMES // 2):
            *_, last = env.render().splitlines()
            frame, question = last.split(maxsplit=1)
            _, _, _, _, info = env.step(env.action_space.sample())
            words = question.partition("?")[2].strip()
            asked = _TASKS[task][1] + (f' "{words}"' if words else "")
            for shown, answer in ((int(frame) - 1, "?"), (int(frame), _answer(task, info["label"]))):
                view = renderer.draw(playback.scene(max(shown, playback.first_frame)))
                yield _captioned(view, asked, answer)

    return frames


_TASKS: Final[Mapping[Task, tuple[str, str]]] = {
    Task.UFN: ("UfN", "Which act are the participant's words?"),
    Task.RFN: ("RfN", "Which act does the Co-Wizard say next?"),
    Task.NFD: ("NfD", "Which action does the Co-Wizard carry out next?"),
}
"""Name of the environment of each task, and what it asks."""


def _answer(task: Task, label: Mapping[str, Any]) -> str:
    if task is Task.NFD:
        name = PhysicalAction.from_nfd_class(label["action"]).label
        return f"{name}, {label['angle']} degrees" if label["angle"] else name
    values = [entry.label for entry, named in zip(LABELS, label["slots"], strict=True) if named]
    return f"{DialogueMove(label['move']).label} {', '.join(values)}".strip()


def _captioned(view: Frame, asked: str, answer: str) -> Frame:
    """Returns a view with two lines of text below it."""
    height, width, _ = view.shape
    small = Image.fromarray(view).resize((WIDTH, round(height * WIDTH / width)), Image.Resampling.LANCZOS)
    sheet = Image.new("RGB", (WIDTH, small.height + CAPTION), "white")
    sheet.paste(small)
    text, font = ImageDraw.Draw(sheet), ImageFont.load_default(16)
    for row, line in enumerate((asked, f"Answer: {answer}")):
        while text.textlength(line, font=font) > WIDTH - 20:
            line = f"{line.rstrip('… ')[:-1]}…"
        text.text((10, small.height + 8 + 26 * row), line, fill="black", font=font)
    return np.asarray(sheet)


def _of_town() -> Iterator[Frame]:
    """Yields the drive of an ego that starts and keeps its speed among dense traffic."""
    settings = {
        "town": "midtown", "vehicles": 110, "pedestrians": 80, "scaling": 5.0, "screen_width": WIDTH,
        "screen_height": 400,
    }  # fmt: skip
    env = gym.make("dorothie_gym/Town-v0", config=settings, render_mode="rgb_array")
    env.reset(seed=1)
    for number in range(FRAMES):
        *_, terminated, truncated, _ = env.step(1 if number else 3)  # the ego stands at first: FASTER, then IDLE
        yield env.render()  # type: ignore[misc]  # an array in this render mode
        if terminated or truncated:
            return


ANIMATIONS: Final[Mapping[str, Callable[[], Iterator[Frame]]]] = {
    "duo_wizard": _of_all_roles,
    "participant": _of_role("Participant"),
    "co_wizard": _of_role("CoWizard"),
    "ad_wizard": _of_role("AdWizard"),
    "navigation": _of_drive("Navigation-v0", obey),
    "navigation_continuous": _of_drive("Navigation-continuous-v0", lambda observation, _: pursue(observation)),
    "ufn": _of_task(Task.UFN),
    "rfn": _of_task(Task.RFN),
    "nfd": _of_task(Task.NFD),
    "town": _of_town,
}
"""Functions that draw the frames of each page."""

MILLISECONDS: Final[Mapping[str, int]] = {"ufn": 1200, "rfn": 1200, "nfd": 1200}
"""Time of a frame [ms]; 250 for pages that are not named."""


def draw_animation(page: str, path: Path) -> None:
    """Draws the animation of a page as an animated WebP file."""
    shots = []
    for frame in ANIMATIONS[page]():
        height, width, _ = frame.shape
        image = Image.fromarray(frame)
        if width > WIDTH:
            image = image.resize((WIDTH, round(height * WIDTH / width)), Image.Resampling.LANCZOS)
        shots.append(image)
    shots[0].save(
        path, save_all=True, append_images=shots[1:], duration=MILLISECONDS.get(page, 250), loop=0, quality=45, method=6
    )


def draw_animations(folder: Path = FOLDER) -> None:
    """Draws the animations of all pages."""
    for page in ANIMATIONS:
        draw_animation(page, folder / f"{page}.webp")
