// Page of a participant: shows the stage that the server names, from consent to completion code.

import { button, h, notice } from '/static/dom.js';
import { openSeat } from '/console/seat_page.js';
import { Questionnaire, forgetDrafts } from './forms.js';
import { prose } from './prose.js';
import { passes, post } from './requests.js';

const RETRY = 2000;  // [ms]
const main = document.getElementById('main'), bar = document.getElementById('bar');
let tag = '', shown = '', seated = false, asking = null, acting = null, over = false, contact = '', joined = 0;

// --- server ----------------------------------------------------------------------------------------------------------

const pause = time => new Promise(done => setTimeout(done, time));

/** Waits before the next try; pages that were refused together do not come back together. */
const before = error => pause(Math.max(RETRY, error.wait || 0) * (0.75 + Math.random() / 2));

/** Shows in the bar, also of a seat, that there is no connection and what happens next; null: there is one. */
function lost(text) {
  document.body.classList.toggle('lost', text !== null);
  const line = bar.querySelector('.state');
  if (line && !seated) line.textContent = text ?? '';
}

/** Sends what the participant did until the server has answered, and shows what follows; no news are asked for meanwhile. */
async function act(name, body) {
  if (acting) return;
  asking?.abort();
  acting = send(name, body);
  await acting;
  acting = null;
}

async function send(name, body) {
  for (let tries = 0; !over; tries++) {
    try {
      show(await post(name, body));
      return lost(null);
    } catch (error) {
      if (error.status === 401) return name === 'withdraw' && tries ? gone('You have withdrawn.') : unknown(error);
      if (!passes(error)) {
        tag = shown = error.status === 409 ? '' : tag;
        if (!tries) notice(error.message, 'error');  // else the first try had arrived, and only its answer was lost
        return lost(null);
      }
      if (!tries) notice(`${error.status ? error.message : 'There is no connection to the server.'} This page tries again by itself; nothing is lost.`, 'error');
      lost('No connection – trying again');
      await before(error);
    }
  }
}

/** Asks for news for as long as the page is open; the server answers when something has changed. */
async function follow() {
  while (!over) {
    await acting;
    if (over) return;
    asking = new AbortController();
    try {
      show(await post('news', { have: tag }, asking.signal));
      lost(null);
    } catch (error) {
      if (error.name === 'AbortError') continue;
      if (error.status === 401) return unknown(error);
      lost('No connection – trying again');
      await before(error);
    }
  }
}

/** Goes on for a person whom the server does not know (any more). */
function unknown(error) {
  if (document.body.dataset.stage !== 'consent') return gone(error.message);
  if (Date.now() - joined < 5000) return gone('Your browser does not keep the cookie of this page. Allow cookies for it, and open your link again.');
  location.reload();  // it was open for long and nothing was agreed to: the person begins anew by the same link
}

// --- entrance --------------------------------------------------------------------------------------------------------

/** Values of this tab that survive a reload. */
const kept = {
  get(name) { return JSON.parse(sessionStorage.getItem(`study-${name}`) ?? 'null'); },
  set(name, value) { sessionStorage.setItem(`study-${name}`, JSON.stringify(value)); },
};

/** Returns the link with which this tab was opened; neither ids nor invitations stay in the address. */
function link() {
  const parameters = Object.fromEntries(new URLSearchParams(location.search)), invitation = /^#([\w-]{22})$/.exec(location.hash)?.[1];
  if (Object.keys(parameters).length || invitation || !kept.get('link')) {
    const visit = Array.from(crypto.getRandomValues(new Uint8Array(16)), byte => byte.toString(16).padStart(2, '0')).join('');
    sessionStorage.clear();
    kept.set('link', { parameters, visit, ...(invitation && { invitation }) });
  }
  history.replaceState(null, '', location.pathname);
  return kept.get('link');
}

async function start() {
  const given = link(), farewell = kept.get('farewell');
  if (farewell) return gone(farewell.text, farewell);
  for (let refused = 0; ;) {
    try {
      const entered = await post('join', given);
      joined = Date.now();
      show(entered);
      return follow();
    } catch (error) {
      if (passes(error)) wait(error.status ? 'Many people are coming in at this moment.' : 'The server does not answer.');
      else if (refused++) return gone(error.message, { keep: false });  // another tab may have just come in with the same link
      await before(error);
    }
  }
}

const wait = text => main.replaceChildren(h('p', { class: 'card', role: 'status', text: `${text} This page tries again by itself; please leave it open.` }));

// --- stages ----------------------------------------------------------------------------------------------------------

function show({ view, newTag }) {
  tag = newTag;
  if (view.gone) return gone(view.gone, view);
  ({ contact } = view);
  const { stage } = view, key = JSON.stringify([stage, view.part, view.in_vain, view.token, view.over && !seated]);
  if (key === shown || over) return;
  if (seated && (stage !== document.body.dataset.stage || view.token !== seated)) return location.reload();  // the seat's listeners go
  shown = key;
  if (seated) return;
  document.body.dataset.stage = stage;
  document.title = view.title;
  if (!view.items) forgetDrafts();
  STAGES[stage](view);
}

/** Shows a page of text with a heading, which gets the focus. */
function page(view, heading, ...children) {
  bar.className = 'study';
  bar.replaceChildren(h('h1', { text: view.title }), h('span', { class: 'state', role: 'status' }), h('span', { class: 'number', title: 'Your number in this study', text: view.id }), ...(view.stage === 'consent' ? [] : [withdrawal(view.code)]));
  const title = h('h2', { tabindex: '-1', text: heading });
  main.replaceChildren(h('div', { class: 'sheet' }, h('article', { class: 'text' }, title, ...children.flat())));
  title.focus();
  main.firstChild.scrollTop = 0;
}

const next = (label, run) => h('p', {}, button(label, { class: 'primary', run }));
/** Ends a stage; the second click of a double one, which began on the page before, does nothing. */
const proceed = (stage, more = {}) => event => { if (!(event?.detail > 1)) act('proceed', { stage, ...more }); };

const STAGES = {
  consent(view) {
    const boxes = view.statements.map((text, k) => h('label', { class: 'statement', for: `statement-${k}` }, h('input', { type: 'checkbox', id: `statement-${k}` }), h('span', { text })));
    const wrong = h('p', { class: 'wrong', role: 'alert' });
    const form = h('form', { class: 'questions', onsubmit: event => {
      event.preventDefault();
      const agreed = boxes.map(box => box.firstChild.checked);
      if (agreed.every(Boolean)) act('consent', { agreed });
      else { wrong.textContent = 'Please tick every statement, or choose “I do not take part”.'; boxes[agreed.indexOf(false)].firstChild.focus(); }
    } }, boxes, wrong, h('p', { class: 'row' }, h('button', { type: 'submit', class: 'primary', text: 'I take part' }), button('I do not take part', { run: () => act('consent', { agreed: null }) })));
    page(view, 'Information and consent', prose(view.text), h('p', { class: 'hint', text: `Contact: ${view.contact}` }), form);
  },
  before: view => questions(view, 'Before you begin'),
  after_session: view => questions(view, 'About this drive'),
  after: view => questions(view, 'At the end'),
  instructions(view) {
    const roles = kept.get('roles') ?? [];
    if (roles.at(-1) !== view.part) kept.set('roles', [...roles, view.part]);
    const changed = kept.get('roles').length > 1;  // a partner has left, and somebody else would wait in vain
    page(view, changed ? 'New instructions' : 'Instructions', changed ? h('p', { class: 'changed', text: 'Your role has changed, as somebody has left. Please read these instructions; those before do not hold any more.' }) : null,
      prose(view.text), next('Continue', proceed('instructions', { role: view.part })));
  },
  tutorial(view) {
    const go = button('Start the practice drive', { class: 'primary', run: () => seat(view, view.title, 'The practice drive is over', [button('End practice', { class: 'soft', run: proceed('tutorial') })]) });
    page(view, 'Practice drive', prose(view.text ?? 'In a short practice drive with an automatic partner you can try everything out. It is not recorded.'),
      view.token ? h('p', { class: 'row' }, go, button('Skip it', { run: proceed('tutorial') })) : h('p', { class: 'busy', role: 'status', text: 'The practice drive is being prepared …' }));
  },
  lobby(view) {
    const choice = h('p', { class: 'row' }, button('Go on waiting', { class: 'primary', run: () => act('wait', { on: true }) }), button('Finish now', { run: () => act('wait', { on: false }) }));
    page(view, 'Waiting room', prose(view.text), view.in_vain ? choice : h('p', { class: 'busy', role: 'status', text: 'Waiting …' }));
  },
  session(view) {
    if (view.over) return page(view, 'The session is over', h('p', { text: 'It ended, or it was broken off because somebody left. Either way you go on to the last questions, and get your code.' }), next('Continue', proceed('session')));
    if (view.token) { document.title = `Now: ${view.title}`; return seat(view, document.title, 'The session is over'); }
    page(view, 'Your session is about to begin', h('p', { class: 'busy', role: 'status', text: 'The session is being prepared …' }));
  },
  debriefing: view => page(view, 'Thank you', prose(view.text), h('p', { class: 'hint', text: `Contact: ${view.contact}` }), next('Continue', proceed('debriefing'))),
  done: view => page(view, 'You are finished',
    view.code ? h('p', {}, 'Your completion code: ', h('strong', { class: 'code', text: view.code })) : null,
    view.url ? h('p', {}, h('a', { href: view.url, rel: 'noreferrer', text: 'Go back to the recruiting page' })) : null,
    h('p', {}, 'Your number in the data: ', h('strong', { text: view.id }), '. Keep it if you might want to withdraw later; you can also withdraw here, now.'),
    h('p', { class: 'hint', text: `Contact: ${view.contact}` })),
};

function questions(view, heading) {
  const key = `draft-${view.id}-${view.stage}-${view.part}`;
  forgetDrafts(key);
  const form = new Questionnaire(view.items, key, answers => act('answers', { stage: view.stage, answers }));
  page(view, heading, form.element);
}

/** Takes the seat of a tutorial or session, with the title of the tab and the heading of the end. */
function seat(view, title, heading, tools = []) {
  seated = view.token;
  openSeat(view.token, {
    then: { label: 'Continue', run: proceed(view.stage) }, away: view.away, tools: [...tools, withdrawal()], title, over: heading,
    onFinal: why => {
      if (why === 'unknown' || why === 'refused') { again(); return true; }
      if (why !== 'failed') return false;
      page(view, heading, h('p', { text: 'The program failed. This is not your fault.' }), next('Continue', proceed(view.stage)));
      return true;
    },
  });
}

/** Loads the page again after the seat is gone: the server has restarted, the room was closed, or the connection was refused. */
async function again() {
  await pause(1000);
  await acting;
  if (!over) location.reload();
}

// --- end -------------------------------------------------------------------------------------------------------------

/** @param code completion code on this page, which is gone after the withdrawal. */
function withdrawal(code = '') {
  return button('Withdraw', { class: 'soft', run: () => {
    const dialog = h('dialog', { 'aria-labelledby': 'withdraw-title' }, h('h2', { id: 'withdraw-title', text: 'Withdraw from the study?' }),
      h('p', { text: 'The study ends for you, and everything that was recorded about you is deleted: answers, what you wrote and said, and your number. This cannot be undone.' }),
      code ? h('p', { text: `Note your completion code, ${code}, first: this page will be gone.` }) : null,
      h('p', { class: 'row' }, button('Go on with the study', { class: 'primary', autofocus: true, run: () => dialog.close() }), button('Withdraw and delete', { run: () => { dialog.close(); act('withdraw', { sure: true }); } })));
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  } });
}

/**
 * Ends the page for a person who does not take part; a reload shows the same.
 * @param again whether the person may begin anew.
 * @param keep false if a reload asks the server once more.
 */
function gone(text, { again: anew = false, keep = true } = {}) {
  over = true;
  asking?.abort();
  window.consoleLink?.stop();
  forgetDrafts();
  if (keep) kept.set('farewell', { text, again: anew });
  const restart = () => { sessionStorage.removeItem('study-farewell'); location.reload(); };
  bar.replaceChildren();
  document.body.dataset.stage = 'gone';
  main.replaceChildren(h('div', { class: 'card' }, h('h1', { tabindex: '-1', text: keep ? 'The study is over for you' : 'You cannot go on here' }), prose(text),
    anew || !keep ? button(keep ? 'Begin again' : 'Try again', { run: restart }) : null));
  main.querySelector('h1').focus();
}

start();
