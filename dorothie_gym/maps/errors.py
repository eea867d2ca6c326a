"""What is told of a map that cannot be used."""

from __future__ import annotations


class TownError(ValueError):
    """A map cannot be read: names the file, the element and the reason."""

    def __init__(self, source: str, element: str, reason: str) -> None:
        super().__init__(source, element, reason)  # as they are, so that it can be copied and sent to other processes
        self.source, self.element, self.reason = source, element, reason

    def __str__(self) -> str:
        return f"{self.source}: {self.element}: {self.reason}"
