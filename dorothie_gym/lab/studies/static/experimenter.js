// Page of the experimenter of a study: people who wait, rooms, and the seat of the experimenter in one of them.

import { button, clock, h, rebuild } from '/static/dom.js';
import { openSeat } from '/console/seat_page.js';
import { passes, post } from './requests.js';

const PERIOD = 2000;  // between two looks [ms]
const ROLES = { participant: 'Participant', co_wizard: 'Co-Wizard', ad_wizard: 'Ad-Wizard' };
const STAGES = { consent: 'consent', before: 'questionnaire before', instructions: 'instructions', tutorial: 'practice drive', lobby: 'waiting room', session: 'session', after_session: 'questionnaire after a session', after: 'questionnaire after', debriefing: 'debriefing', done: 'finished' };
const main = document.getElementById('main'), bar = document.getElementById('bar');
const counts = h('p', {}), people = h('ul', { class: 'people' }), made = h('p', { class: 'made', role: 'status' }), waiting = h('ul', {}), rooms = h('div', { class: 'rooms' });
let seated = false;

async function start() {
  const token = location.hash.slice(1);
  try {
    const { view } = token ? await post('experimenter/enter', { token }) : await post('experimenter/overview', {});
    history.replaceState(null, '', location.pathname);  // the token does not stay in the address
    open(view);
  } catch (error) {
    const again = passes(error);
    const text = again ? 'The server does not answer. This page tries again.' : error.message;
    main.replaceChildren(h('div', { class: 'card' }, h('h1', { text: 'Experimenter' }), h('p', { text })));
    if (again) setTimeout(start, PERIOD);
  }
}

function open(view) {
  document.title = `Experimenter – ${view.title}`;
  bar.className = 'experimenter';
  bar.replaceChildren(h('h1', { text: view.title }), h('span', { class: 'state', role: 'status' }));
  main.replaceChildren(h('div', { class: 'sheet' }, h('article', { class: 'text' },
    h('h2', { text: 'People' }), counts, back(), h('h2', { text: 'Waiting room' }), waiting, h('h2', { text: 'Rooms' }), rooms)));
  show(view);
  setTimeout(look, PERIOD);
}

/** People by number, and links for those who cannot go on in their browser. */
function back() {
  const given = h('input', { id: 'person', type: 'text', autocomplete: 'off', maxlength: 2000 });
  const form = h('form', { class: 'row', onsubmit: event => { event.preventDefault(); if (given.value.trim()) readmit(given.value.trim()); } },
    h('label', { for: 'person', text: 'Number, or id of the recruiting platform' }), given, h('button', { type: 'submit', text: 'Make a link' }));
  return h('details', {}, h('summary', { text: 'Somebody cannot go on' }),
    h('p', { text: 'A person whose browser has lost its cookie, or who has changed to another one, goes on by a link. It works once; the old browser is then shut out.' }), form, made, people);
}

async function readmit(participant) {
  try {
    const { token } = (await post('experimenter/readmit', { participant })).view;
    const link = `${location.origin}/#${token}`;
    made.replaceChildren(`Link for ${participant}: `, h('code', { text: link }), ' ', button('Copy', { class: 'soft', run: () => navigator.clipboard.writeText(link) }));
  } catch (error) { made.textContent = error.status ? error.message : 'The server does not answer. Please try again in a moment.'; }
}

async function look() {
  if (seated) return;
  try {
    show((await post('experimenter/overview', {})).view);
    bar.querySelector('.state').textContent = '';
  } catch (error) {
    if (error.status === 401) return location.reload();
    bar.querySelector('.state').textContent = 'The server does not answer. This page tries again.';
  }
  setTimeout(look, PERIOD);
}

function show(view) {
  if (seated) return;
  const stages = Object.keys(STAGES).filter(stage => view.stages[stage]).map(stage => `${STAGES[stage]}: ${view.stages[stage]}`);
  rebuild(counts, stages, () => [stages.join(', ') || 'Nobody has opened the link yet.']);
  rebuild(people, view.people, () => view.people.map(person =>
    h('li', {}, `${person.id}, ${STAGES[person.stage]}${person.present ? '' : ' (away)'} `, button('Make a link', { class: 'soft', run: () => readmit(person.id), 'data-id': person.id, 'aria-label': `Make a link for ${person.id}` }))));
  rebuild(waiting, view.waiting, () => (view.waiting.length ? view.waiting : [null]).map(person =>
    h('li', { text: person ? `${person.id}, ${ROLES[person.role]}, for ${clock(person.seconds)}` : 'Nobody is waiting.' })));
  rebuild(rooms, view.rooms, () => (view.rooms.length ? view.rooms.map(room) : [h('p', { text: 'No room is open.' })]));
}

function room({ session, condition, state, seconds, people, token }) {
  const name = session ?? `Practice of ${people[0].id}`;
  return h('section', { class: 'room', 'aria-label': name },
    h('p', {}, h('strong', { text: name }), condition ? ` ${condition}` : '', `: ${state}, ${clock(seconds)}`,
      h('small', { text: people.map(each => `${ROLES[each.role]} ${each.id}${each.present ? '' : ' (away)'}`).join(', ') })),
    token ? button('Watch and control', { run: () => sit(token), 'data-id': name, 'aria-label': `Watch and control ${name}` }) : null);
}

/** Takes the seat of the experimenter in a room, with pause, messages and end. */
function sit(token) {
  const back = () => location.reload();  // the seat's listeners go
  seated = true;
  openSeat(token, { then: { label: 'All rooms', run: back }, tools: [button('All rooms', { class: 'soft', run: back })], onFinal: why => { if (why === 'unknown') { back(); return true; } return false; } });
}

start();
