// Dialog for one choice, in the middle of the page or beside an element: closes with Escape or a click elsewhere, and gives the focus back.

import { h } from './dom.js';

let closeOpen = () => {};

/** Closes the dialog that is open, such as when what it is about has changed. */
export function closePopover() { closeOpen(); }

/**
 * Shows a dialog. The focus goes to what has `data-first`, or to the first field or choice.
 * @param title its name, and its heading unless it is beside an element.
 * @param make returns its content; gets `close`, and `fill`, which makes the content again.
 * @param keys functions by key, which get the same.
 * @param beside element beside which it is shown; null for the middle of the page.
 */
export function popover(title, make, { keys = {}, beside = null } = {}) {
  closePopover();
  const before = beside ?? document.activeElement;
  const close = () => { box.remove(); removeEventListener('pointerdown', outside, true); closeOpen = () => {}; if (before?.isConnected) before.focus(); };
  const outside = event => { if (!box.contains(event.target)) close(); };
  const box = h('div', { class: `popover ${beside ? '' : 'centred'}`, role: 'dialog', 'aria-label': title });
  const fill = () => {
    const held = box.contains(document.activeElement) ? document.activeElement.textContent : null;
    box.replaceChildren(...(beside ? [] : [h('h2', { text: title })]), ...make(close, fill).flat().filter(Boolean));
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
  if (beside) place(box, beside);
  addEventListener('pointerdown', outside, true);
  (box.querySelector('[data-first]') ?? box.querySelector('input, [aria-pressed="true"]') ?? box.querySelector('button')).focus();
  return close;
}

/** Places a dialog above an element, or below it where there is no room. */
function place(box, element) {
  const at = element.getBoundingClientRect(), size = box.getBoundingClientRect();
  box.style.left = `${Math.max(8, Math.min(innerWidth - size.width - 8, at.left))}px`;
  box.style.top = `${at.top > size.height + 12 ? at.top - size.height - 6 : Math.min(innerHeight - size.height - 8, at.bottom + 6)}px`;
}

function trap(event, box) {
  const items = [...box.querySelectorAll('button, input')], edge = event.shiftKey ? items[0] : items.at(-1);
  if (document.activeElement !== edge) return;
  event.preventDefault();
  (event.shiftKey ? items.at(-1) : items[0]).focus();
}
