// The current span: the decision tree, question by question, or a key for each move.

import { h, words } from '/static/dom.js';

export class Decision {
  /** @param vocabulary vocabularies. @param onmove takes the label of a move. */
  constructor(vocabulary, onmove) {
    Object.assign(this, { vocabulary, onmove, path: [] });
    this.question = h('div', { class: 'question', 'aria-live': 'polite' });
    this.moves = h('div', { class: 'direct', role: 'group', 'aria-label': 'Moves' });
    this.element = h('section', { class: 'panel decision', 'aria-labelledby': 'decision-title' }, h('h2', { id: 'decision-title', text: 'Move' }), this.question, this.moves);
  }

  /** Begins at the root for another span. */
  reset() { this.path = []; }

  /** Answers the current question by the number of the answer, from 1. */
  answer(number) {
    const node = this.node(), found = node.answers[number - 1];
    if (!found) return;
    if (typeof found[1] === 'string') { this.path = []; this.onmove(found[1]); } else { this.path.push(found); this.show(this.span); }
  }

  back() { if (this.path.length) { this.path.pop(); this.show(this.span); } }

  node() { return this.path.length ? this.path.at(-1)[1] : this.vocabulary.tree; }

  show(span) {
    this.span = span;
    const node = this.node();
    const back = this.path.length ? h('button', { type: 'button', class: 'soft back', 'aria-keyshortcuts': 'Backspace', onclick: () => this.back() }, 'Back', h('kbd', { 'aria-hidden': 'true', text: '⌫' })) : null;
    const trail = this.path.length ? this.path.map(([label]) => h('span', { text: label })) : h('span', { text: 'Answer with 1, 2, 3, or press the letter of a move.' });
    this.question.replaceChildren(
      h('div', { class: 'head' }, h('p', { class: 'trail' }, trail), back),
      h('h3', { text: node.text }),
      h('div', { class: 'answers' }, node.answers.map(([label, next], k) => h('button', { type: 'button', class: 'soft', 'aria-keyshortcuts': String(k + 1), onclick: () => this.answer(k + 1) },
        h('kbd', { 'aria-hidden': 'true', text: k + 1 }), h('span', { class: 'label', text: label }), typeof next === 'string' ? h('small', { text: words(next) }) : null))));
    this.moves.replaceChildren(...this.vocabulary.moves.map(([move, letter, path]) =>
      h('button', { type: 'button', class: 'soft', 'aria-pressed': String(span?.move === move && !span.suggested), 'aria-keyshortcuts': letter.toUpperCase(), title: path.join(' → '), onclick: () => this.onmove(move) },
        h('span', { class: 'label', text: words(move) }), h('kbd', { 'aria-hidden': 'true', text: letter.toUpperCase() }))));
  }
}
