"""Settings of the navigation environments: difficulty, guidance and observation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from dorothie_gym.policies.ad_wizard import MOST_TRICKS
from dorothie_gym.policies.navigation.instructor import Guidance
from dorothie_gym.policies.navigation.observation_fields import DECISION_FREQUENCY, MAX_SECONDS
from dorothie_gym.session.config import CameraConfig, CameraOutput, EnvConfig
from dorothie_gym.session.rewards import NavigationWeights
from dorothie_gym.sim.config import WorldConfig
from dorothie_gym.support.copying import shared
from dorothie_gym.support.input_files import settings_of

TRAFFIC: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"none": (0, 0), "light": (4, 2), "medium": (10, 4), "heavy": (30, 20)}
)
"""Numbers of vehicles and pedestrians of each traffic density; upper bounds where the town is small."""


OBSERVATIONS: Final = ("vector", "camera")
"""Kinds of observations."""

SMALL_CAMERA: Final = CameraConfig(width=84, height=84)
"""Camera of drivers unless another one is given."""


@shared
@dataclass(frozen=True, kw_only=True)
class NavigationConfig:
    """Settings of `NavigationEnv`.

    Attributes:
        guidance: a `Guidance` or its name.
        traffic: one of `TRAFFIC`.
        exceptions: average number of exceptions in a session, 0 to 4, by the scripted Ad-Wizard.
        max_seconds: time after which the session is truncated [s].
        patience: time without progress after which the participant gives up and the episode terminates [s].
        decision_frequency: decisions per second [Hz]; it divides the 30 Hz of the physics.
        weights: weights of the reward terms.
        observation: one of `OBSERVATIONS`.
        camera: camera of the observation "camera", with RGB only; None for `SMALL_CAMERA`.

    Raises:
        ValueError: a setting is out of its range; names the field.
    """

    guidance: Guidance | str = Guidance.TURNS
    traffic: str = "light"
    exceptions: float = 0.0
    max_seconds: float = MAX_SECONDS
    patience: float = 60.0
    decision_frequency: float = DECISION_FREQUENCY
    weights: NavigationWeights = field(default_factory=NavigationWeights)
    observation: str = "vector"
    camera: CameraConfig | None = None

    def __post_init__(self) -> None:
        if self.guidance not in tuple(Guidance):
            raise ValueError(
                f"NavigationConfig.guidance is {str(self.guidance)!r}; it must be one of {', '.join(Guidance)}"
            )
        object.__setattr__(self, "guidance", Guidance(self.guidance))
        if self.traffic not in TRAFFIC:
            raise ValueError(f"NavigationConfig.traffic is {self.traffic!r}; it must be one of {', '.join(TRAFFIC)}")
        if not 0.0 <= self.exceptions <= MOST_TRICKS:
            raise ValueError(
                f"NavigationConfig.exceptions is {self.exceptions}; it must be in 0..{MOST_TRICKS:g} a session"
            )
        if not 10.0 <= self.patience <= 86400.0:
            raise ValueError(f"NavigationConfig.patience is {self.patience}; it must be in 10..86400 s")
        EnvConfig(decision_frequency=self.decision_frequency, max_seconds=self.max_seconds)  # validates both
        self._check_camera()

    def _check_camera(self) -> None:
        if self.observation not in OBSERVATIONS:
            raise ValueError(f"observation is {self.observation!r}; it must be one of {', '.join(OBSERVATIONS)}")
        if self.observation == "vector":
            if self.camera is not None:
                raise ValueError('camera is set, but observation is "vector"; choose observation="camera"')
            return
        camera = SMALL_CAMERA if self.camera is None else settings_of(self.camera, CameraConfig, "camera")
        if camera.outputs != (CameraOutput.RGB,):
            raise ValueError(f"camera.outputs is {camera.outputs}; drivers observe (CameraOutput.RGB,) only")
        object.__setattr__(self, "camera", camera)

    @property
    def session_config(self) -> EnvConfig:
        """Settings of the session."""
        vehicles, pedestrians = TRAFFIC[self.traffic]
        return EnvConfig(
            decision_frequency=self.decision_frequency,
            max_seconds=self.max_seconds,
            world=WorldConfig(vehicles=vehicles, pedestrians=pedestrians),
        )
