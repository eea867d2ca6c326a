// Start of the page: the seat of the link's secret, the sessions, and the desk of the open session.

import { button, h, notice } from '/static/dom.js';
import { Api } from './api.js';
import { Desk } from './desk.js';
import { sentence } from './marks.js';

const main = document.getElementById('main'), bar = document.getElementById('bar');
const token = location.hash.slice(1);
let api = null, seat = null, desk = null, saved = null;

if (!token) card('dorothie_gym annotation', 'Open your link. It ends in # and a secret, which belongs to the link.');
else start();

function card(title, ...lines) {
  main.replaceChildren(h('div', { class: 'card' }, h('h1', { text: title }), lines.map(line => (typeof line === 'string' ? h('p', { text: line }) : line))));
}

async function start() {
  api = new Api(token);
  try { seat = await api.json('seat'); } catch (error) { card('No connection', sentence(error.message)); return; }
  document.title = `${seat.name} – dorothie_gym annotation`;
  const wanted = Number(new URLSearchParams(location.search).get('session') ?? 0);
  await open(Number.isInteger(wanted) && wanted >= 0 && wanted < seat.sessions.length ? wanted : 0);
}

async function open(number) {
  desk?.close();
  saved = h('p', { class: 'state', role: 'status' });
  document.body.dataset.ready = '';
  main.replaceChildren(h('p', { class: 'card', text: 'Loading …' }));
  try {
    desk = await Desk.open(api, seat, number, state => showState(state));
  } catch (error) {
    head(number, null);
    card('The session cannot be annotated', sentence(error.message));
    document.body.dataset.ready = 'refused';
    return;
  }
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

function showState({ waiting, lost, pre }) {
  saved.textContent = lost ? 'Not saved: reload the page' : waiting ? 'Saving …' : `Saved${pre ? ' · began with suggestions' : ''}`;
  document.body.dataset.saved = String(!waiting && !lost);
  if (lost) notice('The marks could not be loaded. Reload the page.', 'error');
}
