// Exchange and transaction of a span, and the marks of the unit: exception, goal, end.

import { h, words } from '/static/dom.js';
import { popover } from '/static/popover.js';

const RECENT = 5;

/** Lets the annotator choose the exchange of the current span. */
export function chooseExchange(marks, vocabulary, [k, s], take) {
  choose({
    marks, layer: 'exchange', title: `Exchange of “${marks.text(k, s)}”`, at: [k, s], take,
    marksOf: number => marks.exchanges.get(number) ?? { exception: null, end: null },
    rows: [['exception', 'Handles an exception', vocabulary.exceptions, { environmental: 'e', task: 't', none: 'n' }], ['end', 'Ends', vocabulary.exchange_ends, { fulfilled: 'f', abandoned: 'a' }]],
    save: (number, mark) => marks.mark('exchange', { exchanges: [{ exchange: number, ...mark }] }),
  });
}

/** Lets the annotator choose the transaction of the current utterance. */
export function chooseTransaction(marks, vocabulary, [k, s], take) {
  choose({
    marks, layer: 'transaction', title: `Transaction of “${marks.text(k, s)}”`, at: [k, s], take,
    marksOf: number => marks.transactions.get(number) ?? { goal: null, end: null },
    rows: [['end', 'Ends', vocabulary.transaction_ends, { completed: 'c', interrupted: 'i', abandoned: 'a' }], ['goal', 'Goal', vocabulary.goals, {}]],
    save: (number, mark) => marks.mark('transaction', { transactions: [{ transaction: number, ...mark }] }),
  });
}

function choose({ marks, layer, title, at: [k, s], take, marksOf, rows, save }) {
  const units = marks.units(layer), word = layer === 'exchange' ? 'exchange' : 'transaction';
  const before = [...units.values()].filter(unit => unit.k < k || (unit.k === k && unit.s < s)).slice(-RECENT).reverse();
  const fresh = freshNumber(marks, units, k, s);
  const options = [[`New ${word}`, fresh], ...before.map(unit => [`${letter(layer)}${unit.name}: “${marks.text(unit.k, unit.s).slice(0, 44)}”`, unit.number]), [`No ${word}`, null]];
  const current = () => marks.spans[k][s][layer] ?? null;
  const pick = (number, fill) => { take(number); fill(); };
  const toggle = (field, value, fill) => {
    const number = current();
    if (number === null) return;
    const mark = marksOf(number);
    save(number, { ...mark, [field]: mark[field] === value ? null : value });
    fill();
  };
  const keys = {};
  options.forEach(([, number], i) => { keys[String(i + 1)] = (close, fill) => pick(number, fill); });
  for (const [field, , , letters] of rows) for (const [value, key] of Object.entries(letters)) keys[key] = (close, fill) => toggle(field, value, fill);
  popover(title, (close, fill) => [
    h('div', { class: 'options', role: 'group', 'aria-label': title }, options.map(([label, number], i) => h('button', { type: 'button', 'aria-pressed': String(current() === number), 'aria-keyshortcuts': String(i + 1), onclick: () => pick(number, fill) },
      h('kbd', { 'aria-hidden': 'true', text: i + 1 }), h('span', { class: 'label', text: label })))),
    current() === null ? null : rows.map(([field, label, values, letters]) => h('div', { class: 'flags', role: 'group', 'aria-label': label }, h('b', { text: label }), values.map(value => h('button', { type: 'button', class: 'chip', 'aria-pressed': String(marksOf(current())[field] === value),
      onclick: () => toggle(field, value, fill) }, words(value), letters[value] ? h('kbd', { 'aria-hidden': 'true', text: letters[value].toUpperCase() }) : null)))),
    h('button', { type: 'button', class: 'primary', onclick: close }, 'Done'),
  ], { keys });
}

/** Number of a new unit: that of its first word in the session, as in the final version; beyond all words if it is taken. */
function freshNumber(marks, units, k, s) {
  const before = marks.lines.slice(0, k).reduce((sum, line) => sum + line.words.length, 0), number = before + marks.first(k, s);
  if (!units.has(number)) return number;
  return Math.max(marks.lines.reduce((sum, line) => sum + line.words.length, 0), ...units.keys()) + 1;
}

export const letter = layer => (layer === 'exchange' ? 'E' : 'T');
