"""An option whose value may be left out, which typer does not know."""

from __future__ import annotations

from pathlib import PurePath
from typing import Any

from typer.core import TyperCommand

OWN_NAME = "<own name>"
"""Value of `--picture` where none was given: the picture is named after what it shows."""

_TOWNS = (".yaml", ".yml", ".xodr")


class PictureCommand(TyperCommand):
    """A command that takes `--picture FILE.png`, or `--picture` alone."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Puts in the value that was left out: what follows is the value if it could be a picture's name."""
        given: list[str] = []
        for k, arg in enumerate(args):
            given.append(arg)
            suffix = PurePath(args[k + 1]).suffix.lower() if k + 1 < len(args) else ""
            if arg == "--picture" and suffix in ("", *_TOWNS):
                given.append(OWN_NAME)
        return super().parse_args(ctx, given)
