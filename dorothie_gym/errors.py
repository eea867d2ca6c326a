"""Exceptions of dorothie_gym: one root, and one class for each kind of error.

Every class also derives from the built-in exception that callers expect (`ValueError` for bad input, `RuntimeError`
for an environment that does not allow the work), so that `except ValueError` keeps working.

```
DorothieGymError
├── InputFileError       a file is not a regular file, too large, malformed, or has a field of another type
├── OntologyError        a text, number or combination that the closed vocabularies do not contain
├── TownError            a map cannot be read or used
├── TownArchiveError     a cached town is damaged or of another format
├── StoryboardError      a storyboard cannot be read, bound or played
├── AnnotationError      an annotation does not match its session, or names unknown members of a vocabulary
├── SessionError         a recorded session or corpus cannot be read or written
├── OutputFolderError    an output folder was deleted or replaced while it was being written
├── PolicyLoadError      a policy name or file cannot be resolved
├── ActionError          an action is malformed, or a policy returns none
├── EndpointError        the endpoint of a language model rejects all calls
├── AgentSessionError    a session for an agent is used before it has begun
├── PolicyStateError     the state of a policy lacks what a part of the policy needs
├── PredictionError      predictions cannot be scored
├── FeatureStoreError    cached features are damaged
├── RolloutError         results of a rollout cannot be read
├── PictureError         a picture lacks a part that the camera was not set to draw
├── StateError           a state of a session cannot be restored here
├── SettingsError        settings of a training run are out of range
├── ModelFileError       a saved model cannot be read
├── CheckpointError      a training checkpoint is damaged or of another run
├── EncoderError         an encoder is unknown, or its package or weights are missing
├── PhraseFileError      a data file of the dialogue package is malformed
├── AudioError           audio is damaged, too long or of an unsupported form
├── SpeechError          speech cannot be synthesised or recognised: a package, voice, model or server is missing
├── CacheError           the cache folder cannot be written
└── ProcessError         a worker process failed
```
"""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from reprlib import Repr
from typing import Final

MAX_SHOWN: Final = 120
"""Characters of a value that a message shows."""


MAX_MESSAGE: Final = 1000
"""Characters of a message that quotes names of a file."""


class DorothieGymError(Exception):
    """Root of all exceptions that dorothie_gym raises on purpose; the message is one line of printable characters."""

    def __str__(self) -> str:
        return printable(self.message())

    def message(self) -> str:
        """Returns the message as it was written; it may quote names of a file as they are."""
        return super().__str__()


class InputFileError(DorothieGymError, ValueError):
    """A file that a user provides cannot be read as data.

    Attributes:
        where: the file, or the file and line.
        reason: the error and its remedy.
        place: line and column, or the field, where it is known; else empty.
    """

    def __init__(self, where: object, reason: str, place: str = "") -> None:
        # The arguments go to `args` as they are, so that the error can be pickled and sent to other processes.
        super().__init__(str(where), reason, place)
        self.where, self.reason, self.place = str(where), reason, place

    def message(self) -> str:
        """Returns file, place and reason."""
        return f"{self.where}{', ' if self.place else ''}{self.place}: {self.reason}"


class OntologyError(DorothieGymError, ValueError):
    """A text, number or combination that the closed vocabularies do not contain."""


class TownError(DorothieGymError, ValueError):
    """A map cannot be read or used.

    Attributes:
        source: the map's file or name.
        element: the offending element, with its line where the format has lines.
        reason: the error and its remedy.
    """

    def __init__(self, source: str, element: str, reason: str) -> None:
        # The three arguments go to `args` as they are, so that the error can be pickled and sent to other processes.
        super().__init__(source, element, reason)
        self.source, self.element, self.reason = source, element, reason

    def message(self) -> str:
        """Returns source, element and reason."""
        return one_line(f"{self.source}: {self.element}: {self.reason}", MAX_MESSAGE)


class TownArchiveError(DorothieGymError, ValueError):
    """Bytes are not the archive of the expected town: damaged, of another format, or of another town."""


class StoryboardError(DorothieGymError, ValueError):
    """A storyboard cannot be read or bound, or does not allow the requested change.

    Attributes:
        template: name (or path) of the storyboard template.
        field: where in the template, such as "subgoals[2].after" or "variables.P1".
        reason: the error and its remedy.
    """

    def __init__(self, template: str, field: str, reason: str) -> None:
        super().__init__(template, field, reason)
        self.template, self.field, self.reason = template, field, reason

    def message(self) -> str:
        """Returns template, field and reason."""
        return one_line(f"storyboard {self.template}: {self.field}: {self.reason}", MAX_MESSAGE)


class SessionError(DorothieGymError, ValueError):
    """A session cannot be written or read; the message names the file, the line and the field."""


class AnnotationError(DorothieGymError, ValueError):
    """An annotation does not match its session, or cannot be represented; the message names the place."""


class OutputFolderError(DorothieGymError, RuntimeError):
    """An output folder was deleted or replaced while it was being written; the message names the folder."""


class PolicyLoadError(DorothieGymError, ValueError):
    """A policy name or file cannot be resolved; the message gives the reason and the accepted values."""


class ActionError(DorothieGymError, ValueError):
    """An action is malformed, or a policy returns none; the message names the role and the field."""


class EndpointError(DorothieGymError, RuntimeError):
    """The endpoint of a language model rejects the calls of a session; the message has the words of the server."""


class AgentSessionError(DorothieGymError, RuntimeError):
    """A session for a language-model agent does not allow a call now; the message says what to call first."""


class PolicyStateError(DorothieGymError, RuntimeError):
    """The state of a policy lacks what a part of the policy needs, such as a route; the message says what."""


class PredictionError(DorothieGymError, ValueError):
    """Predictions cannot be scored; the message names the file, the row or point, and the remedy."""


class FeatureStoreError(DorothieGymError, ValueError):
    """A cache folder holds no readable features: it is damaged or of another program."""


class RolloutError(DorothieGymError, ValueError):
    """A file of rollout results cannot be read; the message names the file and the remedy."""


class PictureError(DorothieGymError, ValueError):
    """A picture lacks a part, because the outputs of its camera leave it out; the message names the part."""


class StateError(DorothieGymError, ValueError):
    """A state cannot be restored: it is of another town or other settings; the message names both."""


class SettingsError(DorothieGymError, ValueError):
    """Settings of a training run are out of range; the message names the field and the allowed values."""


class ModelFileError(DorothieGymError, ValueError):
    """A saved model cannot be read; the message names the file and the fault."""


class CheckpointError(DorothieGymError, RuntimeError):
    """A checkpoint is damaged, or of another model or corpus; the message names the file and the remedy."""


class EncoderError(DorothieGymError, RuntimeError):
    """An encoder is unknown, or its package or weights are missing; the message says what to install."""


class PhraseFileError(DorothieGymError, ValueError):
    """A data file of the dialogue package is malformed; the message names the file and the line."""


class AudioError(DorothieGymError, ValueError):
    """Audio is damaged, too long or of an unsupported form; the message names the file and the fault."""


class SpeechError(DorothieGymError, RuntimeError):
    """Speech cannot be synthesised or recognised here; the message names what is missing and how to get it."""


class CacheError(DorothieGymError, RuntimeError):
    """The cache folder cannot be written; the message names the environment variable to set."""


class ProcessError(DorothieGymError, RuntimeError):
    """A task failed in its worker process, or the process died; the message names the task and the cause."""


def printable(text: str) -> str:
    r"""Returns a text on one line: spaces for line breaks and tabs, escapes such as `\x1b` for control characters."""
    if text.isprintable():
        return text
    return "".join(
        each if each.isprintable() else " " if each.isspace() else each.encode("unicode_escape").decode()
        for each in text
    )


def one_line(text: object, limit: int = 300) -> str:
    """Returns a text, such as the message of another library, on one line of at most `limit` characters."""
    words = " ".join(str(text)[: 10 * limit].split())
    return words if len(words) <= limit else f"{words[:limit]}..."


class _ShortRepr(Repr):
    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = MAX_SHOWN

    def repr_int(self, value: int, level: int) -> str:
        # Python writes no number of more than 4300 digits
        return super().repr_int(value, level) if value.bit_length() < 4096 else f"<number of {value.bit_length()} bits>"


def short_repr(value: object) -> str:
    """Returns the `repr` of an offending value on one line, cut to `MAX_SHOWN` characters."""
    text = " ".join(_ShortRepr().repr(value).split())
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Returns "did you mean 'NAME'? " for the known name that is most similar to a given one; "" if none is similar."""
    names = {name.casefold(): name for name in known}
    found = get_close_matches(str(given)[:MAX_SHOWN].casefold(), names, n=1, cutoff=0.6)
    return f"did you mean {names[found[0]]!r}? " if found else ""
