"""Faults of an endpoint or of its answers: the names of the silent actions that they end in."""

from __future__ import annotations

import enum

from dorothie_gym.errors import one_line


class Fault(enum.StrEnum):
    """Reason for which a call has brought no answer; the role then does nothing."""

    TIMEOUT = "timeout"
    """No complete answer within the time of the call; slow and hanging servers."""
    NO_CONNECTION = "no connection"
    """The server cannot be reached, or closes the connection; TLS errors included."""
    RATE_LIMITED = "rate limited"
    """Status 429, even after waiting as the server requested."""
    SERVER_ERROR = "server error"
    """Status 500 or above."""
    REJECTED = "rejected"
    """Another status than 200: a wrong key or model, or a request that the server does not support."""
    NOT_A_COMPLETION = "not a completion"
    """Content other than a chat completion, such as a page of a gateway."""
    REFUSED = "refused"
    """The model declined to answer."""
    CUT_OFF = "cut off"
    """The answer ended at the limit of tokens."""
    NOT_JSON = "not JSON"
    """The answer is not a JSON object."""
    WRONG_SCHEMA = "wrong schema"
    """The answer is JSON of another schema, or names an action that is not possible now."""


ABOUT_THE_ANSWER = frozenset({Fault.REFUSED, Fault.CUT_OFF, Fault.NOT_JSON, Fault.WRONG_SCHEMA})
"""Faults of the model rather than of the server; the call is repeated once with a description of the fault."""

WORTH_REPEATING = ABOUT_THE_ANSWER | {Fault.RATE_LIMITED, Fault.SERVER_ERROR, Fault.NOT_A_COMPLETION}
"""Faults after which a second attempt is made, if there is time."""


REJECTIONS = frozenset({Fault.REJECTED, Fault.NO_CONNECTION})
"""Faults of the settings rather than of a moment; they end a session that begins with them."""


class CallError(Exception):
    """Call without a usable answer.

    Attributes:
        fault: kind of the fault.
        reason: fault, on one line; part of the repeated call.
        wait: time after which the server allows another request [s].
    """

    def __init__(self, fault: Fault, reason: str, wait: float = 0.0) -> None:
        super().__init__(fault, reason, wait)
        self.fault, self.reason, self.wait = fault, one_line(reason), wait
