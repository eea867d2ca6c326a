// Marks of the annotator: spans by utterance, exchanges, transactions; edits are sent one after the other.

import { notice } from '/static/dom.js';

const key = (speaker, utterance) => `${speaker}/${utterance}`;

export class Marks extends EventTarget {
  /** @param api connection. @param number session. @param lines utterances of the session. */
  constructor(api, number, lines) {
    super();
    Object.assign(this, { api, number, lines, spans: [], exchanges: new Map(), transactions: new Map(), edit: 0, undo: null, redo: null, waiting: 0, chain: Promise.resolve() });
    this.index = new Map(lines.map((line, k) => [key(line.speaker, line.utterance), k]));
  }

  async load() {
    const state = await this.api.json(`sessions/${this.number}/marks`);
    this.spans = this.lines.map(line => [{ words: line.words.length }]);
    this.exchanges.clear(); this.transactions.clear();
    this.take(state, true);
  }

  take(state, withChange) {
    Object.assign(this, { edit: state.edit, undo: state.undo, redo: state.redo, done: state.done, total: state.spans, preAnnotated: state.pre_annotated });
    if (withChange) this.apply(state.change);
    this.changed();
  }

  apply({ utterances = [], exchanges = [], transactions = [] }) {
    for (const row of utterances) this.spans[this.index.get(key(row.speaker, row.utterance))] = row.spans;
    for (const { exchange, ...mark } of exchanges) this.exchanges.set(exchange, mark);
    for (const { transaction, ...mark } of transactions) this.transactions.set(transaction, mark);
  }

  changed() { this.dispatchEvent(new Event('change')); }

  // --- edits --------------------------------------------------------------------------------------------------------

  /** Marks utterances anew: `utterances` is a map from their index to their spans. */
  mark(label, { utterances = new Map(), exchanges = [], transactions = [] }) {
    const change = {
      utterances: [...utterances].map(([k, spans]) => ({ speaker: this.lines[k].speaker, utterance: this.lines[k].utterance, spans: spans.map(plain) })),
      exchanges, transactions,
    };
    this.apply(change);
    this.send(() => this.api.json(`sessions/${this.number}/mark`, { base: this.edit, label, change }), false);
  }

  step(action) { this.send(() => this.api.json(`sessions/${this.number}/${action}`, { base: this.edit }), true); }

  adopt(k, annotator) {
    const { speaker, utterance } = this.lines[k];
    this.send(() => this.api.json(`sessions/${this.number}/adopt`, { base: this.edit, speaker, utterance, annotator }), true);
  }

  send(request, withChange) {
    this.waiting++;
    this.changed();
    this.chain = this.chain.then(request).then(
      state => { this.waiting--; this.take(state, withChange || !this.waiting); },
      error => this.failed(error));
  }

  async failed(error) {
    this.waiting = Math.max(0, this.waiting - 1);
    notice(error.status ? sentence(error.message) : 'Not saved: the server does not answer. The last edit was taken back.', 'error');
    try { await this.load(); } catch { this.lost = true; this.changed(); }
  }

  // --- views --------------------------------------------------------------------------------------------------------

  /** Returns [utterance, span] of all spans. */
  places() { return this.spans.flatMap((spans, k) => spans.map((_, s) => [k, s])); }

  /** Number of the first word of a span. */
  first(k, s) { return this.spans[k].slice(0, s).reduce((sum, span) => sum + span.words, 0); }

  text(k, s) { const first = this.first(k, s); return this.lines[k].words.slice(first, first + this.spans[k][s].words).join(' '); }

  /** Times of a span [s]: its share of the words of the utterance. */
  times(k, s) {
    const { start, end, words } = this.lines[k], first = this.first(k, s), share = (end - start) / words.length;
    return [start + share * first, start + share * (first + this.spans[k][s].words)];
  }

  /** Units of a layer in the order of their first spans: [number, first utterance, first span, last time]. */
  units(layer) {
    const found = new Map();
    this.places().forEach(([k, s]) => {
      const number = this.spans[k][s][layer];
      if (number === null || number === undefined) return;
      const [start, end] = this.times(k, s);
      if (!found.has(number)) found.set(number, { number, k, s, start, end, name: found.size + 1 });
      else found.get(number).end = Math.max(found.get(number).end, end);
    });
    return found;
  }

  isDecided(k, s) { const span = this.spans[k][s]; return Boolean(span.move) && !span.suggested; }
}

/** Returns a span without empty fields. */
function plain({ words, move, slots, exchange, transaction, suggested }) {
  return { words, ...(move && { move }), ...(slots && Object.keys(slots).length && { slots }), ...(isNumber(exchange) && { exchange }), ...(isNumber(transaction) && { transaction }), ...(suggested && move && { suggested }) };
}

const isNumber = value => Number.isInteger(value);
export const sentence = text => text[0].toUpperCase() + text.slice(1);
