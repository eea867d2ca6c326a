"""Places that the participant says are close ahead, with a distance or without one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from dorothie_gym.dialogue.nlu import ParsedText
    from dorothie_gym.policies.co_wizard.state import CoWizardState

NEAR: Final = 100
"""Distance up to which a place that is said to be ahead is approached slowly [m]."""

JUST_AHEAD: Final = 45.0
"""Distance at which a place is taken to be that is "just ahead" [m]."""

_AHEAD: Final = re.compile(r"\b((just|right|straight) (up )?ahead|(is|'s) (coming up|up ahead))\b")
"""Words that say that a place is close ahead."""


def distance_ahead(state: CoWizardState, words: ParsedText) -> float | None:
    """Returns how far ahead a place is said to be that the car is guided to [m]; None if it is not said to be near."""
    if state.beliefs.exact:
        return None
    if words.distance is not None:
        return float(words.distance) if words.distance <= NEAR else None
    return JUST_AHEAD if _AHEAD.search(words.text.lower()) is not None else None
