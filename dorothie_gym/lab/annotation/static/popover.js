// Dialog beside the page for one choice: closes with Escape or a click elsewhere, and gives the focus back.

import { h } from '/static/dom.js';

let closeOpen = () => {};

/** Closes the dialog that is open, such as when what it is about has changed. */
export function closePopover() { closeOpen(); }

/** Shows a dialog. `keys` maps keys to functions; `make(close)` returns its content. */
export function popover(title, make, keys = {}) {
  closePopover();
  const before = document.activeElement;
  const close = () => { box.remove(); removeEventListener('pointerdown', outside, true); closeOpen = () => {}; if (before?.isConnected) before.focus(); };
  const outside = event => { if (!box.contains(event.target)) close(); };
  const box = h('div', { class: 'popover centred', role: 'dialog', 'aria-label': title });
  const fill = () => {
    const held = box.contains(document.activeElement) ? document.activeElement.textContent : null;
    box.replaceChildren(h('h2', { text: title }), ...make(close, fill).flat().filter(Boolean));
    if (held !== null) ([...box.querySelectorAll('button')].find(each => each.textContent === held) ?? box.querySelector('button')).focus();
  };
  box.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const typing = event.target.matches('input');
    if (event.key === 'Escape') { event.preventDefault(); event.stopPropagation(); close(); return; }
    const run = typing ? null : keys[event.key.toLowerCase()];
    if (run) { event.preventDefault(); run(close, fill); return; }
    if (event.key === 'Tab') trap(event, box);
  });
  closeOpen = close;
  fill();
  document.body.append(box);
  addEventListener('pointerdown', outside, true);
  (box.querySelector('input, [aria-pressed="true"]') ?? box.querySelector('button')).focus();
  return close;
}

function trap(event, box) {
  const items = [...box.querySelectorAll('button, input')], edge = event.shiftKey ? items[0] : items.at(-1);
  if (document.activeElement !== edge) return;
  event.preventDefault();
  (event.shiftKey ? items.at(-1) : items[0]).focus();
}
