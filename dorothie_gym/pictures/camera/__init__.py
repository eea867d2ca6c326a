"""First-person camera: the scene of a town as triangles, drawn on one processor core without graphics libraries."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
