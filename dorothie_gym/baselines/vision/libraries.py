"""Import of `transformers`, which only the vision models need."""

from __future__ import annotations

import importlib
from typing import Any

from dorothie_gym.errors import EncoderError
from dorothie_gym.support.installation import pip_install


def transformers() -> Any:
    """Returns the module `transformers`.

    Raises:
        EncoderError: it is not installed; the message names the extra.
    """
    try:
        return importlib.import_module("transformers")
    except ImportError as error:
        raise EncoderError(f"vision models need transformers ({error}); run: {pip_install('vision')}") from None


def matcher_of(settings: Any) -> Any:
    """Returns the module that matches queries to objects, as the loss of a `DeformableDetrConfig` does."""
    transformers()
    module = importlib.import_module("transformers.loss.loss_deformable_detr")
    return module.DeformableDetrHungarianMatcher(
        class_cost=settings.class_cost, bbox_cost=settings.bbox_cost, giou_cost=settings.giou_cost
    )
