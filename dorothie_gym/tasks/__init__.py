"""Tasks of the participant: landmarks, storyboard templates, their binding to a town, and the task state."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
