// Stopping places: which ones are near, a sign with the distance, and a mark above the picture through the windscreen.

import { h } from '/static/dom.js';

export const NEAR = 60;  // distance from which on a stopping place is shown [m]
const STANDING = 0.5, REACTION = 0.5;  // speed of a car that stands [km/h]; time from seeing the sign to braking [s]

/** Returns the rule by which errands are done. */
export const rule = hello => `An errand is done when the car stands within ${hello.stop.within} m of its stopping place: the ring on the lane beside its pin.`;

/** Returns the place of a point as the car sees it: metres ahead, to the right, and the distance. */
function seen([x, y, heading], stop) {
  const [dx, dy] = [stop.x - x, stop.y - y], [c, s] = [Math.cos(heading), Math.sin(heading)];
  return { ahead: dx * c + dy * s, right: dy * c - dx * s, distance: Math.hypot(dx, dy) };
}

export class StopSign {
  /** @param drives whether the seat drives the car, and is told when to brake. */
  constructor({ drives = false } = {}) {
    this.drives = drives;
    this.words = h('span', { role: 'status' });
    this.metres = h('output', { 'aria-hidden': 'true' });
    this.element = h('p', { class: 'stop-sign', hidden: true }, this.words, this.metres);
  }

  /** Shows the nearest of the stopping places, if one is near. */
  update({ pose, speed }, stops, { within, braking }) {
    const near = pose ? stops.map(stop => ({ stop, ...seen(pose, stop) })).filter(each => each.distance <= NEAR).sort((a, b) => a.distance - b.distance)[0] : null;
    this.element.hidden = !near;
    if (!near) { this.words.textContent = ''; return; }
    const text = this.advice(near, speed, within, braking);
    if (this.words.textContent !== text) this.words.textContent = text;
    this.metres.value = ` ${near.distance.toFixed(near.distance < 10 ? 1 : 0)} m`;
    this.element.classList.toggle('here', near.distance <= within);
  }

  advice({ stop, ahead, right, distance }, speed, within, braking) {
    const v = speed / 3.6, rest = ahead - v * REACTION - v * v / (2 * braking);
    if (distance <= within && speed < STANDING) return `The car stands at ${stop.name}:`;
    if (Math.abs(right) < within && Math.abs(rest) < within) return this.drives ? `Stop now for ${stop.name}:` : `Stopping at ${stop.name} now counts:`;
    return ahead < -within ? `Stopping place of ${stop.name}, behind:` : `Stopping place of ${stop.name}:`;
  }
}

/**
 * Paints the stopping places that are near above a picture of the camera, for people: cameras do not see it.
 * @param ink of a canvas as large as the picture.
 * @param camera place on the car [m], pitch and horizontal field of view [degrees].
 */
export function paintStops(ink, pose, stops, camera, within) {
  const { width, height } = ink.canvas, focal = width / 2 / Math.tan(camera.view * Math.PI / 360), pitch = camera.pitch * Math.PI / 180;
  const project = (ahead, right, up) => {  // the road ahead lies in the plane in which the car stands
    const z = up - camera.up, x = ahead - camera.forward;
    const depth = x * Math.cos(pitch) + z * Math.sin(pitch);
    return [width / 2 + focal * right / depth, height / 2 - focal * (z * Math.cos(pitch) - x * Math.sin(pitch)) / depth];
  };
  ink.clearRect(0, 0, width, height);
  for (const stop of stops) {
    const { ahead, right, distance } = seen(pose, stop);
    if (distance > NEAR || ahead < camera.forward + 1.2) continue;
    ink.beginPath();
    for (let k = 0; k < 32; k++) {
      const turn = k * Math.PI / 16, point = project(Math.max(camera.forward + 0.6, ahead + within * Math.cos(turn)), right + within * Math.sin(turn), 0);
      if (k) ink.lineTo(...point); else ink.moveTo(...point);
    }
    ink.closePath();
    ink.fillStyle = `${stop.colour}40`; ink.fill();
    ink.strokeStyle = '#ffffff'; ink.lineWidth = width / 130; ink.stroke(); ink.strokeStyle = stop.colour; ink.lineWidth = width / 240; ink.stroke();
    paintFlag(ink, project(ahead, right, 0), project(ahead, right, 2.4), stop, distance);
  }
}

function paintFlag(ink, foot, top, stop, distance) {
  const { width, clientWidth } = ink.canvas, size = Math.max(width / 38, 11 * width / Math.max(clientWidth, 1)), text = `${stop.name} · ${distance.toFixed(0)} m`;
  ink.beginPath(); ink.moveTo(...foot); ink.lineTo(...top);
  ink.strokeStyle = '#ffffff'; ink.lineWidth = size / 3; ink.stroke(); ink.strokeStyle = stop.colour; ink.lineWidth = size / 7; ink.stroke();
  ink.font = `700 ${size}px system-ui, "DejaVu Sans", sans-serif`; ink.textAlign = 'center'; ink.textBaseline = 'middle';
  const wide = ink.measureText(text).width + size, x = Math.min(ink.canvas.width - wide / 2, Math.max(wide / 2, top[0])), y = Math.max(size, top[1] - size * 0.8);
  ink.beginPath(); ink.roundRect(x - wide / 2, y - size * 0.8, wide, size * 1.6, size * 0.4);
  ink.fillStyle = stop.colour; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = size / 8; ink.stroke();
  ink.fillStyle = '#ffffff'; ink.fillText(text, x, y);
}
