"""Generated towns: `generate` draws a street plan, signals and names from a seed, and writes them as a YAML town."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
