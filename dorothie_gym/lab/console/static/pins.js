// Links between the errands of a list and their pins on the map: either shows the other by hover, click and focus.

import { h, icon } from '/static/dom.js';

const EDGE = 14;  // distance of the badges of pins out of sight from the edge of the map [px]

/** Returns the buttons that zoom a map and make it follow the car. */
export function zoomButtons(map) {
  return h('div', { class: 'zoom', role: 'group', 'aria-label': 'Map' },
    h('button', { type: 'button', class: 'round', 'aria-label': 'Zoom in', onclick: () => map.zoom(1.4) }, icon('plus')),
    h('button', { type: 'button', class: 'round', 'aria-label': 'Zoom out', onclick: () => map.zoom(1 / 1.4) }, icon('minus')),
    h('button', { type: 'button', class: 'round', 'aria-label': 'Follow the car', onclick: () => { map.follow = true; } }, icon('target')));
}

/** Returns the button of an errand that shows its pin: number and name as on the map. */
export const where = ({ item, landmark }, k, landmarks) => h('button', { type: 'button', class: 'where', 'data-id': `errand-${item}`, title: 'Show it on the map' }, h('b', { text: String(k + 1) }), landmarks[landmark]?.[3] ?? '');

export class PinLinks {
  /**
   * @param map the map; its marks say which pins belong to the list.
   * @param list element with rows that carry `data-pin`, and in each a button of the class `where`.
   * @param what what a row is called: "Errand".
   */
  constructor(map, list, what) {
    Object.assign(this, { map, list, what, buttons: new Map(), pin: null });
    this.element = h('div', { class: 'pins', role: 'group', 'aria-label': `${what}s on the map` });
    map.links = this;
    const over = event => this.show(rowPin(event.target)), out = () => this.show(null);
    for (const [type, listener] of [['pointerover', over], ['focusin', over], ['pointerleave', out], ['focusout', out]]) list.addEventListener(type, listener);
    list.addEventListener('click', event => { if (event.target.closest('.where')) this.goTo(rowPin(event.target)); });
  }

  /** Shows a pin and the rows that belong to it; none for null. */
  show(pin) {
    this.pin = this.map.linked = pin;
    for (const row of this.list.children) row.classList.toggle('linked', pin !== null && row.dataset.pin === String(pin));
    for (const [k, each] of this.buttons) each.classList.toggle('linked', k === pin);
  }

  /** Moves the map to a pin. */
  goTo(pin) {
    const at = this.map.state.landmarks?.[pin];
    if (!at) return;
    this.map.putDown();
    Object.assign(this.map, { follow: false, centre: [at[1], at[2]], scale: Math.max(this.map.scale, 2) });
    this.show(pin);
  }

  /** Moves the focus from a pin to its row. */
  open(pin) {
    const row = [...this.list.children].find(each => each.dataset.pin === String(pin));
    if (this.buttons.get(pin)?.classList.contains('away')) this.goTo(pin);
    row?.scrollIntoView({ block: 'nearest' });
    row?.querySelector('.where')?.focus();
    this.show(pin);
  }

  /** Makes the buttons of the marked pins; called when marks have changed. */
  rebuild() {
    const { marks, state } = this.map;
    for (const [pin, each] of this.buttons) if (!marks.has(pin)) { each.remove(); this.buttons.delete(pin); }
    for (const [pin, { text, colour }] of marks) {
      if (!this.buttons.has(pin)) {
        const made = h('button', { type: 'button', class: 'pin', onclick: () => this.open(pin), onpointerenter: () => this.show(pin), onpointerleave: () => this.show(null), onfocus: () => this.show(pin), onblur: () => this.show(null) });
        this.buttons.set(pin, made);
        this.element.append(made);
      }
      const button = this.buttons.get(pin), name = state.landmarks[pin]?.[3] ?? '', label = `${this.what}${text ? ` ${text}` : ''}: ${name}`;
      if (button.getAttribute('aria-label') !== label) { button.setAttribute('aria-label', label); button.title = label; button.dataset.text = text || '•'; }
      button.style.setProperty('--pin', colour);
    }
    this.show(this.pin);
  }

  /** Puts the buttons where the pins are painted; those of pins out of sight at the edge. */
  place() {
    const { map } = this, w = map.canvas.clientWidth, height = map.canvas.clientHeight;
    for (const [pin, button] of this.buttons) {
      const at = map.state.landmarks?.[pin];
      if (!at) continue;
      const x = w / 2 + (at[1] - map.centre[0]) * map.scale, y = height / 2 + (at[2] - map.centre[1]) * map.scale - 17;
      const [px, py] = [Math.min(w - EDGE, Math.max(EDGE, x)), Math.min(height - EDGE, Math.max(EDGE, y))];
      const place = `translate(${px.toFixed(0)}px, ${py.toFixed(0)}px)`;
      if (button.style.transform !== place) button.style.transform = place;
      const away = Math.hypot(px - x, py - y) > 2;
      if (button.classList.toggle('away', away) !== Boolean(button.textContent)) button.textContent = away ? button.dataset.text : '';
    }
  }
}

function rowPin(element) {
  const pin = element.closest('[data-pin]')?.dataset.pin;
  return pin === undefined ? null : Number(pin);
}
