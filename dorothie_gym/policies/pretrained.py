"""Trained models that the package ships: names (`pretrained:NAME`), folders and cards.

`python benchmarks/pretrained.py` makes them all again. torch is needed to play them, not to list them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from dorothie_gym.errors import PolicyLoadError
from dorothie_gym.ontology.roles import Role
from dorothie_gym.support.input_files import MAX_SMALL_JSON, checked, raising, read_json

PREFIX: Final = "pretrained:"
"""First part of the names of shipped models."""

SHIPPED: Final = Path(__file__).parent / "data" / "pretrained"
"""Folder with a model folder for each name."""

CARD_FILE: Final = "card.json"
"""File of a model folder with its `PretrainedCard`."""

REMEDY: Final = "train the shipped models again with `python benchmarks/pretrained.py`"


@dataclass(frozen=True, kw_only=True)
class CardFigure:
    """Mean of a metric of validation sessions, and the ends of its 95 % interval."""

    mean: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True)
class PretrainedCard:
    """Provenance of a shipped model.

    Attributes:
        description: the model, in a few words.
        commands: commands of the training, in order.
        version: version of the package that trained it.
        licence: licence of the weights.
        seed: seed of the training.
        steps: steps of reinforcement learning, or points times epochs.
        seconds: duration of the training without evaluations [s].
        weights: number of weights.
        observation: widths of the fields of `Navigation-v0`'s observation at the time of the training, in their order;
            None for benchmark models.
        rollout: command of the validation sessions, none of which is in a test.
        sessions: their number.
        figures: closed-loop metrics over them by key; the interval of `success` is Wilson's.
        scores: metrics of the training on its validation episodes or points by key; None where a metric is undefined.
        role: role that the model plays.
    """

    description: str
    commands: tuple[str, ...]
    version: str
    licence: str
    seed: int
    steps: int
    seconds: float
    weights: int
    observation: Mapping[str, int] | None
    rollout: str
    sessions: int
    figures: Mapping[str, CardFigure]
    scores: Mapping[str, float | None]
    role: str = Role.CO_WIZARD.value


def pretrained_names() -> tuple[str, ...]:
    """Returns the names of the shipped models, with their prefix, sorted."""
    if not SHIPPED.is_dir():
        return ()
    return tuple(sorted(f"{PREFIX}{path.name}" for path in SHIPPED.iterdir() if (path / CARD_FILE).is_file()))


def names_for(role: Role) -> tuple[str, ...]:
    """Returns the names of the shipped models that play a role; raises `PolicyLoadError` if a card is damaged."""
    return tuple(name for name in pretrained_names() if pretrained_card(name).role == role)


def is_pretrained(name: str) -> bool:
    """Returns whether a name of a policy is that of a shipped model, whether or not there is one."""
    return name.startswith(PREFIX)


def pretrained_folder(name: str) -> Path:
    """Returns the model folder of a shipped model, which is valid in every place that accepts a model folder.

    Args:
        name: name of the model; the prefix may be omitted.

    Raises:
        PolicyLoadError: there is no such model.
    """
    full = name if is_pretrained(name) else f"{PREFIX}{name}"
    if full not in pretrained_names():
        raise PolicyLoadError(f"there is no model {name!r}; the shipped models are {', '.join(pretrained_names())}")
    return SHIPPED / full.removeprefix(PREFIX)


def pretrained_card(name: str) -> PretrainedCard:
    """Returns the card of a shipped model.

    Raises:
        PolicyLoadError: there is no such model, or its card is damaged.
    """
    file = pretrained_folder(name) / CARD_FILE
    with raising(PolicyLoadError):
        try:
            return checked(read_json(file, MAX_SMALL_JSON), PretrainedCard, file)
        except OSError as error:
            raise PolicyLoadError(f"{file}: cannot be read ({error.strerror}); install the package again") from None


def pretrained_size(name: str) -> int:
    """Returns the size of the files of a shipped model [bytes]."""
    return sum(path.stat().st_size for path in pretrained_folder(name).iterdir())


def check_fits(name: str) -> None:
    """Raises `PolicyLoadError` if a shipped driver was trained with other observations than this version makes."""
    # imported here: the list of names is needed without the simulation
    from dorothie_gym.policies.navigation.observation_fields import FIELDS

    trained = pretrained_card(name).observation
    if trained is None or list(trained.items()) == list(FIELDS.items()):
        return
    there, here = sum(trained.values()), sum(FIELDS.values())
    detail = f"of {there} numbers, not {here}" if there != here else f"of {there} numbers with other fields"
    raise PolicyLoadError(
        f"{name} was trained on observations {detail}: it is older than this version of the package; {REMEDY}"
    )
