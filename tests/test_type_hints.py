"""Types of fields that exist at run time: readers of files, and tools such as tyro or jsonargparse, resolve them."""

from __future__ import annotations

import dataclasses
import importlib
import importlib.util
import inspect
import pkgutil
import typing

import dorothie_gym

WITHOUT = {
    "dorothie_gym.dialogue.realization_context.Wording",  # propositions have directions of its module
    "dorothie_gym.tasks.parsing.TemplateFields",  # the type of JSON values names itself
}


def is_record(kind: object) -> bool:
    if not inspect.isclass(kind):
        return False
    named = issubclass(kind, tuple) and hasattr(kind, "_fields")
    return dataclasses.is_dataclass(kind) or hasattr(kind, "__struct_fields__") or typing.is_typeddict(kind) or named


def test_types_of_all_fields_are_resolved() -> None:
    unresolved, checked = [], 0
    for found in pkgutil.walk_packages(dorothie_gym.__path__, "dorothie_gym."):
        if found.name.endswith("__main__"):
            continue
        try:
            module = importlib.import_module(found.name)
        except ModuleNotFoundError as error:  # of an extra that is not installed
            assert not str(error.name).startswith("dorothie_gym")
            continue
        for kind in vars(module).values():
            if not is_record(kind) or kind.__module__ != found.name or kind.__name__.startswith("_"):
                continue
            checked += 1
            try:
                typing.get_type_hints(kind)
            except NameError as error:
                unresolved.append(f"{found.name}.{kind.__name__}: {error}")
    assert checked > 300
    assert [line for line in unresolved if line.split(":")[0] not in WITHOUT] == []
