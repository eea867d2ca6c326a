"""Effects of the Co-Wizard's own utterances and actions, inferred from its observations."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Self

from dorothie_gym.baselines.acting.history import History
from dorothie_gym.dialogue import Span, speech_seconds
from dorothie_gym.maps import Town
from dorothie_gym.ontology import PhysicalAction, Role
from dorothie_gym.policies.co_wizard.view import CoWizardView
from dorothie_gym.recording import FRAME_RATE
from dorothie_gym.spaces import Motion, Physical, Speech

_TICK: Final = 1e-6
"""Rounding tolerance of sums of decision periods [periods]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class HistoryTracker:
    """History with the pending utterance and action; every change returns a new object.

    Attributes:
        history: completed utterances and actions.
        air: spans of the own utterance that is being spoken.
        began: start of that utterance [s].
        tried: physical action of the last decision, None for none.
        before: observation of the last decision; None at first.
    """

    history: History
    air: tuple[Span, ...] = ()
    began: float = 0.0
    tried: Physical | None = None
    before: CoWizardView | None = None

    def acted(self, speech: Speech | None, physical: Physical | None, view: CoWizardView, most_spans: int) -> Self:
        """Returns the tracker with a decision.

        Args:
            speech: the utterance, with its words.
            physical: the physical action.
            view: observation that the decision was taken on.
            most_spans: largest number of acts in an utterance; further ones are refused.
        """
        air, began = self.air, self.began
        if speech is not None and len(air) < most_spans:
            began = began if air else view.time
            air = (*air, Span(speech.text, speech.act))
        return replace(self, air=air, began=began, tried=physical, before=view)

    def observed(self, view: CoWizardView, town: Town, heard: tuple[Span, ...]) -> Self:
        """Returns the tracker with the next observation.

        Args:
            view: the observation.
            town: the map.
            heard: spans of the participant's utterance that is over, empty for none.
        """
        history = self.history
        if self.tried is not None and self.before is not None and carried_out(self.tried, self.before, view):
            history = history.done(self.tried, history.frame)
        period = view.time - history.frame / FRAME_RATE if history.newest else 1.0
        history = history.seen(view, town)
        over = self.air if self.air and view.speaking == 0.0 else ()
        spoken = [(_start(heard, view.time, period), Role.PARTICIPANT, heard), (self.began, Role.CO_WIZARD, over)]
        for _, speaker, spans in sorted(spoken, key=lambda each: each[0]):
            if spans:
                history = history.said(speaker, spans, history.frame)
        return replace(self, history=history, air=() if over else self.air, tried=None, before=None)


def carried_out(tried: Physical, before: CoWizardView, after: CoWizardView) -> bool:
    """Returns whether an action appears to have been carried out.

    Args:
        tried: the action.
        before: observation that the action was chosen on.
        after: observation one decision later.
    """
    action = tried.action
    held, holds = before.motion is Motion.STOPPED, after.motion is Motion.STOPPED
    match action:
        case PhysicalAction.STOP:
            return not held
        case PhysicalAction.START:
            return held
        case PhysicalAction.SPEED_CHANGE:
            return (after.cruise > before.cruise) if tried.up else (after.cruise < before.cruise)
        case PhysicalAction.LIGHT_CHANGE:
            return before.lights is not tried.up
    if held:
        return not holds  # an executed action ends the stop, a refused one does not
    if action is PhysicalAction.LANE_FOLLOW:
        return before.manoeuvre is not None and after.manoeuvre is None
    same = before.manoeuvre is action and before.angle == after.angle
    return after.manoeuvre is action and not (same and action is PhysicalAction.J_TURN)


def _start(spans: tuple[Span, ...], end: float, period: float) -> float:
    """Returns the time of the decision at which an utterance began, at the usual rate of speech [s].

    Args:
        spans: spans of the utterance.
        end: time at which it is over [s].
        period: time between decisions [s].
    """
    seconds = sum(speech_seconds(span.text) for span in spans)
    return period * math.floor((end - seconds) / period + _TICK)
