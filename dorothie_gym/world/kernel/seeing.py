from __future__ import annotations

from dorothie_gym.world.kernel.compiling import compiled
from dorothie_gym.world.kernel.records import PEDESTRIAN_CLASS, STATIC, VEHICLES, Kind, Walk


@compiled
def see(vehicles, pedestrians, props, seen, eye, x, y, frame, skip):  # type: ignore
    n = 0
    total = len(vehicles) + len(pedestrians) + len(props)
    for b in range(total):
        if b < len(vehicles):
            if b == skip or vehicles[b].kind == Kind.EMPTY:
                continue
            dx, dy = vehicles[b].x - x, vehicles[b].y - y
        elif b < len(vehicles) + len(pedestrians):
            q = pedestrians[b - len(vehicles)]
            if q.state == Walk.EMPTY:
                continue
            dx, dy = q.x - x, q.y - y
        else:
            o = props[b - len(vehicles) - len(pedestrians)]
            if not o.present:
                continue
            dx, dy = o.x - x, o.y - y
        d2 = dx * dx + dy * dy
        if d2 >= 6400.0:
            continue
        at = n
        while at > 0 and seen[at - 1].distance2 > d2:
            seen[at] = seen[at - 1]
            at -= 1
        r = seen[at]
        r.distance2 = d2
        if b < len(vehicles):
            v = vehicles[b]
            r.x, r.y, r.heading, r.cos, r.sin, r.speed = v.x, v.y, v.heading, v.cos, v.sin, v.speed
            r.length, r.width, r.height, r.kind, r.key, r.body = v.length, v.width, v.height, VEHICLES, v.key, b
        elif b < len(vehicles) + len(pedestrians):
            q = pedestrians[b - len(vehicles)]
            r.x, r.y, r.heading, r.cos, r.sin, r.speed = q.x, q.y, q.heading, q.cos, q.sin, q.speed
            r.length, r.width, r.height, r.kind, r.key, r.body = 0.5, 0.5, q.height, PEDESTRIAN_CLASS, q.key, b - len(vehicles)
        else:
            o = props[b - len(vehicles) - len(pedestrians)]
            r.x, r.y, r.heading, r.cos, r.sin, r.speed = o.x, o.y, o.heading, o.cos, o.sin, 0.0
            r.length, r.width, r.height, r.kind, r.key, r.body = o.length, o.width, o.height, STATIC, o.key, b - len(vehicles) - len(pedestrians)
        n += 1
    return n
