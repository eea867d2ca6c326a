"""Loaders of trained models as policies; torch is imported when a model is loaded, not before.

`dorothie_gym.policies.policy_loader` names these functions by kind of model.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from dorothie_gym.ontology.roles import Role

if TYPE_CHECKING:
    from dorothie_gym.baselines.benchmark_co_wizard.policy import BenchmarkCoWizard
    from dorothie_gym.baselines.roles.co_wizard.policy import LearnedCoWizard
    from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant
    from dorothie_gym.policies.policy import AnyPolicy
    from dorothie_gym.session.spaces.fields import SpaceLimits


def load_benchmark_model(path: Path, role: Role, limits: SpaceLimits) -> BenchmarkCoWizard:
    """Returns a Co-Wizard that acts on the predictions of a benchmark model (`dorothie-gym train`).

    Args:
        path: folder of the training, or its `model.json`.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: the role is not the Co-Wizard, or a file of the model is missing or damaged.
    """
    if role is not Role.CO_WIZARD:
        raise ValueError(f"{path}: benchmark models play the Co-Wizard, not the {role}")
    from dorothie_gym.baselines.benchmark_co_wizard.inference import BenchmarkModel
    from dorothie_gym.baselines.benchmark_co_wizard.policy import BenchmarkCoWizard

    return BenchmarkCoWizard(BenchmarkModel.load(path.resolve()), limits)


def load_rl_model(path: Path, role: Role, limits: SpaceLimits) -> AnyPolicy:
    """Returns a policy that plays by a model of stable-baselines3 (`dorothie-gym train-rl`).

    Args:
        path: folder of the training, or a file of the model in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: the model was trained in an environment of another role, or its files are missing or damaged.
    """
    from dorothie_gym.baselines.rl.players import make_player

    return make_player(path, role, limits)


def load_co_wizard(path: Path, role: Role, limits: SpaceLimits) -> LearnedCoWizard:
    """Returns a learned Co-Wizard (`dorothie-gym train co-wizard`).

    Args:
        path: folder of the model, or `model.json` in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: the role is not the Co-Wizard, or the files are missing or damaged.
    """
    if role is not Role.CO_WIZARD:
        raise ValueError(f"{path}: plays the co_wizard, not the {role}")
    from dorothie_gym.baselines.roles.co_wizard.files import FILES
    from dorothie_gym.baselines.roles.co_wizard.policy import LearnedCoWizard

    network, page = FILES.load(path)
    return LearnedCoWizard(network, page.vocabulary, limits)


def load_participant(path: Path, role: Role, limits: SpaceLimits) -> LearnedParticipant:
    """Returns a learned participant (`dorothie-gym train participant`).

    Args:
        path: folder of the model, or `model.json` in it.
        role: the role to play.
        limits: sizes of the spaces.

    Raises:
        ValueError: the role is not the participant, or the files are missing or damaged.
    """
    if role is not Role.PARTICIPANT:
        raise ValueError(f"{path}: plays the participant, not the {role}")
    from dorothie_gym.baselines.roles.participant.files import FILES
    from dorothie_gym.baselines.roles.participant.policy import LearnedParticipant

    network, page = FILES.load(path)
    return LearnedParticipant(network, page.vocabulary, limits)
