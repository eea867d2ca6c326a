// Transcript: utterances with their spans as buttons; the current span is the one that keys mark.

import { clock, h, words } from '/static/dom.js';
import { letter } from './units.js';

const NAMES = { participant: 'Participant', co_wizard: 'Car' };

export class Transcript {
  constructor(page, marks, onselect) {
    Object.assign(this, { page, marks, onselect, current: [0, 0], flagged: new Map() });
    this.list = h('ol', { class: 'script', 'aria-label': 'Transcript' });
    this.progress = h('p', { class: 'hint', role: 'status' });
    this.element = h('section', { class: 'panel transcript', 'aria-labelledby': 'transcript-title' }, h('div', { class: 'head' }, h('h2', { id: 'transcript-title', text: 'Transcript' }), this.progress), this.list);
    this.rows = page.utterances.map((line, k) => {
      const spans = h('div', { class: 'spans', role: 'group', 'aria-label': `${NAMES[line.speaker]}, ${clock(line.start)}` });
      const row = h('li', { class: line.speaker }, h('p', { class: 'who' }, h('b', { text: NAMES[line.speaker] }), h('time', { text: clock(line.start) }), h('span', { class: 'flag' })), spans);
      this.list.append(row);
      return { row, spans, key: null, k };
    });
    marks.addEventListener('change', () => this.draw());
  }

  select(k, s) { this.current = [k, s]; this.draw(); this.rows[k].spans.children[s]?.scrollIntoView({ block: 'nearest' }); }

  draw() {
    const { marks } = this;
    const exchanges = marks.units('exchange'), transactions = marks.units('transaction');
    for (const { row, spans, k } of this.rows) {
      const mine = marks.spans[k], here = this.current[0] === k ? this.current[1] : -1;
      const key = JSON.stringify([mine.map(span => [span, exchanges.get(span.exchange)?.name, transactions.get(span.transaction)?.name, marks.exchanges.get(span.exchange)?.exception]), here, this.flagged.get(k)]);
      if (row.dataset.key === key) continue;
      row.dataset.key = key;
      const held = spans.contains(document.activeElement) ? [...spans.children].indexOf(document.activeElement) : -1;
      spans.replaceChildren(...mine.map((span, s) => this.chip(span, k, s, here === s, exchanges, transactions)));
      row.querySelector('.flag').textContent = this.flagged.get(k) ?? '';
      if (held >= 0) spans.children[Math.min(held, spans.children.length - 1)].focus();
    }
    this.progress.textContent = `${marks.done ?? 0} of ${marks.total ?? 0} spans decided`;
  }

  chip(span, k, s, current, exchanges, transactions) {
    const values = Object.values(span.slots ?? {}).flat().map(words), state = !span.move ? 'open' : span.suggested ? 'suggested' : 'decided';
    const exchange = exchanges.get(span.exchange), transaction = transactions.get(span.transaction), kind = this.marks.exchanges.get(span.exchange)?.exception;
    return h('button', { type: 'button', class: `span ${state}`, 'aria-current': current ? 'true' : null, onclick: () => this.onselect(k, s) },
      h('span', { class: 'said', text: this.marks.text(k, s) || '(no words)' }),
      h('span', { class: 'label' }, h('b', { text: span.move ? words(span.move) + (span.suggested ? '?' : '') : 'undecided' }), values.length ? ` ${values.join(', ')}` : null,
        exchange ? h('small', { text: `${letter('exchange')}${exchange.name}${kind && kind !== 'none' ? ` ${kind}` : ''}` }) : null, transaction ? h('small', { text: `${letter('transaction')}${transaction.name}` }) : null));
  }
}
