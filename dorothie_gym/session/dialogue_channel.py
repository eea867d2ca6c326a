"""Dialogue channel between participant and Co-Wizard: turn-taking, speech recognition, understanding, annotation.

The noise in the cabin decides how well speech is recognised. Its levels follow published laws of growth; their
reference points, like those of rain and talk, are set by hand to ordinary values of a passenger car.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from dorothie_gym import dialogue  # lazy: words and their recognition are made when a session needs them
from dorothie_gym.dialogue.conversation import Conversation, Span, Utterance
from dorothie_gym.dialogue.transactions import Annotator
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.world_exceptions import WeatherParameter
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.providers import SpokenChannel, speak_aloud
from dorothie_gym.session.spaces.fields import UTTERANCE_LENGTH, plain_text
from dorothie_gym.support import portable_math as pm
from dorothie_gym.support.copying import shared

if TYPE_CHECKING:
    from dorothie_gym.ontology.slots import GoalStatus, LandmarkName
    from dorothie_gym.session.scenario import Scenario
    from dorothie_gym.session.spaces.actions import Speech
    from dorothie_gym.sim.world import World
    from dorothie_gym.support.audio import Samples

SpanRecord: TypeAlias = dict[str, object]
"""Event data of one span."""


@dataclass(frozen=True, kw_only=True)
class DeliveredUtterance:
    """Utterance that has ended, as the engine delivers it to observations, beliefs and the record.

    A policy reads it back from its observation as a `HeardUtterance`.

    Attributes:
        said: the utterance as it was spoken.
        heard: the utterance as the listener recognises it, with the acts that belong to the recognised words.
        understood: acts that the belief tracker reads: those of `heard`, or where acts are not observed, those that the
            classifier finds in its words.
        records: event data of each span.
    """

    said: Utterance
    heard: Utterance
    understood: tuple[DialogueAct, ...]
    records: tuple[SpanRecord, ...]


class DialogueChannel:
    """Dialogue of a session.

    Attributes:
        said: all utterances that have ended, as spoken.
    """

    def __init__(
        self,
        scenario: Scenario,
        config: EnvConfig,
        spans: int,
        *,
        words: np.random.SeedSequence,
        ears: np.random.SeedSequence,
        styles: np.random.SeedSequence,
        voices: np.random.SeedSequence,
    ) -> None:
        """Begins without an utterance.

        Args:
            scenario: scenario of the session.
            config: settings of the session.
            spans: maximum number of acts in an utterance.
            words: seed of the wording of acts without words.
            ears: seed of the recognition errors.
            styles: seed of the speakers' styles.
            voices: seed of voices and noise, if the channel is speech.

        Raises:
            SpeechError: the channel is speech and the extra `speech` is not installed.
        """
        storyboard = scenario.storyboard
        self.said: list[Utterance] = []
        self._observe_acts, self._misheard = config.observe_acts, bool(config.word_error_rate)
        self._conversation = Conversation(config.words_per_second, spans)
        self._annotator = Annotator(storyboard.landmarks[subgoal.landmark].name for subgoal in storyboard.subgoals)
        self._seeds = words, ears, styles
        self._rate = config.word_error_rate
        self._titles = scenario.titles
        self._spoken: SpokenChannel | None = None
        if config.channel is ChannelKind.SPEECH:
            self._misheard = True
            self._spoken = speak_aloud(voices, words_per_second=config.words_per_second, classify=config.observe_acts)

    # made when the first utterance needs them: there are sessions without words

    @cached_property
    def _words(self) -> np.random.Generator:
        return np.random.default_rng(self._seeds[0])

    @cached_property
    def _recogniser(self) -> dialogue.Recogniser:
        ears = np.random.default_rng(self._seeds[1])
        return dialogue.Recogniser(dialogue.AsrChannel(rate=self._rate), ears, classify=self._observe_acts)

    @cached_property
    def _styles(self) -> dict[Role, dialogue.SpeakerStyle]:
        rng = np.random.default_rng(self._seeds[2])
        return {role: dialogue.draw_style(role, rng) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}

    @property
    def exchanges(self) -> int:
        """Number of exchanges so far."""
        return len(self._annotator.exchanges)

    @property
    def transactions(self) -> int:
        """Number of transactions so far."""
        return len(self._annotator.transactions)

    def say(self, role: Role, speech: Speech, now: float) -> str | None:
        """Starts or continues an utterance at a time [s]; returns the reason of a refusal."""
        text = self._titles.heard(speech.text.strip()) or self._worded(speech.act, role)
        span = Span(text, speech.act, speech.meaning)
        if self._spoken is None:
            return self._conversation.say(role, span, now, speech.onset, speech.pace)
        return self._say_aloud(self._spoken, role, span, speech, now)

    def _say_aloud(self, spoken: SpokenChannel, role: Role, span: Span, speech: Speech, now: float) -> str | None:
        if not self._conversation.has_room(role):
            return self._conversation.say(role, span, now)  # refuses
        samples = spoken.speak(role, span.text, speech.pace)
        reason = self._conversation.say(role, span, now, speech.onset, seconds=spoken.seconds(samples))
        utterance = self._conversation.in_air(role)
        assert utterance is not None
        spoken.begin(role, samples, utterance.end)
        return reason

    def give_voices(self, pitches: Mapping[Role, float]) -> None:
        """Gives speakers a pitch of their own, see `SpokenChannel.give_voices`; without effect on the text channel."""
        if self._spoken is not None:
            self._spoken.give_voices(pitches)

    def note(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Updates the annotation with a change of a subgoal's status, which ends transactions."""
        self._annotator.note(landmark, status)

    def deliver(self, now: float, cabin: Callable[[], CabinState]) -> list[DeliveredUtterance]:
        """Returns the utterances that have ended at a time [s], in the order of their starts.

        Args:
            now: the time [s].
            cabin: returns the state of the car, for the noise.
        """
        if self._spoken is not None:
            self._spoken.recordings = {}
        delivered = [self._hear(utterance, cabin) for utterance in self._conversation.deliver(now)]
        self._annotator.tick(now)
        return delivered

    @property
    def recordings(self) -> Mapping[str, Samples]:
        """Audio of the spans that were delivered last, by file name; empty for a text channel."""
        return {} if self._spoken is None else self._spoken.recordings

    @property
    def in_progress(self) -> list[Utterance]:
        """Utterances that have begun and are not over, in the order of their starts."""
        begun = [self._conversation.in_air(role) for role in AGENT_ROLES]
        return sorted((each for each in begun if each is not None), key=lambda each: each.start)

    def speaking(self, now: float) -> dict[Role, float]:
        """Returns the remaining speaking time of each role at a time [s]."""
        return {role: self._conversation.speaking(role, now) for role in AGENT_ROLES}

    def _worded(self, act: DialogueAct, role: Role) -> str:
        """Returns words for an act, in the style of the speaker."""
        return plain_text(dialogue.word_act(act, role, self._words, style=self._styles[role]), UTTERANCE_LENGTH)

    def _hear(self, utterance: Utterance, cabin: Callable[[], CabinState]) -> DeliveredUtterance:
        if self._spoken is None:
            heard = self._recogniser.hear(utterance, self._noise(cabin)) if self._rate else utterance
        else:
            heard = self._spoken.hear(utterance, len(self.said), cabin())
        # The Co-Wizard understands its own utterances as spoken, and those of the participant as recognised.
        understood = self._understood(utterance if utterance.speaker is Role.CO_WIZARD else heard)
        records = self._records(utterance, heard)
        self.said.append(utterance)
        return DeliveredUtterance(said=utterance, heard=heard, understood=understood, records=records)

    @staticmethod
    def _noise(cabin: Callable[[], CabinState]) -> dialogue.Loudness:
        return dialogue.Loudness.of(signal_to_noise(cabin()))

    def _understood(self, utterance: Utterance) -> tuple[DialogueAct, ...]:
        """Returns the acts of an utterance, or those classified from its words where acts are not observed."""
        if self._observe_acts:
            return utterance.acts
        return tuple(span.act for span in dialogue.guess_spans(utterance.text))

    def _records(self, utterance: Utterance, heard: Utterance) -> tuple[SpanRecord, ...]:
        exchanges, transaction = self._annotator.update(utterance)
        transcript = {"recognised": heard.text} if self._misheard else {}
        return tuple(
            {
                "utterance": len(self.said),
                "text": utterance.text,
                **transcript,
                "span": span.text,
                **({"fluent": plain} if (plain := dialogue.fluent(span.text)) != span.text else {}),
                "move": span.act.move.label,
                "slots": {label: list(values) for label, values in span.act.slot_labels().items()},
                **({"meaning": [said.to_json() for said in span.meaning]} if span.meaning else {}),
                "exchange": exchange,
                "transaction": transaction,
                "start": round(utterance.start, 3),
                "end": round(utterance.end, 3),
                **({} if self._spoken is None else {"audio": self._spoken.audio_name(len(self.said), place)}),
            }
            for place, (span, exchange) in enumerate(zip(utterance.spans, exchanges, strict=True))
        )


# --- Noise in the cabin -----------------------------------------------------------------------------------------------

_IDLE: Final = 42.0
"""Level of a car with a running engine at a standstill [dB(A)]."""


_ROAD: Final = (57.0, 50.0 / 3.6, 30.0)
"""Level of tyres and drive train [dB(A)] at a speed [m/s], and its growth by a factor of ten of speed [dB]: tyre noise
grows with 30 log10 of speed, the usual regression (Sandberg and Ejsmont, Tyre/Road Noise Reference Book, 2002)."""


_AIR: Final = (62.0, 100.0 / 3.6, 60.0)
"""Likewise of the airflow: sound of forces on bodies grows with the sixth power of velocity (Curle, Proceedings of the
Royal Society A 231, 1955)."""


_STRONGEST_WIND: Final = 15.0
"""Velocity of the wind at 100 percent [m/s], the lower limit of a gale."""


_RAIN: Final = 60.0
"""Level of the heaviest rain on the roof [dB(A)]; half the rain is 3 dB less."""


_TALK: Final = 56.0
"""Level of one other talker at the back of the car, away from the microphone [dB(A)]."""


_SPEECH: Final = 65.0
"""Level of speech of normal effort at half a metre from the lips [dB]: 62.35 dB at a metre by ANSI S3.5-1997, which
would be 68 dB in a free field; less for the usual position of the microphone beside the speaker."""


_LOMBARD: Final = (45.0, 0.6)
"""Level of noise [dB(A)] from which speakers raise their voices, and by how much for each further dB (Pearsons, Bennett
and Fidell, Speech Levels in Various Noise Environments, EPA-600/1-77-025, 1977)."""


@shared
@dataclass(frozen=True, kw_only=True)
class CabinState:
    """State of the world that makes noise in the car.

    Attributes:
        speed: speed of the car [m/s], not negative.
        rain: rain [percent], 0 to 100.
        wind: wind [percent], 0 to 100.
        talkers: number of other people who talk, not negative.

    Raises:
        ValueError: a field is out of its range.
    """

    speed: float = 0.0
    rain: float = 0.0
    wind: float = 0.0
    talkers: int = 0

    def __post_init__(self) -> None:
        if not 0.0 <= self.speed < 200.0:
            raise ValueError(f"CabinState.speed is {self.speed}; it must be in 0..200 m/s")
        for name, value in (("rain", self.rain), ("wind", self.wind)):
            if not 0.0 <= value <= 100.0:
                raise ValueError(f"CabinState.{name} is {value}; it must be in 0..100 percent")
        if not 0 <= self.talkers <= 100:
            raise ValueError(f"CabinState.talkers is {self.talkers}; it must be in 0..100")


def cabin_of(world: World) -> CabinState:
    """Returns the current sources of noise in the car of a world."""
    weather = world.weather.values
    return CabinState(
        speed=abs(float(world.car.speed)),
        rain=weather[WeatherParameter.PRECIPITATION],
        wind=weather[WeatherParameter.WIND_INTENSITY],
    )


def noise_levels(state: CabinState) -> dict[str, float]:
    """Returns the levels of the sources that sound [dB(A)], by name: "idle", "road", "air", "rain", "talk"."""
    found = {"idle": _IDLE}
    airflow = state.speed + _STRONGEST_WIND * state.wind / 100.0
    for name, velocity, (level, reference, growth) in (("road", state.speed, _ROAD), ("air", airflow, _AIR)):
        if velocity > 1.0:
            found[name] = level + growth * pm.log10(velocity / reference)
    if state.rain > 0.0:
        found["rain"] = _RAIN + 10.0 * pm.log10(state.rain / 100.0)
    if state.talkers:
        found["talk"] = _TALK + 10.0 * pm.log10(state.talkers)
    return found


def noise_level(state: CabinState) -> float:
    """Returns the level of all noise together [dB(A)]."""
    return 10.0 * pm.log10(sum(pm.power(10.0, level / 10.0) for level in noise_levels(state).values()))


def signal_to_noise(state: CabinState) -> float:
    """Returns the ratio of speech to noise at the microphone [dB], both A-weighted; speakers raise their voices."""
    noise = noise_level(state)
    threshold, slope = _LOMBARD
    return _SPEECH + slope * max(noise - threshold, 0.0) - noise
