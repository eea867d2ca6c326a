"""Dialogue: utterances and timing, exchange units, language generation (NLG) and understanding (NLU)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
