"""Pictures of towns and sessions, drawn with pygame on surfaces that need no display.

Modules that draw nothing, such as the palette and the shapes of maps, are imported without pygame.
"""

import os

import lazy_loader

# before the first import of pygame: its greeting would spoil machine-readable output
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
