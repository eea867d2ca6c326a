// Page of a participant: shows the stage that the server names, from consent to completion code.

import { button, h, notice } from '/static/dom.js';
import { openSeat } from '/static/seat_page.js';
import { Questionnaire } from './forms.js';
import { prose } from './prose.js';

const RETRY = 2000;  // [ms]
const main = document.getElementById('main'), bar = document.getElementById('bar');
let tag = '', shown = '', seated = false, asking = null, acting = null, over = false;

// --- server ----------------------------------------------------------------------------------------------------------

async function post(name, body, signal) {
  const answer = await fetch(`/study/${name}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body), signal });
  const view = await answer.json();
  if (!answer.ok) throw Object.assign(new Error(view.error), { status: answer.status });
  return { view, newTag: answer.headers.get('ETag') };
}

/** Sends what the participant did, and shows what follows; no news are asked for meanwhile. */
async function act(name, body) {
  if (acting) return;
  asking?.abort();
  acting = send(name, body);
  await acting;
  acting = null;
}

async function send(name, body) {
  try {
    show(await post(name, body));
  } catch (error) {
    if (error.status === 401) return gone('You do not take part in this study any more.');
    notice(error.status ? error.message : 'The server does not answer. Please try again in a moment.', 'error');
    if (error.status === 409) tag = shown = '';
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
      document.body.classList.remove('lost');
    } catch (error) {
      if (error.name === 'AbortError') continue;
      if (error.status === 401) return gone('You do not take part in this study any more.');
      document.body.classList.add('lost');
      await pause(RETRY);
    }
  }
}

const pause = time => new Promise(done => setTimeout(done, time));

async function start() {
  const parameters = Object.fromEntries(new URLSearchParams(location.search)), invitation = location.hash.slice(1) || null;
  for (;;) {
    try {
      const entered = await post('join', { parameters, ...(invitation && { invitation }) });
      history.replaceState(null, '', location.pathname);  // neither the ids nor the invitation stay in the address
      show(entered);
      return follow();
    } catch (error) {
      if (error.status) return gone(error.message);
      main.replaceChildren(h('p', { class: 'card', text: 'The server does not answer. This page tries again.' }));
      await pause(RETRY);
    }
  }
}

// --- stages ----------------------------------------------------------------------------------------------------------

function show({ view, newTag }) {
  tag = newTag;
  if (view.gone) return gone(view.gone);
  const { stage } = view, key = JSON.stringify([stage, view.part, view.in_vain, view.token, view.over && !seated]);
  if (key === shown || over) return;
  if (seated && (stage !== document.body.dataset.stage || view.token !== seated)) return location.reload();  // the seat's listeners go
  shown = key;
  if (seated) return;
  document.body.dataset.stage = stage;
  document.title = view.title;
  STAGES[stage](view);
}

/** Shows a page of text with a heading, which gets the focus. */
function page(view, heading, ...children) {
  bar.className = 'study';
  bar.replaceChildren(h('h1', { text: view.title }), h('span', { class: 'state' }), ...(view.stage === 'consent' ? [] : [withdrawal()]));
  const title = h('h2', { tabindex: '-1', text: heading });
  main.replaceChildren(h('div', { class: 'sheet' }, h('article', { class: 'text' }, title, ...children.flat())));
  title.focus();
  main.firstChild.scrollTop = 0;
}

const next = (label, run) => h('p', {}, button(label, { class: 'primary', run }));
const proceed = stage => () => act('proceed', { stage });

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
  instructions: view => page(view, 'Instructions', prose(view.text), next('Continue', proceed('instructions'))),
  tutorial(view) {
    const go = button('Start the practice drive', { class: 'primary', run: () => seat(view, [button('End practice', { class: 'soft', run: proceed('tutorial') })]) });
    page(view, 'Practice drive', prose(view.text ?? 'In a short practice drive with an automatic partner you can try everything out. It is not recorded.'),
      view.token ? h('p', { class: 'row' }, go, button('Skip it', { run: proceed('tutorial') })) : h('p', { class: 'busy', role: 'status', text: 'The practice drive is being prepared …' }));
  },
  lobby(view) {
    const choice = h('p', { class: 'row' }, button('Go on waiting', { class: 'primary', run: () => act('wait', { on: true }) }), button('Finish now', { run: () => act('wait', { on: false }) }));
    page(view, 'Waiting room', prose(view.text), view.in_vain ? choice : h('p', { class: 'busy', role: 'status', text: 'Waiting …' }));
  },
  session(view) {
    if (view.over) return page(view, 'The session is over', h('p', { text: 'It ended, or it was broken off because somebody left.' }), next('Continue', proceed('session')));
    if (view.token) { document.title = `Now: ${view.title}`; return seat(view, []); }
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
  const form = new Questionnaire(view.items, key, async answers => {
    await act('answers', { stage: view.stage, answers });
    if (document.body.dataset.stage !== view.stage) sessionStorage.removeItem(key);
  });
  page(view, heading, form.element);
}

/** Takes the seat of a tutorial or session. */
function seat(view, tools) {
  seated = view.token;
  openSeat(view.token, {
    then: { label: 'Continue', run: proceed(view.stage) }, tools: [...tools, withdrawal()],
    onFinal: why => {
      if (why === 'unknown') { again(); return true; }
      if (why !== 'failed') return false;
      page(view, 'The session is over', h('p', { text: 'The program failed. This is not your fault.' }), next('Continue', proceed(view.stage)));
      return true;
    },
  });
}

/** Loads the page again after the seat is gone: the server has restarted, or the room was closed. */
async function again() {
  await pause(1000);
  await acting;
  if (!over) location.reload();
}

// --- end -------------------------------------------------------------------------------------------------------------

function withdrawal() {
  return button('Withdraw', { class: 'soft', run: () => {
    const dialog = h('dialog', { 'aria-labelledby': 'withdraw-title' }, h('h2', { id: 'withdraw-title', text: 'Withdraw from the study?' }),
      h('p', { text: 'The study ends for you, and everything that was recorded about you is deleted: answers, what you wrote and said, and your number. This cannot be undone.' }),
      h('p', { class: 'row' }, button('Go on with the study', { class: 'primary', autofocus: true, run: () => dialog.close() }), button('Withdraw and delete', { run: () => { dialog.close(); act('withdraw', { sure: true }); } })));
    dialog.addEventListener('close', () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  } });
}

/** Ends the page for a person who does not take part. */
function gone(text) {
  over = true;
  asking?.abort();
  sessionStorage.clear();
  window.consoleLink?.stop();
  bar.replaceChildren();
  document.body.dataset.stage = 'gone';
  main.replaceChildren(h('div', { class: 'card' }, h('h1', { tabindex: '-1', text: 'The study is over for you' }), prose(text)));
  main.querySelector('h1').focus();
}

start();
