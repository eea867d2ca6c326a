"""Standing car as the participant sees it: at a red light, turning, or kept from going on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from dorothie_gym.maps.town import LightColour
from dorothie_gym.ontology.slots import ObjectClass
from dorothie_gym.policies.mood import Happening
from dorothie_gym.policies.route_progress import light_ahead

if TYPE_CHECKING:
    from dorothie_gym.policies.participant.state import ParticipantState
    from dorothie_gym.policies.participant.view import ParticipantView

LONG_RED = 10.0
"""Standstill at a red light that is felt as long [s]."""

TURN_TIME = 4.0
"""Standstill across the lane after which a car is no longer regarded as turning [s]."""

IN_THE_WAY = 40.0
"""Distance of an obstacle that the car stands before [m]."""

LONGEST_WAIT = 150.0
"""Standstill after which the participant no longer waits for an obstacle to go [s]."""

OBEYED_WITHIN = 12.0
"""Time after which a standing car that was sent on is known to be kept from it [s]."""


def excuse_at_light(state: ParticipantState, view: ParticipantView) -> None:
    """Excuses a standstill before a red light and right after it has turned green."""
    progress, config = state.route.progress, state.config
    if not view.standing or view.time - state.motion.moved_at > config.red_light_time:
        return
    last_stretch = (
        state.guidance.guiding
        and progress is not None
        and progress.left(view.station) < config.last_stretch
        and progress.next_crossing(state.town, view.station) is None
    )
    if last_stretch:
        return
    if light_ahead(state.town, view.lane, view.station, view.time) in (None, LightColour.GREEN):
        return
    waited = state.motion.standstill(view.time)
    if waited - state.clock.interval < LONG_RED <= waited:
        state.feel(Happening.RED_LIGHT, view.time)
    state.motion = state.motion.at_red_light(view.time, config.start_time)


def cannot_go_on(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether a standing car was sent on in vain, or an obstacle is known to be ahead on its lane."""
    sent_on = state.guidance.step == ("on", view.lane, 0)
    if sent_on and view.standing and view.time - state.guidance.step_at > OBEYED_WITHIN:
        return True
    return is_blocked_ahead(state, view)


def waits_for_road(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether the car stands before an obstacle that the route does not avoid, so that it has to wait."""
    if not view.standing or not is_blocked_ahead(state, view) or view.time - state.motion.moved_at > LONGEST_WAIT:
        return False
    return any(thing.kind is ObjectClass.STATIC and thing.distance < IN_THE_WAY for thing in view.objects)


def is_blocked_ahead(state: ParticipantState, view: ParticipantView) -> bool:
    """Returns whether an obstacle is known to be ahead on the lane of the car."""
    return any(lane == view.lane and station > view.station for lane, station in state.route.blocked)
