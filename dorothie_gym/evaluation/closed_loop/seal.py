"""Seal of a model: hashes of policy and code, the settings of a run, and the date, written before a beacon is known.

A seal shows that a model was finished before its test scenarios could be known: the scenarios follow from a `Beacon` of
a later date. The date is that of the computer that seals; to prove it, publish the hash of the seal.
"""

from __future__ import annotations

import datetime
import functools
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, TypedDict

import dorothie_gym
from dorothie_gym._version import __version__
from dorothie_gym.errors import RolloutError, one_line, short_repr
from dorothie_gym.evaluation.closed_loop.beacon import Beacon, check_date
from dorothie_gym.ontology.roles import Role
from dorothie_gym.policies.policy_loader import is_own
from dorothie_gym.session.recording.files import canonical, same_json, to_line, to_page
from dorothie_gym.support.copying import shared
from dorothie_gym.support.files import write_atomically
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, raising, read_json

FORMAT: Final = "dorothie_gym-seal"
VERSION: Final = "1.0"

_RUN: Final = ("tier", "trials", "participant", "ad_wizard", "pool_sha256", "sessions_planned", "references", "config")
"""Settings of a rollout that are sealed; the others follow from the policy and from the beacon."""


class SealPage(TypedDict):
    """Seal in JSON types; fields as in `Seal`, with its format and its own hash."""

    format: str
    version: str
    date: str
    package_version: str
    code_sha256: str
    co_wizard: str
    policy_sha256: str
    run: dict[str, Any]
    sha256: str


@shared
@dataclass(frozen=True, kw_only=True)
class Seal:
    """Seal of a Co-Wizard.

    Attributes:
        date: day of the seal, as YYYY-MM-DD, in universal time.
        package_version: version of the package.
        code_sha256: hash of the source of the package (`code_sha256`).
        co_wizard: name of the policy, for readers.
        policy_sha256: hash of the policy (`policy_sha256`).
        run: settings of the rollout that do not follow from policy and beacon: tier, partners, sessions, engine.
    """

    date: str
    package_version: str
    code_sha256: str
    co_wizard: str
    policy_sha256: str
    run: Mapping[str, Any]

    def to_json(self) -> SealPage:
        """Returns the content of the file of the seal."""
        page: Any = {"format": FORMAT, "version": VERSION, **asdict(self), "run": dict(self.run)}
        page["sha256"] = _hash_of(page)
        sealed: SealPage = page
        return sealed

    @classmethod
    def from_json(cls, page: SealPage) -> Seal:
        """Parses the output of `to_json`.

        Raises:
            ValueError: it is of another format, or does not have its own hash.
        """
        if page["format"] != FORMAT or page["version"] != VERSION:
            raise ValueError(f"its format is {short_repr(page['format'])} {short_repr(page['version'])}, not {FORMAT}")
        if page["sha256"] != _hash_of(page):
            raise ValueError("it does not have its own hash: it was changed after the model was sealed")
        check_date("its date", page["date"])
        return cls(
            date=page["date"],
            package_version=page["package_version"],
            code_sha256=page["code_sha256"],
            co_wizard=page["co_wizard"],
            policy_sha256=page["policy_sha256"],
            run=page["run"],
        )


def seal_of(settings: Mapping[str, Any], date: datetime.date | None = None) -> Seal:
    """Returns the seal of a rollout that is to be played.

    Args:
        settings: its settings (`RolloutSettings.to_json`).
        date: day of the seal; None for today, in universal time.

    Raises:
        RolloutError: the policy has no file that could be hashed.
    """
    today = datetime.datetime.now(datetime.UTC).date() if date is None else date
    return Seal(
        date=today.isoformat(),
        package_version=__version__,
        code_sha256=code_sha256(),
        co_wizard=str(settings[str(Role.CO_WIZARD)]),
        policy_sha256=policy_sha256(settings),
        run=_run_of(settings),
    )


def faults_of_seal(seal: Seal, beacon: Beacon, settings: Mapping[str, Any]) -> Iterator[str]:
    """Yields the reasons for which a rollout is not the one that was sealed before its beacon.

    Args:
        seal: the seal.
        beacon: the beacon from which the scenarios are drawn.
        settings: settings of the rollout (`RolloutSettings.to_json`).
    """
    if seal.date >= beacon.date:  # of one form, which sorts by time
        yield (
            f"the model was sealed on {seal.date}, and the beacon became known on {beacon.date}: a model must be "
            "sealed on an earlier day; take a later beacon"
        )
    if seal.policy_sha256 != policy_sha256(settings):
        yield (
            f"co_wizard {one_line(settings[str(Role.CO_WIZARD)])} has the hash {policy_sha256(settings)[:16]}..., and "
            f"that of the seal is {short_repr(seal.policy_sha256[:16])}...: it is not the model that was sealed "
            f"({one_line(seal.co_wizard)})"
        )
    if (seal.package_version, seal.code_sha256) != (__version__, code_sha256()):
        yield (
            f"the seal is of version {one_line(seal.package_version)}, code {one_line(seal.code_sha256[:16])}...; this "
            f"is {__version__}, code {code_sha256()[:16]}...: install the version that was sealed"
        )
    run = _run_of(settings)
    for name in sorted({*run, *seal.run}):
        if not same_json(run.get(name), seal.run.get(name)):
            yield f"{name} is {short_repr(run.get(name))}; the seal has {short_repr(seal.run.get(name))}"


def policy_sha256(settings: Mapping[str, Any]) -> str:
    """Returns the hash that identifies the Co-Wizard of a rollout.

    It is the hash of the weights for a model file; for a class, that of its name and of its source file; for a language
    model, that of its name and settings; for a policy of the package without a file, that of its name, whose source
    belongs to the hash of the code. Prices of a language model are left out.

    Args:
        settings: settings of the rollout (`RolloutSettings.to_json`).

    Raises:
        RolloutError: a class has no source file.
    """
    role = str(Role.CO_WIZARD)
    name = str(settings[role])
    file = settings.get("sha256", {}).get(role)
    model = settings.get("language_models", {}).get(role)
    if model is not None:
        return _sha256({"name": name, "settings": {key: value for key, value in model.items() if key != "prices"}})
    if not is_own(name):
        return _sha256({"name": name}) if file is None else str(file)
    if file is None:
        raise RolloutError(f"{one_line(name)} has no source file that could be hashed; give a class from a file")
    return _sha256({"class": name.rpartition(":")[2], "source": file})


@functools.cache
def code_sha256() -> str:
    """Returns the hash of the Python and YAML files of the package, by their paths within it."""
    root, digest = Path(dorothie_gym.__file__).parent, hashlib.sha256()
    files = (path for path in root.rglob("*") if path.suffix in (".py", ".yaml"))
    for path in sorted(files, key=lambda path: path.relative_to(root).as_posix()):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def read_seal(file: Path) -> Seal:
    """Reads the file of a seal.

    Raises:
        RolloutError: the file is missing or damaged.
    """
    with raising(RolloutError):
        try:
            page = checked(read_json(file, MAX_SMALL_JSON), SealPage, file)
        except FileNotFoundError:
            raise RolloutError(f"{file}: does not exist; write it with `dorothie-gym seal MODEL --out FILE`") from None
    try:
        return Seal.from_json(page)
    except ValueError as error:
        raise RolloutError(f"{file}: {error}") from None


def write_seal(file: Path, seal: Seal) -> None:
    """Writes the file of a seal."""
    write_atomically(file, to_page(seal.to_json()))


def _run_of(settings: Mapping[str, Any]) -> dict[str, Any]:
    return {name: settings[name] for name in _RUN if name in settings}


def _sha256(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(to_line(canonical(dict(content), "seal")).encode()).hexdigest()


def _hash_of(page: Mapping[str, Any]) -> str:
    """Returns the hash of a seal without its own hash."""
    return _sha256({name: value for name, value in page.items() if name != "sha256"})
