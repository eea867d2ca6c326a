"""Remark that states the steps of a driving plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from dorothie_gym.dialogue.plan_words import spoken_plan
from dorothie_gym.dialogue.realization_context import Wording
from dorothie_gym.policies.plan_propositions import content_of
from dorothie_gym.policies.speech import Remark, intend

if TYPE_CHECKING:
    from dorothie_gym.dialogue.intentions import CommunicativeFunction
    from dorothie_gym.dialogue.routes import PlanStep


def told_plan(steps: Sequence[PlanStep], function: CommunicativeFunction, *, joined: bool = False) -> Remark:
    """Returns the remark that states the steps of a plan.

    Args:
        steps: the steps.
        function: communicative function: an acceptance, or an answer.
        joined: as of `Remark`.
    """
    wording = Wording(topic="steps", plan=spoken_plan(steps))
    return intend(function, *map(content_of, steps), wording=wording, joined=joined)
