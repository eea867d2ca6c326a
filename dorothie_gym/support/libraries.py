"""Libraries that most runs do not need: each is imported on first use.

`lazy_loader.load` would enter them into `sys.modules` at once, where other packages look for imported modules.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING


class Library:
    """Placeholder for a module until its first use.

    Args:
        name: name of the module.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> object:
        """Returns an attribute of the module, which is imported on first use; raises `ImportError` if that fails."""
        value = getattr(importlib.import_module(self._name), name)
        self.__dict__[name] = value  # so that this method is not called for it again
        return value

    def __repr__(self) -> str:
        return f"<library {self._name}>"


if TYPE_CHECKING:
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq
    import pygame
else:
    pa, pc, pq = Library("pyarrow"), Library("pyarrow.compute"), Library("pyarrow.parquet")
    pygame = Library("pygame")

__all__ = ["Library", "pa", "pc", "pq", "pygame"]
