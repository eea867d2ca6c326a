"""Town maps: the data model, the catalogue of shipped towns, and readers for OpenDRIVE and YAML files."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
