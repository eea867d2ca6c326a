"""Speech: synthesis, recognition with the language of the sessions, car noise, and understanding of recognised words.

Needs the extra `speech`; the packages are imported when a synthesiser or recogniser is made, and nothing is downloaded.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
