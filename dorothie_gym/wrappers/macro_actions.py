"""Macro-actions of the Co-Wizard: one small discrete space for driving, setting a goal, speaking and asking."""

from __future__ import annotations

import enum
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, SupportsFloat

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from dorothie_gym.ontology.actions import PhysicalAction
from dorothie_gym.ontology.dialogue_acts import LABELS, DialogueAct, DialogueMove
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.slots import ActionValue, GoalStatus, LandmarkName, StreetName
from dorothie_gym.policies.co_wizard.goal_driver import GoalDriver
from dorothie_gym.session.spaces.actions import CoWizardAction, Physical, Speech
from dorothie_gym.session.spaces.observations import ExitColumn
from dorothie_gym.sim.state.codes import Motion

if TYPE_CHECKING:
    from dorothie_gym.envs.single_role_v0 import SingleRole
    from dorothie_gym.session.spaces.actions import StepInfo
    from dorothie_gym.session.spaces.observations import ObservationMapping

MEMORY: Final = 60.0
"""Time after which a word that was heard has faded from `heard` and `heard_moves` [s]."""

SIDE: Final = 35.0
"""Angle from which an exit leads to a side [degrees]; smaller ones lead straight on."""

_DIRECTIONS: Final[Mapping[str, float]] = {"left": 90.0, "straight": 0.0, "right": -90.0}
"""Angle of each direction at a crossroads [degrees, positive left]."""

_COMMANDS: Final[Mapping[str, Physical]] = {
    "start": Physical(action=PhysicalAction.START),
    "stop": Physical(action=PhysicalAction.STOP),
    "turn_round": Physical(action=PhysicalAction.U_TURN),
    "faster": Physical(action=PhysicalAction.SPEED_CHANGE, up=True),
    "slower": Physical(action=PhysicalAction.SPEED_CHANGE, up=False),
}
_KEEPING_GOAL: Final = frozenset({"faster", "slower"})
"""Commands that leave the goal as it is; the others take the wheel."""

_PLACES: Final = tuple(name for name in LandmarkName if name not in (LandmarkName.UNKNOWN, LandmarkName.QUERIED))

_LABEL_OF: Final = {place: LABELS.index(place) for place in _PLACES}
"""Index of each place in `LABELS`."""

_SAYINGS: Final[Mapping[str, DialogueAct]] = {
    "say_okay": DialogueAct.of(DialogueMove.ACKNOWLEDGE),
    "say_will_do": DialogueAct.of(DialogueMove.CONFIRM),
    "say_yes": DialogueAct.of(DialogueMove.REPLY_Y),
    "say_no": DialogueAct.of(DialogueMove.REPLY_N),
    "say_not_understood": DialogueAct.of(DialogueMove.CONFUSE),
    "ask_where_to": DialogueAct.of(DialogueMove.QUERY_W, LandmarkName.QUERIED),
    "ask_which_street": DialogueAct.of(DialogueMove.QUERY_W, StreetName.QUERIED),
    "ask_which_way": DialogueAct.of(DialogueMove.QUERY_W, ActionValue.QUERIED),
    "ask_whether_done": DialogueAct.of(DialogueMove.QUERY_YN, GoalStatus.COMPLETE),
}
"""Acts of the sayings, which the grammar words."""

_ABOUT_GOAL: Final[Mapping[str, Callable[[LandmarkName], DialogueAct]]] = {
    "say_goal": lambda place: DialogueAct.of(DialogueMove.CONFIRM, place),
    "ask_goal": lambda place: DialogueAct.of(DialogueMove.CHECK, place),
}
"""Acts of the sayings that name the goal."""


GOAL_HEARD: Final = "goal_heard"
"""Name of the action that sets the place that the participant has mentioned last as goal."""


class MacroKind(enum.StrEnum):
    """Kind of a macro-action."""

    CONTINUE = "continue"
    DRIVE = "drive"
    GOAL = "goal"
    SAY = "say"
    ASK = "ask"


@dataclass(frozen=True, kw_only=True)
class MacroAction:
    """One macro-action.

    Attributes:
        name: its name, such as "left", "goal_KFC" or "ask_which_way".
        kind: its kind.
        place: place that becomes the goal; None for other actions.
    """

    name: str
    kind: MacroKind
    place: LandmarkName | None = None


MACRO_ACTIONS: Final = (
    MacroAction(name="continue", kind=MacroKind.CONTINUE),
    *(MacroAction(name=name, kind=MacroKind.DRIVE) for name in (*_COMMANDS, *_DIRECTIONS)),
    *(MacroAction(name=f"goal_{place.label}", kind=MacroKind.GOAL, place=place) for place in _PLACES),
    *(MacroAction(name=name, kind=MacroKind(name.split("_")[0])) for name in (*_SAYINGS, *_ABOUT_GOAL)),
    MacroAction(name=GOAL_HEARD, kind=MacroKind.GOAL),
)
"""The macro-actions, in the order of the action space; the first one continues."""


class MacroActions(gym.Wrapper[dict[str, Any], int, dict[str, Any], Any], RecordConstructorArgs):
    """Wrapper of `CoWizard-v0` with 31 actions, or fewer by `kinds`, in place of a dict of 104 entries.

    One action begins a command, a goal or an utterance, and lasts until something happens: the participant has spoken,
    the car waits for a choice, stands, or has arrived, or `seconds` have passed. An action that sets a goal is not
    ended by what the participant says. A goal stays set while the agent speaks or continues: the car drives there by
    the navigator of the scripted Co-Wizard (`GoalDriver`), which reports goal and plan as mental actions. Other driving
    commands drop the goal. The grammar words what is said.

    The observation has four more fields, because words are observed only when they are heard:

    - `heard`: `Box` (69,) float32, for each of `LABELS` how lately the participant mentioned it: 1 now, 0 after 60 s;
    - `heard_moves`: `Box` (15,) float32, the same for moves;
    - `goal`: `Discrete`, id of the `LandmarkName` of the goal, 0 for none;
    - `arrived`: `Discrete`, 1 when the car has stopped at the goal.

    The reward is the sum over the decisions of an action; `info["decisions"]` counts them. `action_masks()`, which
    sb3-contrib calls, and `info["action_mask"]` state what is possible: places that are on the map, exits that exist,
    and speech while the Co-Wizard is silent.

    Attributes:
        actions: the macro-actions of the action space, in order.

    Args:
        env: a Co-Wizard's environment.
        seconds: longest simulated time of an action [s].
        kinds: kinds of actions to keep, such as `{"goal", "ask"}`; None keeps all. To continue is always possible.

    Raises:
        ValueError: the environment is not that of a Co-Wizard, or hides dialogue acts; there is no such kind.
    """

    def __init__(
        self, env: gym.Env[Any, Any], seconds: float = 5.0, kinds: Collection[MacroKind | str] | None = None
    ) -> None:
        kept = set(MacroKind) if kinds is None else _checked_kinds(kinds)
        recorded = None if kinds is None else sorted(map(str, kept))  # a list, as specifications are written as JSON
        RecordConstructorArgs.__init__(self, seconds=seconds, kinds=recorded)
        gym.Wrapper.__init__(self, env)
        self._inner: SingleRole = env.unwrapped  # type: ignore[assignment]  # checked next
        if getattr(env.unwrapped, "role", None) is not Role.CO_WIZARD:
            raise ValueError(
                "MacroActions wraps dorothie_gym/CoWizard-v0; flatten(env, fields=[...]) keeps some fields of another"
            )
        observed = self._inner.observation_space
        if not isinstance(observed, spaces.Dict) or "participant_slots" not in observed.spaces:
            raise ValueError("MacroActions reads dialogue acts; leave EnvConfig.observe_acts at True")
        if not seconds > 0.0:
            raise ValueError(f"seconds is {seconds}; it must be above 0")
        self._seconds = seconds
        self.actions = tuple(action for action in MACRO_ACTIONS if action.kind in kept)
        self.action_space: spaces.Space[Any] = spaces.Discrete(len(self.actions))
        self.observation_space: spaces.Space[Any] = spaces.Dict(
            {
                **observed.spaces,
                "heard": spaces.Box(0.0, 1.0, (len(LABELS),), dtype=np.float32),
                "heard_moves": spaces.Box(0.0, 1.0, (len(DialogueMove),), dtype=np.float32),
                "goal": spaces.Discrete(len(LandmarkName)),
                "arrived": spaces.Discrete(2),
            }
        )

    def reset(self, *, seed: int | None = None, options: StepInfo | None = None) -> tuple[dict[str, Any], StepInfo]:
        """Begins a session."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._driver = GoalDriver(self._inner.engine.town, self._inner.engine.limits)
        self._slots_at = np.full(len(LABELS), -MEMORY)
        self._moves_at = np.full(len(DialogueMove), -MEMORY)
        self._take_in(observation, info)
        return self._observed(), {**info, "action_mask": self.action_masks(), "decisions": 0}

    def step(self, action: int) -> tuple[dict[str, Any], SupportsFloat, bool, bool, StepInfo]:
        """Carries out a macro-action; raises `ValueError` if it is not in the space.

        An action that the mask excludes continues.
        """
        if not self.action_space.contains(np.int64(action)):
            raise ValueError(f"action is {action!r}; it must be a whole number in 0..{len(self.actions) - 1}")
        chosen = self.actions[int(action)] if self.action_masks()[int(action)] else self.actions[0]
        if chosen.name == GOAL_HEARD:
            chosen = replace(chosen, place=self._heard_place())
        begun = self._driver.view.time
        reward, decisions = 0.0, 0
        typed = self._begun(chosen)
        while True:
            before = self._driver.view.motion, self._driver.arrived
            observation, gained, terminated, truncated, info = self.env.step(self._encoded(typed))
            reward, decisions = reward + float(gained), decisions + 1
            self._take_in(observation, info)
            over = self._driver.view.time - begun >= self._seconds - 1e-9
            if terminated or truncated or over or self._happened(before, heard=chosen.place is None):
                break
            typed = self._driver.act()
        info = {**info, "action_mask": self.action_masks(), "decisions": decisions}
        return self._observed(), reward, terminated, truncated, info

    def action_masks(self) -> NDArray[np.bool_]:
        """Returns which of `actions` are possible now, (n,) bool; the interface of sb3-contrib."""
        physical = np.asarray(self._mask["physical"])
        silent = self._driver.view.speaking <= 0.0
        exits = self._exits()
        possible = {
            "continue": True,
            **{name: bool(physical[command.action]) for name, command in _COMMANDS.items()},
            **{name: bool(physical[PhysicalAction.J_TURN]) and name in exits for name in _DIRECTIONS},
            **dict.fromkeys(_SAYINGS, silent),
            **dict.fromkeys(_ABOUT_GOAL, silent and self._driver.goal is not None),
            GOAL_HEARD: self._heard_place() not in (None, self._driver.goal),
        }
        return np.array(
            [possible[one.name] if one.place is None else self._is_new_goal(one.place) for one in self.actions]
        )

    # --- one action ---------------------------------------------------------------------------------------------------

    def _begun(self, chosen: MacroAction) -> CoWizardAction:
        """Returns the action of the first decision."""
        name, driver = chosen.name, self._driver
        if chosen.place is not None:
            driver.set_goal(chosen.place)
        elif name in _DIRECTIONS:
            angle = self._exits()[name]
            driver.leave_goal()
            return CoWizardAction(physical=Physical(action=PhysicalAction.J_TURN, angle=angle))
        elif name in _COMMANDS:
            if name not in _KEEPING_GOAL:
                driver.leave_goal()
            return CoWizardAction(physical=_COMMANDS[name])
        driving = driver.act()
        act = _SAYINGS.get(name)
        if name in _ABOUT_GOAL and driver.goal is not None:
            act = _ABOUT_GOAL[name](driver.goal)
        return driving if act is None else _with_speech(driving, act)

    def _encoded(self, action: CoWizardAction) -> Any:  # gymnasium types the action as the wrapper's
        return action.encode(self._inner.engine.limits)

    def _happened(self, before: tuple[Motion, bool], *, heard: bool) -> bool:
        """Returns whether the agent has something to react to; what was said counts if `heard` is set."""
        view, driver = self._driver.view, self._driver
        motion, arrived = before
        if (heard and view.raw["participant_text"]) or (driver.arrived and not arrived):
            return True
        return driver.goal is None and view.motion is not motion and view.motion in (Motion.WAITING, Motion.STOPPED)

    def _take_in(self, observation: ObservationMapping, info: StepInfo) -> None:
        """Observes, and remembers what was heard."""
        self._mask = info["action_mask"]
        self._driver.observe(observation)
        now = self._driver.view.time
        for move, slots in zip(observation["participant_moves"], observation["participant_slots"], strict=True):
            if move < len(DialogueMove):
                self._moves_at[int(move)] = now
                self._slots_at[np.asarray(slots) > 0] = now

    def _observed(self) -> dict[str, Any]:
        driver = self._driver
        now = driver.view.time
        goal = LandmarkName.UNKNOWN if driver.goal is None else driver.goal
        return {
            **driver.view.raw,
            "heard": _fresh(now, self._slots_at),
            "heard_moves": _fresh(now, self._moves_at),
            "goal": np.int64(goal.value),
            "arrived": np.int64(driver.arrived),
        }

    def _exits(self) -> dict[str, int]:
        """Returns the angle of the exit in each direction at the next junction [degrees]; only those that there are."""
        rows = self._driver.view.raw["exits"]
        angles = [round(float(angle)) for angle in rows[rows[:, ExitColumn.PRESENT] > 0.0][:, ExitColumn.ANGLE]]
        found: dict[str, int] = {}
        for name, wanted in _DIRECTIONS.items():
            fitting = [angle for angle in angles if _direction(angle) == name]
            if fitting:
                found[name] = min(fitting, key=lambda angle: abs(angle - wanted))
        return found

    def _heard_place(self) -> LandmarkName | None:
        """Returns the place on the map that the participant has mentioned last, within `MEMORY`; None without one."""
        since = self._driver.view.time - MEMORY
        heard = {place: float(self._slots_at[_LABEL_OF[place]]) for place in _PLACES}
        known = [place for place, time in heard.items() if time > since and self._driver.knows(place)]
        return max(known, key=heard.__getitem__, default=None)

    def _is_new_goal(self, place: LandmarkName) -> bool:
        return place is not self._driver.goal and self._driver.knows(place)


def _checked_kinds(kinds: Collection[MacroKind | str]) -> set[MacroKind]:
    """Returns kinds of actions, with that to continue; raises `ValueError` for an unknown one, or a single text."""
    names = list(map(str, MacroKind))
    if isinstance(kinds, str) or (unknown := [kind for kind in kinds if kind not in names]):
        wrong = kinds if isinstance(kinds, str) else unknown[0]
        raise ValueError(f"kinds has {wrong!r}; give a set of {', '.join(names)}")
    return {MacroKind.CONTINUE, *map(MacroKind, kinds)}


def _with_speech(driving: CoWizardAction, act: DialogueAct) -> CoWizardAction:
    return CoWizardAction(speech=Speech(act=act), physical=driving.physical, mental=driving.mental)


def _direction(angle: int) -> str:
    return "left" if angle > SIDE else "right" if angle < -SIDE else "straight"


def _fresh(now: float, times: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.clip(1.0 - (now - times) / MEMORY, 0.0, 1.0).astype(np.float32)
