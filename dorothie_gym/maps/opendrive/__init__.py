"""Towns from OpenDRIVE files (ASAM OpenDRIVE 1.4 to 1.8)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
