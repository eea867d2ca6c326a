// Marks of the annotator: spans by utterance, exchanges, transactions. Edits wait in a queue and are sent one by one.
//
// What is shown is the state of the server with the marks that wait. Each load begins a generation: edits of an earlier
// one were made on marks that are no longer there, so they are dropped and named.

import { notice, sentence } from '/static/dom.js';

const key = (speaker, utterance) => `${speaker}/${utterance}`;

export class Marks extends EventTarget {
  /** @param api connection. @param number session. @param lines utterances of the session. */
  constructor(api, number, lines) {
    super();
    Object.assign(this, { api, number, lines, spans: [], exchanges: new Map(), transactions: new Map(), edit: 0, undo: null, redo: null, generation: 0, queue: [], sending: false, trouble: null, refused: null });
    this.index = new Map(lines.map((line, k) => [key(line.speaker, line.utterance), k]));
  }

  /** Number of edits that wait for the server. */
  get waiting() { return this.queue.length; }

  async load() {
    const state = await this.ask('marks');
    this.generation++;
    this.take(state);
  }

  /** Takes the state of the server after an edit or a load; marks that wait are shown on top of it. */
  take(state) {
    Object.assign(this, { edit: state.edit, undo: state.undo, redo: state.redo, done: state.done, total: state.spans, preAnnotated: state.pre_annotated });
    if (state.whole) this.served = { spans: this.lines.map(line => [{ words: line.words.length }]), exchanges: new Map(), transactions: new Map() };
    this.apply(state.change, this.served);
    this.show();
  }

  /** Shows the state of the server with the marks that wait. */
  show() {
    const { spans, exchanges, transactions } = this.served;
    Object.assign(this, { spans: [...spans], exchanges: new Map(exchanges), transactions: new Map(transactions) });
    for (const { generation, body } of this.queue) if (generation === this.generation && body.change) this.apply(body.change, this);
    this.changed();
  }

  apply({ utterances = [], exchanges = [], transactions = [] }, to) {
    for (const row of utterances) to.spans[this.index.get(key(row.speaker, row.utterance))] = row.spans;
    for (const { exchange, ...mark } of exchanges) to.exchanges.set(exchange, mark);
    for (const { transaction, ...mark } of transactions) to.transactions.set(transaction, mark);
  }

  changed() { this.dispatchEvent(new Event('change')); }

  // --- edits --------------------------------------------------------------------------------------------------------

  /** Marks utterances anew: `utterances` is a map from their index to their spans. */
  mark(label, { utterances = new Map(), exchanges = [], transactions = [] }) {
    const change = {
      utterances: [...utterances].map(([k, spans]) => ({ speaker: this.lines[k].speaker, utterance: this.lines[k].utterance, spans: spans.map(plain) })),
      exchanges, transactions,
    };
    const [k] = utterances.keys();
    this.send('mark', { label, change }, label, k);
  }

  step(action) { this.send(action, {}, action); }

  adopt(k, annotator) {
    const { speaker, utterance } = this.lines[k];
    this.send('adopt', { speaker, utterance, annotator }, `take over from ${annotator}`, k);
  }

  /** Queues an edit; `label` names it, with the words of utterance `k` if it is about one. */
  send(action, body, label, k) {
    if (this.refused) { notice(`Not saved: ${this.refused}. Reload the page.`, 'error'); return; }
    const said = k === undefined ? '' : this.lines[k].words.join(' ');
    const name = said ? `${label}: “${said.length > 40 ? `${said.slice(0, 40)} …` : said}”` : label;
    this.queue.push({ action, body, name, generation: this.generation });
    this.show();
    this.work();
  }

  /** Sends the edits that wait, one after the other. */
  async work() {
    if (this.sending) return;
    this.sending = true;
    while (this.queue.length) await this.sendFirst();
    this.sending = false;
    this.changed();
    this.dispatchEvent(new Event('saved'));
  }

  async sendFirst() {
    const { action, body } = this.queue[0], base = this.edit;
    let state;
    try {
      state = await this.ask(action, again => ({ ...body, base, ...(again && { again }) }));
    } catch (error) {
      await this.failed(error, this.queue[0]);
      return;
    }
    this.queue.shift();
    this.take(state);
  }

  /** Drops what cannot be saved: an undo without anything to undo, or all edits that were made on former marks. */
  async failed(error, edit) {
    if (edit.action !== 'mark' && error.status === 400) {
      this.queue.shift();
      notice(sentence(error.message), 'error');
      return;
    }
    try { await this.load(); } catch (later) { this.refused = later.message; }
    const dropped = this.queue.filter(({ generation }) => this.refused || generation < this.generation);
    this.queue = this.queue.filter(each => !dropped.includes(each));
    this.show();
    this.dispatchEvent(new CustomEvent('dropped', { detail: { reason: this.refused ?? error.message, names: dropped.map(({ name }) => name) } }));
  }

  ask(path, body) {
    const onwait = trouble => { if (trouble !== this.trouble) { this.trouble = trouble; this.changed(); } };
    return this.api.patiently(`sessions/${this.number}/${path}`, { body, onwait, waits: refusal => refusal.passes || refusal.isOfLink });
  }

  /** Waits until no edit waits. */
  async settled() { while (this.queue.length) await new Promise(resolve => this.addEventListener('saved', resolve, { once: true })); }

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
