// Map of a town: painted once for a part of the town and a scale, with moving things above. Metres, x east, y south.

import { words } from './dom.js';

const BEHIND = 0.12;  // s behind the last frame, so that positions are interpolated and not guessed
const SCALES = [0.5, 16];

export const COLOURS = {
  car: '#246beb', path: '#246beb', plan: '#7a3fb5', vehicle: '#424956', person: '#d65c8c', prop: '#e67e22', guess: '#b3690f',
  pending: '#b26a00', ongoing: '#246beb', complete: '#1c8a51', abandoned: '#a33a3a', none: '#5b6472',
};

export class MapView {
  constructor(canvas, { onclick = null } = {}) {
    Object.assign(this, {
      canvas, onclick, ink: canvas.getContext('2d'), centre: [0, 0], scale: 4, follow: true, names: [], poses: [], offset: null, hover: null,
      cursor: null, held: false, trail: [], state: {}, layers: [], ratio: 1, marks: new Map(), linked: null, links: null, within: 2,
    });
    canvas.tabIndex = 0;
    new ResizeObserver(() => this.fit()).observe(canvas);
    this.listen();
    this.fit();
    const loop = () => { this.draw(); requestAnimationFrame(loop); };
    requestAnimationFrame(loop);
  }

  setTown(page, names) {
    this.names = names;
    this.town = page;
    const { shapes } = page;
    this.boxes = new Float32Array(4 * shapes.length);
    shapes.forEach(([, points], k) => {
      let [x0, y0, x1, y1] = [1e9, 1e9, -1e9, -1e9];
      for (let i = 0; i < points.length; i += 2) {
        x0 = Math.min(x0, points[i]); x1 = Math.max(x1, points[i]); y0 = Math.min(y0, points[i + 1]); y1 = Math.max(y1, points[i + 1]);
      }
      this.boxes.set([x0, y0, x1, y1], 4 * k);
    });
    this.base = null;
  }

  fit() {
    const { canvas } = this;
    this.ratio = window.devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * this.ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * this.ratio));
    this.base = null;
  }

  /** Shows the whole town. */
  overview() {
    if (!this.town) return;
    const [x0, y0, x1, y1] = this.town.bounds.map(v => v / 10);
    this.follow = false;
    this.centre = [(x0 + x1) / 2, (y0 + y1) / 2];
    this.scale = Math.min(this.canvas.clientWidth / (x1 - x0), this.canvas.clientHeight / (y1 - y0));
  }

  zoom(factor, at = null) {
    const before = at && this.world(...at);
    this.scale = Math.min(SCALES[1], Math.max(SCALES[0], this.scale * factor));
    if (at && !this.follow) { const now = this.world(...at); this.centre = [this.centre[0] + before[0] - now[0], this.centre[1] + before[1] - now[1]]; }
  }

  /** World coordinates of a point of the canvas [CSS px]. */
  world(px, py) {
    return [this.centre[0] + (px - this.canvas.clientWidth / 2) / this.scale, this.centre[1] + (py - this.canvas.clientHeight / 2) / this.scale];
  }

  listen() {
    const { canvas } = this;
    let held = null, moved = false;
    canvas.addEventListener('wheel', event => { event.preventDefault(); this.zoom(Math.exp(-event.deltaY / 500), [event.offsetX, event.offsetY]); }, { passive: false });
    canvas.addEventListener('pointerdown', event => { held = [event.offsetX, event.offsetY, ...this.centre]; moved = false; canvas.setPointerCapture(event.pointerId); this.cursor = null; this.held = false; });
    canvas.addEventListener('pointermove', event => {
      this.hover = this.world(event.offsetX, event.offsetY);
      if (!held) return;
      const [dx, dy] = [event.offsetX - held[0], event.offsetY - held[1]];
      if (!moved && Math.hypot(dx, dy) < 5) return;
      moved = true; this.follow = false;
      this.centre = [held[2] - dx / this.scale, held[3] - dy / this.scale];
    });
    canvas.addEventListener('pointerup', event => { if (held && !moved) this.onclick?.(this.world(event.offsetX, event.offsetY), 14 / this.scale); held = null; });
    canvas.addEventListener('pointercancel', () => { held = null; });
    canvas.addEventListener('pointerleave', () => { this.hover = null; });
    canvas.addEventListener('keydown', event => this.key(event));
    canvas.addEventListener('blur', () => this.putDown());
  }

  /** Returns the pointer of the keyboard, at first in the middle; the map stands still while there is one. */
  pointer() {
    if (!this.cursor) { this.cursor = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2]; this.held = this.follow; this.follow = false; }
    return this.cursor;
  }

  /** Takes the pointer of the keyboard away; a map that it held follows the car again. */
  putDown() {
    if (this.held) this.follow = true;
    this.cursor = null; this.held = false;
  }

  key(event) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const [w, H] = [this.canvas.clientWidth, this.canvas.clientHeight];
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (step && event.shiftKey) { this.follow = this.held = false; this.centre = [this.centre[0] + step[0] * 60 / this.scale, this.centre[1] + step[1] * 60 / this.scale]; }
    else if (step) { const [x, y] = this.pointer(); this.cursor = [Math.min(w, Math.max(0, x + 12 * step[0])), Math.min(H, Math.max(0, y + 12 * step[1]))]; this.hover = this.world(...this.cursor); }
    else if (event.key === 'Enter' && this.onclick) this.onclick(this.world(...this.pointer()), 14 / this.scale);
    else if (event.key === '+' || event.key === '=') this.zoom(1.25);
    else if (event.key === '-') this.zoom(0.8);
    else if (event.key === '0') { this.cursor = null; this.held = false; this.follow = true; }
    else return;
    event.preventDefault(); event.stopPropagation();
  }

  // --- what moves ---------------------------------------------------------------------------------------------------

  /** Takes the state after a frame. */
  update(state) {
    this.state = state;
    if (!state.pose) return;
    const now = performance.now() / 1000, last = this.poses.at(-1);
    if (last && state.time < last[0]) { this.poses = []; this.trail = []; this.offset = null; }
    if (last && state.time === last[0]) return;
    this.poses.push([state.time, ...state.pose]);
    if (this.poses.length > 30) this.poses.shift();
    const offset = now - state.time;
    this.offset = this.offset === null || Math.abs(offset - this.offset) > 1 ? offset : Math.min(offset, this.offset + 0.0005);
    const end = this.trail.at(-1);
    if (!end || Math.hypot(end[0] - state.pose[0], end[1] - state.pose[1]) > 4) this.trail.push(state.pose.slice(0, 2));
    if (this.trail.length > 400) this.trail.shift();
  }

  pose() {
    const frames = this.poses;
    if (!frames.length) return null;
    const time = performance.now() / 1000 - this.offset - BEHIND;
    let k = frames.length - 1;
    while (k > 0 && frames[k][0] > time) k--;
    const [a, b] = [frames[k], frames[Math.min(k + 1, frames.length - 1)]];
    const share = b[0] > a[0] ? Math.min(1, Math.max(0, (time - a[0]) / (b[0] - a[0]))) : 0;
    const turn = Math.atan2(Math.sin(b[3] - a[3]), Math.cos(b[3] - a[3]));
    return [a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]), a[3] + share * turn];
  }

  // --- painting -----------------------------------------------------------------------------------------------------

  draw() {
    const { ink, canvas } = this;
    if (!canvas.clientWidth || !this.town) return;
    const pose = this.pose();
    if (this.follow && pose) this.centre = [pose[0], pose[1]];
    this.paintBase();
    ink.setTransform(1, 0, 0, 1, 0, 0);
    ink.fillStyle = this.town.ground;
    ink.fillRect(0, 0, canvas.width, canvas.height);
    const k = this.scale * this.ratio, ox = canvas.width / 2 - k * this.centre[0], oy = canvas.height / 2 - k * this.centre[1];
    const { base } = this;
    ink.drawImage(base.canvas, ox + k * base.x, oy + k * base.y, base.canvas.width * k / base.k, base.canvas.height * k / base.k);
    ink.setTransform(k, 0, 0, k, ox, oy);
    ink.lineCap = ink.lineJoin = 'round';
    const px = 1 / this.scale;
    this.paintTrail(px);
    this.paintPath(px);
    this.paintStops(px);
    for (const layer of this.layers) layer(ink, px, this);
    this.paintGuesses(px);
    for (const object of this.state.objects ?? []) paintBody(ink, object, px);
    for (const [kind, x, y, heading] of this.state.props ?? []) paintProp(ink, kind, x, y, heading, px);
    this.paintLandmarks(px);
    if (this.state.covariance) this.paintEstimate(px, pose);
    if (pose) paintCar(ink, pose, px, this.state.lights);
    if (this.cursor) this.paintCursor();
    this.paintScale();
    this.links?.place();
  }

  paintBase() {
    const { canvas } = this, k = this.scale * this.ratio;
    const [halfW, halfH] = [canvas.width / 2 / k, canvas.height / 2 / k];
    const [x0, y0, x1, y1] = [this.centre[0] - halfW, this.centre[1] - halfH, this.centre[0] + halfW, this.centre[1] + halfH];
    const { base } = this;
    if (base && base.k === k && x0 >= base.x && y0 >= base.y && x1 <= base.x + base.w && y1 <= base.y + base.h) return;
    if (base && base.k !== k && performance.now() - base.made < 120) return;  // while zooming, the old picture is stretched
    const margin = 0.45, w = halfW * 2 * (1 + 2 * margin), hh = halfH * 2 * (1 + 2 * margin);
    const page = base?.canvas.width === Math.ceil(w * k) && base?.canvas.height === Math.ceil(hh * k) ? base.canvas : document.createElement('canvas');
    page.width = Math.ceil(w * k); page.height = Math.ceil(hh * k);
    const x = this.centre[0] - w / 2, y = this.centre[1] - hh / 2, ink = page.getContext('2d');
    ink.fillStyle = this.town.ground; ink.fillRect(0, 0, page.width, page.height);
    ink.setTransform(k / 10, 0, 0, k / 10, -k * x, -k * y);
    const smallest = 7 / this.scale;  // decimetres that no one sees
    let colour = null, open = false;
    this.town.shapes.forEach(([fill, points], i) => {
      const [bx0, by0, bx1, by1] = [this.boxes[4 * i], this.boxes[4 * i + 1], this.boxes[4 * i + 2], this.boxes[4 * i + 3]];
      if (bx1 < 10 * x || by1 < 10 * y || bx0 > 10 * (x + w) || by0 > 10 * (y + hh) || (bx1 - bx0 < smallest && by1 - by0 < smallest)) return;
      if (fill !== colour) { if (open) ink.fill('nonzero'); ink.beginPath(); ink.fillStyle = colour = fill; open = true; }
      // Polygons of either direction fill the same: each is its own path, so that overlapping ones do not cancel out.
      let area = 0;
      for (let j = 0; j < points.length; j += 2) { const n = (j + 2) % points.length; area += points[j] * points[n + 1] - points[n] * points[j + 1]; }
      const count = points.length / 2;
      for (let j = 0; j < count; j++) { const at = area >= 0 ? j : count - 1 - j; if (j) ink.lineTo(points[2 * at], points[2 * at + 1]); else ink.moveTo(points[2 * at], points[2 * at + 1]); }
      ink.closePath();
    });
    if (open) ink.fill('nonzero');
    this.paintNames(ink);
    this.base = { canvas: page, k, x, y, w, h: hh, made: performance.now() };
  }

  paintNames(ink) {
    ink.textAlign = 'center'; ink.textBaseline = 'middle';
    for (const [street, size, path] of this.town.labels) {
      const name = this.names[street];
      if (!name) continue;
      const letters = 10 * Math.min(Math.max(size, 11 / this.scale), 22 / this.scale);
      ink.font = `600 ${letters}px system-ui, "DejaVu Sans", sans-serif`;
      ink.fillStyle = '#ffffff'; ink.strokeStyle = '#5a6270'; ink.lineWidth = letters * 0.28; ink.lineJoin = 'round';
      writeAlong(ink, name, path);
    }
  }

  paintTrail(px) {
    const { ink, trail } = this;
    if (trail.length < 2) return;
    ink.beginPath(); trail.forEach(([x, y], k) => (k ? ink.lineTo(x, y) : ink.moveTo(x, y)));
    ink.strokeStyle = '#84b4ff'; ink.globalAlpha = 0.75; ink.lineWidth = Math.max(0.9, 2.4 * px); ink.stroke(); ink.globalAlpha = 1;
  }

  paintPath(px) {
    const { path } = this.state, { ink } = this, pose = this.poses.at(-1);
    if (!path?.length || !pose) return;
    ink.beginPath(); ink.moveTo(pose[1], pose[2]); for (const [x, y] of path) ink.lineTo(x, y);
    ink.strokeStyle = COLOURS.path; ink.setLineDash([2.4, 2]); ink.lineWidth = Math.max(0.7, 2.2 * px); ink.stroke(); ink.setLineDash([]);
  }

  paintGuesses(px) {
    for (const [name, x, y, xx, yy, xy] of this.state.guesses ?? []) {
      ellipse(this.ink, x, y, xx, yy, xy); this.ink.fillStyle = '#d98a1c2e'; this.ink.fill();
      this.ink.strokeStyle = COLOURS.guess; this.ink.lineWidth = 1.4 * px; this.ink.setLineDash([4 * px, 3 * px]); this.ink.stroke(); this.ink.setLineDash([]);
      pin(this.ink, x, y, px, COLOURS.guess, `${words(name)}?`, true);
    }
  }

  /** Marks pins that belong to errands: row of the landmarks, with text for its head, colour, and whether a stop there is due. */
  mark(marks) { this.marks = marks; this.links?.rebuild(); }

  paintStops(px) {
    (this.state.landmarks ?? []).forEach(([, x, y, , sx, sy], k) => {
      const mark = this.marks.get(k);
      if (mark ? !mark.open : px > 0.35 && k !== this.linked) return;
      const { ink } = this, colour = mark?.colour ?? COLOURS.none;
      ink.globalAlpha = mark ? 1 : 0.55;
      ink.beginPath(); ink.moveTo(x, y); ink.lineTo(sx, sy); ink.strokeStyle = colour; ink.lineWidth = 1.2 * px; ink.setLineDash([3 * px, 3 * px]); ink.stroke(); ink.setLineDash([]);
      ink.beginPath(); ink.arc(sx, sy, Math.max(this.within, 4.5 * px), 0, 7);
      ink.fillStyle = `${colour}4d`; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = 3.6 * px; ink.stroke(); ink.strokeStyle = colour; ink.lineWidth = 2 * px; ink.stroke();
      ink.globalAlpha = 1;
    });
  }

  paintLandmarks(px) {
    (this.state.landmarks ?? []).forEach(([, x, y, name], k) => {
      const mark = this.marks.get(k);
      if (k === this.linked) { this.ink.beginPath(); this.ink.arc(x, y - 16 * px, 16 * px, 0, 7); this.ink.fillStyle = '#ffd54a'; this.ink.fill(); this.ink.strokeStyle = '#1f2733'; this.ink.lineWidth = 2 * px; this.ink.stroke(); }
      pin(this.ink, x, y, px, mark?.colour ?? COLOURS.none, this.state.hidden?.[k] ? `${name} (hidden)` : name, false, Boolean(mark), mark?.text);
    });
  }

  paintEstimate(px, pose) {
    const [xx, yy, xy] = this.state.covariance, at = this.state.estimate ?? pose;
    if (!at) return;
    ellipse(this.ink, at[0], at[1], xx, yy, xy); this.ink.fillStyle = '#246beb26'; this.ink.fill();
    this.ink.strokeStyle = '#246beb'; this.ink.lineWidth = 1.5 * px; this.ink.stroke();
    if (this.state.estimate) { this.ink.globalAlpha = 0.45; paintCar(this.ink, at, px, false); this.ink.globalAlpha = 1; }
  }

  paintCursor() {
    const { ink } = this, [x, y] = this.world(...this.cursor), r = 14 / this.scale;
    ink.beginPath(); ink.moveTo(x - r, y); ink.lineTo(x + r, y); ink.moveTo(x, y - r); ink.lineTo(x, y + r);
    ink.strokeStyle = '#ffffff'; ink.lineWidth = 5 / this.scale; ink.stroke(); ink.strokeStyle = '#111a2b'; ink.lineWidth = 2 / this.scale; ink.stroke();
  }

  paintScale() {
    const { ink, canvas, ratio } = this, metres = [10, 20, 50, 100, 200, 500, 1000].findLast(m => m * this.scale <= 130) ?? 10;
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [x, y, w] = [14, canvas.clientHeight - 14, metres * this.scale];
    ink.strokeStyle = '#ffffffd0'; ink.lineWidth = 5; ink.beginPath(); ink.moveTo(x, y); ink.lineTo(x + w, y); ink.stroke();
    ink.strokeStyle = '#2e3644'; ink.lineWidth = 2; ink.beginPath(); ink.moveTo(x, y - 4); ink.lineTo(x, y); ink.lineTo(x + w, y); ink.lineTo(x + w, y - 4); ink.stroke();
    ink.font = '600 11px system-ui, "DejaVu Sans", sans-serif'; ink.textAlign = 'left'; ink.textBaseline = 'bottom';
    ink.strokeStyle = '#ffffffd0'; ink.lineWidth = 3; ink.strokeText(`${metres} m`, x + 5, y - 4); ink.fillStyle = '#2e3644'; ink.fillText(`${metres} m`, x + 5, y - 4);
  }
}

function ellipse(ink, x, y, xx, yy, xy) {  // two standard deviations
  const turn = 0.5 * Math.atan2(2 * xy, xx - yy), mean = (xx + yy) / 2, spread = Math.hypot((xx - yy) / 2, xy);
  ink.beginPath();
  ink.ellipse(x, y, 2 * Math.sqrt(Math.max(mean + spread, 0.01)), 2 * Math.sqrt(Math.max(mean - spread, 0.01)), turn, 0, 7);
}

function paintCar(ink, [x, y, heading], px, lights) {
  const grow = Math.max(1, 3.2 * px);  // the car stays visible on the map of the whole town
  ink.save(); ink.translate(x, y); ink.rotate(heading); ink.scale(grow, grow);
  if (lights) { ink.fillStyle = '#ffe28266'; ink.beginPath(); ink.moveTo(2, -0.7); ink.lineTo(11, -3.6); ink.lineTo(11, 3.6); ink.lineTo(2, 0.7); ink.fill(); }
  ink.beginPath(); ink.roundRect(-2.5, -1.05, 5, 2.1, 0.7); ink.fillStyle = COLOURS.car; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = 0.35; ink.stroke();
  ink.beginPath(); ink.roundRect(0.35, -0.8, 0.95, 1.6, 0.25); ink.fillStyle = '#cde0ff'; ink.fill();
  ink.restore();
}

function paintBody(ink, [kind, x, y, heading, length, width], px) {
  const grow = Math.max(1, 1.8 * px);
  if (kind === 'Vehicles') {
    ink.save(); ink.translate(x, y); ink.rotate(heading); ink.scale(grow, grow);
    ink.beginPath(); ink.roundRect(-length / 2, -width / 2, length, width, 0.5); ink.fillStyle = COLOURS.vehicle; ink.fill(); ink.strokeStyle = '#ffffffb0'; ink.lineWidth = 0.25; ink.stroke();
    ink.restore();
  } else if (kind === 'Pedestrian') {
    ink.beginPath(); ink.arc(x, y, Math.max(0.55, 2.6 * px), 0, 7); ink.fillStyle = COLOURS.person; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = 0.9 * px; ink.stroke();
  } else paintProp(ink, kind, x, y, heading, px);
}

function paintProp(ink, kind, x, y, heading, px) {
  const r = Math.max(1.1, 6 * px);
  ink.save(); ink.translate(x, y); ink.rotate(heading);
  ink.beginPath(); ink.rect(-r, -r, 2 * r, 2 * r); ink.fillStyle = COLOURS.prop; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = 1.4 * px; ink.stroke();
  ink.beginPath(); ink.moveTo(-r, r); ink.lineTo(r, -r); ink.stroke();
  ink.restore();
}

export function pin(ink, x, y, px, colour, text, hollow = false, strong = false, inside = '') {
  const r = (inside ? 9 : strong ? 8 : 6.5) * px;
  ink.beginPath(); ink.moveTo(x, y); ink.arc(x, y - 2.1 * r, r, Math.PI * 0.85, Math.PI * 2.15); ink.closePath();
  ink.fillStyle = hollow ? '#ffffff' : colour; ink.fill(); ink.strokeStyle = hollow ? colour : '#ffffff'; ink.lineWidth = 1.6 * px; ink.stroke();
  if (inside) {
    ink.font = `700 ${(inside.length > 2 ? 9 : 11) * px}px system-ui, "DejaVu Sans", sans-serif`; ink.textAlign = 'center'; ink.textBaseline = 'middle';
    ink.fillStyle = '#ffffff'; ink.fillText(inside, x, y - 2.05 * r);
  } else { ink.beginPath(); ink.arc(x, y - 2.1 * r, 0.36 * r, 0, 7); ink.fillStyle = hollow ? colour : '#ffffff'; ink.fill(); }
  ink.font = `${strong ? 700 : 600} ${12 * px}px system-ui, "DejaVu Sans", sans-serif`; ink.textAlign = 'center'; ink.textBaseline = 'bottom';
  ink.lineWidth = 3.4 * px; ink.strokeStyle = '#ffffffe6'; ink.lineJoin = 'round'; ink.strokeText(text, x, y - 3.4 * r); ink.fillStyle = strong ? colour : '#2e3644'; ink.fillText(text, x, y - 3.4 * r);
}

/** Writes a text along a line, centred, letter by letter. */
function writeAlong(ink, text, path) {
  const points = [], lengths = [0];
  for (let k = 0; k < path.length; k += 2) points.push([path[k], path[k + 1]]);
  for (let k = 1; k < points.length; k++) lengths.push(lengths[k - 1] + Math.hypot(points[k][0] - points[k - 1][0], points[k][1] - points[k - 1][1]));
  const widths = [...text].map(letter => ink.measureText(letter).width), total = widths.reduce((a, b) => a + b, 0);
  let at = lengths.at(-1) / 2 - total / 2;
  const places = widths.map(width => { const place = along(points, lengths, at + width / 2); at += width; return place; });
  for (const draw of ['strokeText', 'fillText']) [...text].forEach((letter, k) => {
    const [x, y, turn] = places[k];
    ink.save(); ink.translate(x, y); ink.rotate(turn); ink[draw](letter, 0, 0); ink.restore();
  });
}

function along(points, lengths, at) {
  let k = 1;
  while (k < lengths.length - 1 && lengths[k] < at) k++;
  const [a, b] = [points[k - 1], points[k]], share = (at - lengths[k - 1]) / Math.max(1e-6, lengths[k] - lengths[k - 1]);
  return [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), Math.atan2(b[1] - a[1], b[0] - a[0])];
}
