"""Tasks of the participant: landmarks, storyboard templates, their binding to a town, and the task state."""

from dorothie_gym.errors import StoryboardError
from dorothie_gym.tasks.binding import bind
from dorothie_gym.tasks.catalogue import LandmarkKind, catalogue, map_label, map_labels
from dorothie_gym.tasks.parsing import is_shipped_story, load_template, parse_template, template_names
from dorothie_gym.tasks.state import TaskState
from dorothie_gym.tasks.storyboard import (
    Channel,
    Dependent,
    Landmark,
    LandmarkSite,
    Storyboard,
    StoryboardTemplate,
    Subgoal,
    SubgoalTemplate,
    TaskMessage,
    TaskMessages,
    Variable,
    with_reason,
)

__all__ = [
    "Channel",
    "Dependent",
    "Landmark",
    "LandmarkKind",
    "LandmarkSite",
    "Storyboard",
    "StoryboardError",
    "StoryboardTemplate",
    "Subgoal",
    "SubgoalTemplate",
    "TaskMessage",
    "TaskMessages",
    "TaskState",
    "Variable",
    "bind",
    "catalogue",
    "is_shipped_story",
    "load_template",
    "map_label",
    "map_labels",
    "parse_template",
    "template_names",
    "with_reason",
]
