"""Checks of the content of utterances: truth, reasons, arrival times, answers, exceptions and loops."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
