"""Draws pictures with the boxes that a trained detector finds, in the picture and in space.

python benchmarks/detections.py CORPUS runs/detr/small/seed-0 --picture docs/detections.webp

The pictures are of the test sessions in unseen towns: of each session the one with the largest sum of scores.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from dorothie_gym.archive import Corpus
from dorothie_gym.baselines.vision.detected_boxes import DetectedBoxes, objects_in
from dorothie_gym.baselines.vision.detector import Detector
from dorothie_gym.baselines.vision.experiment import TESTS, config_of, sampling_of
from dorothie_gym.baselines.vision.frames import SessionFrames, load_frames
from dorothie_gym.baselines.vision.object_learner import corners_of, focals_of
from dorothie_gym.baselines.vision.pixel_learner import predict_pixels
from dorothie_gym.baselines.vision.segformer import SegFormer, normalised
from dorothie_gym.baselines.vision.solids import Focals, spaces_of
from dorothie_gym.baselines.vision.trained import load_detector, load_segformer

SCALE = 2
"""Pixels of the drawing for one of the picture."""

COLOURS = ((255, 210, 40), (60, 230, 255), (255, 120, 220))
"""Of vehicles, pedestrians and props."""

_EDGES = [(a, b) for a, b in itertools.combinations(range(8), 2) if (a ^ b).bit_count() == 1]


def corners(space: NDArray[np.float64], pitch: float) -> NDArray[np.float64]:
    """Returns the corners (8, 3) of a box in space of `SPACE_COLUMNS`, in the frame of a camera with a pitch [rad]."""
    x, y, z, length, width, height, heading = space
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    ahead, aside, up = (signs * (length, width, height)).T
    forward, right = (
        ahead * np.cos(heading) - aside * np.sin(heading),
        ahead * np.sin(heading) + aside * np.cos(heading),
    )
    down = forward * np.sin(pitch) - up * np.cos(pitch)
    return np.stack((x + right, y + down, z + forward * np.cos(pitch) + up * np.sin(pitch)), axis=1)


@dataclass(frozen=True, eq=False)
class Found:
    """Detections in a picture.

    Attributes:
        total: sum of the scores.
        rgb: the picture (h, w, 3).
        boxes: (n, 4) left, top, right, bottom, in shares of the picture.
        spaces: (n, 7) `SPACE_COLUMNS`.
        kinds: (n,) rows of `KINDS`.
    """

    total: float
    rgb: NDArray[np.uint8]
    boxes: NDArray[np.floating]
    spaces: NDArray[np.float64]
    kinds: Sequence[int]


def draw(found: Found, focals: Focals, pitch: float) -> Image.Image:
    """Returns a picture with its boxes; `pitch` is that of the camera [rad]."""
    height, width = found.rgb.shape[:2]
    picture = Image.fromarray(found.rgb).resize((width * SCALE, height * SCALE), Image.Resampling.BICUBIC)
    pen = ImageDraw.Draw(picture)
    size = np.array([width, height]) * SCALE
    for box, space, kind in zip(found.boxes, found.spaces, found.kinds, strict=True):
        pen.rectangle(tuple((box * np.tile(size, 2)).tolist()), outline=(255, 255, 255))
        places = corners(space, pitch)
        if places[:, 2].min() < 0.5:
            continue
        seen = (0.5 + np.array(focals) * places[:, :2] / places[:, 2:]) * size
        for first, second in _EDGES:
            pen.line([tuple(seen[first].tolist()), tuple(seen[second].tolist())], fill=COLOURS[kind], width=2)
    return picture


def main(arguments: Sequence[str]) -> None:
    """Draws a picture of four pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("detector", type=Path)
    parser.add_argument("--picture", type=Path, required=True)
    parser.add_argument("--count", type=int, default=4)
    options = parser.parse_args(arguments)
    torch.set_num_threads(1)
    sight, cpu = DetectedBoxes(options.detector), torch.device("cpu")
    reader, detector = load_segformer(sight.segformer, cpu), load_detector(sight.detector, cpu)
    sampling = sampling_of(config_of("detr", "small"))
    pitch = np.radians(sampling.camera.mount.pitch)
    every = load_frames(Corpus.load(options.corpus), sampling)[TESTS["unseen"]].sessions
    found = [best_of(session, reader, detector, sight.threshold) for session in every]
    found.sort(key=lambda each: -each.total)
    drawn = [draw(each, focals_of(detector.config), pitch) for each in found[: options.count]]
    width, height = drawn[0].size
    page = Image.new("RGB", (2 * width, -(-len(drawn) // 2) * height))
    for number, each in enumerate(drawn):
        page.paste(each, (number % 2 * width, number // 2 * height))
    page.save(options.picture, quality=70)
    print(f"{options.picture}: {page.width} x {page.height}, {options.picture.stat().st_size / 1000:.0f} kB")


def best_of(session: SessionFrames, reader: SegFormer, detector: Detector, threshold: float) -> Found:
    """Returns the picture of a session with the largest sum of scores, of every third."""
    every = []
    for k in range(0, len(session), 3):
        rgb = np.array(session.rgb[k : k + 1])
        semantic, depth = predict_pixels(reader, rgb)
        with torch.inference_mode():
            detections = detector(
                normalised(torch.from_numpy(rgb)), torch.from_numpy(depth), torch.from_numpy(semantic).long()
            )
        scores = detections.scores[0].numpy()
        chosen = objects_in(detections.boxes[0].numpy(), scores, threshold)
        every.append(
            Found(
                total=float(scores.max(1)[chosen].sum()),
                rgb=rgb[0],
                boxes=corners_of(detections.boxes[0].numpy()[chosen]),
                spaces=spaces_of(detections.solids[0].numpy()[chosen], focals_of(detector.config)),
                kinds=scores[chosen].argmax(1).tolist(),
            )
        )
    return max(every, key=lambda each: each.total)


if __name__ == "__main__":
    main(sys.argv[1:])
