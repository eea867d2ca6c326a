"""Model inputs: a corpus as columns, its points, and batches of the data visible at points."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
