"""The one error of this package."""

from __future__ import annotations


class StoryboardError(ValueError):
    """A storyboard cannot be read or bound, or does not allow what was asked of it.

    Attributes:
        template: name (or path) of the storyboard template.
        field: where in the template, such as "subgoals[2].after" or "variables.P1".
        reason: what is wrong, and what to do about it.
    """

    def __init__(self, template: str, field: str, reason: str) -> None:
        super().__init__(f"storyboard {template}: {field}: {reason}")
        self.template, self.field, self.reason = template, field, reason
