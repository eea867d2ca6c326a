// Choice of the word at which a new span begins: arrows and Enter, or a click.

import { h } from '/static/dom.js';
import { popover } from '/static/popover.js';

/** Lets the annotator choose a word; `take` gets the number of words before it. */
export function chooseWord(said, take) {
  let at = Math.max(1, Math.round(said.length / 2));
  const keys = {
    arrowleft: (close, fill) => { at = Math.max(1, at - 1); fill(); },
    arrowright: (close, fill) => { at = Math.min(said.length - 1, at + 1); fill(); },
  };
  popover('Where does the next span begin?', (close, fill) => [
    h('p', { class: 'cut', role: 'group', 'aria-label': 'Words' }, said.map((word, k) => (k ? h('button', { type: 'button', class: 'word', 'aria-pressed': String(k === at), onclick: () => { close(); take(k); } }, word) : h('span', { text: word })))),
    h('p', { class: 'hint', text: 'Left and right choose the word, Enter splits before it.' }),
    h('button', { type: 'button', class: 'primary', 'data-first': true, onclick: () => { close(); take(at); } }, `Split before “${said[at]}”`),
  ], { keys });
}
