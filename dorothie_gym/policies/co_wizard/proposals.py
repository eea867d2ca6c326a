"""Ways that the Co-Wizard proposes: a question that a yes or a no answers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from dorothie_gym.dialogue.direction import Direction
from dorothie_gym.dialogue.intentions import CommunicativeFunction as Function
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.ontology.slots import ActionValue, StreetName
from dorothie_gym.policies import act_builders
from dorothie_gym.policies.co_wizard.acknowledgement import plan_remark
from dorothie_gym.policies.co_wizard.intentions import Directive
from dorothie_gym.policies.observation_parser import street_of
from dorothie_gym.policies.route_progress import Choice, direction_of
from dorothie_gym.policies.speech import intend

if TYPE_CHECKING:
    from dorothie_gym.maps.model import Exit
    from dorothie_gym.policies.co_wizard.state import CoWizardState
    from dorothie_gym.policies.co_wizard.view import CoWizardView


def probable_way(state: CoWizardState, view: CoWizardView, choice: Choice) -> Exit | None:
    """Returns the exit that the car has a reason to think of; None without one.

    It leads onto a street on which the place is said to be, or straight on along such a street.

    Args:
        state: state of the Co-Wizard.
        view: observation.
        choice: exits of the next junction.
    """
    meant = set(state.beliefs.streets) - {StreetName.UNKNOWN, StreetName.QUERIED}
    leading = [way for way in choice.exits if street_of(view.raw, state.town, way.lane) in meant]
    return min(leading, key=lambda way: abs(way.angle)) if leading else None


def propose_way(state: CoWizardState, view: CoWizardView, choice: Choice, rng: np.random.Generator) -> None:
    """Asks whether one of the exits is meant: the one that the car has a reason to think of, otherwise any."""
    drawn = choice.exits[int(rng.integers(len(choice.exits)))]
    way = probable_way(state, view, choice) or drawn
    direction = direction_of(way)
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    street = street_of(view.raw, state.town, way.lane)
    named = action is ActionValue.J_TURN and rng.random() < 0.3
    content = act_builders.action(action, direction=direction, street=street if named else None)
    state.dialogue = state.dialogue.with_proposal(Directive(direction=direction, junction=choice.junction))
    first = plan_remark(state, view, rng)
    wording = Wording(direction=direction)
    question = intend(Function.PROPOSITIONAL_QUESTION, content, wording=wording, joined=bool(first))
    state.say(*first, question)


def go_on_unanswered(state: CoWizardState, choice: Choice) -> None:
    """Takes the way that turns least, and says so: the participant has left several questions unanswered.

    A way onto a street that the participant wants to be kept off is taken only where there is no other.
    """
    kept_off = {lane for lane, _ in state.route.kept_off}
    way = min(choice.exits, key=lambda way: (way.lane in kept_off, abs(way.angle)))
    direction = direction_of(way)
    state.intentions = state.intentions.turning(Directive(direction=direction, junction=choice.junction))
    action = ActionValue.LANE_FOLLOW if direction is Direction.STRAIGHT else ActionValue.J_TURN
    state.dialogue = state.dialogue.with_proposal(None)
    announced = act_builders.action(action, direction=direction)
    state.say(intend(Function.INFORM, announced, wording=Wording(direction=direction)))
