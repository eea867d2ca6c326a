"""The 24 phenomena of dialogue between people and cars, each found by a query over acts, texts and events."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
