"""Example study of a tier of the benchmark: the row of people in it."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

    from dorothie_gym.evaluation.tiers import Tier

_SCENARIOS: Final = 4
"""Number of towns of the example; sessions take turns in them."""

_DEBRIEFING: Final = """\
    Thank you for taking part!

    In this study your passenger was a computer program, and some of the words between passenger and car may have been
    changed at random, as a speech recogniser would mishear them. We compare how people and programs drive and talk
    under the same conditions. Events such as fog, roadblocks and new errands were caused by a computer program.

    Please do not tell other people about this before they take part.

"""
"""Debriefing: in a tier, the participant is always a program."""


def tier_study(example: str, tier: Tier) -> str:
    """Returns the example of a study in which people play the Co-Wizard of a tier.

    Args:
        example: text of the usual example, whose consent, questions and other texts are kept.
        tier: the tier.
    """
    text, count = re.subn(r"(?m)^  debriefing: \|\n(?:(?:    .*)?\n)+", f"  debriefing: |\n{_DEBRIEFING}", example)
    if count != 1:
        raise ValueError(f"the example has {count} debriefings; it must have one")
    return _replaced(
        text,
        {
            "conditions": "".join(
                f"  - name: partner{number}\n    participant: {participant}\n    co_wizard: human\n"
                f"    ad_wizard: {tier.ad_wizard}\n"
                for number, participant in enumerate(tier.participants, start=1)
            ),
            "scenarios": "".join(f"  - {{town: '{town}'}}\n" for town in tier.towns[:_SCENARIOS]),
            "session": f"  tier: {tier.name}   # words, time, stops, traffic and braking of the tier\n"
            "  pictures: true\n",
        },
    )


def _replaced(text: str, blocks: Mapping[str, str]) -> str:
    """Returns a YAML text with other contents of some of its top-level blocks."""
    for name, content in blocks.items():
        block = f"{name}:\n{content}".replace("\\", r"\\")
        text, count = re.subn(rf"(?m)^{name}:\n(?:[ #].*\n)+", block, text)
        if count != 1:
            raise ValueError(f"the example has {count} blocks {name!r}; it must have one")
    return text
