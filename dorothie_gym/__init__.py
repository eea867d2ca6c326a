"""Gymnasium and PettingZoo environments for situated dialogue between a passenger, a driver and an adversary.

Importing the package registers its environments. The public names are listed once, in `__init__.pyi`; the module behind
a name is imported when the name is first used, so that `import dorothie_gym` loads neither highway-env nor torch.
"""

from dorothie_gym import _startup as _startup  # first: it handles Ctrl-C during the other imports

# isort: split
import lazy_loader

from dorothie_gym._registration import register_environments
from dorothie_gym._version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

register_environments()
