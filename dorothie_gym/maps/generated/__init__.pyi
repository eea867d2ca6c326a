"""Public names of the package and the modules that define them (read by type checkers and by lazy_loader)."""

from .generate import generate as generate
from .generate import generate_town as generate_town
from .specification import TownSize as TownSize
from .specification import TownSpecification as TownSpecification
from .specification import TownStyle as TownStyle
