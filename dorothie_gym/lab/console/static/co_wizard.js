// Seat of the Co-Wizard: map with what it knows, actions, beliefs, talk.

import { button, clock, h, icon, notice, panel, rebuild, words } from '/static/dom.js';
import { Hints } from './hints.js';
import { COLOURS, MapView } from '/static/map.js';
import { PinLinks, zoomButtons } from './pins.js';
import { Speech } from './speech.js';
import { NEAR, rule, StopSign } from './stops.js';
import { Talk } from './talk.js';
import { toldPlaces } from './told.js';
import { Windscreen } from './windscreen.js';

const QUICK = ['Okay.', 'Where would you like to go?', 'Which way?', 'Is it on this street?', 'Are we there?', 'Turning left.', 'Turning right.', 'I have to turn around.', 'Sorry, could you say that again?'];
const MOTION = { driving: 'Driving', stopped: 'Stopped', waiting: 'Waiting for a turn', hazard: 'Braking for a hazard' };
const PREPARED = { JTurn: 'Turn', UTurn: 'U-turn', LaneSwitch: 'Lane change', LaneFollow: 'Follow lane' };
const ACTIONS = [
  ['LaneFollow', 'Follow lane', 'lane', 'f', {}],
  ['LaneSwitch', 'Lane left', 'left', 'q', { angle: 90 }],
  ['LaneSwitch', 'Lane right', 'right', 'e', { angle: -90 }],
  ['UTurn', 'U-turn', 'uturn', 'u', {}],
  ['Stop', 'Stop', 'stop', 's', {}],
  ['Start', 'Go', 'go', 'g', {}],
  ['SpeedChange', 'Faster', 'faster', 'ArrowUp', { up: true }],
  ['SpeedChange', 'Slower', 'slower', 'ArrowDown', { up: false }],
];

/** Names a turn by its angle [degrees, positive left]. */
export function turnName(angle) {
  const size = Math.abs(angle);
  if (size < 20) return 'straight on';
  if (size > 160) return 'back';
  return `${size < 50 ? 'slightly ' : size > 115 ? 'sharply ' : ''}${angle > 0 ? 'left' : 'right'}`;
}

const kindOf = key => key.split('#')[0];

export class CoWizardPage {
  constructor(link, keys) {
    this.link = link;
    this.forget();
    this.mode = null;
    this.windscreen = new Windscreen(link, { rate: 5, stops: () => this.stops() });
    this.talk = new Talk(link, { own: 'co_wizard', quick: QUICK, keys, alt: true });
    this.speech = new Speech(link, this.talk, keys);
    this.canvas = h('canvas', { 'aria-label': 'Map with what the car knows; press a mode below it, then click' });
    this.map = new MapView(this.canvas, { onclick: (at, reach) => this.click(at, reach) });
    this.map.layers.push((ink, px) => this.paintPlan(ink, px));
    this.status = h('dl', { class: 'status' });
    this.sign = new StopSign({ drives: true });
    this.rule = h('p', { class: 'rule' });
    this.hints = new Hints([
      ['You do not know the errands. Ask your passenger where to go: press Alt 2, or Enter and type.', () => this.talk.list.querySelector('.line.own:not(.waiting)')],
      ['The car follows its lane. Choose where it turns at the next junction: keys 1 to 8.', () => this.driven],
      ['Near a place, press S so that the car stands in the ring beside the pin; G goes on.', () => false],
    ]);
    this.talk.element.querySelector('h2').after(this.hints.element);
    this.exits = h('div', { class: 'exits', role: 'group', 'aria-label': 'Turns at the next junction' });
    this.buttons = ACTIONS.map(([action, label, glyph, key, more]) => {
      const made = button(label, { glyph, key, run: () => this.drive(action, more) });
      made.dataset.action = action;
      keys.add(key, label, () => made.click());
      return made;
    });
    this.lights = button('Lights', { glyph: 'lights', key: 'l', run: () => this.drive('LightChange', { up: !this.state?.lights }) });
    this.lights.dataset.action = 'LightChange';
    keys.add('l', 'Head lights on or off', () => this.lights.click());
    for (let k = 1; k <= 8; k++) keys.add(String(k), `Turn number ${k} at the next junction`, () => this.exits.children[k - 1]?.click());
    this.asked = h('ol', { class: 'asked' });
    this.noteRows = h('ul', { class: 'notes' });
    this.links = new PinLinks(this.map, this.noteRows, 'Place');
    this.element = h('div', { class: 'page co_wizard' },
      h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas, this.links.element, this.status, this.sign.element, this.windscreen.element, this.modes(keys)),
      h('div', { class: 'controls' },
        panel('Next junction', { class: 'turns' }, this.exits),
        this.askedPanel = panel('Asked for', { class: 'way', hidden: true }, this.asked),
        panel('Driving', { class: 'driving' }, h('div', { class: 'grid' }, this.buttons, this.lights), this.rule),
        this.notes(keys)),
      this.talk.element);
    keys.add('v', 'View through the windscreen on or off', () => this.windscreen.turn(!this.windscreen.on));
  }

  // --- beliefs ------------------------------------------------------------------------------------------------------

  modes(keys) {
    const rows = [['goal', 'Goal', 'flag', 'o', 'Click the places that you drive to'], ['mark', 'Mark place', 'pin', 'k', 'Choose a place in the notes, then click where it is'], ['plan', 'Plan', 'route', 'p', 'Click the junctions of the way, in order']];
    this.modeButtons = rows.map(([mode, label, glyph, key, hint]) => {
      const made = button(label, { glyph, key, title: hint, 'aria-pressed': 'false', run: () => this.setMode(this.mode === mode ? null : mode) });
      made.dataset.mode = mode;
      keys.add(key, `${label}: ${hint.toLowerCase()}`, () => made.click());
      return made;
    });
    this.clearPlan = button('Clear plan', { glyph: 'cross', key: 'c', run: () => this.sendPlan([]) });
    keys.add('c', 'Clear the plan', () => this.sendPlan([]));
    keys.add('Escape', 'Leave the mode', () => this.setMode(null));
    this.hint = h('p', { class: 'hint', 'aria-live': 'polite' });
    return h('div', { class: 'tools' }, h('div', { class: 'modes', role: 'group', 'aria-label': 'Clicks on the map' }, this.modeButtons, this.clearPlan), this.hint, zoomButtons(this.map));
  }

  notes(keys) {
    keys.add('n', 'Go to the notes', () => this.noteRows.querySelector('button, select')?.focus());
    const other = button('Other change of belief', { key: 'b', class: 'soft', run: () => this.link.command('other') });
    keys.add('b', 'Note another change of what you believe', () => other.click());
    return panel('Notes', { class: 'beliefs' }, this.noteRows, other);
  }

  setMode(mode) {
    this.mode = mode;
    for (const each of this.modeButtons) each.setAttribute('aria-pressed', String(each.dataset.mode === mode));
    const chosen = this.marked ? `Click where the ${words(this.marked)} is.` : 'Choose a place in the notes, then click where it is.';
    this.hint.textContent = { goal: 'Click the places that you drive to; again to remove one.', mark: chosen, plan: 'Click the junctions of your way, in order; the last one again to remove it.' }[mode] ?? '';
    this.canvas.classList.toggle('armed', Boolean(mode));
  }

  click([x, y], reach) {
    if (this.mode === 'goal') {
      const near = (this.state.landmarks ?? []).map(([, lx, ly], k) => [Math.hypot(lx - x, ly - 1.5 * reach - y), k]).filter(([d]) => d < 2.2 * reach).sort((a, b) => a[0] - b[0])[0];
      if (near) this.toggleGoal(this.keyOf(near[1])); else notice('There is no known place; click a pin.');
    } else if (this.mode === 'mark') {
      if (!this.marked) { notice('Choose a place in the notes first.'); return; }
      this.link.command('mark', { landmark: this.marked, x, y });
      this.setMode(null);
    } else if (this.mode === 'plan') {
      const junctions = this.map.town.junctions.map(([jx, jy], k) => [Math.hypot(jx / 10 - x, jy / 10 - y), k]).sort((a, b) => a[0] - b[0]);
      if (junctions[0][0] > Math.max(25, 2 * reach)) { notice('There is no junction; click the middle of one.'); return; }
      const [, junction] = junctions[0];
      this.sendPlan(this.plan.at(-1) === junction ? this.plan.slice(0, -1) : [...this.plan, junction]);
    }
  }

  sendPlan(plan) { this.plan = plan; this.link.command('plan', { junctions: plan }); }

  // Notes are kept for each pin; the car knows kinds of places only, so that two houses are one goal to it.

  /** Returns the key of the notes on a pin: the landmark, with its number among those of its kind if there are several. */
  keyOf(pin) {
    const landmarks = this.state.landmarks ?? [], name = landmarks[pin][0], same = landmarks.flatMap(([other], k) => (other === name ? [k] : []));
    return same.length > 1 ? `${name}#${same.indexOf(pin)}` : name;
  }

  toggleGoal(key) {
    this.goals = this.goals.includes(key) ? this.goals.filter(other => other !== key) : [...this.goals, key];
    this.link.command('goal', { landmarks: [...new Set(this.goals.map(kindOf))] });
    this.showNotes();
  }

  setStatus(key, status) {
    this.statuses[key] = status;
    if (status) this.link.command('status', { landmark: kindOf(key), status });
    this.showNotes();
  }

  /** Takes lines of the talk: places that the passenger has named are told. */
  hear(entries) {
    const before = this.heard.length;
    for (const entry of entries) if (entry.who === 'participant' && entry.places) this.heard.push(entry);
    if (this.heard.length > before) this.showNotes();
  }

  /** Returns the rows of the notes: what was told first, in the order of telling. */
  rowsOfNotes() {
    const { vocabulary, streets } = this.link.hello, landmarks = this.state?.landmarks ?? [], told = toldPlaces(this.heard, landmarks, streets, vocabulary.several);
    const known = landmarks.map(([name, , , label], pin) => ({ key: this.keyOf(pin), name, label, pin, told: told.get(pin) }));
    const missing = vocabulary.landmarks.filter(name => !landmarks.some(([other]) => other === name)).map(name => ({ key: name, name, label: words(name), pin: null, told: told.get(name) }));
    return [...known, ...missing].sort((a, b) => (a.told?.number ?? 1e9) - (b.told?.number ?? 1e9));
  }

  showNotes() {
    const rows = this.rowsOfNotes();
    this.markPins(rows);
    rebuild(this.noteRows, [rows, this.goals, this.statuses, this.marked], () => rows.map(row => this.note(row)));
  }

  note({ key, name, label, pin, told }) {
    const quote = told ? h('small', { class: 'quote', text: `${told.sure ? '' : 'perhaps: '}“${told.text}” ${clock(told.t)}` }) : null;
    const title = pin === null ? h('span', { text: label }) : h('button', { type: 'button', class: 'where', 'data-id': `pin-${key}`, title: 'Show it on the map' }, told ? h('b', { text: told.mark }) : null, label);
    return h('li', { class: told ? 'told' : '', ...(pin !== null && { 'data-pin': String(pin) }) },
      h('button', { type: 'button', class: 'goal', 'data-id': `goal-${key}`, 'aria-pressed': String(this.goals.includes(key)), title: 'Goal', 'aria-label': `Goal: ${label}`, onclick: () => this.toggleGoal(key) }, icon('flag')),
      h('div', {}, title, pin === null ? h('small', { text: ' not on the map' }) : null),
      h('button', { type: 'button', class: 'mark', 'data-id': `mark-${key}`, 'aria-pressed': String(this.marked === name), title: 'Mark where it is', 'aria-label': `Mark the place of ${label}`, onclick: () => { this.marked = name; this.setMode('mark'); this.showNotes(); this.canvas.focus(); } }, icon('pin')),
      h('select', { 'aria-label': `State of ${label}`, 'data-id': `status-${key}`, onchange: event => this.setStatus(key, event.target.value) },
        h('option', { value: '', text: 'state' }), this.link.hello.vocabulary.statuses.map(status => h('option', { value: status, text: status.toLowerCase(), selected: this.statuses[key] === status }))), quote);
  }

  markPins(rows) {
    const marks = new Map();
    for (const { key, pin, told } of rows) {
      const goal = this.goals.includes(key), status = this.statuses[key]?.toLowerCase();
      if (pin === null || !(told || goal || status)) continue;
      const open = !['complete', 'abandoned'].includes(status);
      marks.set(pin, { text: told?.mark ?? '', colour: COLOURS[status] ?? (goal ? COLOURS.ongoing : COLOURS.pending), open, next: open });
    }
    this.map.mark(marks);
  }

  /** Returns the stopping places near the car: of goals and told places, if any are near, or else of all places on its map. */
  stops() {
    const { landmarks = [], pose } = this.link.state;
    if (!pose) return [];
    const near = landmarks.map(([, , , name, x, y], pin) => ({ name, x, y, mark: this.map.marks.get(pin), colour: this.map.marks.get(pin)?.colour ?? COLOURS.none }))
      .filter(({ x, y }) => Math.hypot(x - pose[0], y - pose[1]) <= NEAR);
    const wanted = near.filter(({ mark }) => mark?.open);
    return wanted.length ? wanted : near.filter(({ mark }) => !mark);
  }

  paintPlan(ink, px) {
    if (!this.plan.length || !this.map.town) return;
    const at = this.plan.map(k => this.map.town.junctions[k].map(v => v / 10));
    ink.beginPath(); at.forEach(([x, y], k) => (k ? ink.lineTo(x, y) : ink.moveTo(x, y)));
    ink.strokeStyle = COLOURS.plan; ink.lineWidth = 3 * px; ink.setLineDash([8 * px, 6 * px]); ink.stroke(); ink.setLineDash([]);
    at.forEach(([x, y], k) => {
      ink.beginPath(); ink.arc(x, y, 10 * px, 0, 7); ink.fillStyle = COLOURS.plan; ink.fill(); ink.strokeStyle = '#ffffff'; ink.lineWidth = 2 * px; ink.stroke();
      ink.font = `700 ${11 * px}px system-ui, "DejaVu Sans", sans-serif`; ink.textAlign = 'center'; ink.textBaseline = 'middle'; ink.fillStyle = '#ffffff'; ink.fillText(String(k + 1), x, y);
    });
  }

  // --- driving ------------------------------------------------------------------------------------------------------

  drive(action, more) { this.driven = true; this.link.command('drive', { action, ...more }); }

  forget() { Object.assign(this, { plan: [], goals: [], statuses: {}, marked: null, heard: [], driven: false }); }

  begin(hello) {
    this.speech.begin(hello);
    this.forget();
    this.map.within = hello.stop.within;
    this.rule.textContent = `${rule(hello)} Notes neither steer nor stop it; before a goal it slows down.`;
    this.windscreen.begin();
    this.setMode(null);
  }

  update(state, fields) {
    this.state = state;
    if (fields.feasible) for (const each of [...this.buttons, this.lights]) each.setAttribute('aria-disabled', String(!state.feasible.includes(each.dataset.action)));
    if ('lights' in fields) this.lights.setAttribute('aria-pressed', String(state.lights));
    if (fields.exits || 'manoeuvre' in fields) this.showExits(state);
    if (fields.landmarks) this.showNotes();
    if (fields.asked) this.showAsked(state.asked);
    this.showStatus(state);
    this.sign.update(state, this.stops().filter(({ mark }) => mark), this.link.hello.stop);
    this.hints.update(state);
  }

  /** Shows the steps that the passenger has asked for and that wait for their place. */
  showAsked(steps) {
    this.askedPanel.hidden = !steps.length;
    rebuild(this.asked, steps, () => steps.map((words, k) => h('li', { text: words, 'aria-current': k ? null : 'step' })));
  }

  showExits({ exits, manoeuvre, feasible }) {
    const { streets } = this.link.hello, possible = feasible?.includes('JTurn');
    rebuild(this.exits, [exits.map(([angle, , street]) => [angle, street]), manoeuvre, possible], () => exits.length
      ? exits.map(([angle, , street], k) => button(streets[street] || 'unnamed road', {
        glyph: 'arrow', turn: -angle, key: String(k + 1), run: () => this.drive('JTurn', { angle }), 'data-id': `exit-${k}`,
        'aria-pressed': String(manoeuvre?.[0] === 'JTurn' && manoeuvre[1] === angle),
        'aria-label': `${turnName(angle)} into ${streets[street] || 'an unnamed road'}, ${angle} degrees`,
      })).map((made, k) => { made.querySelector('.label').append(h('small', { text: `${turnName(exits[k][0])} · ${exits[k][0]}°` })); return made; })
      : [h('p', { class: 'hint', text: 'No junction ahead.' })]);
  }

  showStatus(state) {
    const uncertain = state.covariance ? 2 * Math.sqrt(Math.max(state.covariance[0], state.covariance[1])) : 0;
    const next = state.exits?.[0], { streets } = this.link.hello;
    const rows = [
      ['Speed', `${Math.round(state.speed ?? 0)} km/h`], ['Cruise', `${state.cruise ?? 0} km/h`],
      ['State', `${MOTION[state.motion] ?? ''}${state.hazard ? `: ${words(state.hazard[0]).toLowerCase()}, ${state.hazard[1]} m` : ''}`],
      ['Prepared', state.manoeuvre ? `${PREPARED[state.manoeuvre[0]] ?? words(state.manoeuvre[0])}${state.manoeuvre[0] === 'JTurn' ? ` ${turnName(state.manoeuvre[1])}` : ''}` : '–'],
      ['Junction', next ? `in ${next[1]} m` : '–'], ['Position', uncertain > 3 ? `± ${uncertain.toFixed(0)} m` : 'exact'], ['Sight', `${state.sight ?? 0} m`],
    ];
    rebuild(this.status, rows, () => rows.map(([name, value]) => h('div', { class: (name === 'State' && state.hazard) || (name === 'Position' && uncertain > 3) ? 'alert' : '' }, h('dt', { text: name }), h('dd', { text: value }))));
  }
}
