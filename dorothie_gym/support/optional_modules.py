"""Packages of the extra `speech`: import with a helpful error."""

from __future__ import annotations

import importlib
import importlib.util
from types import ModuleType
from typing import Final

from dorothie_gym.errors import SpeechError
from dorothie_gym.support.installation import pip_install

PACKAGES: Final = ("hibari", "pocketsphinx", "soundfile")
"""Modules of the extra that the default synthesiser, the default recogniser and recordings need."""


def check_installed() -> None:
    """Raises `SpeechError` if a package that spoken sessions need is not installed; imports none."""
    missing = [name for name in PACKAGES if importlib.util.find_spec(name) is None]
    if missing:
        raise SpeechError(f"speech needs {', '.join(missing)}: {pip_install('speech')}")


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
        remedy = f"{pip_install(extra)}" if extra else f"pip install {name.replace('_', '-')}"
        raise SpeechError(f"the package {name} is needed and cannot be imported ({error}): {remedy}") from error
