"""Griffe extension that keeps square brackets in docstrings literal.

Docstrings of this package write units and intervals in square brackets ("in [0, length] [m]"). Markdown reads two
bracketed texts in a row as a link. The docstrings contain no Markdown links, so every bracket outside code is escaped.
"""

from __future__ import annotations

import re
from typing import Any

import griffe

_CODE = re.compile(r"(```.*?```|`[^`\n]*`)", flags=re.DOTALL)


def escape_brackets(text: str) -> str:
    """Returns Markdown text with square brackets escaped outside code literals."""
    parts = _CODE.split(text)  # odd entries are code
    return "".join(part if k % 2 else re.sub(r"(?<!\\)([\[\]])", r"\\\1", part) for k, part in enumerate(parts))


class LiteralBrackets(griffe.Extension):
    """Escapes square brackets in the docstring of every documented object."""

    def on_object(self, *, obj: griffe.Object, **kwargs: Any) -> None:
        """Rewrites the docstring of an object before it is parsed."""
        if obj.docstring is not None:
            obj.docstring.value = escape_brackets(obj.docstring.value)
