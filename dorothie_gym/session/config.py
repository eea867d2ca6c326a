"""Settings of a session: cameras, perception, channel, and the views in which it is drawn."""

from __future__ import annotations

import enum
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field

from dorothie_gym.dialogue.conversation import USUAL_WORD_ERROR_RATE, WORDS_PER_SECOND
from dorothie_gym.session.rewards import RewardWeights
from dorothie_gym.session.sensor_config import (
    SensorConfig,
    SensorMount,
    check_bounds,
    check_flags,
    check_type,
    check_whole,
    checked_outputs,
)
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.support.copying import shared
from dorothie_gym.tasks.briefs import TalkFamily
from dorothie_gym.tasks.storyboard_specification import StoryboardSource

# --- First-person camera ----------------------------------------------------------------------------------------------


class CameraOutput(enum.StrEnum):
    """Part of a picture. All but RGB are ground truth, which no camera gives: privileged."""

    RGB = "rgb"
    """Colours (h, w, 3) uint8."""
    DEPTH = "depth"
    """Distance along the axis of the camera [m] (h, w) float32, infinite for the sky."""
    SEMANTIC = "semantic"
    """Class of the ontology, `ObjectClass` (h, w) uint8."""
    INSTANCE = "instance"
    """Key of the body (h, w) int32, 0 for none."""
    BOXES = "boxes"
    """Boxes around the visible pixels of each body."""
    OPTICAL_FLOW = "optical_flow"
    """Movement of the visible surface of each pixel since the picture of the previous decision [pixels], to the right
    and down (h, w, 2) float32; 0 in the first picture, and for surfaces that were behind the camera."""
    NORMALS = "normals"
    """Unit normal of the surface towards the camera, as components to the right, down and forward (h, w, 3) float32;
    0 for the sky."""
    BIRDS_EYE = "birds_eye"
    """`ObjectClass` of what is below each point of a square grid around the camera, seen from above (h, w) uint8: the
    camera is in the centre and looks up the picture, `CameraConfig.metres_per_pixel`. Crowns of trees, and what hangs
    above the car, such as bridges, are left out; 0 beyond the map."""


@shared
@dataclass(frozen=True, kw_only=True)
class CameraMount(SensorMount):
    """Place and direction of a camera on the car, by default behind the windscreen; see `SensorMount`."""

    forward: float = 0.35
    up: float = 1.45
    pitch: float = -2.0


@shared
@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """Settings of a camera.

    Attributes:
        width: width of the picture [pixels].
        height: height of the picture [pixels].
        field_of_view: horizontal [degrees].
        mount: place on the car.
        outputs: parts of a picture; all but `CameraOutput.RGB` are privileged.
        antialiasing: whether edges are smoothed with 2 x 2 samples in a pixel.
        shadows: whether the sun casts shadows.
        metres_per_pixel: width of a pixel of `CameraOutput.BIRDS_EYE` [m].

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    width: int = 480
    height: int = 320
    field_of_view: float = 90.0
    mount: CameraMount = CameraMount()
    outputs: tuple[CameraOutput, ...] = (CameraOutput.RGB,)
    antialiasing: bool = True
    shadows: bool = True
    metres_per_pixel: float = 0.25

    def __post_init__(self) -> None:
        check_whole(self, (("width", 8, 4096, "pixels"), ("height", 8, 4096, "pixels")))
        check_bounds(self, (("field_of_view", 10.0, 150.0, "degrees"), ("metres_per_pixel", 0.02, 5.0, "m")))
        check_type(self, "mount", CameraMount)
        check_flags(self, ("antialiasing", "shadows"))
        object.__setattr__(self, "outputs", checked_outputs(self, self.outputs, CameraOutput))

    @property
    def samples(self) -> int:
        """Number of samples along each side of a pixel."""
        return 2 if self.antialiasing else 1


# --- Session ----------------------------------------------------------------------------------------------------------


class PerceptionModel(enum.StrEnum):
    """Bodies and landmarks that the participant and the Co-Wizard see."""

    SYMBOLIC = "symbolic"
    """All bodies around the car that are near enough for the weather."""

    CAMERA = "camera"
    """Objects visible in the picture of the camera on the car: in front of it, and not hidden."""


class ChannelKind(enum.StrEnum):
    """Channel of the words between participant and Co-Wizard."""

    TEXT = "text"
    """Text with simulated recognition errors, `EnvConfig.word_error_rate`."""

    SPEECH = "speech"
    """Synthesised speech in the noise of the car, which is recognised."""


@shared
@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Settings of a session, of `DuoWizardEnv` and of the single-role environments.

    Attributes:
        decision_frequency: decisions per second [Hz]; a divisor of the 30 Hz of the physics.
        max_seconds: simulated time after which the session is truncated [s]. The default is a minimum on maps where
            cars follow the speed limits, see `time_allowed.time_allowed`.
        words_per_second: speaking rate of all roles [words/s].
        observe_acts: whether utterances are observed with their acts (move and slots), or as text only.
        word_error_rate: word error rate of the speech recognition between participant and Co-Wizard, in [0, 1); 0 for
            an exact channel. They observe the transcript; a misrecognised span carries the act that the classifier
            reads from its transcript. The Ad-Wizard observes the spoken words.
        world: settings of traffic, pedestrians and sensing.
        rewards: weights of the reward terms.
        camera: first-person camera on the car, observed by the participant and the Co-Wizard; None for no camera.
            It has no other effect on a session.
        cameras: further cameras by name, such as `{"left": CameraConfig(mount=CameraMount(yaw=-90.0))}`: their fields
            begin with the name ("left_camera"). Names are lower-case words other than lidar.
        sensors: further sensors of the car, observed by the Co-Wizard.
        perception: perception model of the participant and the Co-Wizard. With `PerceptionModel.CAMERA` they observe
            the objects that a picture shows, and the Co-Wizard also the hidden landmarks that have been in view. The
            car's own safety functions are not affected.
        channel: channel of the words between participant and Co-Wizard. With `ChannelKind.SPEECH` they are
            synthesised, mixed with the noise of the car and recognised; `word_error_rate` is then not used, and
            utterances take as long as their audio. Needs the extra `speech`.
        time_factor: time after which the session is truncated as a multiple of the reference time of its scenario
            (`Scenario.reference`); `max_seconds` is then an upper bound. None for `max_seconds` alone.
        stops: range of the number of stops, the subgoals at the start, of drawn storyboards; None draws from all.
        storyboards: storyboards that are drawn: those of the package, or a generated one for each session.
        talk: family of talk tasks that replace drawn storyboards, see `dorothie_gym.session.talk_tasks`; None draws
            storyboards.
    """

    decision_frequency: float = 2.0
    max_seconds: float = 900.0
    words_per_second: float = WORDS_PER_SECOND
    observe_acts: bool = True
    word_error_rate: float = USUAL_WORD_ERROR_RATE
    world: WorldConfig = field(default_factory=WorldConfig)
    rewards: RewardWeights = field(default_factory=RewardWeights)
    camera: CameraConfig | None = None
    cameras: Mapping[str, CameraConfig] = field(default_factory=dict, hash=False)
    sensors: SensorConfig = SensorConfig()
    perception: PerceptionModel = PerceptionModel.SYMBOLIC
    channel: ChannelKind = ChannelKind.TEXT
    time_factor: float | None = None
    stops: tuple[int, int] | None = None
    storyboards: StoryboardSource = StoryboardSource.SHIPPED
    talk: TalkFamily | None = None

    def __post_init__(self) -> None:
        frames = FRAME_RATE / self.decision_frequency if self.decision_frequency > 0 else 0.5
        if abs(frames - round(frames)) > 1e-9 or not 1 <= frames <= 10 * FRAME_RATE:
            raise ValueError(
                f"EnvConfig.decision_frequency is {self.decision_frequency}; "
                f"it must divide {FRAME_RATE} Hz and be in 0.1..30"
            )
        if not 1.0 <= self.max_seconds <= 86400.0:
            raise ValueError(f"EnvConfig.max_seconds is {self.max_seconds}; it must be in 1..86400 s")
        if not 0.5 <= self.words_per_second <= 20.0:
            raise ValueError(f"EnvConfig.words_per_second is {self.words_per_second}; it must be in 0.5..20")
        if not 0.0 <= self.word_error_rate < 1.0:
            raise ValueError(f"EnvConfig.word_error_rate is {self.word_error_rate}; it must be at least 0 and below 1")
        self._check_sensors()
        if self.perception not in (models := list(map(str, PerceptionModel))):
            raise ValueError(f"EnvConfig.perception is {self.perception!r}; it must be {' or '.join(models)}")
        object.__setattr__(self, "perception", PerceptionModel(self.perception))
        if self.channel not in (kinds := list(map(str, ChannelKind))):
            raise ValueError(f"EnvConfig.channel is {self.channel!r}; it must be {' or '.join(kinds)}")
        object.__setattr__(self, "channel", ChannelKind(self.channel))
        if self.time_factor is not None and not 0.1 <= self.time_factor <= 100.0:
            raise ValueError(f"EnvConfig.time_factor is {self.time_factor}; it must be in 0.1..100, or None")
        if self.talk is not None:
            if self.talk not in (families := list(map(str, TalkFamily))):
                raise ValueError(f"EnvConfig.talk is {self.talk!r}; it must be {' or '.join(families)}, or None")
            object.__setattr__(self, "talk", TalkFamily(self.talk))
        if self.storyboards not in (sources := list(map(str, StoryboardSource))):
            raise ValueError(f"EnvConfig.storyboards is {self.storyboards!r}; it must be {' or '.join(sources)}")
        object.__setattr__(self, "storyboards", StoryboardSource(self.storyboards))
        self._check_stops()

    def _check_stops(self) -> None:
        if self.stops is None:
            return
        if len(self.stops) != 2 or not 1 <= self.stops[0] <= self.stops[1]:
            raise ValueError(f"EnvConfig.stops is {self.stops}; it must be a range (least, most) from 1, or None")
        object.__setattr__(self, "stops", tuple(self.stops))

    def _check_sensors(self) -> None:
        check_type(self, "camera", CameraConfig, optional=True)
        check_type(self, "sensors", SensorConfig)
        if not isinstance(self.cameras, Mapping):
            raise ValueError(
                f"EnvConfig.cameras is a {type(self.cameras).__name__}; it must map names to CameraConfigs"
            )
        for name, camera in self.cameras.items():
            if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]{0,30}", name):
                raise ValueError(f"EnvConfig.cameras has the name {name!r}; it must be a lower-case word, such as left")
            if not isinstance(camera, CameraConfig):
                raise ValueError(f"EnvConfig.cameras[{name!r}] is a {type(camera).__name__}; it must be a CameraConfig")
        if "lidar" in self.cameras:
            raise ValueError("EnvConfig.cameras has the name 'lidar', with which the fields of the lidar begin")
        object.__setattr__(self, "cameras", dict(self.cameras))

    @property
    def all_cameras(self) -> dict[str, CameraConfig]:
        """All cameras by name; that of `camera` has the empty name."""
        return {**({} if self.camera is None else {"": self.camera}), **self.cameras}

    @property
    def has_sensors(self) -> bool:
        """Whether the car has a camera or another sensor."""
        return self.draws or self.sensors.measures

    @property
    def draws(self) -> bool:
        """Whether there is a camera, lidar or radar, which need the scene of the session."""
        return self.camera is not None or bool(self.cameras) or self.sensors.scans

    @property
    def frames(self) -> int:
        """Number of physics frames between two decisions."""
        return round(FRAME_RATE / self.decision_frequency)

    def record(self) -> dict[str, object]:
        """Returns the settings in JSON types, for records.

        They lack cameras and sensors, which have no effect on a session, and the usual perception, channel, time,
        stops and storyboards, so that records are equal to those of versions without a choice.
        """
        settings = {**asdict(self), "world": self.world.record()}
        for name in ("camera", "cameras", "sensors"):
            del settings[name]
        for name in ("perception", "channel", "storyboards"):
            value = settings.pop(name)
            if value is not getattr(EnvConfig, name):
                settings[name] = str(value)
        if self.time_factor is None:
            del settings["time_factor"]
        if settings.pop("stops") is not None:
            settings["stops"] = list(self.stops or ())
        if settings.pop("talk") is not None:
            settings["talk"] = str(self.talk)
        return settings


# --- Views ------------------------------------------------------------------------------------------------------------


class RenderView(enum.StrEnum):
    """View of a session."""

    MAP = "map"
    """Map around the car, with tasks and talk (800, 1280, 3)."""
    CAMERA = "camera"
    """Picture of the camera behind the windscreen (720, 1280, 3)."""
    BOTH = "both"
    """Windscreen, subtitles, map and tasks (720, 1280, 3)."""


def checked_view(name: str) -> RenderView:
    """Returns the view with a name.

    Raises:
        ValueError: there is no such view; lists them.
    """
    if name not in [view.value for view in RenderView]:
        raise ValueError(f"render_view is {name!r}; it must be one of {', '.join(RenderView)}")
    return RenderView(name)
