"""The contract between roles and environments: observation and action spaces, field by field."""

from dorothie_gym.spaces.actions import (
    NO_MOVE,
    ActionDict,
    AdWizardAction,
    CoWizardAction,
    Mental,
    ParticipantAction,
    Physical,
    Place,
    RoleAction,
    Speech,
    action_space,
    decode_action,
    noop,
)
from dorothie_gym.spaces.limits import SpaceLimits
from dorothie_gym.spaces.observations import (
    ExitColumn,
    GuessColumn,
    LandmarkColumn,
    Motion,
    ObjectColumn,
    Observation,
    PropColumn,
    SubgoalColumn,
    heard_acts,
    observation_space,
)
from dorothie_gym.spaces.text import plain_text

__all__ = [
    "NO_MOVE",
    "ActionDict",
    "AdWizardAction",
    "CoWizardAction",
    "ExitColumn",
    "GuessColumn",
    "LandmarkColumn",
    "Mental",
    "Motion",
    "ObjectColumn",
    "Observation",
    "ParticipantAction",
    "Physical",
    "Place",
    "PropColumn",
    "RoleAction",
    "SpaceLimits",
    "Speech",
    "SubgoalColumn",
    "action_space",
    "decode_action",
    "heard_acts",
    "noop",
    "observation_space",
    "plain_text",
]
