// Adjudication: what each annotator has marked for the current utterance, agreement, and the history of decisions.

import { h, words } from '/static/dom.js';
import { popover } from '/static/popover.js';
import { letter } from './units.js';

const LAYERS = { undecided: 'not finished by all' };

export class Adjudication {
  constructor(api, number, page, marks, keys) {
    Object.assign(this, { api, number, page, marks, versions: null, k: 0 });
    this.list = h('div', { class: 'versions' });
    this.figures = h('p', { class: 'hint', role: 'status' });
    this.element = h('section', { class: 'panel adjudication', 'aria-labelledby': 'adjudication-title' }, h('div', { class: 'head' }, h('h2', { id: 'adjudication-title', text: 'Annotators' }), h('button', { type: 'button', class: 'soft', onclick: () => this.history() }, 'History')),
      this.figures, this.list);
    for (let n = 1; n < 10; n++) keys.add(String(n), `Take over from annotator ${n}`, () => this.take(n - 1), { alt: true });
  }

  async load(transcript) {
    try {
      this.versions = await this.api.patiently(`sessions/${this.number}/versions`);
    } catch (error) { this.figures.textContent = error.message; return; }
    const at = new Map(this.page.utterances.map((line, k) => [`${line.speaker}/${line.utterance}`, k]));
    transcript.flagged = new Map(this.versions.disagreements.map(({ speaker, utterance, layers }) => [at.get(`${speaker}/${utterance}`), layers.map(layer => LAYERS[layer] ?? layer).join(', ')]));
    this.names = Object.keys(this.versions.annotators);
    this.spans = this.names.map(name => new Map(this.versions.annotators[name].utterances.map(row => [at.get(`${row.speaker}/${row.utterance}`), row.spans])));
    this.ranks = this.spans.map(rows => ({ exchange: ranks(rows, 'exchange'), transaction: ranks(rows, 'transaction') }));
    const figure = value => (value === null ? 'undefined' : value.toFixed(2));
    this.figures.textContent = this.versions.agreement.map(pair => `${pair.annotators.join(', ')}: spans ${figure(pair.spans.agreement)}, moves κ ${figure(pair.moves.kappa)}, slots κ ${figure(pair.slots.kappa)}`).join('; ') || 'Fewer than two people have annotated this session.';
    transcript.draw();
    this.show(this.k);
  }

  show(k) {
    this.k = k;
    if (!this.versions) return;
    this.list.replaceChildren(...this.names.map((name, n) => h('div', { class: 'version' }, h('b', { text: name }),
      h('p', {}, this.chips(this.spans[n].get(k), k, this.ranks[n])),
      h('button', { type: 'button', class: 'soft', 'aria-keyshortcuts': `Alt+${n + 1}`, 'aria-label': `Take over from ${name}`, onclick: () => this.take(n) }, 'Take over', h('kbd', { 'aria-hidden': 'true', text: `Alt ${n + 1}` })))));
  }

  chips(spans, k, ranks) {
    let first = 0;
    return spans.map(({ words: count, move, slots, suggested, exchange, transaction }) => {
      const said = this.page.utterances[k].words.slice(first, first += count).join(' ');
      const values = Object.values(slots ?? {}).flat().map(words).join(', ');
      return h('span', { class: 'chip', text: `${said} – ${move && !suggested ? move : 'undecided'}${values ? ` ${values}` : ''}` }, h('small', { text: [ranks.exchange.get(exchange), ranks.transaction.get(transaction)].filter(Boolean).join(' ') }));
    });
  }

  take(n) { if (this.names?.[n]) this.marks.adopt(this.k, this.names[n]); }

  async history() {
    await this.marks.settled();
    const rows = await this.api.patiently(`sessions/${this.number}/history`);
    popover('History of the final version', close => [
      rows.length ? h('ol', { class: 'history', tabindex: '0', 'aria-label': 'Decisions, the latest first' }, rows.map(row => h('li', { text: `${row.edit}. ${row.by || 'start'}: ${row.action === 'mark' ? '' : `${row.action} `}${row.label || (row.action === 'start' ? 'what all annotators agree on' : 'mark')}${row.utterances.length === 1 ? ` (${row.utterances[0].join(' ')})` : ''}` }))) : h('p', { text: 'Nothing has been decided yet.' }),
      h('button', { type: 'button', class: 'primary', onclick: close }, 'Close'),
    ]);
  }
}

/** Returns the names of the units of an annotator, by their numbers: E1, E2, ... in the order of their first spans. */
function ranks(rows, layer) {
  const found = new Map();
  for (const spans of rows.values()) for (const span of spans) if (Number.isInteger(span[layer]) && !found.has(span[layer])) found.set(span[layer], `${letter(layer)}${found.size + 1}`);
  return found;
}
