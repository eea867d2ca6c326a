"""YAML town language: `schema` reads a plan, `layout` computes its centre lines, `compile` builds the town."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
