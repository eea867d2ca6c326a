"""What listeners get of an utterance where a recogniser stands between speaker and listener."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dorothie_gym.dialogue.exchanges import PATIENCE
from dorothie_gym.dialogue.guessing import guess_act
from dorothie_gym.dialogue.mishearing import Channel, same_words
from dorothie_gym.dialogue.utterances import Span, Utterance
from dorothie_gym.ontology import DialogueMove, Role


class Recogniser:
    """Hears the utterances of a session, one after the other, through a `Channel`.

    Words that are heard right keep the act that was meant. Of a span that is misheard only the heard words count: its
    act is what rules read from them, so that an act that comes along with the words never tells what they were.
    """

    def __init__(self, channel: Channel, rng: np.random.Generator) -> None:
        """Begins a session.

        Args:
            channel: how badly it hears.
            rng: source of chance; nothing is drawn where the channel's rate is 0.
        """
        self._channel, self._rng = channel, rng
        self._open: dict[Role, tuple[DialogueMove, float]] = {}

    def hear(self, utterance: Utterance) -> Utterance:
        """Returns the utterance as it is heard: the same spans with heard words, and with acts that fit them.

        Args:
            utterance: what was said; utterances have to come in the order in which they end.
        """
        if self._channel.rate == 0:
            return utterance
        after = self._answered_by(utterance)
        spans = []
        for place, span in enumerate(utterance.spans):
            text = self._channel.transcribe(span.text, self._rng)
            act = span.act if same_words(text, span.text) else guess_act(text, after if place == 0 else None)
            spans.append(Span(text, act))
        self._open[utterance.speaker] = (utterance.spans[-1].act.move, utterance.end)
        return replace(utterance, spans=tuple(spans))

    def _answered_by(self, utterance: Utterance) -> DialogueMove | None:
        """The last move of somebody else that still waits for an answer; an utterance answers it for good."""
        waiting = [(end, move) for role, (move, end) in self._open.items() if role is not utterance.speaker]
        self._open = {role: opened for role, opened in self._open.items() if role is utterance.speaker}
        end, move = max(waiting, default=(-np.inf, None))
        return move if utterance.start - end < PATIENCE else None
