"""Dialogue channel between participant and Co-Wizard: turn-taking, speech recognition, understanding, annotation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from dorothie_gym import dialogue  # lazy: words and their recognition are made when a session needs them
from dorothie_gym.dialogue.conversation import Conversation, Span, Utterance
from dorothie_gym.dialogue.transactions import Annotator
from dorothie_gym.ontology.dialogue_acts import DialogueAct
from dorothie_gym.ontology.roles import AGENT_ROLES, Role
from dorothie_gym.ontology.slots import GoalStatus, LandmarkName
from dorothie_gym.session.config import ChannelKind, EnvConfig
from dorothie_gym.session.providers import CabinState, SpokenChannel, signal_to_noise, speak_aloud
from dorothie_gym.session.scenario import Scenario
from dorothie_gym.session.spaces.actions import Speech
from dorothie_gym.session.spaces.fields import UTTERANCE_LENGTH, plain_text

if TYPE_CHECKING:
    from dorothie_gym.support.audio import Samples

SpanRecord: TypeAlias = dict[str, object]
"""Event data of one span."""


@dataclass(frozen=True, kw_only=True)
class DeliveredUtterance:
    """Utterance that is over, as the engine delivers it to observations, beliefs and the record.

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
        said: all utterances that are over, as they were spoken.
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
            spans: largest number of acts in an utterance.
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
        text = speech.text.strip() or self._worded(speech.act, role)
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
        """Returns the utterances that are over at a time [s], in the order in which they started.

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
