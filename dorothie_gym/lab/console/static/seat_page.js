// Page of a seat: connection, state of the session, end.

import { AdWizardPage } from './ad_wizard.js';
import { CoWizardPage } from './co_wizard.js';
import { button, clock, h, notice, sentence } from '/static/dom.js';
import { ExperimenterPage } from './experimenter.js';
import { Keys } from '/static/keys.js';
import { Link } from './link.js';
import { ParticipantPage } from './participant.js';
import { rule } from './stops.js';

const TITLES = { participant: 'Participant', co_wizard: 'Co-Wizard', ad_wizard: 'Ad-Wizard', experimenter: 'Experimenter', spectator: 'Spectator' };
const REASONS = {
  arrived: 'The destination was reached.', 'out of time': 'The time is up.', left: 'The session ended because somebody left.', ended: 'The experimenter ended the session.', technical: 'The session ended for a technical reason.',
};
const FINAL = {
  failed: 'The program failed. What was recorded ends at the last decision.',
  refused: 'The server refused the connection.', unknown: 'This link leads to no seat. It may be of an earlier server: ask for a new one.', 'too fast': 'This page sent too many messages.',
};

const main = document.getElementById('main'), bar = document.getElementById('bar');
const time = h('time', { class: 'clock', text: '0:00' }), state = h('p', { class: 'state', role: 'status' }), net = h('span', { class: 'net' });
let page = null, keys = null, seat = null, extras = [], next = {}, names = {};

/**
 * Opens the seat of a token in this page.
 * @param then button of the page that is shown at the end, and what it does; null for "Next session".
 * @param tools further elements of the bar.
 * @param away what happens next while somebody else is away, or this browser (`lost`, `others`); sentences.
 * @param title name of the browser's tab; null for that of the seat.
 * @param over heading of the end.
 * @param onFinal called with the reason if the connection has ended for good; shows it if it returns nothing.
 */
export function openSeat(token, { then = null, tools = [], away = {}, title = null, over = 'The session is over', onFinal = null } = {}) {
  extras = tools;
  names = { title, over };
  next = away;
  const link = new Link(token);
  window.consoleLink = link;  // for measurements
  link.on('hello', hello => greet(link, hello)).on('frame', change => update(link, change, then))
    .on('refused', ({ reason }) => notice(reason, 'error'))
    .on('pong', ({ c }) => { net.textContent = `${Math.round(performance.now() - c)} ms`; })
    .on('lost', () => {
      if (next.lost && !document.body.classList.contains('lost')) notice(next.lost, 'error');
      net.textContent = 'reconnecting …'; document.body.classList.add('lost');
    })
    .on('final', why => { if (!onFinal?.(why)) finish(link, why); });
  link.connect();
}

async function greet(link, hello) {
  document.body.classList.remove('lost');
  if (!page || seat !== hello.seat) build(link, hello);
  page.talk.clear();
  page.begin(hello);
  keys.note = rule(hello);
  document.querySelector('.over')?.remove();
  if (page.map.town?.name !== hello.town) {
    const answer = await fetch(`/towns/${encodeURIComponent(hello.town)}.json`);
    page.map.setTown({ ...await answer.json(), name: hello.town }, hello.streets);
  } else { page.map.names = hello.streets; page.map.base = null; }
  document.body.classList.toggle('left-hand', hello.traffic === 'left');
  document.body.dataset.ready = hello.seat;
}

function build(link, hello) {
  seat = hello.seat;
  document.title = names.title ?? `${TITLES[seat]} – dorothie_gym`;
  keys = new Keys();
  page = { participant: () => new ParticipantPage(link, keys), co_wizard: () => new CoWizardPage(link, keys), ad_wizard: () => new AdWizardPage(link, keys),
    experimenter: () => new ExperimenterPage(link, keys, { controls: true }), spectator: () => new ExperimenterPage(link, keys, { controls: false }) }[seat]();
  bar.className = seat;
  bar.replaceChildren(h('h1', { text: TITLES[seat] }), time, state, net, button('Keys', { glyph: 'help', key: '?', run: () => keys.show(), class: 'soft' }), ...extras);
  main.replaceChildren(page.element);
}

function update(link, { fields, talk, events, refused }, then) {
  const { state: now } = link;
  page.map.update(now);
  page.update(now, fields);
  page.talk.state(now);
  if (talk) { page.talk.add(talk); page.hear?.(talk); }
  if (events) page.addEvents?.(events);
  if (refused) for (const reason of refused) notice(sentence(reason), 'error');
  if ('time' in fields) time.textContent = clock(now.time);
  if ('state' in fields || 'why' in fields) showState(now);
  if (fields.outcome) showOutcome(link, now.outcome, then);
}

function showState({ state: now, why }) {
  const text = { waiting: 'Waiting for the others', running: '', over: 'Over' }[now] ?? (why === 'experimenter' ? 'Paused by the experimenter' : `Paused: somebody is away. ${next.others ?? ''}`.trim());
  state.textContent = text;
  document.body.dataset.state = now;
}

function showOutcome(link, outcome, then) {
  document.querySelector('.over')?.remove();
  const { subgoals } = outcome;
  const box = h('section', { class: 'over card', 'aria-labelledby': 'over-title' }, h('h2', { id: 'over-title', tabindex: '-1', text: outcome.success ? 'All errands are done' : names.over }),
    h('p', { text: REASONS[outcome.reason] ?? outcome.reason }),
    h('p', { text: `${subgoals.reached} of ${subgoals.live} errands in ${clock(outcome.seconds)}.` }),
    then ? button(then.label, { glyph: 'go', class: 'primary', run: then.run })
      : seat === 'spectator' || !link.hello.repeatable ? null : button('Next session', { glyph: 'go', class: 'primary', run: () => link.send({ k: 'control', act: 'again' }) }));
  main.append(box);
  box.querySelector('h2').focus();
}

function finish(link, why) {
  document.body.classList.remove('lost');
  const card = why === 'replaced'
    ? h('div', { class: 'card' }, h('h2', { text: 'This seat was opened in another window' }), h('p', { text: 'What you see there goes on. You can also take the seat back.' }), button('Use it here', { class: 'primary', run: () => { card.remove(); link.connect(); } }))
    : h('div', { class: 'card' }, h('h2', { text: 'No connection' }), h('p', { text: FINAL[why] }),
      ['refused', 'too fast'].includes(why) ? button('Load again', { class: 'primary', run: () => location.reload() }) : null);
  card.classList.add('over');
  main.append(card);
  card.querySelector('button')?.focus();
}
