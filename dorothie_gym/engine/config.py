"""Settings of the environment."""

from __future__ import annotations

from dataclasses import dataclass, field

from dorothie_gym.dialogue import WORDS_PER_SECOND
from dorothie_gym.sim.config import FRAME_RATE, WorldConfig


@dataclass(frozen=True, kw_only=True)
class RewardWeights:
    """Weights of the reward's terms; the participant and the Co-Wizard share theirs, the Ad-Wizard gets the opposite.

    Attributes:
        subgoal: for each subgoal reached.
        success: at the end, if every live subgoal was reached and nothing was hit.
        collision: for each collision of the car's own making.
        time: for each second.
        talk: for each act that the role itself says (participant and Co-Wizard).
        refusal: for each action of the role that is refused.
    """

    subgoal: float = 1.0
    success: float = 5.0
    collision: float = -2.0
    time: float = -0.005
    talk: float = -0.01
    refusal: float = -0.02


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Settings of `DuoWizardEnv`.

    Attributes:
        decision_frequency: decisions a second [Hz]; it divides the 30 Hz of the physics.
        max_seconds: the session is cut off (truncated) after this long [s].
        words_per_second: how fast everybody speaks.
        observe_acts: whether others' words come with their acts (move and slots), or as text only.
        word_error_rate: how badly the participant and the Co-Wizard hear each other, in [0, 1): errors of a recogniser
            per word that is said. They then observe its transcript, and of words that were misheard no act but the one
            that rules read from the transcript. The Ad-Wizard observes what was said.
        world: traffic, pedestrians and the like.
        rewards: weights of the reward's terms.
    """

    decision_frequency: float = 2.0
    max_seconds: float = 900.0
    words_per_second: float = WORDS_PER_SECOND
    observe_acts: bool = True
    word_error_rate: float = 0.0
    world: WorldConfig = field(default_factory=WorldConfig)
    rewards: RewardWeights = field(default_factory=RewardWeights)

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

    @property
    def frames(self) -> int:
        """Physics frames between two decisions."""
        return round(FRAME_RATE / self.decision_frequency)
