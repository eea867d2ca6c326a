"""Policies of users: classes by reference ("module:Class"), and the checks of what a class and its decisions return."""

from __future__ import annotations

import hashlib
import inspect
import re
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from dorothie_gym.errors import PolicyLoadError, did_you_mean
from dorothie_gym.policies.policy import AnyPolicy, Policy

if TYPE_CHECKING:
    from dorothie_gym.ontology.roles import Role
    from dorothie_gym.session.spaces.fields import SpaceLimits

_REFERENCE: Final = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*")
_SCRIPT: Final = re.compile(r".*\.py:[^\W\d]\w*")

REMEDY: Final = "derive it from dorothie_gym.Policy, with initial_state(seed, town) and step(observation, state)"


def is_reference(name: str) -> bool:
    """Returns whether a name has the form "module:Class", or "file.py:Class", which `import_policy` explains."""
    return _REFERENCE.fullmatch(name) is not None or _SCRIPT.fullmatch(name) is not None


def import_policy(reference: str) -> type[AnyPolicy]:
    """Returns the policy class of a reference; modules of the working directory are found as by `python -m`.

    Args:
        reference: "module:Class", such as "own_policy:SteadySpeed" or "package.module:Class".

    Raises:
        PolicyLoadError: there is no such module or class, its import fails, or it is no policy.
    """
    module_name, _, class_name = reference.partition(":")
    if module_name.endswith(".py") or "/" in module_name:
        stem = Path(module_name).stem
        raise PolicyLoadError(
            f"{reference}: name the module, not the file: {stem}:{class_name}, in the folder of the file"
        )
    if "" not in sys.path and str(Path.cwd()) not in sys.path:
        sys.path.insert(0, str(Path.cwd()))
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
            raise PolicyLoadError(f"{reference}: {module_name} imports {error.name}, which is not installed") from error
        raise PolicyLoadError(
            f"{reference}: there is no module {error.name!r} in {Path.cwd()} nor among the installed packages"
        ) from None
    except Exception as error:
        raise PolicyLoadError(f"{reference}: importing {module_name} fails: {type(error).__name__}: {error}") from error
    found = getattr(module, class_name, None)
    if found is None:
        known = [
            name for name, value in vars(module).items() if _is_policy_class(value) and value.__module__ == module_name
        ]
        there = f"its policies are {', '.join(known)}" if known else "it has no policy"
        raise PolicyLoadError(
            f"{reference}: {module_name} has no {class_name!r}; {did_you_mean(class_name, known)}{there}"
        )
    return check_policy_class(found, reference)


def check_policy_class(found: object, name: str) -> type[AnyPolicy]:
    """Returns a class if it can be a policy; raises `PolicyLoadError` that names what is missing."""
    if not _is_policy_class(found):
        kind = "is no class" if not isinstance(found, type) else "is no policy"
        raise PolicyLoadError(f"{name} {kind}; {REMEDY}")
    missing = sorted(getattr(found, "__abstractmethods__", ()))
    if missing:
        raise PolicyLoadError(f"{name} has no {' and no '.join(missing)}; {REMEDY}")
    return found  # type: ignore[return-value]  # checked above


def create_policy(policy_class: type[AnyPolicy], role: Role, limits: SpaceLimits) -> AnyPolicy:
    """Returns an object of a policy class, which is given those of `role` and `limits` that its constructor takes.

    Raises:
        PolicyLoadError: the constructor needs other arguments, or the object acts for another role.
    """
    name = name_of(policy_class)
    parameters = inspect.signature(policy_class).parameters.values()
    takes_all = any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters)
    given = {"role": role, "limits": limits}
    names = {parameter.name for parameter in parameters}
    needed = [
        parameter.name
        for parameter in parameters
        if parameter.default is parameter.empty
        and parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
        and parameter.name not in given
    ]
    if needed:
        raise PolicyLoadError(
            f"{name} needs the arguments {', '.join(needed)}; give them defaults, or pass an object in Python"
        )
    create: Callable[..., AnyPolicy] = policy_class
    policy = create(**{key: value for key, value in given.items() if takes_all or key in names})
    return check_fits_role(policy, role, name)


def check_fits_role(policy: AnyPolicy, role: Role, name: str) -> AnyPolicy:
    """Returns a policy if it acts for a role; raises `PolicyLoadError` otherwise."""
    if getattr(policy, "role", None) is not role:
        other = getattr(policy, "role", None)
        reason = "calls no super().__init__(role, limits)" if other is None else f"acts for {other}, not for {role}"
        raise PolicyLoadError(f"{name} {reason}")
    return policy


def name_of(policy_class: type) -> str:
    """Returns the reference of a class, "module:Class"."""
    return f"{policy_class.__module__}:{policy_class.__qualname__}"


def source_hash(policy_class: type) -> str | None:
    """Returns the SHA-256 of the file that defines a class; None where there is no file, as in a notebook."""
    try:
        file = inspect.getsourcefile(policy_class)
    except TypeError:
        return None
    if file is None or not Path(file).is_file():
        return None
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def _is_policy_class(value: Any) -> bool:
    return isinstance(value, type) and issubclass(value, Policy)
