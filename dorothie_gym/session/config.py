"""Settings of a session."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from dorothie_gym.dialogue.conversation import USUAL_WORD_ERROR_RATE, WORDS_PER_SECOND
from dorothie_gym.session.camera_config import CameraConfig
from dorothie_gym.session.channel_kind import ChannelKind
from dorothie_gym.session.perception_model import PerceptionModel
from dorothie_gym.session.rewards import RewardWeights
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig
from dorothie_gym.support.copying import shared


@shared
@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Settings of a session, of `DuoWizardEnv` and of the single-role environments.

    Attributes:
        decision_frequency: decisions per second [Hz]; a divisor of the 30 Hz of the physics.
        max_seconds: simulated time after which the session is truncated [s].
        words_per_second: speaking rate of all roles [words/s].
        observe_acts: whether utterances are observed with their acts (move and slots), or as text only.
        word_error_rate: word error rate of the speech recognition between participant and Co-Wizard, in [0, 1); 0 for
            an exact channel. They observe the transcript; a misrecognised span carries the act that the classifier
            reads from its transcript. The Ad-Wizard observes the spoken words.
        world: settings of traffic, pedestrians and sensing.
        rewards: weights of the reward terms.
        camera: first-person camera on the car, whose pictures the participant and the Co-Wizard observe; None for none.
            It affects nothing else in a session.
        perception: perception model of the participant and the Co-Wizard. With `PerceptionModel.CAMERA` they observe
            the objects that a picture shows, and the Co-Wizard also the hidden landmarks that have been in view. The
            car's own safety functions are not affected.
        channel: channel of the words between participant and Co-Wizard. With `ChannelKind.SPEECH` they are
            synthesised, mixed with the noise of the car and recognised; `word_error_rate` is then not used, and
            utterances take as long as their audio. Needs the extra `speech`.
    """

    decision_frequency: float = 2.0
    max_seconds: float = 900.0
    words_per_second: float = WORDS_PER_SECOND
    observe_acts: bool = True
    word_error_rate: float = USUAL_WORD_ERROR_RATE
    world: WorldConfig = field(default_factory=WorldConfig)
    rewards: RewardWeights = field(default_factory=RewardWeights)
    camera: CameraConfig | None = None
    perception: PerceptionModel = PerceptionModel.SYMBOLIC
    channel: ChannelKind = ChannelKind.TEXT

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
        if self.camera is not None and not isinstance(self.camera, CameraConfig):
            raise ValueError(f"EnvConfig.camera is a {type(self.camera).__name__}; it must be a CameraConfig or None")
        if self.perception not in (models := list(map(str, PerceptionModel))):
            raise ValueError(f"EnvConfig.perception is {self.perception!r}; it must be {' or '.join(models)}")
        object.__setattr__(self, "perception", PerceptionModel(self.perception))
        if self.channel not in (kinds := list(map(str, ChannelKind))):
            raise ValueError(f"EnvConfig.channel is {self.channel!r}; it must be {' or '.join(kinds)}")
        object.__setattr__(self, "channel", ChannelKind(self.channel))

    @property
    def frames(self) -> int:
        """Number of physics frames between two decisions."""
        return round(FRAME_RATE / self.decision_frequency)

    def record(self) -> dict[str, object]:
        """Returns the settings in JSON types, for records.

        They lack the camera, which changes nothing in a session, and the usual perception and channel, so that records
        are equal to those of versions without a choice.
        """
        settings = asdict(self)
        del settings["camera"]
        for name in ("perception", "channel"):
            value = settings.pop(name)
            if value is not getattr(EnvConfig, name):
                settings[name] = str(value)
        return settings
