// Timeline: speech of both speakers, actions, events, exchanges and transactions, with the moment of the film.

import { clock, h, words } from '/static/dom.js';
import { letter } from './units.js';

const ROWS = ['Participant', 'Car', 'Actions', 'Events', 'Exchanges', 'Transactions'];
const HEIGHT = 20, LEFT = 92, TOP = 18;
const TINTS = ['#d9e7ff', '#ffe7c2', '#d8f2e1', '#f6dcf2', '#e7e3fb', '#f9dede'];

export class Timeline {
  constructor(page, marks, film, onselect) {
    Object.assign(this, { page, marks, film, onselect, span: 45, current: [0, 0], boxes: [] });
    this.canvas = h('canvas', { class: 'timeline', tabindex: '0', role: 'slider', 'aria-label': 'Timeline', 'aria-valuemin': '0', 'aria-valuemax': String(Math.ceil(page.seconds)), 'aria-valuenow': '0' });
    this.hover = h('p', { class: 'tip', hidden: true });
    this.element = h('section', { class: 'panel timeline-panel', 'aria-label': 'Timeline' }, this.canvas, this.hover);
    this.ink = this.canvas.getContext('2d');
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    this.canvas.addEventListener('pointerdown', event => this.click(event));
    this.canvas.addEventListener('pointermove', event => this.point(event));
    this.canvas.addEventListener('pointerleave', () => { this.hover.hidden = true; });
    this.canvas.addEventListener('keydown', event => this.key(event));
    this.canvas.addEventListener('wheel', event => { event.preventDefault(); this.zoom(event.deltaY > 0 ? 1.25 : 0.8); }, { passive: false });
    film.addEventListener('time', () => this.draw());
    marks.addEventListener('change', () => this.draw());
  }

  zoom(factor) { this.span = Math.min(Math.max(8, this.span * factor), Math.max(60, this.page.seconds)); this.draw(); }

  key(event) {
    const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: 10, PageUp: -10, Home: -1e9, End: 1e9 }[event.key];
    if (event.key === '+' || event.key === '=') this.zoom(0.8);
    else if (event.key === '-') this.zoom(1.25);
    else if (step) this.film.seek(this.film.time + step);
    else return;
    event.preventDefault(); event.stopPropagation();
  }

  range() {
    const whole = this.page.seconds, span = Math.min(this.span, Math.max(whole, 1));
    const from = Math.min(Math.max(0, this.film.time - span / 3), Math.max(0, whole - span));
    return [from, span];
  }

  click(event) {
    const hit = this.at(event);
    if (hit?.place) this.onselect(...hit.place);
    else if (event.offsetX > LEFT) { const [from, span] = this.range(); this.film.seek(from + span * (event.offsetX - LEFT) / (this.canvas.clientWidth - LEFT)); }
  }

  at({ offsetX: x, offsetY: y }) { return this.boxes.findLast(box => x >= box.x && x <= box.x + box.w && y >= box.y && y <= box.y + HEIGHT); }

  point(event) {
    const hit = this.at(event);
    this.hover.hidden = !hit;
    if (hit) { this.hover.textContent = hit.text; this.hover.style.left = `${Math.min(event.offsetX, this.canvas.clientWidth - 300)}px`; }
  }

  draw() {
    const { canvas, ink } = this, ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
    ink.setTransform(ratio, 0, 0, ratio, 0, 0);
    ink.fillStyle = '#ffffff'; ink.fillRect(0, 0, width, height);
    const [from, span] = this.range(), scale = (width - LEFT) / span;
    this.x = time => LEFT + (time - from) * scale;
    this.boxes = [];
    this.grid(from, span, width);
    ink.save(); ink.beginPath(); ink.rect(LEFT, 0, width - LEFT, height); ink.clip();
    this.speech(); this.happenings(); this.units('exchange', 4); this.units('transaction', 5);
    ink.fillStyle = '#c0272d'; ink.fillRect(this.x(this.film.time) - 1, 0, 2, height);
    ink.restore();
    canvas.setAttribute('aria-valuenow', String(Math.round(this.film.time)));
    canvas.setAttribute('aria-valuetext', clock(this.film.time));
  }

  grid(from, span, width) {
    const { ink } = this;
    ink.font = '600 12px system-ui, "DejaVu Sans", sans-serif'; ink.textBaseline = 'middle'; ink.textAlign = 'left';
    ROWS.forEach((name, k) => {
      ink.fillStyle = k % 2 ? '#f7f8fa' : '#ffffff'; ink.fillRect(0, TOP + k * HEIGHT, width, HEIGHT);
      ink.fillStyle = '#414b5a'; ink.fillText(name, 6, TOP + (k + 0.5) * HEIGHT);
    });
    const step = [1, 2, 5, 10, 20, 30, 60, 120, 300].find(each => each * (width - LEFT) / span > 64) ?? 600;
    ink.font = '11px system-ui, "DejaVu Sans", sans-serif'; ink.textAlign = 'center';
    for (let t = Math.ceil(from / step) * step; t <= from + span; t += step) {
      const x = this.x(t);
      ink.fillStyle = '#d5dae1'; ink.fillRect(x, TOP, 1, ROWS.length * HEIGHT);
      ink.fillStyle = '#56606f'; if (x > LEFT + 12) ink.fillText(clock(t), x, TOP / 2);
    }
    ink.textAlign = 'left';
  }

  box(row, start, end, text, fill, { stroke = null, place = null, dashed = false } = {}) {
    const { ink } = this, x = this.x(start), w = Math.max(3, this.x(end) - x - 1), y = TOP + row * HEIGHT + 2;
    if (x + w < LEFT || x > this.canvas.clientWidth) return;
    ink.fillStyle = fill; ink.beginPath(); ink.roundRect(x, y, w, HEIGHT - 4, 3); ink.fill();
    if (stroke) { ink.strokeStyle = stroke; ink.lineWidth = dashed ? 1 : 2; ink.setLineDash(dashed ? [3, 2] : []); ink.stroke(); ink.setLineDash([]); }
    if (w > 14) { ink.save(); ink.beginPath(); ink.rect(x, y, w - 2, HEIGHT); ink.clip(); ink.fillStyle = '#1f2733'; ink.font = '11px system-ui, "DejaVu Sans", sans-serif'; ink.fillText(text, Math.max(x, LEFT) + 4, y + (HEIGHT - 4) / 2 + 0.5); ink.restore(); }
    this.boxes.push({ x, y: y - 2, w, text, place });
  }

  speech() {
    const { marks, page } = this;
    marks.places().forEach(([k, s]) => {
      const span = marks.spans[k][s], [start, end] = marks.times(k, s), own = page.utterances[k].speaker === 'participant';
      const current = k === this.current[0] && s === this.current[1];
      const label = span.move ? `${words(span.move)} – ${marks.text(k, s)}` : marks.text(k, s);
      this.box(own ? 0 : 1, start, end, label, span.move ? (own ? '#ffe0b0' : '#cfe0ff') : '#eceff3', { place: [k, s], stroke: current ? '#c0272d' : span.suggested ? '#6a7482' : null, dashed: span.suggested && !current });
    });
  }

  happenings() {
    for (const [time, type, , text] of this.page.events) {
      const action = type === 'PhysicalAction';
      this.box(action ? 2 : 3, time, time + 0.8, text, action ? '#dfe5ee' : { Exception: '#f6dcf2', Message: '#f6dcf2', Subgoal: '#d8f2e1' }[type] ?? '#eceff3');
    }
  }

  units(layer, row) {
    for (const unit of this.marks.units(layer).values()) {
      const [start] = this.marks.times(unit.k, unit.s), mark = (layer === 'exchange' ? this.marks.exchanges : this.marks.transactions).get(unit.number);
      const more = [mark?.exception, mark?.goal && words(mark.goal), mark?.end].filter(Boolean).join(', ');
      this.box(row, start, unit.end, `${letter(layer)}${unit.name}${more ? ` ${more}` : ''}`, TINTS[unit.name % TINTS.length], { stroke: '#97a1af', dashed: true });
    }
  }
}
