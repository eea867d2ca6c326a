// Start of the page: the seat of the link's secret, the sessions, and the desk of the open session.

import { button, h, sentence } from '/static/dom.js';
import { Api } from './api.js';
import { Desk } from './desk.js';

const main = document.getElementById('main'), bar = document.getElementById('bar');
const dropped = h('div', { id: 'dropped', class: 'dropped', role: 'alert' });
const secret = () => location.hash.slice(1);
let api = null, seat = null, desk = null, saved = null, wanted = null;

main.before(dropped);
addEventListener('beforeunload', event => { if (desk?.marks.waiting) event.preventDefault(); });
addEventListener('hashchange', () => { if (seat) takeLink(); else location.reload(); });
if (!secret()) card('dorothie_gym annotation', 'Open your link. It ends in # and a secret, which belongs to the link.');
else start();

function card(title, ...lines) {
  main.replaceChildren(h('div', { class: 'card' }, h('h1', { text: title }), lines.map(line => (typeof line === 'string' ? h('p', { text: line }) : line))));
}

async function start() {
  api = new Api(secret());
  const onwait = reason => { if (reason) card('No connection', `${sentence(reason)}. The page tries again.`); };
  try { seat = await api.patiently('seat', { onwait }); } catch (error) { card('No connection', sentence(error.message)); return; }
  document.title = `${seat.name} – dorothie_gym annotation`;
  const number = Number(new URLSearchParams(location.search).get('session') ?? 0);
  await open(Number.isInteger(number) && number >= 0 && number < seat.sessions.length ? number : 0);
}

/** Goes on with a new link of the same person, so that edits that wait are saved by it; that of another begins anew. */
async function takeLink() {
  const other = new Api(secret());
  try {
    const found = await other.patiently('seat');
    if (found.name !== seat.name || found.kind !== seat.kind) location.reload(); else api.token = other.token;
  } catch { location.reload(); }
}

async function open(number) {
  wanted = number;
  await desk?.marks.settled();
  if (wanted !== number) return;
  desk?.close();
  desk = null;
  saved = h('p', { class: 'state', role: 'status' });
  document.body.dataset.ready = '';
  const onwait = reason => main.replaceChildren(h('p', { class: 'card', text: reason ? `${sentence(reason)}. The page tries again.` : 'Loading …' }));
  onwait(null);
  try {
    desk = await Desk.open(api, seat, number, showState, onwait);
  } catch (error) {
    head(number, null);
    card('The session cannot be annotated', sentence(error.message));
    document.body.dataset.ready = 'refused';
    return;
  }
  desk.marks.addEventListener('dropped', event => showDropped(event.detail));
  head(number, desk);
  main.replaceChildren(desk.element);
  desk.begin();
  document.body.dataset.ready = seat.kind;
  document.body.dataset.session = String(number);
}

function head(number, open_) {
  const choice = h('select', { 'aria-label': 'Session', onchange: event => open(Number(event.target.value)) },
    seat.sessions.map(([name, begun], k) => h('option', { value: k, selected: k === number, text: begun ? `${name} (begun)` : name })));
  bar.className = seat.kind;
  bar.replaceChildren(h('h1', { text: seat.kind === 'adjudicator' ? `Adjudication: ${seat.name}` : `Annotation: ${seat.name}` }), choice, saved,
    ...(open_ ? [open_.undo, open_.redo, button('Keys', { glyph: 'help', key: '?', run: () => open_.keys.show(), class: 'soft' })] : []));
}

function showState({ waiting, trouble, refused, preAnnotated }) {
  const edits = `${waiting} ${waiting === 1 ? 'edit waits' : 'edits wait'}`;
  saved.textContent = refused ? `${sentence(refused)}. Reload the page.`
    : trouble ? `Not saved: ${trouble}. ${edits}; the page tries again.`
      : waiting ? 'Saving …' : `Saved${preAnnotated ? ' · began with suggestions' : ''}`;
  document.body.dataset.saved = String(!waiting && !refused);
}

/** Names edits that were not saved, until the person has read it. */
function showDropped({ reason, names }) {
  dropped.replaceChildren(...dropped.querySelectorAll('p, ul'),
    h('p', { text: `${sentence(reason)}. Not saved:` }), h('ul', {}, names.map(name => h('li', { text: name }))),
    h('button', { type: 'button', onclick: () => dropped.replaceChildren() }, 'Close'));
}
