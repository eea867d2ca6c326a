"""Camera whose pictures determine the roles' perception, and the required numbers of visible pixels.

By Ricco's law, as in `sim.sensing.visibility`, a small target is detected by its area times its contrast: a loss of
contrast by air, darkness or a fault must be compensated by proportionally more pixels. Only unhidden pixels count.

Johnson (Image Intensifier Symposium, 1958) measured the number of line pairs across the smallest dimension of a target
that half of all observers need: 1 to detect an object, 6.4 to identify it. A pair of lines is two pixels.
"""

from __future__ import annotations

from typing import Final

from dorothie_gym.session.config import CameraConfig, CameraOutput

PERCEPTION_CAMERA: Final = CameraConfig(outputs=(CameraOutput.BOXES,), antialiasing=False, shadows=False)
"""Camera of the perception, with the usual size and mount; it does not depend on `EnvConfig.camera`."""

BODY_PIXELS: Final = 8
"""Minimum number of visible pixels of a perceived body, at full contrast: that of a person at `visibility.CLEAR_SIGHT`,
up to which the symbolic model perceives all bodies on a clear day. Johnson's criterion is 2 x 2 pixels. Detectors need
more: KITTI (Geiger et al., CVPR 2012) ignores objects less than 25 pixels high at a focal length of 721 pixels,
such as a person beyond 50 m, and COCO (Lin et al., ECCV 2014) calls less than 32 x 32 pixels small.
"""

LANDMARK_PIXELS: Final = 400
"""Visible pixels, at full contrast, from which a landmark is recognised: 20 x 20, those of a person with a sign, the
smallest landmark, at 40 m, and of a store at 110 m. That is half as wide again as Johnson's 12.8 x 12.8."""


def is_body_seen(pixels: int, gain: float) -> bool:
    """Returns whether a body is seen.

    Args:
        pixels: number of its visible pixels in the picture of `PERCEPTION_CAMERA`.
        gain: share of a clear noon's signal that is left, `Visibility.gain`.
    """
    return pixels * gain >= BODY_PIXELS


def is_landmark_recognised(pixels: int, contrast: float) -> bool:
    """Returns whether a landmark is recognised.

    Args:
        pixels: number of its visible pixels in the picture of `PERCEPTION_CAMERA`.
        contrast: share of the contrast that the air and the view leave. Darkness does not reduce the contrast, because
            the signs are lit.
    """
    return pixels * contrast >= LANDMARK_PIXELS
