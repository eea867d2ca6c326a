// Desk of the open session: parts of the page, keys, and the edits of the current span.

import { button, h } from '/static/dom.js';
import { Keys } from '/static/keys.js';
import { Adjudication } from './adjudication.js';
import { Decision } from './decision.js';
import { Film } from './film.js';
import { Marks } from './marks.js';
import { closePopover } from '/static/popover.js';
import { chooseWord } from './split.js';
import { Timeline } from './timeline.js';
import { Transcript } from './transcript.js';
import { chooseExchange, chooseTransaction } from './units.js';
import { chooseValues } from './values.js';

export class Desk {
  static async open(api, seat, number, onstate, onwait) {
    const page = await api.patiently(`sessions/${number}`, { onwait });
    const marks = new Marks(api, number, page.utterances);
    marks.addEventListener('change', () => onwait(marks.trouble), { once: true });
    await marks.load();
    return new Desk(api, seat, number, page, marks, onstate);
  }

  constructor(api, seat, number, page, marks, onstate) {
    Object.assign(this, { seat, page, marks, vocabulary: seat.vocabulary, k: 0, s: 0 });
    this.keys = new Keys();
    this.film = new Film(api, number, page);
    this.transcript = new Transcript(page, marks, (k, s) => this.select(k, s));
    this.timeline = new Timeline(page, marks, this.film, (k, s) => this.select(k, s));
    this.decision = new Decision(this.vocabulary, move => this.decide(move));
    this.undo = button('Undo', { key: 'Ctrl+Z', run: () => this.step('undo'), class: 'soft' });
    this.redo = button('Redo', { key: 'Ctrl+Y', run: () => this.step('redo'), class: 'soft' });
    this.tools = h('div', { class: 'tools-row', role: 'group', 'aria-label': 'Span' }, this.actions());
    this.values = h('p', { class: 'chosen' });
    const side = h('div', { class: 'side' }, this.decision.element, h('section', { class: 'panel', 'aria-labelledby': 'span-title' }, h('h2', { id: 'span-title', text: 'Span' }), this.values, this.tools));
    this.adjudication = seat.kind === 'adjudicator' ? new Adjudication(api, number, page, marks, this.keys) : null;
    const left = h('div', { class: 'left' }, this.film.element, this.adjudication?.element ?? this.about());
    this.element = h('div', { class: 'desk' }, left, this.transcript.element, side, this.timeline.element);
    marks.addEventListener('change', () => { this.refresh(); onstate(marks); });
    marks.addEventListener('dropped', () => closePopover());
    this.addKeys();
    this.onkey = event => this.control(event);
    addEventListener('keydown', this.onkey);
  }

  begin() {
    this.marks.changed();
    this.adjudication?.load(this.transcript);
    const next = this.marks.places().find(([k, s]) => !this.marks.isDecided(k, s)) ?? [0, 0];
    this.select(...next);
  }

  close() { this.film.close(); removeEventListener('keydown', this.onkey); this.keys.rows = []; this.element.remove(); }

  about() {
    return h('section', { class: 'panel about', tabindex: '0', 'aria-labelledby': 'about-title' }, h('h2', { id: 'about-title', text: 'Session' }), this.page.story ? h('p', { class: 'story', text: this.page.story }) : null,
      h('ul', {}, this.page.errands.map(text => h('li', { text }))));
  }

  actions() {
    return [['Split', 's', () => this.split()], ['Merge', 'm', () => this.merge()], ['Border ←', '[', () => this.border(-1)], ['Border →', ']', () => this.border(1)],
      ['Values', 'g', () => this.chooseValues()], ['Exchange', 'x', () => this.chooseExchange()], ['Transaction', 't', () => this.chooseTransaction()], ['Same exch.', 'p', () => this.sameExchange()], ['Play it', 'r', () => this.film.playLine(this.page.utterances[this.k])],
    ].map(([label, key, run]) => button(label, { key, run, class: 'soft' }));
  }

  addKeys() {
    const { keys } = this;
    keys.add('ArrowDown', 'Next span', () => this.move(1));
    keys.add('ArrowUp', 'Previous span', () => this.move(-1));
    keys.add('j', 'Next span', () => this.move(1));
    keys.add('k', 'Previous span', () => this.move(-1));
    keys.add('Enter', 'Accept the suggestion, and go to the next undecided span', () => this.accept());
    for (let n = 1; n < 5; n++) keys.add(String(n), `Answer ${n} of the question`, () => this.decision.answer(n));
    keys.add('Backspace', 'One question back', () => this.decision.back());
    for (const [move, letter] of this.vocabulary.moves) keys.add(letter, move, () => this.decide(move));
    keys.add('s', 'Split the span; arrows choose the word', () => this.split());
    keys.add('m', 'Merge with the next span of the utterance', () => this.merge());
    keys.add('[', 'Move the right border of the span to the left', () => this.border(-1));
    keys.add(']', 'Move the right border of the span to the right', () => this.border(1));
    keys.add('g', 'Slot values', () => this.chooseValues());
    keys.add('x', 'Exchange, with exception and end', () => this.chooseExchange());
    keys.add('p', 'Same exchange as the span before', () => this.sameExchange());
    keys.add('t', 'Transaction, with goal and end', () => this.chooseTransaction());
    keys.add(' ', 'Play or pause', () => this.film.toggle());
    keys.add('r', 'Play the utterance', () => this.film.playLine(this.page.utterances[this.k]));
    keys.add('ArrowLeft', 'One second back', () => this.film.seek(this.film.time - 1));
    keys.add('ArrowRight', 'One second on', () => this.film.seek(this.film.time + 1));
    keys.add('b', 'Map or windscreen', () => this.film.swap());
    keys.add('+', 'Timeline: closer', () => this.timeline.zoom(0.8));
    keys.add('-', 'Timeline: wider', () => this.timeline.zoom(1.25));
    keys.add('Ctrl+Z', 'Undo', () => this.step('undo'));
    keys.add('Ctrl+Y', 'Redo (also Ctrl+Shift+Z)', () => this.step('redo'));
  }

  control(event) {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.target.closest?.('input, dialog, .popover')) return;
    const letter = event.key.toLowerCase();
    if (letter !== 'z' && letter !== 'y') return;
    event.preventDefault();
    this.step(letter === 'y' || event.shiftKey ? 'redo' : 'undo');
  }

  // --- where ----------------------------------------------------------------------------------------------------------

  get span() { return this.marks.spans[this.k][this.s]; }

  select(k, s, { seek = true } = {}) {
    const line = this.marks.spans[k];
    [this.k, this.s] = [k, Math.min(s, line.length - 1)];
    this.decision.reset();
    this.timeline.current = [this.k, this.s];
    this.transcript.select(this.k, this.s);
    this.adjudication?.show(this.k);
    if (seek && !this.film.playing) this.film.seek(this.marks.times(this.k, this.s)[0]);
    this.refresh();
  }

  move(step) {
    const places = this.marks.places(), at = places.findIndex(([k, s]) => k === this.k && s === this.s);
    const next = places[Math.min(Math.max(0, at + step), places.length - 1)];
    if (next) this.select(...next);
  }

  refresh() {
    const { marks } = this;
    if (this.s >= marks.spans[this.k].length) this.s = marks.spans[this.k].length - 1;
    this.decision.show(this.span);
    const slots = Object.entries(this.span.slots ?? {}).map(([slot, values]) => `${slot}: ${values.join(', ')}`).join(' · ');
    this.values.replaceChildren(h('q', { text: marks.text(this.k, this.s) }), h('span', { text: slots || 'no values' }));
    for (const [element, label] of [[this.undo, marks.undo], [this.redo, marks.redo]]) { element.setAttribute('aria-disabled', String(label === null)); element.title = label ?? ''; }
  }

  // --- edits --------------------------------------------------------------------------------------------------------

  /** Marks the current utterance with other spans. */
  remark(label, spans, k = this.k) { this.marks.mark(label, { utterances: new Map([[k, spans]]) }); }

  change(label, fields) { this.remark(label, this.marks.spans[this.k].map((span, s) => (s === this.s ? { ...span, suggested: false, ...fields } : span))); }

  decide(move) { this.decision.reset(); this.change(`move ${move}`, { move }); }

  accept() {
    if (this.span.suggested) this.change('accept', {});
    const places = this.marks.places(), at = places.findIndex(([k, s]) => k === this.k && s === this.s);
    const next = [...places.slice(at + 1), ...places.slice(0, at)].find(([k, s]) => !this.marks.isDecided(k, s));
    if (next) this.select(...next); else this.move(1);
  }

  step(action) { if (this.marks[action] !== null || this.marks.waiting) this.marks.step(action); }

  split() {
    const { marks, k, s } = this, { words: count } = this.span;
    if (count < 2) return;
    const first = marks.first(k, s), said = this.page.utterances[k].words.slice(first, first + count);
    chooseWord(said, at => {
      const spans = marks.spans[k].flatMap((span, i) => (i === s ? [{ ...span, words: at }, { ...span, words: count - at }] : [span]));
      this.remark('split', spans);
      this.select(k, s, { seek: false });
    });
  }

  merge() {
    const spans = this.marks.spans[this.k], next = spans[this.s + 1];
    if (!next) return;
    const slots = structuredClone(this.span.slots ?? {});
    for (const [slot, values] of Object.entries(next.slots ?? {})) slots[slot] = [...new Set([...(slots[slot] ?? []), ...values])];
    this.remark('merge', spans.toSpliced(this.s, 2, { ...this.span, slots, words: this.span.words + next.words }));
  }

  /** Moves the border between the current and the next span by a word. */
  border(step) {
    const spans = this.marks.spans[this.k], next = spans[this.s + 1];
    if (!next || this.span.words + step < 1 || next.words - step < 1) return;
    this.remark('border', spans.toSpliced(this.s, 2, { ...this.span, words: this.span.words + step }, { ...next, words: next.words - step }));
  }

  chooseValues() { chooseValues(this.vocabulary, this.page, this.marks.text(this.k, this.s), this.span.slots, slots => this.change('values', { slots })); }

  chooseExchange() { chooseExchange(this.marks, this.vocabulary, [this.k, this.s], exchange => this.change('exchange', { exchange })); }

  chooseTransaction() {
    chooseTransaction(this.marks, this.vocabulary, [this.k, this.s], transaction => this.remark('transaction', this.marks.spans[this.k].map(span => ({ ...span, transaction }))));
  }

  sameExchange() {
    const places = this.marks.places(), at = places.findIndex(([k, s]) => k === this.k && s === this.s);
    if (at < 1) return;
    const [k, s] = places[at - 1];
    this.change('exchange', { exchange: this.marks.spans[k][s].exchange ?? null });
  }
}
