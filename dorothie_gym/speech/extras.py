"""Packages of the extra `speech`: import with a helpful error."""

from __future__ import annotations

import importlib
from types import ModuleType

from dorothie_gym.errors import SpeechError


def speech_module(name: str, *, extra: str = "speech") -> ModuleType:
    """Returns a module of an optional package.

    Args:
        name: name of the module.
        extra: extra of this package that installs it; empty if none does.

    Raises:
        SpeechError: the package is not installed.
    """
    try:
        return importlib.import_module(name)
    except ImportError as error:
        remedy = f"pip install 'dorothie-gym[{extra}]'" if extra else f"pip install {name.replace('_', '-')}"
        raise SpeechError(f"the package {name} is needed and cannot be imported ({error}): {remedy}") from error
