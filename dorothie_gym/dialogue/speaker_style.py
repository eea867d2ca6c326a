"""Speaker styles: the manner of speaking of a role during a session, sampled from data/styles.yaml."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dorothie_gym.dialogue.lexicon import read_data, strings
from dorothie_gym.dialogue.phrases import Register
from dorothie_gym.errors import PhraseFileError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.ontology.spellings import parse_role
from dorothie_gym.support.copying import shared

_SHARES = ("chattiness", "indirectness", "anaphora", "disfluency", "repairs", "habit", "addressing")


@shared
@dataclass(frozen=True, kw_only=True)
class SpeakerStyle:
    """Style of a speaker. Shares are in [0, 1].

    Attributes:
        register: plain, slangy, polite or blunt.
        chattiness: share of optional words that are spoken.
        indirectness: share of sentences open to indirect forms: "could you turn left".
        anaphora: share of mentioned names that are replaced by "that one", "the same street".
        disfluency: share of sentences with a hesitation or a restart.
        repairs: share of names that follow a wrong name as its correction.
        habit: share of choices that use the favourite alternative; below 1.
        idiolect: number that determines the favourite alternatives; not negative.
        address: vocative for the other speaker; empty if there is none.
        addressing: share of sentences with the vocative.
        proper: whether sentences start with a capital letter and end with a full stop.

    Raises:
        ValueError: if a field is out of its range; names the field.
    """

    register: Register = Register.PLAIN
    chattiness: float = 0.35
    indirectness: float = 0.3
    anaphora: float = 0.3
    disfluency: float = 0.0
    repairs: float = 0.0
    habit: float = 0.0
    idiolect: int = 0
    address: str = ""
    addressing: float = 0.0
    proper: bool = True

    def __post_init__(self) -> None:
        for name in _SHARES:
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise ValueError(f"SpeakerStyle.{name} must be within 0 to 1, not {value}")
        if self.habit == 1:
            raise ValueError("SpeakerStyle.habit must be below 1: a value of 1 leaves no random choices")
        if self.idiolect < 0:
            raise ValueError(f"SpeakerStyle.idiolect must not be negative, but is {self.idiolect}")


@dataclass(frozen=True)
class _StyleSpread:
    """Distribution of the styles of a role: shares of registers, ranges of the other traits."""

    registers: Mapping[Register, float]
    ranges: Mapping[str, tuple[float, float]]
    addresses: tuple[str, ...]
    proper: float


def draw_style(role: Role, rng: np.random.Generator, leanings: Mapping[str, float] | None = None) -> SpeakerStyle:
    """Samples the style of a speaker for a session.

    Args:
        role: the Ad-Wizard shares the distribution of the participant, the car itself that of the Co-Wizard.
        rng: source of randomness; the same numbers are drawn for all leanings.
        leanings: places in [0, 1] of shares within their ranges, and of "register" from blunt to polite.
    """
    leanings = leanings or {}
    spread = _spreads()[Role.PARTICIPANT if role in (Role.PARTICIPANT, Role.AD_WIZARD) else Role.CO_WIZARD]
    registers = list(spread.registers)
    weights = np.array([spread.registers[register] for register in registers])
    register = registers[int(rng.choice(len(registers), p=weights / weights.sum()))]
    if "register" in leanings:
        register = _register(spread.registers, leanings["register"])
    shares = {name: float(rng.uniform(*spread.ranges[name])) for name in _SHARES}
    for name in leanings.keys() & set(_SHARES):
        low, high = spread.ranges[name]
        shares[name] = low + (high - low) * leanings[name]
    address = spread.addresses[int(rng.integers(len(spread.addresses)))] if spread.addresses else ""
    return SpeakerStyle(
        register=register,
        idiolect=int(rng.integers(1, 2**31)),
        address=address,
        proper=bool(rng.random() < spread.proper),
        chattiness=shares["chattiness"],
        indirectness=shares["indirectness"],
        anaphora=shares["anaphora"],
        disfluency=shares["disfluency"],
        repairs=shares["repairs"],
        habit=shares["habit"],
        addressing=shares["addressing"],
    )


def _register(shares: Mapping[Register, float], politeness: float) -> Register:
    """Returns the register of a speaker by its politeness in [0, 1]; over all speakers, registers have their shares."""
    left = politeness * sum(shares.values())
    for register in _BY_POLITENESS:
        left -= shares.get(register, 0.0)
        if left < 0.0:
            return register
    return _BY_POLITENESS[-1]


_BY_POLITENESS = (Register.BLUNT, Register.SLANGY, Register.PLAIN, Register.POLITE)


@functools.cache
def default_style(role: Role) -> SpeakerStyle:
    """Returns the default style of a role: mean traits without favourite words, vocative and disfluencies."""
    spread = _spreads()[role]
    chattiness, indirectness, anaphora = (
        sum(spread.ranges[name]) / 2 for name in ("chattiness", "indirectness", "anaphora")
    )
    proper = role is Role.CO_WIZARD
    return SpeakerStyle(chattiness=chattiness, indirectness=indirectness, anaphora=anaphora, proper=proper)


@functools.cache
def _spreads() -> Mapping[Role, _StyleSpread]:
    data = read_data("styles.yaml")
    return {parse_role(name): _spread(name, entry) for name, entry in data.items()}


def _spread(role: str, entry: Mapping[str, object]) -> _StyleSpread:
    wanted = {"registers", "addresses", "proper", *_SHARES}
    if set(entry) != wanted:
        raise PhraseFileError(f"styles.yaml: {role} needs exactly {sorted(wanted)}, has {sorted(entry)}")
    shares = entry["registers"]
    if not isinstance(shares, dict) or not set(shares) <= {register.name.lower() for register in Register}:
        raise PhraseFileError(f"styles.yaml: {role}.registers gives shares of {[r.name.lower() for r in Register]}")
    ranges = {name: _range(f"{role}.{name}", entry[name]) for name in _SHARES}
    proper = entry["proper"]
    if not isinstance(proper, int | float):
        raise PhraseFileError(f"styles.yaml: {role}.proper is a share, not {proper!r}")
    return _StyleSpread(
        {Register[name.upper()]: float(share) for name, share in shares.items()},
        ranges,
        strings(f"styles.yaml: {role}.addresses", entry["addresses"]),
        float(proper),
    )


def _range(where: str, value: object) -> tuple[float, float]:
    if isinstance(value, list) and len(value) == 2 and all(isinstance(end, int | float) for end in value):
        low, high = map(float, value)
        if 0 <= low <= high <= 1:
            return low, high
    raise PhraseFileError(f"styles.yaml: {where} is a range [low, high] within 0 to 1, not {value!r}")
