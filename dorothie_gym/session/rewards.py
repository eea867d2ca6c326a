"""All rewards: the rewards of each environment, the names of the terms, and their weights.

| environment | terms | weights |
|---|---|---|
| `DuoWizard-v0` and its roles | `RewardWeights.terms` | `RewardWeights` (`EnvConfig.rewards`) |
| `Navigation-v0`, `Navigation-continuous-v0` | `write_navigation_terms` | `NavigationWeights` (argument `reward`) |
| `UfN-v0`, `RfN-v0` | `act_terms` | the mean of both |
| `NfD-v0` | `decision_terms` | the mean of both |

The reward of a decision is the sum of its terms (the mean for predictions); `info["reward_terms"]` has each of them.
`Town-v0` is an environment of highway-env without roles: its two terms are in `TownEnv._rewards`, where highway-env
requests them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from dorothie_gym.ontology.roles import Role
from dorothie_gym.support.copying import shared
from dorothie_gym.support.input_files import settings_of

RewardTerms: TypeAlias = dict[str, float]
"""Terms of a reward, by name."""


# --- Sessions of three roles ------------------------------------------------------------------------------------------

_SIGNS = ((Role.PARTICIPANT, 1.0), (Role.CO_WIZARD, 1.0), (Role.AD_WIZARD, -1.0))
"""Roles and the sign of the shared reward terms: the Ad-Wizard plays against the others."""


def term_names(role: Role) -> tuple[str, ...]:
    """Returns the names of the terms of a role's reward, in order."""
    return ("subgoal", "success", "collision", "time", "refusal", *(() if role is Role.AD_WIZARD else ("talk",)))


@shared
@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """Weights of the reward terms. Participant and Co-Wizard share the first four; the Ad-Wizard gets them negated.

    Attributes:
        subgoal: reward for each subgoal reached.
        success: reward at the end, if every live subgoal was reached without a collision caused by the ego.
        collision: reward for each collision caused by the ego.
        time: reward per second [1/s].
        talk: reward for each utterance span of the role itself (participant and Co-Wizard).
        refusal: reward for each refused action of the role.

    Raises:
        ValueError: a weight is not finite; names the field.
    """

    subgoal: float = 1.0
    success: float = 5.0
    collision: float = -2.0
    time: float = -0.005
    talk: float = -0.01
    refusal: float = -0.02

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise ValueError(f"RewardWeights.{name} is {value}; it must be a finite number")

    def terms(
        self,
        *,
        reached: int,
        success: bool,
        collisions: int,
        decision_frequency: float,
        refusals: Mapping[Role, int],
        spoken: Mapping[Role, bool],
    ) -> dict[Role, RewardTerms]:
        """Returns the reward terms of one decision, by role.

        Args:
            reached: number of subgoals reached.
            success: whether the session has ended with every live subgoal reached and no collision.
            collisions: number of collisions caused by the ego.
            decision_frequency: decisions per second [Hz].
            refusals: number of refused actions, by role.
            spoken: whether an utterance span began, for the roles that speak.
        """
        subgoal, success_reward = self.subgoal * reached, self.success * success
        collision, time = self.collision * collisions, self.time / decision_frequency
        terms: dict[Role, RewardTerms] = {}
        for role, sign in _SIGNS:
            own = terms[role] = {
                "subgoal": sign * subgoal,
                "success": sign * success_reward,
                "collision": sign * collision,
                "time": sign * time,
                "refusal": self.refusal * refusals[role],
            }
            if role in spoken:
                own["talk"] = self.talk * spoken[role]
            if own.keys() != _NAMES[role]:
                raise _disagreement("RewardWeights.terms", own, _NAMES[role])
        return terms


def _disagreement(computes: str, terms: Iterable[str], names: Iterable[str]) -> NotImplementedError:
    """Returns the error for terms that are not those that have a weight and a name."""
    found, wanted = set(terms), set(names)
    faults = [f"lacks {', '.join(sorted(wanted - found))}"] if wanted - found else []
    faults += [f"has {', '.join(sorted(found - wanted))} without a weight"] if found - wanted else []
    path = f"{__name__.replace('.', '/')}.py"
    return NotImplementedError(f"{computes} of {path} does not agree with the weights: it {' and '.join(faults)}")


_NAMES = {role: frozenset(term_names(role)) for role, _ in _SIGNS}

if (_named := frozenset().union(*_NAMES.values())) != vars(RewardWeights()).keys():
    raise _disagreement("term_names", _named, vars(RewardWeights()))


# --- Driving by instructions ------------------------------------------------------------------------------------------


@shared
@dataclass(frozen=True, kw_only=True)
class NavigationWeights:
    """Weights of the reward terms; a term of weight 0 is reported as 0.

    Attributes:
        progress: reward for each metre by which the cost to go decreases. The cost to go is that of the route to the
            current goal in metres at 40 km/h; as a difference of potentials it leaves the optimal policy unchanged (Ng,
            Harada and Russell 1999).
        subgoal: reward for each subgoal reached.
        success: reward at the end, if every live subgoal was reached without a collision caused by the ego.
        collision: reward for each collision caused by the ego.
        infraction: reward for each red light, stop sign, stretch off the road or on the wrong side.
        gave_up: reward at the end, if the participant has given up or the ego has left the road.
        time: reward per second [1/s].
        action: reward for each action that is carried out; discourages needless actions.
        refusal: reward for each action that is refused.

    Raises:
        ValueError: a weight is not finite; names the field.
    """

    progress: float = 0.02
    subgoal: float = 1.0
    success: float = 2.0
    collision: float = -1.0
    infraction: float = -0.1
    gave_up: float = -1.0
    time: float = -0.02
    action: float = -0.005
    refusal: float = -0.01

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise ValueError(f"NavigationWeights.{name} is {value}; it must be a finite number")


NAVIGATION_WEIGHTS: Mapping[str, NavigationWeights] = MappingProxyType(
    {
        "dense": NavigationWeights(),
        "careful": NavigationWeights(collision=-3.0),
        "sparse": NavigationWeights(progress=0.0, infraction=0.0, gave_up=0.0, time=0.0, action=0.0, refusal=0.0),
    }
)
"""Weights by name: the argument `reward` of the navigation environments."""

NAVIGATION_TERMS: Final = tuple(vars(NavigationWeights()))
"""Names of the reward terms, in the order of the arrays of `write_navigation_terms`."""


def weights_of(reward: str | NavigationWeights | Mapping[str, object]) -> NavigationWeights:
    """Returns weights given by name, directly or by their fields; raises `ValueError` for an unknown name or field."""
    if not isinstance(reward, str):
        return settings_of(reward, NavigationWeights, "reward")
    if reward not in NAVIGATION_WEIGHTS:
        raise ValueError(
            f"reward is {reward!r}; it must be one of {', '.join(NAVIGATION_WEIGHTS)}, or NavigationWeights"
        )
    return NAVIGATION_WEIGHTS[reward]


def write_navigation_terms(
    terms: NDArray[np.float64],
    weights: NDArray[np.float64],
    progress: float,
    reached: int,
    success: bool,
    collisions: int,
    infractions: int,
    failed: bool,
    frequency: float,
    acted: bool,
    refusals: int,
) -> float:
    """Writes the terms of one decision in the order of `NAVIGATION_TERMS`, and returns their sum.

    `envs.navigation.episode` compiles it. This module imports no compiler, so that settings are read without one.

    Args:
        terms: receives the terms, shape (9,).
        weights: values of a `NavigationWeights`, shape (9,).
        progress: decrease of the cost to go [m at 40 km/h].
        reached: number of subgoals reached.
        success: whether every live subgoal was reached without a collision caused by the ego.
        collisions: number of collisions caused by the ego.
        infractions: number of other infractions.
        failed: whether the participant has given up or the ego has left the road.
        frequency: decisions per second [Hz].
        acted: whether an action was carried out.
        refusals: number of refused actions.
    """
    terms[0] = weights[0] * progress
    terms[1] = weights[1] * reached
    terms[2] = weights[2] * (1.0 if success else 0.0)
    terms[3] = weights[3] * collisions
    terms[4] = weights[4] * infractions
    terms[5] = weights[5] * (1.0 if failed else 0.0)
    terms[6] = weights[6] / frequency
    terms[7] = weights[7] * (1.0 if acted else 0.0)
    terms[8] = weights[8] * refusals
    reward = 0.0
    for k in range(len(terms)):
        reward += terms[k]
    return reward


def _check_navigation_terms() -> None:
    """Checks that `write_navigation_terms` writes a term for each weight."""
    terms = np.full(len(NAVIGATION_TERMS), math.nan)
    in_python = getattr(write_navigation_terms, "py_func", write_navigation_terms)  # compiled code checks no bounds
    in_python(terms, np.zeros(len(terms)), 0.0, 0, False, 0, 0, False, 1.0, False, 0)
    if np.isnan(terms).any():
        written = [name for name, term in zip(NAVIGATION_TERMS, terms.tolist(), strict=True) if not math.isnan(term)]
        raise _disagreement("write_navigation_terms", written, NAVIGATION_TERMS)


_check_navigation_terms()


# --- Predictions of the three tasks -----------------------------------------------------------------------------------

ACT_TERMS: Final = ("move", "slots")
"""Terms of UfN and RfN: whether the move is right, and F1 of the slots with values."""

DECISION_TERMS: Final = ("action", "joint")
"""Terms of NfD: whether the action is right, and whether action and angle are."""


def act_terms(is_right_move: bool, truth: NDArray[np.bool_], guess: NDArray[np.bool_]) -> RewardTerms:
    """Returns the terms of a predicted dialogue act, each in [0, 1].

    Args:
        is_right_move: whether the move is that of the point.
        truth: slots of the point with their values, shape (69,).
        guess: predicted ones, shape (69,). Where both are empty, `slots` is 1.
    """
    hits, named = int((truth & guess).sum()), int(truth.sum() + guess.sum())
    return {"move": float(is_right_move), "slots": 2.0 * hits / named if named else 1.0}


def decision_terms(is_right_action: bool, is_right_angle: bool | None) -> RewardTerms:
    """Returns the terms of a predicted decision, each in [0, 1]; `joint` only if the angle is known.

    Args:
        is_right_action: whether the action is that of the point.
        is_right_angle: whether the angle is that of the point; None if the recording lacks it.
    """
    terms = {"action": float(is_right_action)}
    if is_right_angle is not None:
        terms["joint"] = float(is_right_action and is_right_angle)
    return terms
