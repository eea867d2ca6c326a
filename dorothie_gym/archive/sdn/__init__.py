"""Situated Dialogue Navigation corpus (SDN): reader into `Session`, and writer of its release layout."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
