// Talk: what was said, typing with the acts of the classifier as chips, quick phrases, corrections with two clicks.

import { button, clock, h, icon, words } from '/static/dom.js';
import { popover } from '/static/popover.js';

const NAMES = { participant: 'Participant', co_wizard: 'Car', ad_wizard: 'Message', experimenter: 'Experimenter' };
const NEAR = 60;  // distance from the end at which a person still reads there [px]

export class Talk {
  /**
   * @param link connection.
   * @param own role of the seat; null for seats that only watch.
   * @param quick phrases to say with one click.
   * @param names names of the speakers for this seat.
   */
  constructor(link, { own = null, quick = [], names = {}, keys = null, alt = false, acts = true } = {}) {
    Object.assign(this, { link, own, acts, names: { ...NAMES, ...names }, draft: null, overrides: new Map(), parsing: 0, pending: [], queries: new Map() });
    this.list = h('div', { class: 'lines', role: 'log', 'aria-label': 'Talk', tabindex: '0' });
    this.typing = h('p', { class: 'typing', 'aria-live': 'polite' });
    this.element = h('section', { class: 'panel talk', 'aria-label': 'Talk' }, h('h2', { text: 'Talk' }), this.list, this.typing);
    this.low = true;  // the list shows its end
    this.top = 0;
    this.list.addEventListener('scroll', () => this.scrolled());
    new ResizeObserver(() => this.toEnd()).observe(this.list);  // chips, hints and quick phrases take of its space
    if (own) this.addInput(quick, keys, alt);
    link.on('parsed', message => this.parsed(message)).on('corrected', message => this.corrected(message));
  }

  addInput(quick, keys, alt) {
    this.input = h('input', { id: 'words', type: 'text', maxlength: '600', autocomplete: 'off', placeholder: 'Say something …', 'aria-label': 'What you say', 'aria-keyshortcuts': 'Enter', oninput: () => this.changed(),
      onkeydown: event => { if (event.key === 'Escape') this.input.blur(); } });
    this.chips = h('div', { class: 'chips', role: 'group', 'aria-label': 'Acts of what you type' });
    const form = h('form', { class: 'say', onsubmit: event => { event.preventDefault(); this.say(this.input.value); } }, this.input,
      h('button', { type: 'submit', class: 'primary', 'aria-label': 'Say' }, icon('send')));
    this.quick = h('div', { class: 'quick', role: 'group', 'aria-label': 'Quick phrases' },
      quick.map((text, k) => button(text, { run: () => this.say(text, true), key: k < 9 ? `${alt ? 'Alt+' : ''}${k + 1}` : null, class: 'soft' })));
    this.element.append(this.chips, form, this.quick);
    keys?.add('Enter', 'Type what you say; Enter again says it, Escape leaves', () => this.input.focus());
    quick.slice(0, 9).forEach((text, k) => keys?.add(String(k + 1), `Say “${text}”`, () => this.say(text, true), { alt }));
  }

  /** Empties the talk, for a new session or after a new connection. */
  clear() { this.list.replaceChildren(); this.pending = []; this.low = true; }

  /** Shows the last line, unless the person has scrolled up. */
  toEnd() { if (this.low) this.list.scrollTop = this.list.scrollHeight; }

  /** Notes whether the end is shown; only scrolling up leaves it, not less space for the list. */
  scrolled() {
    const { scrollTop, scrollHeight, clientHeight } = this.list;
    this.low = scrollHeight - scrollTop - clientHeight < NEAR || (this.low && scrollTop >= this.top);
    this.top = scrollTop;
  }

  // --- lines --------------------------------------------------------------------------------------------------------

  add(entries) {
    for (const entry of entries) {
      const own = entry.who === this.own;
      if (own) this.settle(entry.text);
      this.list.append(this.line(entry, own));
    }
    for (const line of this.pending) this.list.append(line);  // what waits stays below
    this.toEnd();
  }

  line(entry, own) {
    const line = h('div', { class: `line ${own ? 'own' : ''} ${entry.who}` },
      h('span', { class: 'who' }, own ? 'You' : this.names[entry.who] ?? entry.who, h('time', { text: clock(entry.t) })),
      h('p', { text: entry.text }));
    if (entry.spans && (own || !this.own) && this.acts) {
      const row = h('div', { class: 'chips' });
      entry.spans.forEach((span, k) => row.append(this.chip(span, own ? act => this.link.send({ k: 'correct', utterance: entry.utterance, span: k, ...act }) : null)));
      row.dataset.utterance = entry.utterance;
      line.append(row);
    }
    return line;
  }

  /** Shows own words that are still being spoken. */
  await(text) {
    const line = h('div', { class: 'line own waiting' }, h('span', { class: 'who', text: 'You' }), h('p', { text }));
    this.pending.push(line);
    this.list.append(line);
    this.low = true;
    this.toEnd();
  }

  settle(text) {
    const plain = value => value.toLowerCase().replace(/\W+/g, ' ').trim(), whole = plain(text);
    const before = this.pending.length;
    this.pending = this.pending.filter(line => { const gone = whole.includes(plain(line.lastChild.textContent)); if (gone) line.remove(); return !gone; });
    if (this.pending.length === before) this.pending.shift()?.remove();
  }

  state({ other_speaking, state }) {
    const text = other_speaking && state === 'running' ? `${this.own === 'participant' ? 'The car' : 'The participant'} is speaking …` : '';
    if (this.typing.textContent !== text) this.typing.textContent = text;
  }

  // --- typing -------------------------------------------------------------------------------------------------------

  changed() {
    clearTimeout(this.timer);
    const text = this.input.value.trim();
    if (!text) { this.recorded = this.draft = null; this.overrides.clear(); this.chips.replaceChildren(); return; }
    this.timer = setTimeout(() => { const c = ++this.parsing; this.queries.set(c, text); this.link.send({ k: 'parse', c, text }); }, 220);
  }

  parsed({ c, spans }) {
    const text = this.queries.get(c);
    this.queries.delete(c);
    if (c !== this.parsing || text !== this.input.value.trim()) return;
    this.draft = { text, spans: spans.map(span => ({ ...span, ...this.overrides.get(span.text) })) };
    if (this.acts) this.showDraft();
  }

  showDraft() {
    this.chips.replaceChildren(...this.draft.spans.map((span, k) => this.chip(span, act => {
      this.overrides.set(span.text, act);
      this.draft.spans[k] = { ...span, ...act, corrected: true };
      this.showDraft(); this.input.focus();
    })));
  }

  say(text, phrase = false) {
    text = text.trim();
    if (!text) return;
    const spans = !phrase && this.draft?.text === text && this.overrides.size ? this.draft.spans.map(({ text: words, move, slots }) => ({ text: words, move, slots })) : undefined;
    const audio = !phrase && this.recorded || undefined;
    if (audio) this.recorded = null;
    this.link.command('say', { text, ...(spans && { spans }), ...(audio && { audio }) });
    this.await(text);
    if (!phrase) { this.input.value = ''; this.draft = null; this.overrides.clear(); this.chips.replaceChildren(); }
  }

  // --- chips --------------------------------------------------------------------------------------------------------

  /** Returns a value in words; streets that the map names have this name. */
  name(value) { return this.link.hello.titles?.[value] ?? words(value); }

  chip(span, correct) {
    const values = Object.values(span.slots).flat().map(value => this.name(value));
    const text = [h('b', { text: span.move }), values.length ? ` ${values.join(', ')}` : ''];
    if (!correct) return h('span', { class: 'chip', title: span.text }, ...text);
    const chip = h('button', { type: 'button', class: `chip ${span.corrected ? 'corrected' : ''}`, title: `“${span.text}”: press to correct`, 'aria-haspopup': 'dialog',
      'aria-label': `${span.move} ${values.join(', ')}: correct the act of “${span.text}”`, onclick: () => this.choose(chip, span, correct) }, ...text);
    return chip;
  }

  choose(chip, span, correct) {
    const { vocabulary } = this.link.hello;
    const slots = structuredClone(span.slots);
    const values = Object.entries(slots).flatMap(([slot, found]) => found.map(value =>
      h('button', { type: 'button', class: 'chip value', 'aria-pressed': 'true', title: 'Leave this out', onclick: event => {
        const kept = event.currentTarget.getAttribute('aria-pressed') !== 'true';
        event.currentTarget.setAttribute('aria-pressed', String(kept));
        slots[slot] = kept ? [...slots[slot], value] : slots[slot].filter(other => other !== value);
        if (!slots[slot].length) delete slots[slot];
      } }, `${slot}: ${this.name(value)}`)));
    popover(`Act of “${span.text}”`, close => [
      h('p', { class: 'quoted', text: `“${span.text}”` }),
      values.length ? h('div', { class: 'chips', role: 'group', 'aria-label': 'Values' }, values) : null,
      h('div', { class: 'moves', role: 'group', 'aria-label': 'Moves' }, vocabulary.moves.map(([move, hint]) =>
        h('button', { type: 'button', 'aria-pressed': String(move === span.move), 'data-first': move === span.move, title: hint, onclick: () => { close(); correct({ move, slots }); } }, h('b', { text: move }), h('small', { text: hint })))),
    ], { beside: chip });
  }

  corrected({ utterance, span, move, slots }) {
    const row = this.list.querySelector(`.chips[data-utterance="${utterance}"]`);
    const old = row?.children[span];
    if (old) old.replaceWith(this.chip({ text: old.title.replace(/^“|”.*$/g, ''), move, slots, corrected: true }, act => this.link.send({ k: 'correct', utterance, span, ...act })));
    this.toEnd();
  }
}
