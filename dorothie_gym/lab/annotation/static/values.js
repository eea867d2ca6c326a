// Slot values of a span: typing filters, Enter takes the first match; names of the town come first.

import { h, words } from '/static/dom.js';
import { popover } from '/static/popover.js';

/** Lets the annotator choose values. `slots` are the present ones; `take` gets the new ones. */
export function chooseValues(vocabulary, page, text, slots, take) {
  const chosen = structuredClone(slots ?? {});
  const here = { Street: new Set(page.streets), Landmark: new Set(page.landmarks.map(([name]) => name)) };
  const all = Object.entries(vocabulary.slots).flatMap(([slot, values]) => values.map(value => ({ slot, value, known: here[slot]?.has(value) ?? false })));
  const order = all.toSorted((a, b) => b.known - a.known);
  const has = ({ slot, value }) => chosen[slot]?.includes(value) ?? false;
  const toggle = item => {
    const { slot, value } = item;
    const rest = (chosen[slot] ?? []).filter(other => other !== value);
    chosen[slot] = has(item) ? rest : [...rest, value];
    if (!chosen[slot].length) delete chosen[slot];
    take(structuredClone(chosen));
    input.value = '';
    draw(true);
  };
  const matches = () => {
    const wanted = input.value.trim().toLowerCase().replace(/\s+/g, '');
    return wanted ? order.filter(({ slot, value }) => value.toLowerCase().includes(wanted) || slot.toLowerCase().startsWith(wanted)) : order;
  };
  const input = h('input', { type: 'text', placeholder: 'Type a value …', 'aria-label': 'Filter values; Enter takes the first one', autocomplete: 'off', oninput: () => draw(),
    onkeydown: event => { if (event.key === 'Enter') { event.preventDefault(); const [first] = matches(); if (first && input.value.trim()) toggle(first); else if (!input.value.trim()) close(); } } });
  const list = h('div', { class: 'values' });
  const draw = refocus => {
    const shown = matches(), first = input.value.trim() ? shown[0] : null;
    list.replaceChildren(...Object.keys(vocabulary.slots).map(slot => {
      const items = shown.filter(each => each.slot === slot);
      return items.length ? h('div', { class: 'slot', role: 'group', 'aria-label': slot }, h('b', { text: slot }), items.map(item => h('button', { type: 'button', class: `chip ${item === first ? 'first' : ''}`, 'data-id': `${slot}/${item.value}`,
        'aria-pressed': String(has(item)), onclick: () => toggle(item) }, words(item.value)))) : null;
    }).filter(Boolean));
    if (refocus) input.focus();
  };
  const close = popover(`Values of “${text}”`, () => [input, list, h('p', { class: 'hint', text: 'Enter takes the marked value, or closes if nothing is typed. Escape closes.' })]);
  draw();
  return close;
}
