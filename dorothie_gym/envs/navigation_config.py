"""Settings of driving alone: how hard it is, how the way is told, and what is rewarded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.policies.ad_wizard import MOST_TRICKS
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.observation_vector import DECISION_FREQUENCY, MAX_SECONDS
from dorothie_gym.sim.config import WorldConfig

TRAFFIC: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"none": (0, 0), "light": (4, 2), "medium": (10, 4), "heavy": (30, 20)}
)
"""Vehicles and pedestrians of each degree of traffic, as many as fit."""


@dataclass(frozen=True, kw_only=True)
class NavigationWeights:
    """Weights of the reward's terms; a term whose weight is 0 is told as 0.

    Attributes:
        progress: for each metre by which the way left gets shorter (negative: longer). The way left is the cost of the
            route to the present goal in metres at 40 km/h. It is a difference of potentials, which leaves the best
            policy as it is (Ng, Harada and Russell 1999).
        subgoal: for each subgoal reached.
        success: at the end, if every live subgoal was reached and nothing was hit.
        collision: for each collision of the car's own making.
        infraction: for each red light, stop sign, stretch off the road or on the wrong side.
        gave_up: at the end, if the participant has given up, or the car has left the road.
        time: for each second.
        action: for each action that is carried out: who fiddles about is no good driver.
        refusal: for each action that is refused.
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


REWARDS: Mapping[str, NavigationWeights] = MappingProxyType(
    {
        "dense": NavigationWeights(),
        "sparse": NavigationWeights(progress=0.0, infraction=0.0, gave_up=0.0, time=0.0, action=0.0, refusal=0.0),
    }
)
"""Weights by name."""


@dataclass(frozen=True, kw_only=True)
class NavigationConfig:
    """Settings of `NavigationEnv`.

    Attributes:
        guidance: a `Guidance` or its name.
        traffic: one of `TRAFFIC`.
        exceptions: of a session on average, 0 to 4, by the scripted Ad-Wizard.
        max_seconds: the session is cut off (truncated) after this long [s].
        patience: the participant gives up (the episode terminates) when the car has come no nearer to its goal than it
            once was for this long [s].
        decision_frequency: decisions a second [Hz]; it divides the 30 Hz of the physics.
        weights: of the reward.
    """

    guidance: Guidance | str = Guidance.TURNS
    traffic: str = "light"
    exceptions: float = 0.0
    max_seconds: float = MAX_SECONDS
    patience: float = 60.0
    decision_frequency: float = DECISION_FREQUENCY
    weights: NavigationWeights = field(default_factory=NavigationWeights)

    def __post_init__(self) -> None:
        if self.guidance not in tuple(Guidance):
            raise ValueError(f"guidance is {str(self.guidance)!r}; it must be one of {', '.join(Guidance)}")
        object.__setattr__(self, "guidance", Guidance(self.guidance))
        if self.traffic not in TRAFFIC:
            raise ValueError(f"traffic is {self.traffic!r}; it must be one of {', '.join(TRAFFIC)}")
        if not 0.0 <= self.exceptions <= MOST_TRICKS:
            raise ValueError(f"exceptions is {self.exceptions}; it must be in 0..{MOST_TRICKS:g} a session")
        if not 10.0 <= self.patience <= 86400.0:
            raise ValueError(f"patience is {self.patience}; it must be in 10..86400 s")
        EnvConfig(decision_frequency=self.decision_frequency, max_seconds=self.max_seconds)  # which checks them

    @property
    def session(self) -> EnvConfig:
        """Settings of the session that is driven in."""
        vehicles, pedestrians = TRAFFIC[self.traffic]
        return EnvConfig(
            decision_frequency=self.decision_frequency,
            max_seconds=self.max_seconds,
            world=WorldConfig(vehicles=vehicles, pedestrians=pedestrians),
        )


def weights_of(reward: str | NavigationWeights) -> NavigationWeights:
    """Weights by name or as they are; raises `ValueError` where there is no such name."""
    if isinstance(reward, NavigationWeights):
        return reward
    if reward not in REWARDS:
        raise ValueError(f"reward is {reward!r}; it must be one of {', '.join(REWARDS)}, or NavigationWeights")
    return REWARDS[reward]
