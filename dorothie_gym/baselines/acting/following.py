"""What has become of the Co-Wizard's own words and actions, read off its observations: nobody tells it."""

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
"""Slack for sums of decision periods, as a share of one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Following:
    """A history, and what was begun and is not yet known to be over; every change gives a new one.

    Attributes:
        history: what is over.
        air: spans of the own utterance that is being said.
        began: when that began [s].
        tried: the last decision's physical action.
        before: what was observed when it was taken; None at first.
    """

    history: History
    air: tuple[Span, ...] = ()
    began: float = 0.0
    tried: Physical | None = None
    before: CoWizardView | None = None

    def acted(self, speech: Speech | None, physical: Physical | None, view: CoWizardView, most_spans: int) -> Self:
        """Returns this with the decision that was taken at a view.

        Args:
            speech: what was said, with its words.
            physical: what was done.
            view: what was observed before.
            most_spans: so many acts an utterance has room for; more are refused.
        """
        air, began = self.air, self.began
        if speech is not None and len(air) < most_spans:
            began = began if air else view.time
            air = (*air, Span(speech.text, speech.act))
        return replace(self, air=air, began=began, tried=physical, before=view)

    def observed(self, view: CoWizardView, town: Town, heard: tuple[Span, ...]) -> Self:
        """Returns this with what the next observation tells.

        Args:
            view: the observation.
            town: the map.
            heard: the participant's utterance that is over, empty for none.
        """
        history = self.history
        if self.tried is not None and self.before is not None and carried_out(self.tried, self.before, view):
            history = history.done(self.tried, history.frame)
        period = view.time - history.glimpses[-1].frame / FRAME_RATE if history.glimpses else 1.0
        history = history.seen(view, town)
        over = self.air if self.air and view.speaking == 0.0 else ()
        spoken = [(_start(heard, view.time, period), Role.PARTICIPANT, heard), (self.began, Role.CO_WIZARD, over)]
        for _, speaker, spans in sorted(spoken, key=lambda each: each[0]):
            if spans:
                history = history.said(speaker, spans, history.frame)
        return replace(self, history=history, air=() if over else self.air, tried=None, before=None)


def carried_out(tried: Physical, before: CoWizardView, after: CoWizardView) -> bool:
    """Whether an action seems to have been carried out.

    Args:
        tried: the action.
        before: what was observed when it was taken.
        after: what is observed one decision later.
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
        return not holds  # whatever is carried out ends the stop, and what is refused leaves it
    if action is PhysicalAction.LANE_FOLLOW:
        return before.manoeuvre is not None and after.manoeuvre is None
    same = before.manoeuvre is action and before.angle == after.angle
    return after.manoeuvre is action and not (same and action is PhysicalAction.J_TURN)


def _start(spans: tuple[Span, ...], end: float, period: float) -> float:
    """The decision at which an utterance began that is over by now, at the usual rate of speech [s].

    Args:
        spans: what was said.
        end: now [s].
        period: time between decisions [s].
    """
    seconds = sum(speech_seconds(span.text) for span in spans)
    return period * math.floor((end - seconds) / period + _TICK)
