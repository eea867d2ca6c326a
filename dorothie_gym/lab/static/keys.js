// Keyboard: shortcuts of a seat, and the list of them.

import { h, shownKey } from './dom.js';

const TYPING = 'input:not([type=range], [type=checkbox], [type=radio]), textarea, select, [contenteditable]';

export class Keys {
  constructor() {
    this.rows = [];
    this.note = '';
    addEventListener('keydown', event => this.press(event));
    this.add('?', 'Show the keys', () => this.show());
  }

  /** Adds a shortcut; `alt` ones also work while somebody types. */
  add(key, label, run, { alt = false } = {}) { this.rows.push({ key, label, run, alt }); }

  press(event) {
    if (event.ctrlKey || event.metaKey || event.defaultPrevented) return;
    const typing = event.target.closest?.(TYPING), inDialog = event.target.closest?.('dialog, .popover');
    if (inDialog) return;
    if (typing && event.key === 'Escape') return event.target.blur();
    const digit = /^Digit\d$/.test(event.code) ? event.code.at(-1) : null;
    for (const row of this.rows) {
      if (row.alt !== event.altKey || (typing && !row.alt)) continue;
      if (row.key !== event.key && row.key !== event.key.toLowerCase() && !(row.alt && row.key === digit)) continue;
      if ((event.key === 'Enter' || event.key === ' ') && event.target.closest?.('button, a, summary, canvas')) return;
      event.preventDefault();
      row.run();
      return;
    }
  }

  show() {
    const dialog = h('dialog', { class: 'keys', 'aria-label': 'Keys' }, h('h2', { text: 'Keys' }),
      h('dl', { tabindex: '0' }, this.rows.flatMap(({ key, label, alt }) => [h('dt', {}, h('kbd', { text: (alt ? 'Alt ' : '') + shownKey(key) })), h('dd', { text: label })])),
      h('p', { class: 'hint', text: 'On the map: arrows move the pointer and hold the map, Enter clicks, Shift and arrows move the map, + and − zoom, 0 follows the car. Escape leaves a field.' }),
      this.note ? h('p', { class: 'hint', text: this.note }) : null,
      h('button', { type: 'button', autofocus: true, onclick: () => dialog.close(), text: 'Close' }));
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }
}
