"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .binding import bind as bind
from .binding import needed_places as needed_places
from .catalogue import LandmarkKind as LandmarkKind
from .catalogue import catalogue as catalogue
from .catalogue import map_label as map_label
from .catalogue import map_labels as map_labels
from .parsing import is_shipped_story as is_shipped_story
from .parsing import load_template as load_template
from .parsing import parse_template as parse_template
from .parsing import template_names as template_names
from .storyboard import Channel as Channel
from .storyboard import Dependent as Dependent
from .storyboard import Landmark as Landmark
from .storyboard import LandmarkSite as LandmarkSite
from .storyboard import Storyboard as Storyboard
from .storyboard import StoryboardTemplate as StoryboardTemplate
from .storyboard import Subgoal as Subgoal
from .storyboard import SubgoalTemplate as SubgoalTemplate
from .storyboard import TaskMessage as TaskMessage
from .storyboard import TaskMessages as TaskMessages
from .storyboard import TaskState as TaskState
from .storyboard import Variable as Variable
from .storyboard import with_reason as with_reason
