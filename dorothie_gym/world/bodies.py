"""temporary"""
from __future__ import annotations
import numpy as np
from dorothie_gym.ontology import PropKind

class _Body:
    group = ""
    def __init__(self, road, holder, row):
        self.road, self._holder, self.row = road, holder, row
    @property
    def _r(self):
        return getattr(self._holder.arrays, self.group)[self.row]
    position = property(lambda s: np.array((s._r.x, s._r.y)))
    heading = property(lambda s: float(s._r.heading))
    height = property(lambda s: float(s._r.height))
    key = property(lambda s: int(s._r.key))
    LENGTH = property(lambda s: float(s._r.length))
    WIDTH = property(lambda s: float(s._r.width))
    @property
    def diagonal(self): return float(np.hypot(self.LENGTH, self.WIDTH))

class TrafficVehicle(_Body):
    group = "vehicles"
    speed = property(lambda s: float(s._r.speed))
    crashed = property(lambda s: bool(s._r.crashed))
    lane_id = property(lambda s: int(s._r.lane))

class Pedestrian(_Body):
    group = "pedestrians"
    LENGTH = WIDTH = 0.5
    speed = property(lambda s: float(s._r.speed))
    crashed = property(lambda s: bool(s._r.crashed))

class Prop(_Body):
    group = "props"
    speed = 0.0
    lane_id = property(lambda s: int(s._r.lane[0]))
    station = property(lambda s: float(s._r.station[0]))
    @property
    def kind(self):
        return next(k for k in PropKind if k.length == self.LENGTH and k.width == self.WIDTH)
