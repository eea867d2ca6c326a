// Questionnaires: an element for each item, the answers, and messages where they are missing.

import { h } from '/static/dom.js';

const KINDS = ['likert', 'choice', 'number', 'text'];
let numbers = 0;

/** Removes drafts of questionnaires from this browser: all, or all but one. */
export function forgetDrafts(but = null) {
  for (const name of Object.keys(localStorage)) if (name.startsWith('draft-') && name !== but) localStorage.removeItem(name);
}

/** Form of a questionnaire; what was filled in survives a reload, and is shown in other tabs, until it is sent. */
export class Questionnaire {
  /**
   * @param items items as the server sends them.
   * @param key name of the draft in the browser's storage.
   * @param submit called with the answers.
   */
  constructor(items, key, submit) {
    Object.assign(this, { items, key });
    this.fields = items.map(item => new Field(item));
    this.element = h('form', { class: 'questions', novalidate: true, oninput: () => this.keep(), onsubmit: event => { event.preventDefault(); if (this.check()) submit(this.answers()); } },
      this.fields.map(field => field.element), h('p', {}, h('button', { type: 'submit', class: 'primary', text: 'Continue' })));
    this.fill(localStorage.getItem(key));
    addEventListener('storage', event => { if (event.key === key && event.newValue && this.element.isConnected) this.fill(event.newValue); });
  }

  fill(draft) {
    const answers = JSON.parse(draft ?? '{}');
    for (const field of this.fields) if (answers[field.item.id] !== undefined && !field.focused) { field.value = answers[field.item.id]; field.count?.(); }
  }

  answers() { return Object.fromEntries(this.fields.map(field => [field.item.id, field.value])); }
  keep() { localStorage.setItem(this.key, JSON.stringify(this.answers())); }

  /** Returns whether every answer is there and allowed; goes to the first that is not. */
  check() {
    const wrong = this.fields.filter(field => !field.check());
    wrong[0]?.focus();
    return !wrong.length;
  }
}

class Field {
  constructor(item) {
    if (!KINDS.includes(item.kind)) throw new Error(`lab/studies/static/forms.js has no field for items of kind '${item.kind}'`);
    Object.assign(this, { item, name: `item-${++numbers}` });
    this.error = h('p', { class: 'wrong', id: `${this.name}-wrong`, hidden: true });
    const mark = item.required ? null : h('small', { text: ' (optional)' });
    if (item.kind === 'likert' || item.kind === 'choice') {
      const { kind, points, several } = item;
      const labels = kind === 'likert' ? Array.from({ length: points }, (_, k) => String(k + 1)) : item.options;
      this.inputs = labels.map((label, k) => h('input', { type: several ? 'checkbox' : 'radio', name: this.name, id: `${this.name}-${k}`, value: String(k), 'aria-describedby': this.error.id, ...(kind === 'likert' && { 'aria-label': k === 0 ? `1: ${item.low}` : k === points - 1 ? `${points}: ${item.high}` : label }) }));
      const options = this.inputs.map((input, k) => h('label', { for: input.id }, input, h('span', { text: labels[k], ...(kind === 'likert' && { 'aria-hidden': 'true' }) })));
      const scale = kind === 'likert'
        ? h('div', { class: 'scale' }, h('span', { class: 'end', 'aria-hidden': 'true', text: item.low }), h('div', { class: 'points' }, options), h('span', { class: 'end', 'aria-hidden': 'true', text: item.high }))
        : h('div', { class: 'options' }, options);
      this.element = h('fieldset', { class: kind }, h('legend', {}, item.text, mark), scale, this.error);
    } else {
      const common = { id: this.name, name: item.id, 'aria-describedby': this.error.id, ...(item.required && { 'aria-required': 'true' }) };
      this.input = item.kind === 'number' ? h('input', { ...common, type: 'number', min: item.min, max: item.max, step: item.whole ? 1 : 'any', inputmode: item.whole ? 'numeric' : 'decimal' })
        : item.long ? h('textarea', { ...common, rows: 4 }) : h('input', { ...common, type: 'text', autocomplete: 'off' });
      this.length = item.kind === 'text' ? h('small', { class: 'length', role: 'status' }) : null;
      this.element = h('div', { class: `field ${item.kind}`, oninput: () => this.count() }, h('label', { for: this.name }, item.text, mark), this.input, this.length, this.error);
    }
  }

  get focused() { return this.element.contains(document.activeElement) && document.hasFocus(); }

  /** Number of characters, as the server counts them, above the most that are allowed. */
  get excess() { return this.item.kind === 'text' ? [...this.input.value.trim()].length - this.item.max_length : 0; }

  /** Says how much room is left when there is little; nothing is ever cut off. */
  count() {
    if (!this.length) return;
    const { excess, item } = this;
    this.length.textContent = excess > 0 ? `${excess} characters too many: at most ${item.max_length}.` : excess > -Math.max(10, item.max_length / 10) ? `${-excess} characters left.` : '';
  }

  get value() {
    const { item } = this;
    if (this.inputs) {
      const chosen = this.inputs.flatMap((input, k) => (input.checked ? [k] : []));
      if (item.kind === 'likert') return chosen.length ? chosen[0] + 1 : null;
      const options = chosen.map(k => item.options[k]);
      return item.several ? options : options[0] ?? null;
    }
    const text = this.input.value.trim();
    if (item.kind === 'number') return text === '' ? null : Number(text);
    return text || null;
  }

  set value(value) {
    const { item } = this;
    if (this.inputs) this.inputs.forEach((input, k) => { input.checked = item.kind === 'likert' ? value === k + 1 : [value].flat().includes(item.options[k]); });
    else this.input.value = value ?? '';
  }

  check() {
    const { item, value } = this;
    const empty = value === null || value === undefined || (Array.isArray(value) && !value.length);
    let wrong = '';
    if (this.input?.validity.badInput || (item.kind === 'number' && Number.isNaN(value))) wrong = 'Please enter a number.';
    else if (this.excess > 0) wrong = `Please shorten this text by ${this.excess} characters; at most ${item.max_length} are allowed.`;
    else if (empty && item.required) wrong = item.kind === 'text' || item.kind === 'number' ? 'Please answer this question.' : 'Please choose an answer.';
    else if (!empty && item.kind === 'number' && (value < item.min || value > item.max || (item.whole && !Number.isInteger(value)))) wrong = `Please enter ${item.whole ? 'a whole number' : 'a number'} from ${item.min} to ${item.max}.`;
    this.error.textContent = wrong;
    this.error.hidden = !wrong;
    for (const input of this.inputs ?? [this.input]) input.toggleAttribute('aria-invalid', false), wrong && input.setAttribute('aria-invalid', 'true');
    return !wrong;
  }

  focus() { (this.inputs?.[0] ?? this.input).focus(); }
}
