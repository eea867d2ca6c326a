"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .curriculum import AgentTask as AgentTask
from .curriculum import CurriculumStage as CurriculumStage
from .curriculum import Split as Split
from .curriculum import tasks as tasks
from .page_changes import merged_page as merged_page
from .text_session import PageStyle as PageStyle
from .text_session import TextSession as TextSession
from .tools import ToolSpec as ToolSpec
from .turn import Outcome as Outcome
from .turn import Turn as Turn
