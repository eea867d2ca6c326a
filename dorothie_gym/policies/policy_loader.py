"""Policies by name, including shipped trained policies, and trained policies from files.

The module of a policy is imported when the policy is made (through the lazy packages below `policies`), so that listing
the names imports none of them.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Final, TypeAlias

from dorothie_gym import policies
from dorothie_gym.errors import MAX_SHOWN, InputFileError, PolicyLoadError, did_you_mean, short_repr
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies import language_model as model_policies
from dorothie_gym.policies.ad_wizard_options import parse_ad_wizard
from dorothie_gym.policies.language_model.config import LanguageModelConfig
from dorothie_gym.policies.persona import parse_traits
from dorothie_gym.policies.policy import DESCRIPTION, AnyPolicy, BatchPolicy, Policy
from dorothie_gym.policies.policy_import import (
    check_fits_role,
    check_policy_class,
    create_policy,
    import_policy,
    is_reference,
    name_of,
    source_hash,
)
from dorothie_gym.policies.pretrained import PREFIX, check_fits, is_pretrained, names_for, pretrained_folder
from dorothie_gym.session.spaces.fields import SpaceLimits
from dorothie_gym.support.input_files import MAX_MODEL_JSON, MAX_WEIGHTS, check_file, raising, read_json
from dorothie_gym.support.installation import pip_install

POLICY_NAMES = ("scripted", "silent", "random")
"""Names that `make_policy` accepts for every role."""

WITH_TRAITS: Final = "scripted:"
"""Beginning of the name of a scripted policy whose personas have given traits, or of an Ad-Wizard with options."""

LANGUAGE_MODEL: Final = "llm:"
"""Prefix of the name of a policy that calls a language model; the name of the model follows."""

LANE_FOLLOW = "lane-follow"
"""Name of the Co-Wizard's policy that drives and never talks."""


TALK_POLICIES: Final[Mapping[Role, tuple[str, ...]]] = MappingProxyType(
    {
        Role.PARTICIPANT: ("client",),
        Role.CO_WIZARD: ("talk-oracle", "always-asks", "never-asks", "says-yes", "keyword-rule"),
        Role.AD_WIZARD: ("street-closer",),
    }
)
"""Names of the policies of talk tasks (docs/tiers.md), by role."""


def policy_names(role: Role) -> tuple[str, ...]:
    """Returns the names that `make_policy` accepts for a role."""
    own = (*((LANE_FOLLOW,) if role is Role.CO_WIZARD else ()), *TALK_POLICIES.get(role, ()))
    return (*POLICY_NAMES, *own, *names_for(role))


def make_policy(name: str, role: Role, limits: SpaceLimits | None = None) -> AnyPolicy:
    """Returns a policy by name.

    Args:
        name: "scripted", "silent" (does nothing) or "random" (samples the action space); for participant and Co-Wizard
            also "scripted:" with traits of the persona ("scripted:talkativeness=0.8..1", see
            `dorothie_gym.policies.persona`), for the Ad-Wizard with its options ("scripted:rate=4,spacing=12", see
            `dorothie_gym.policies.ad_wizard_options`); for the Co-Wizard also "lane-follow" (follows its lane, never
            talks), or a shipped model such as "pretrained:maskable-ppo"; "llm:" with the name of a language model at
            the endpoint `OPENAI_BASE_URL`; "module:Class" for a class of the user (`policy_import`).
        role: role of the policy.
        limits: sizes of the spaces.

    Raises:
        ValueError: if there is no policy of that name, the role takes no actions, or a shipped model needs the extra
            `baselines`, which is not installed.
    """
    if role not in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD):
        raise ValueError(f"role is {role}; policies act for participant, co_wizard and ad_wizard")
    if _gives_traits(name, role):
        return _with_traits(name.removeprefix(WITH_TRAITS), role, limits)
    if name.startswith(LANGUAGE_MODEL):
        return model_policies.LanguageModelPolicy(
            role, LanguageModelConfig.usual(name.removeprefix(LANGUAGE_MODEL)), limits
        )
    if name == "silent":
        return policies.SilentPolicy(role, limits)
    if name == "random":
        return policies.RandomPolicy(role, limits)
    if is_own(name):
        return create_policy(import_policy(name), role, limits or SpaceLimits())
    if name not in policy_names(role):
        hint = did_you_mean(name, policy_names(role))
        raise ValueError(f"there is no policy {name!r}; {hint}the policies are {', '.join(policy_names(role))}")
    if is_pretrained(name):
        check_fits(name)
        return _trained_player(name, pretrained_folder(name), role).make(role, limits or SpaceLimits())
    if name == LANE_FOLLOW or name in TALK_POLICIES[role]:
        return _simple_policy(name, role, limits)
    if role is Role.PARTICIPANT:
        return policies.ScriptedParticipant(limits)
    return policies.ScriptedCoWizard(limits) if role is Role.CO_WIZARD else policies.ScriptedAdWizard(limits)


def _with_traits(given: str, role: Role, limits: SpaceLimits | None) -> AnyPolicy:
    """Returns the scripted policy of a role with given traits, or with the options of an Ad-Wizard."""
    if role is Role.AD_WIZARD:
        options = parse_ad_wizard(given)
        return policies.ScriptedAdWizard(limits, rate=options.rate, kinds=options.kinds, config=options.config)
    traits = parse_traits(given)
    if role is Role.PARTICIPANT:
        return policies.ScriptedParticipant(limits, traits=traits)
    return policies.ScriptedCoWizard(limits, traits=traits)


def is_own(name: str) -> bool:
    """Returns whether a name refers to a class of the user."""
    return is_reference(name) and not name.startswith((WITH_TRAITS, LANGUAGE_MODEL, PREFIX))


def _simple_policy(name: str, role: Role, limits: SpaceLimits | None) -> AnyPolicy:
    """Returns the policy that follows its lane, or one of talk tasks."""
    if role is Role.CO_WIZARD:
        return policies.LaneFollowPolicy(limits) if name == LANE_FOLLOW else policies.TalkDriver(name, limits)
    return policies.Client(limits) if role is Role.PARTICIPANT else policies.StreetCloser(limits)


def _gives_traits(name: str, role: Role) -> bool:
    return name.startswith(WITH_TRAITS) and role in (Role.PARTICIPANT, Role.CO_WIZARD, Role.AD_WIZARD)


Loader: TypeAlias = Callable[[Path, Role, SpaceLimits], AnyPolicy]
"""Function that reads a policy from a file or folder; defined in a module, so that it can be pickled."""

_COSTS: Final = ("steps", "seconds")

MODEL_LOADERS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "benchmark": "dorothie_gym.baselines.loaders:load_benchmark_model",
        "co-wizard": "dorothie_gym.baselines.loaders:load_co_wizard",
        "participant": "dorothie_gym.baselines.loaders:load_participant",
        "dorothie_gym-rl": "dorothie_gym.baselines.loaders:load_rl_model",
    }
)
"""Loaders of the models that `dorothie-gym train` and `train-rl` write, by kind, as "module:function"."""

_LOADERS: Final[dict[str, Loader]] = {}
"""Loaders that users have registered, by kind."""


def register_loader(kind: str, loader: Loader) -> None:
    """Registers the loader of a kind of files.

    Args:
        kind: suffix of the files (".safetensors"), or the field "kind" of their JSON ("ppo").
        loader: function that reads them; it raises `ValueError` if it cannot.

    Raises:
        ValueError: another loader has the kind.
    """
    if kind in MODEL_LOADERS:
        raise ValueError(f"files of the kind {kind!r} have a loader already: {MODEL_LOADERS[kind]}")
    if _LOADERS.setdefault(kind, loader) is not loader:
        raise ValueError(f"files of the kind {kind!r} have a loader already: {_LOADERS[kind].__qualname__}")


def loadable_kinds() -> tuple[str, ...]:
    """Returns the kinds of files that have a loader, sorted."""
    return tuple(sorted({*MODEL_LOADERS, *_LOADERS}))


def _loader_of(kind: str) -> Loader | None:
    """Returns the loader of a kind of files, None if there is none; imports the loader of a model of the package."""
    if kind not in MODEL_LOADERS:
        return _LOADERS.get(kind)
    module, _, name = MODEL_LOADERS[kind].partition(":")
    loader: Loader = getattr(import_module(module), name)
    return loader


@dataclass(frozen=True, kw_only=True)
class Player:
    """Source of a role's policy, by name or from a file; can be sent to other processes.

    Attributes:
        name: name of the policy, with traits if any are given, or the path or "module:Class" that was given.
        path: file or folder of a trained policy; None for a policy by name, also for that of a shipped model, whose
            place differs between machines.
        loader: function that reads it.
        sha256: hash of the file, or of the model files ("model.*") of the folder; identifies the policy of a rollout.
            That of a class of the user is the hash of its source file.
        training: cost of the training in `steps` and `seconds`, where the JSON of the file has them.
        language_model: settings of a language model; None for other policies.
        policy: policy of the user, as an object or a class; None for a policy by name or file.
    """

    name: str
    path: Path | None = None
    loader: Loader | None = None
    sha256: str | None = None
    training: Mapping[str, float] = field(default_factory=dict)
    language_model: LanguageModelConfig | None = None
    policy: AnyPolicy | type[AnyPolicy] | None = None

    @property
    def trained(self) -> bool:
        """Whether the policy is read from a file, which may be that of a class."""
        return self.sha256 is not None

    @property
    def may_batch(self) -> bool:
        """Whether its policy may be a `BatchPolicy`: that of a model file may; a class of the user is looked at."""
        if self.policy is not None:
            own = self.policy if isinstance(self.policy, type) else type(self.policy)
            return issubclass(own, BatchPolicy)
        if self.path is None and is_own(self.name):
            return issubclass(import_policy(self.name), BatchPolicy)
        return self.trained

    def make(self, role: Role, limits: SpaceLimits) -> AnyPolicy:
        """Returns the policy.

        Raises:
            ValueError: the role has no policy of this name, the file cannot be read, or a library is not installed.
        """
        if self.language_model is not None:
            return model_policies.LanguageModelPolicy(role, self.language_model, limits)
        if isinstance(self.policy, type):
            return create_policy(self.policy, role, limits)
        if self.policy is not None:
            return _fitting(self.policy, self.name, role, limits)
        if self.path is None or self.loader is None:
            return make_policy(self.name, role, limits)
        with _reporting_missing_library(self.name):
            return self.loader(self.path, role, limits)


AnyPlayer: TypeAlias = str | Player | AnyPolicy | type[AnyPolicy]
"""Policy in any form that `player_of` takes: a name or path, a source, a policy object, a policy class."""

SCRIPTED: Final = Player(name="scripted")
ALL_SCRIPTED: Final[Mapping[Role, Player]] = MappingProxyType(
    {Role.PARTICIPANT: SCRIPTED, Role.CO_WIZARD: SCRIPTED, Role.AD_WIZARD: SCRIPTED}
)
"""Scripted policies for all roles."""


def find_player(given: str, role: Role, language_model: LanguageModelConfig | None = None) -> Player:
    """Returns the source of a policy by name or path.

    Args:
        given: name of a policy, or path of a file or folder; a name has precedence ("./scripted" is a path).
        role: role of the policy.
        language_model: settings of a policy "llm:MODEL", whose name replaces that in the settings; None for the usual
            ones (`LanguageModelConfig.usual`).

    Raises:
        PolicyLoadError: there is no such policy for the role, no such file, or a file without a playable policy.
    """
    if _gives_traits(given, role):
        try:
            parse = parse_ad_wizard if role is Role.AD_WIZARD else parse_traits
            parse(given.removeprefix(WITH_TRAITS))
        except ValueError as error:
            raise PolicyLoadError(f"{role}: {error}") from None
        return Player(name=given)
    if given.startswith(LANGUAGE_MODEL):
        return _language_model(given, role, language_model)
    if is_own(given) and not Path(given).exists():
        return Player(name=given, sha256=source_hash(import_policy(given)))
    if given in policy_names(role):
        return _shipped_player(given, role) if is_pretrained(given) else Player(name=given)
    path = Path(given)
    if not path.exists():
        raise PolicyLoadError(
            f"{role}: there is no policy {given!r}, nor a file of that name (a class is module:Class); "
            f"{did_you_mean(given, policy_names(role))}the policies are {', '.join(policy_names(role))}"
        )
    return _trained_player(given, path, role)


def player_of(given: AnyPlayer, role: Role) -> Player:
    """Returns the source of a policy in any form: a name or path, a policy object, a class, or a source.

    Args:
        given: the policy. A class is given `role` and `limits` if its constructor takes them. Where sessions are played
            in several processes, objects and classes must be picklable.
        role: role of the policy.

    Raises:
        PolicyLoadError: there is no such policy, or it is not for the role.
    """
    if isinstance(given, Player):
        return given
    if isinstance(given, str):
        return find_player(given, role)
    if isinstance(given, Policy):
        name = name_of(type(given))
        return Player(name=name, sha256=source_hash(type(given)), policy=check_fits_role(given, role, name))
    name = name_of(given) if isinstance(given, type) else type(given).__name__
    found = check_policy_class(given, name)
    return Player(name=name, sha256=source_hash(found), policy=found)


def _fitting(policy: AnyPolicy, name: str, role: Role, limits: SpaceLimits) -> AnyPolicy:
    """Returns a policy object if it has a role and the sizes of a town; raises `PolicyLoadError` otherwise."""
    if policy.limits != limits:
        raise PolicyLoadError(f"{name} has other SpaceLimits than the town; pass its class, or make it with {limits}")
    return check_fits_role(policy, role, name)


def _language_model(given: str, role: Role, settings: LanguageModelConfig | None) -> Player:
    """Returns the source of a language model; raises `PolicyLoadError` if its settings are incomplete."""
    model = given.removeprefix(LANGUAGE_MODEL)
    try:
        config = LanguageModelConfig.usual(model) if settings is None else replace(settings, model=model)
    except ValueError as error:
        raise PolicyLoadError(f"{role}: {error}") from None
    return Player(name=given, language_model=config)


def _shipped_player(name: str, role: Role) -> Player:
    """Returns the source of a shipped model."""
    return replace(_trained_player(name, pretrained_folder(name), role), path=None, loader=None)


def _trained_player(given: str, path: Path, role: Role) -> Player:
    """Returns the source of a policy in a file or folder; raises `PolicyLoadError` if it cannot be played."""
    description = _description(path)
    kinds = _kinds_of(path, description)
    loader = next((found for kind in kinds if (found := _loader_of(kind))), None)
    if loader is None:
        stated, known = " or ".join(map(short_repr, kinds)), ", ".join(loadable_kinds())
        raise PolicyLoadError(f"{role}: {given} is of the kind {stated}, which cannot be played (known: {known})")
    training = {name: value for name in _COSTS if (value := _cost(description.get(name))) is not None}
    return Player(name=given, path=path, loader=loader, sha256=_sha256(path), training=training)


_BASELINES: Final = ("torch", "safetensors", "stable_baselines3", "sb3_contrib")
"""Libraries of the extra `baselines`."""


@contextmanager
def _reporting_missing_library(name: str) -> Iterator[None]:
    """Turns the failed import of a library into a `PolicyLoadError` that says how to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or str(error)).partition(".")[0]
        command = pip_install("baselines") if library in _BASELINES else f"pip install {library}"
        raise PolicyLoadError(f"{name} needs {library}, which is not installed; run: {command}") from None


def _cost(value: object) -> float | None:
    """Returns a number of at least 0; None for anything else."""
    return value if isinstance(value, int | float) and not isinstance(value, bool) and value >= 0 else None


def _description(path: Path) -> Mapping[str, object]:
    """Returns the JSON of a file, or of a folder's description; empty if there is none."""
    file = path / DESCRIPTION if path.is_dir() else path
    if file.suffix != ".json" or not file.exists():
        return {}
    try:
        page = read_json(file, MAX_MODEL_JSON)
    except OSError as error:
        raise PolicyLoadError(f"{file}: cannot be read ({error.strerror}); give the file of a policy") from None
    except InputFileError as error:
        raise PolicyLoadError(f"{error}; give the file of a policy") from None
    if not isinstance(page, Mapping) or not isinstance(page.get("kind", ""), str):
        raise PolicyLoadError(f"{file}: describes no policy: it must be a JSON object whose field 'kind' is a text")
    return page


def _kinds_of(path: Path, description: Mapping[str, object]) -> tuple[str, ...]:
    """Returns the possible kinds of a file: the one named in its JSON, and its suffix."""
    named = (str(description["kind"])[:MAX_SHOWN],) if "kind" in description else ()
    if not path.is_dir():
        return (*named, path.suffix or "file without an ending")
    return (*named, ".json") if (path / DESCRIPTION).is_file() else ("folder without " + DESCRIPTION,)


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    files = sorted(path.glob(Path(DESCRIPTION).stem + ".*")) if path.is_dir() else [path]
    for each in files:
        with raising(PolicyLoadError):
            check_file(each, MAX_WEIGHTS)
        digest.update(each.name.encode() + b"\0")
        with each.open("rb") as content:
            digest.update(hashlib.file_digest(content, "sha256").digest())
    return digest.hexdigest()
