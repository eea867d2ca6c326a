"""The three tasks on recordings: metrics, prediction files, trivial baselines and the results table."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
