"""What the participant and the Co-Wizard say to each other: who speaks when, what is heard, and how it is annotated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dorothie_gym.dialogue import (
    Annotator,
    AsrChannel,
    Conversation,
    Recogniser,
    Span,
    Utterance,
    draw_style,
    guess_spans,
    word_act,
)
from dorothie_gym.engine.config import EnvConfig
from dorothie_gym.engine.scenario import Scenario
from dorothie_gym.ontology import AGENT_ROLES, DialogueAct, GoalStatus, LandmarkName, Role
from dorothie_gym.spaces import Speech, plain_text
from dorothie_gym.spaces.limits import UTTERANCE_LENGTH


@dataclass(frozen=True, kw_only=True)
class HeardUtterance:
    """An utterance whose words are over.

    Attributes:
        said: what was said.
        heard: what the recogniser made of it.
        understood: acts that the Co-Wizard may take from it.
        records: data of an event for each of its spans.
    """

    said: Utterance
    heard: Utterance
    understood: tuple[DialogueAct, ...]
    records: tuple[dict[str, Any], ...]


class DialogueChannel:
    """The talk of a session.

    Attributes:
        said: all utterances that were heard so far.
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
    ) -> None:
        """Begins in silence.

        Args:
            scenario: of the session.
            config: of the environment.
            spans: acts of an utterance at most.
            words: seed of the words of acts that come without.
            ears: seed of what is misheard.
            styles: seed of how the speakers talk.
        """
        storyboard = scenario.storyboard
        self.said: list[Utterance] = []
        self._acts_show, self._misheard = config.observe_acts, bool(config.word_error_rate)
        self._conversation = Conversation(config.words_per_second, spans)
        self._annotator = Annotator(storyboard.landmarks[subgoal.landmark].name for subgoal in storyboard.subgoals)
        self._words, rng = np.random.default_rng(words), np.random.default_rng(styles)
        self._styles = {role: draw_style(role, rng) for role in (Role.PARTICIPANT, Role.CO_WIZARD)}
        self._recogniser = Recogniser(AsrChannel(rate=config.word_error_rate), np.random.default_rng(ears))

    @property
    def exchanges(self) -> int:
        """How many exchanges there were."""
        return len(self._annotator.exchanges)

    @property
    def transactions(self) -> int:
        """How many transactions there were."""
        return len(self._annotator.transactions)

    def say(self, role: Role, speech: Speech, now: float) -> str | None:
        """Begins an utterance at a time [s], or goes on with one; returns the reason where it is refused."""
        text = speech.text.strip() or self._worded(speech.act, role)
        return self._conversation.say(role, Span(text, speech.act), now)

    def note(self, landmark: LandmarkName, status: GoalStatus) -> None:
        """Takes note of what became of a place, which ends transactions."""
        self._annotator.note(landmark, status)

    def deliver(self, now: float) -> list[HeardUtterance]:
        """Hands out the utterances whose words are over at a time [s], in the order in which they began."""
        heard = [self._hear(utterance) for utterance in self._conversation.deliver(now)]
        self._annotator.tick(now)
        return heard

    def speaking(self, now: float) -> dict[Role, float]:
        """For how long each role still speaks at a time [s]."""
        return {role: self._conversation.speaking(role, now) for role in AGENT_ROLES}

    def _worded(self, act: DialogueAct, role: Role) -> str:
        """Words for an act that came without, in the speaker's style."""
        return plain_text(word_act(act, role, self._words, style=self._styles[role]), UTTERANCE_LENGTH)

    def _hear(self, utterance: Utterance) -> HeardUtterance:
        heard = self._recogniser.hear(utterance)
        # The Co-Wizard's beliefs are of what it takes itself, and the human, to have said.
        understood = self._understood(utterance if utterance.speaker is Role.CO_WIZARD else heard)
        records = self._records(utterance, heard)
        self.said.append(utterance)
        return HeardUtterance(said=utterance, heard=heard, understood=understood, records=records)

    def _understood(self, utterance: Utterance) -> tuple[DialogueAct, ...]:
        """What the Co-Wizard may take from an utterance: its acts, or where they do not show, what words sound like."""
        if self._acts_show:
            return utterance.acts
        return tuple(span.act for span in guess_spans(utterance.text))

    def _records(self, utterance: Utterance, heard: Utterance) -> tuple[dict[str, Any], ...]:
        exchanges, transaction = self._annotator.update(utterance)
        transcript = {"recognised": heard.text} if self._misheard else {}
        return tuple(
            {
                "utterance": len(self.said),
                "text": utterance.text,
                **transcript,
                "span": span.text,
                "move": span.act.move.label,
                "slots": {label: list(values) for label, values in span.act.slot_labels().items()},
                "exchange": exchange,
                "transaction": transaction,
                "start": round(utterance.start, 3),
                "end": round(utterance.end, 3),
            }
            for span, exchange in zip(utterance.spans, exchanges, strict=True)
        )
