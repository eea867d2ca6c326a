"""Made-up labelled pictures: a road, a sky and a red car; no town has to be drawn for the tests of models."""

import math

import numpy as np

from dorothie_gym.baselines.vision.frames import BOX_DTYPE, FrameSampling, FrameSet, SessionFrames
from dorothie_gym.baselines.vision.solids import Focals
from dorothie_gym.ontology import ObjectClass

ROAD, SKY, CAR = (kind.value for kind in (ObjectClass.ROAD, ObjectClass.SKY, ObjectClass.VEHICLES))

CAR_DEPTH, CAR_TURN = 10.0, 0.6  # [m], and to the viewer [rad]


def session_frames(count=8, width=128, height=64, seed=0):
    """Pictures with the sky above the middle, a road that ends there, and a car at a random place on it."""
    focals = Focals.of(FrameSampling(width=width, height=height).camera)
    generator = np.random.default_rng(seed)
    rows = np.arange(height)
    below = rows >= height // 2
    depth = np.full((count, height, width), np.inf, np.float16)
    depth[:, below] = (80.0 / (rows[below] - height // 2 + 1.0)).clip(2.0)[:, None]
    semantic = np.where(below, ROAD, SKY).astype(np.uint8)[None, :, None].repeat(count, 0).repeat(width, 2)
    rgb = np.where(below, 90, 200).astype(np.uint8)[None, :, None, None].repeat(count, 0).repeat(width, 2).repeat(3, 3)
    rgb = rgb + generator.integers(0, 20, rgb.shape, dtype=np.uint8)
    boxes = []
    for k in range(count):
        left, top = int(generator.integers(0, width - 24)), int(generator.integers(height // 2, height - 16))
        inside = k, slice(top, top + 16), slice(left, left + 24)
        rgb[inside], semantic[inside], depth[inside] = (220, 20, 20), CAR, CAR_DEPTH
        x = CAR_DEPTH * ((left + 12) / width - 0.5) / focals.x
        y = CAR_DEPTH * ((top + 8) / height - 0.5) / focals.y
        turned = CAR_TURN + math.atan2(x, CAR_DEPTH)
        space = x, y, CAR_DEPTH, 4.0, 1.8, 1.5, turned
        boxes.append((k, CAR, left, top, left + 24, top + 16, 24 * 16, *space))
    return SessionFrames(
        f"made-up-{seed}", "nowhere", f"{seed:064x}", rgb, semantic, depth, np.array(boxes, BOX_DTYPE),
        np.arange(count, dtype=np.int64),
    )  # fmt: skip


def frame_set(*seeds, count=8):
    return FrameSet([session_frames(count, seed=seed) for seed in seeds])
