"""Settings of the first-person camera."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from dorothie_gym.support.copying import shared


class CameraOutput(StrEnum):
    """Part of a picture. All but RGB are ground truth, which no camera gives: privileged."""

    RGB = "rgb"
    """Colours (h, w, 3) uint8."""
    DEPTH = "depth"
    """Distance along the axis of the camera [m] (h, w) float32, infinite for the sky."""
    SEMANTIC = "semantic"
    """Class of the ontology, `ObjectClass` (h, w) uint8."""
    INSTANCE = "instance"
    """Key of the body (h, w) int32, 0 for none."""
    BOXES = "boxes"
    """Boxes around the visible pixels of each body."""


@shared
@dataclass(frozen=True, kw_only=True)
class CameraMount:
    """Place of the camera on the car.

    Attributes:
        forward: distance in front of the middle of the car [m].
        up: above the road [m].
        pitch: upwards [degrees].

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    forward: float = 0.35
    up: float = 1.45
    pitch: float = -2.0

    def __post_init__(self) -> None:
        for name, low, high, unit in (
            ("forward", -5.0, 5.0, "m"),
            ("up", 0.2, 10.0, "m"),
            ("pitch", -60.0, 60.0, "degrees"),
        ):
            value = getattr(self, name)
            if not (isinstance(value, float | int) and low <= value <= high):
                raise ValueError(f"CameraMount.{name} is {value}; it must be in {low:g}..{high:g} {unit}")


@shared
@dataclass(frozen=True, kw_only=True)
class CameraConfig:
    """Settings of a camera.

    Attributes:
        width: width of the picture [pixels].
        height: height of the picture [pixels].
        field_of_view: horizontal [degrees].
        mount: place on the car.
        outputs: parts of a picture; all but `CameraOutput.RGB` are privileged.
        antialiasing: whether edges are smoothed with 2 x 2 samples in a pixel.
        shadows: whether the sun casts shadows.

    Raises:
        ValueError: a value is out of its range; names the field.
    """

    width: int = 480
    height: int = 320
    field_of_view: float = 90.0
    mount: CameraMount = CameraMount()
    outputs: tuple[CameraOutput, ...] = (CameraOutput.RGB,)
    antialiasing: bool = True
    shadows: bool = True

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            if not isinstance(value, int) or not 8 <= value <= 4096:
                raise ValueError(f"CameraConfig.{name} is {value}; it must be a whole number in 8..4096 pixels")
        if not (isinstance(self.field_of_view, float | int) and 10.0 <= self.field_of_view <= 150.0):
            raise ValueError(f"CameraConfig.field_of_view is {self.field_of_view}; it must be in 10..150 degrees")
        if not isinstance(self.mount, CameraMount):
            raise ValueError(f"CameraConfig.mount is a {type(self.mount).__name__}; it must be a CameraMount")
        for name in ("antialiasing", "shadows"):
            if not isinstance(getattr(self, name), bool):
                raise ValueError(f"CameraConfig.{name} is {getattr(self, name)!r}; it must be True or False")
        if not isinstance(self.outputs, tuple):
            raise ValueError(
                f"CameraConfig.outputs is a {type(self.outputs).__name__}; it must be a tuple of CameraOutput"
            )
        known = [output.value for output in CameraOutput]
        for output in self.outputs:
            if output not in known:
                raise ValueError(f"CameraConfig.outputs contains {output!r}; it must be of {', '.join(known)}")
        if not self.outputs or len(set(self.outputs)) < len(self.outputs):
            raise ValueError(f"CameraConfig.outputs is {self.outputs}; it must name at least one output, each once")

    @property
    def samples(self) -> int:
        """Number of samples along each side of a pixel."""
        return 2 if self.antialiasing else 1
