"""Recording of a session: the files of its folder, their writer and their reader."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
