"""Limit of how often something may happen: a token bucket."""

from __future__ import annotations


class TokenBucket:
    """Tokens that are taken one by one and grow back at a constant rate.

    Args:
        burst: most tokens, and those at the beginning.
        rate: tokens that grow back per second [1/s].
    """

    def __init__(self, burst: float, rate: float) -> None:
        self._burst, self._rate, self._tokens = burst, rate, burst
        self._seen: float | None = None

    def admits(self, now: float) -> bool:
        """Takes a token; returns whether there was one.

        Args:
            now: clock that does not jump [s].
        """
        passed = 0.0 if self._seen is None else now - self._seen
        self._seen, self._tokens = now, min(self._burst, self._tokens + passed * self._rate)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True
