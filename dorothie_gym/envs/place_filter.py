"""A filter for places that are only talked about: every statement is a measurement with its own covariance.

"On Fuller", "beside the KFC", "at the corner of Beal and Hayward" all say that a place is about one of some points: of
the street, the landmark, the junctions. A mark on the map says where it is. The estimate stays one normal
distribution: marks are taken in by a Kalman filter (filterpy), points by the mean and covariance of the mixture that
they make of it (probabilistic data association; Bar-Shalom and Fortmann 1988). What excludes all that was known before
begins anew.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from dorothie_gym.world.town.model import Array

GATE = 13.82
"""Squared Mahalanobis distance that one in a thousand true statements exceeds (chi-square, 2 degrees of freedom)."""


@dataclass(frozen=True)
class PlaceEstimate:
    """A normal distribution over places.

    Attributes:
        mean: (x, y) [m].
        covariance: rows (xx, xy), (xy, yy) [m^2].
    """

    mean: tuple[float, float]
    covariance: tuple[tuple[float, float], tuple[float, float]]

    @classmethod
    def of(cls, mean: Array, covariance: Array) -> PlaceEstimate:
        """From arrays (2,) and (2, 2)."""
        (xx, xy), (yx, yy) = covariance.tolist()
        return cls((float(mean[0]), float(mean[1])), ((xx, (xy + yx) / 2), ((xy + yx) / 2, yy)))

    def distance(self, x: float, y: float) -> float:
        """Squared Mahalanobis distance of a place [m] from the mean."""
        offset = np.array([x, y]) - self.mean
        return float(offset @ np.linalg.solve(np.array(self.covariance), offset))


def near(x: float, y: float, sigma: float) -> PlaceEstimate:
    """Somewhere about a place [m], `sigma` off along each axis [m]."""
    return PlaceEstimate((x, y), ((sigma**2, 0.0), (0.0, sigma**2)))


def refined(before: PlaceEstimate | None, mark: PlaceEstimate, drift: float = 0.0) -> PlaceEstimate:
    """The estimate after a mark on the map.

    Args:
        before: the estimate so far; None if nothing is known.
        mark: place of the mark, and how exact it is.
        drift: by how much the estimate may have been off besides, along each axis [m]: a mark is moved for a reason.
    """
    if before is None:
        return mark
    # imported here: filterpy brings matplotlib along, which is slow to import
    from filterpy.kalman import KalmanFilter

    refine = KalmanFilter(dim_x=2, dim_z=2)
    refine.x, refine.P = np.array(before.mean), np.array(before.covariance)
    refine.F, refine.H = np.eye(2), np.eye(2)
    refine.Q, refine.R = drift**2 * np.eye(2), np.array(mark.covariance)
    refine.predict()
    refine.update(np.array(mark.mean))
    if float(refine.y @ refine.SI @ refine.y) > GATE:
        return mark
    return PlaceEstimate.of(refine.x, refine.P)


def about(before: PlaceEstimate | None, points: Array, sigma: float) -> PlaceEstimate:
    """The estimate after a statement that the place is about one of some points.

    Each point makes another Gaussian of the estimate, as likely as the point is from it; together they are replaced by
    one of the same mean and covariance.

    Args:
        before: the estimate so far; None if nothing is known.
        points: any of them as likely as the others (n, 2) [m].
        sigma: how far off it the place is, along each axis [m].

    Raises:
        ValueError: there are no points.
    """
    points = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    if not len(points):
        raise ValueError("a place about one of some points needs at least one point")
    offset = points.mean(axis=0) - points
    alone = PlaceEstimate.of(points.mean(axis=0), offset.T @ offset / len(points) + sigma**2 * np.eye(2))
    if before is None:
        return alone
    mean, covariance = np.array(before.mean), np.array(before.covariance)
    spread = np.linalg.inv(covariance + sigma**2 * np.eye(2))
    away = points - mean
    squared = np.einsum("ij,jk,ik->i", away, spread, away)
    if squared.min() > GATE:
        return alone
    weights = np.exp(-0.5 * (squared - squared.min()))
    weights /= weights.sum()
    gain = covariance @ spread
    means = mean + away @ gain.T  # (n, 2)
    together = weights @ means
    centred = means - together
    return PlaceEstimate.of(together, (centred * weights[:, None]).T @ centred + (np.eye(2) - gain) @ covariance)
