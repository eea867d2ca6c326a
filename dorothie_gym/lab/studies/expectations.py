"""Expected content of the fields of a study file, in words for error messages."""

from __future__ import annotations

from typing import Any, Final

from msgspec import inspect

PATTERNS: Final = {
    r"^[a-z][a-z0-9_]{0,39}$": "a name of lower-case letters, digits and _ that begins with a letter, at most 40",
    r"^https?://[^\s<>\"]{1,500}$": "an address that begins with https:// or http://",
    r"^[A-Za-z][A-Za-z0-9_]{0,39}$": "a name of letters, digits and _ that begins with a letter, at most 40",
}
"""Patterns of texts in words."""


def explain(reason: str, schema: type, steps: list[tuple[str, str]]) -> str:
    """Returns the message of a fault, with the expected value.

    Args:
        reason: message of msgspec.
        schema: type of the whole file.
        steps: name, or index, of each step that leads to the field.
    """
    kinds = _descend([inspect.type_info(schema)], steps)
    for pattern, words in PATTERNS.items():
        if pattern in reason or repr(pattern) in reason:
            return f"expected {words}"
    if reason.startswith(("Invalid value", "Invalid enum value")):
        values = _values(kinds, steps[-1][0] if steps else "")
        if values:
            return f"{reason[0].lower()}{reason[1:]}; expected {', '.join(values[:-1])} or {values[-1]}"
    if "unknown field" in reason:
        name = reason.rpartition("unknown field ")[2].strip("`")
        known = sorted({each.encode_name for kind in _structs(kinds) for each in kind.fields})
        return f"has no field {name!r}; it has {', '.join(known)}" if known else f"has no field {name!r}"
    return reason[0].lower() + reason[1:] if reason[1:2].islower() else reason


def _descend(kinds: list[Any], steps: list[tuple[str, str]]) -> list[Any]:
    """Returns the types that the value at the end of the given steps may have."""
    kinds = _alternatives(kinds)
    for name, index in steps:
        below: list[Any] = []
        for kind in kinds:
            if index and isinstance(kind, inspect.ListType):
                below.append(kind.item_type)
            elif isinstance(kind, inspect.StructType):
                below += [each.type for each in kind.fields if each.encode_name == name]
        if not below:
            return kinds  # a tag, which is no field
        kinds = _alternatives(below)
    return kinds


def _alternatives(kinds: list[Any]) -> list[Any]:
    found: list[Any] = []
    for kind in kinds:
        plain = kind.type if isinstance(kind, inspect.Metadata) else kind
        found += _alternatives(list(plain.types)) if isinstance(plain, inspect.UnionType) else [plain]
    return found


def _structs(kinds: list[Any]) -> list[inspect.StructType]:
    return [kind for kind in kinds if isinstance(kind, inspect.StructType)]


def _values(kinds: list[Any], last: str) -> list[str]:
    """Returns the allowed values of enumerations, or the tags of structs."""
    enums = [str(each.value) for kind in kinds if isinstance(kind, inspect.EnumType) for each in kind.cls]
    tags = [str(kind.tag) for kind in _structs(kinds) if kind.tag is not None and kind.tag_field == last]
    return enums or tags
