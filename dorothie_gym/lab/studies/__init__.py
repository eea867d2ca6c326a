"""Studies with people: a study file, participants from consent to completion code, pairing, withdrawal, export."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
