"""Annotation of sessions by people: marks, logs, agreement, adjudication, formats, and the tool in the browser."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
