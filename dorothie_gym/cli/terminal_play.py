"""Play by keys in a terminal: the Co-Wizard by macro-actions, and `Navigation-v0`."""

from __future__ import annotations

import codecs
import enum
import os
import re
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import gymnasium as gym
import numpy as np
from rich.text import Text

from dorothie_gym.ontology.slots import LandmarkName
from dorothie_gym.policies.navigation.actions import NavigationAction
from dorothie_gym.sim.state.codes import Motion
from dorothie_gym.tasks.catalogue import map_label
from dorothie_gym.wrappers.macro_actions import MACRO_ACTIONS, MacroAction, MacroActions

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from rich.console import Console

    from dorothie_gym.session.config import EnvConfig

QUIT: Final = "q"
PICTURE: Final = "v"
HELP: Final = "?"
NOTHING: Final = " "
END_OF_INPUT: Final = "\x04"
"""Ctrl-D, which a terminal that passes single keys leaves to the program."""

_ESCAPED: Final = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|O.|.)?", re.DOTALL)
"""Key that a terminal sends as several characters, such as an arrow."""

_SHADES: Final = " .:-=+*#%@"
"""Characters from dark to bright, for terminals without colours."""

COMMANDS: Final[Mapping[str, str]] = {
    " ": "continue", "g": "start", "x": "stop", "u": "turn_round", "+": "faster", "-": "slower",
    "a": "left", "w": "straight", "d": "right", "p": "goal_heard",
    "o": "say_okay", "k": "say_will_do", "y": "say_yes", "n": "say_no", "h": "say_not_understood", "m": "say_goal",
    "f": "ask_where_to", "t": "ask_which_street", "j": "ask_which_way", "e": "ask_whether_done", "c": "ask_goal",
}  # fmt: skip
"""Key of each macro-action; goals have the digits."""

DRIVING: Final[Mapping[str, str]] = {
    " ": "NOTHING", "l": "LANE_FOLLOW", "<": "SWITCH_LEFT", ">": "SWITCH_RIGHT", "u": "U_TURN", "x": "STOP",
    "g": "START", "+": "FASTER", "-": "SLOWER", "i": "LIGHTS", "a": "TURN_LEFT", "w": "TURN_STRAIGHT",
    "d": "TURN_RIGHT", "z": "TURN_HALF_LEFT", "c": "TURN_HALF_RIGHT", "y": "TURN_SHARP_LEFT", "n": "TURN_SHARP_RIGHT",
    "b": "TURN_BACK",
}  # fmt: skip
"""Key of each action of `Navigation-v0`."""


class KeyGame(ABC):
    """Environment that is played by keys."""

    keys: Mapping[str, int]
    names: Mapping[str, str]

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        self.env = env

    @abstractmethod
    def heard(self) -> str:
        """Returns the words that the participant has just said; empty if there are none."""

    @abstractmethod
    def status(self) -> str:
        """Returns the state of the car in one line."""

    def begin(self, seed: int) -> None:
        """Begins a session."""
        self.observation, self.info = self.env.reset(seed=seed)
        self.over = False

    def press(self, key: str) -> None:
        """Carries out the action of a key."""
        self.observation, _, terminated, truncated, self.info = self.env.step(self.keys[key])
        self.over = terminated or truncated

    def possible(self) -> list[str]:
        """Returns the keys whose actions are possible now."""
        mask = self.env.get_wrapper_attr("action_masks")()
        return [key for key, number in self.keys.items() if mask[number]]


class CoWizardGame(KeyGame):
    """Session in which a person plays the Co-Wizard by macro-actions.

    Args:
        town: name or file of the town.
        config: settings of the session.
    """

    def __init__(self, town: str, config: EnvConfig) -> None:
        env = gym.make("dorothie_gym/CoWizard-v0", town=town, config=config, render_mode="rgb_array")
        super().__init__(MacroActions(env))
        actions = MACRO_ACTIONS
        numbers = {one.name: number for number, one in enumerate(actions)}
        goals = [number for number, one in enumerate(actions) if one.place is not None]
        self.keys = {key: numbers[name] for key, name in COMMANDS.items()} | {
            str(digit): number for digit, number in enumerate(goals)
        }
        self.names = {key: _name_of(actions[number]) for key, number in self.keys.items()}

    def heard(self) -> str:
        """Returns what has ended since the last action."""
        return str(self.observation["participant_text"])

    def status(self) -> str:
        """Returns time, speed, motion and goal."""
        motion = Motion(int(self.observation["motion"])).name.lower()
        goal = LandmarkName(int(self.observation["goal"]))
        towards = "" if goal is LandmarkName.UNKNOWN else f", goal {map_label(goal)}"
        arrived = ", arrived" if self.observation["arrived"] else ""
        speed = float(self.observation["speed"][0]) * 3.6
        return f"{self.observation['time'][0]:5.1f} s  {speed:3.0f} km/h  {motion}{towards}{arrived}"


def _name_of(action: MacroAction) -> str:
    return action.name.replace("_", " ") if action.place is None else f"goal {map_label(action.place)}"


class NavigationGame(KeyGame):
    """Episode of `Navigation-v0`, in which a person drives by the instructions of the participant.

    Args:
        town: name or file of the town.
        seconds: longest simulated time [s].
    """

    def __init__(self, town: str, seconds: float) -> None:
        super().__init__(
            gym.make("dorothie_gym/Navigation-v0", town=town, max_seconds=seconds, render_mode="rgb_array")
        )
        self.keys = {key: int(NavigationAction[name]) for key, name in DRIVING.items()}
        self.names = {key: name.lower().replace("_", " ") for key, name in DRIVING.items()}
        self._told = ""

    def begin(self, seed: int) -> None:
        """Begins an episode."""
        super().begin(seed)
        self._told = ""

    def heard(self) -> str:
        """Returns the words of a new instruction."""
        words = str(self.env.get_wrapper_attr("instruction"))
        new, self._told = words != self._told, words
        return words if new else ""

    def status(self) -> str:
        """Returns time and speed."""
        world = self.env.get_wrapper_attr("session").world
        return f"{world.time:5.1f} s  {world.car.speed * 3.6:3.0f} km/h"


class Ending(enum.Enum):
    """How a session by keys has ended."""

    OVER = "the session is over"
    LEFT = "the player has left"
    NO_MORE_INPUT = "the input has ended"
    NO_INPUT = "there was no key at all"


def play(game: KeyGame, seed: int, screen: Console) -> Ending:
    """Plays a session by keys.

    Args:
        game: the game.
        seed: seed of the session.
        screen: console on which the session is shown.
    """
    read_any = False
    with _keys() as read:
        game.begin(seed)
        _show_help(game, screen)
        while not game.over:
            words = game.heard()
            if words:
                screen.print(Text(f"Participant: {words}", style="bold"))
            screen.print(game.status(), style="dim")
            key = read()
            if key == "":
                return Ending.NO_MORE_INPUT if read_any else Ending.NO_INPUT
            if key in (QUIT, END_OF_INPUT):
                return Ending.LEFT
            read_any = True
            _obey(game, key, screen)
    return Ending.OVER


def _obey(game: KeyGame, key: str, screen: Console) -> None:
    """Carries out a key and prints what it did."""
    if key == PICTURE:
        coloured = screen.color_system is not None
        screen.print(small_picture(game.env.render(), screen.width - 1, max(screen.height - 2, 2), coloured=coloured))
    elif key == HELP:
        _show_help(game, screen)
    elif key not in game.keys:
        screen.print(f"This key does nothing; {HELP} lists the keys.", style="dim")
    elif key not in game.possible():
        screen.print(f"{game.names[key]} is not possible now", style="dim")
    else:
        game.press(key)
        if key != NOTHING:
            screen.print(f"You: {game.names[key]}")
        if reason := str(game.info["refusal_reason"]):
            screen.print(f"Refused: {reason}")


def small_picture(picture: Any, columns: int, lines: int = 50, *, coloured: bool = True) -> Text:
    """Returns a picture (height, width, 3) uint8 as text of its proportions.

    Args:
        picture: the picture.
        columns: largest width [characters]; at most 100 are used.
        lines: largest height [lines].
        coloured: whether to draw coloured half blocks; otherwise two pixels are one character by their brightness.
    """
    height, width = picture.shape[:2]
    wide = max(min(columns, 100, 2 * lines * width // height), 1)
    rows = max(2, round(wide * height / width) // 2 * 2)
    down = np.linspace(0, height, rows + 1).astype(int)
    across = np.linspace(0, width, wide + 1).astype(int)
    means: NDArray[np.float64] = np.add.reduceat(np.add.reduceat(picture.astype(float), down[:-1], 0), across[:-1], 1)
    areas = np.diff(down)[:, None, None] * np.diff(across)[None, :, None]
    small = (means / areas).astype(int)
    text = Text()
    for upper, lower in zip(small[::2], small[1::2], strict=True):
        for one, two in zip(upper, lower, strict=True):
            if coloured:
                text.append("▀", style=f"rgb({one[0]},{one[1]},{one[2]}) on rgb({two[0]},{two[1]},{two[2]})")
            else:
                text.append(_SHADES[int(one.sum() + two.sum()) * len(_SHADES) // (6 * 256)])
        text.append("\n")
    return text


def _show_help(game: KeyGame, screen: Console) -> None:
    possible = set(game.possible())
    shown = [f"{'space' if key == ' ' else key} {name}" for key, name in game.names.items() if key in possible]
    screen.print("Keys: " + " · ".join([*shown, f"{PICTURE} map", f"{HELP} help", f"{QUIT} quit"]))


@contextmanager
def _keys() -> Iterator[Callable[[], str]]:
    """Yields a function that reads one key: at once on a terminal, else the next character of the input.

    Keys that were pressed before are kept; those that are pressed after the end are not left to the shell.
    """
    if not sys.stdin.isatty():
        yield _next_character
        return
    try:
        import termios
        import tty
    except ImportError:  # Windows
        import msvcrt

        yield lambda: str(msvcrt.getwch())  # type: ignore[attr-defined]  # of Windows only
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    keys = TerminalKeys(descriptor)

    def read() -> str:
        tty.setcbreak(descriptor, termios.TCSANOW)  # again, as a shell changes it while the program is suspended
        return keys.read()

    tty.setcbreak(descriptor, termios.TCSANOW)
    try:
        yield read
    finally:
        termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


class TerminalKeys:
    """Keys of a terminal in cbreak mode; one that is sent as several characters is one key.

    Args:
        descriptor: number of the open terminal.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor, self._waiting = descriptor, ""
        self._decoder = codecs.getincrementaldecoder("utf-8")(errors="replace")

    def read(self) -> str:
        """Returns the next key; empty if the terminal was closed."""
        while not self._waiting:
            read = os.read(self._descriptor, 1024)
            if not read:
                return ""
            self._waiting = self._decoder.decode(read)
        escaped = _ESCAPED.match(self._waiting)
        length = escaped.end() if escaped is not None else 1
        key, self._waiting = self._waiting[:length], self._waiting[length:]
        return key


def _next_character() -> str:
    """Returns the next character of the input; line breaks are left out, and "" is its end."""
    while (key := sys.stdin.read(1)) in ("\n", "\r"):
        pass
    return key
