// Texts of a study: paragraphs, headings ("# "), and lists ("- ").

import { h } from '/static/dom.js';

/** Returns the elements of a text; it is never read as HTML. */
export function prose(text) {
  const elements = [];
  for (const block of text.trim().split(/\n\s*\n/)) {
    let words = [], entries = [];
    const flush = () => {
      if (words.length) elements.push(h('p', { text: words.join(' ') }));
      if (entries.length) elements.push(h('ul', {}, entries.map(entry => h('li', { text: entry }))));
      words = []; entries = [];
    };
    for (const line of block.split('\n').map(each => each.trim())) {
      if (line.startsWith('# ')) { flush(); elements.push(h('h3', { text: line.slice(2) })); }
      else if (line.startsWith('- ')) { if (words.length) flush(); entries.push(line.slice(2)); }
      else if (entries.length) entries.push(`${entries.pop()} ${line}`);
      else words.push(line);
    }
    flush();
  }
  return elements;
}
