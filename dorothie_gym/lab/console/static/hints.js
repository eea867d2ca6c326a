// Hints in the first minute of a session: what to do next.

import { h, icon } from '/static/dom.js';

const FIRST = 60;  // time for which hints are shown [s]

export class Hints {
  /** @param rows texts with the test by which each is done; the first one that is not done is shown. */
  constructor(rows) {
    Object.assign(this, { rows, closed: false });
    this.text = h('span', { role: 'status' });
    this.element = h('p', { class: 'first-hint', hidden: true }, this.text,
      h('button', { type: 'button', class: 'round', 'aria-label': 'Close the hint', onclick: () => { this.closed = true; this.update({}); } }, icon('cross')));
  }

  update({ state, time }) {
    const next = !this.closed && state === 'running' && time < FIRST ? this.rows.find(([, done]) => !done()) : null;
    this.element.hidden = !next;
    const text = next?.[0] ?? '';
    if (this.text.textContent !== text) this.text.textContent = text;
  }
}
