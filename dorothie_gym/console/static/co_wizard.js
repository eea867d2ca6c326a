// Seat of the Co-Wizard: map with what it knows, actions, beliefs, talk.

import { button, h, icon, notice, panel, rebuild, words } from './dom.js';
import { COLOURS, MapView } from './map.js';
import { Speech } from './speech.js';
import { Talk } from './talk.js';
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

export class CoWizardPage {
  constructor(link, keys) {
    Object.assign(this, { link, mode: null, plan: [], goals: [], statuses: {}, marked: null });
    this.windscreen = new Windscreen(link, { rate: 5 });
    this.talk = new Talk(link, { own: 'co_wizard', quick: QUICK, keys, alt: true });
    this.speech = new Speech(link, this.talk, keys);
    this.canvas = h('canvas', { 'aria-label': 'Map with what the car knows; press a mode below it, then click' });
    this.map = new MapView(this.canvas, { onclick: (at, reach) => this.click(at, reach) });
    this.map.layers.push((ink, px) => this.paintPlan(ink, px));
    this.status = h('dl', { class: 'status' });
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
    this.element = h('div', { class: 'page co_wizard' },
      h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas, this.status, this.windscreen.element, this.modes(keys)),
      h('div', { class: 'controls' },
        panel('Next junction', { class: 'turns' }, this.exits),
        panel('Driving', { class: 'driving' }, h('div', { class: 'grid' }, this.buttons, this.lights)),
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
    const zoom = h('div', { class: 'zoom', role: 'group', 'aria-label': 'Map' },
      h('button', { type: 'button', class: 'round', 'aria-label': 'Zoom in', onclick: () => this.map.zoom(1.4) }, icon('plus')),
      h('button', { type: 'button', class: 'round', 'aria-label': 'Zoom out', onclick: () => this.map.zoom(1 / 1.4) }, icon('minus')),
      h('button', { type: 'button', class: 'round', 'aria-label': 'Follow the car', onclick: () => { this.map.follow = true; } }, icon('target')));
    return h('div', { class: 'tools' }, h('div', { class: 'modes', role: 'group', 'aria-label': 'Clicks on the map' }, this.modeButtons, this.clearPlan), this.hint, zoom);
  }

  notes(keys) {
    this.noteRows = h('ul', { class: 'notes' });
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
      const near = (this.state.landmarks ?? []).map(([name, lx, ly]) => [Math.hypot(lx - x, ly - 1.5 * reach - y), name]).filter(([d]) => d < 2.2 * reach).sort((a, b) => a[0] - b[0])[0];
      if (near) this.toggleGoal(near[1]); else notice('There is no known place; click a pin.');
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

  toggleGoal(name) {
    this.goals = this.goals.includes(name) ? this.goals.filter(other => other !== name) : [...this.goals, name];
    this.map.goals = this.goals;
    this.link.command('goal', { landmarks: this.goals });
    this.showNotes();
  }

  showNotes() {
    const { vocabulary } = this.link.hello, known = new Set((this.state.landmarks ?? []).map(([name]) => name));
    rebuild(this.noteRows, [[...known], this.goals, this.statuses, this.marked], () => vocabulary.landmarks.map(name => h('li', {},
      h('button', { type: 'button', class: 'goal', 'data-id': `goal-${name}`, 'aria-pressed': String(this.goals.includes(name)), title: 'Goal', 'aria-label': `Goal: ${words(name)}`, onclick: () => this.toggleGoal(name) }, icon('flag')),
      h('span', { text: words(name) }, known.has(name) ? null : h('small', { text: ' not on the map' })),
      h('button', { type: 'button', class: 'mark', 'data-id': `mark-${name}`, 'aria-pressed': String(this.marked === name), title: 'Mark where it is', 'aria-label': `Mark the place of ${words(name)}`, onclick: () => { this.marked = name; this.setMode('mark'); this.showNotes(); this.canvas.focus(); } }, icon('pin')),
      h('select', { 'aria-label': `State of ${words(name)}`, 'data-id': `status-${name}`, onchange: event => { this.statuses[name] = event.target.value; if (event.target.value) this.link.command('status', { landmark: name, status: event.target.value }); } },
        h('option', { value: '', text: 'state' }), vocabulary.statuses.map(status => h('option', { value: status, text: status.toLowerCase(), selected: this.statuses[name] === status }))))));
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

  drive(action, more) { this.link.command('drive', { action, ...more }); }

  begin(hello) { this.speech.begin(hello); Object.assign(this, { plan: [], goals: [], statuses: {}, marked: null }); this.map.goals = []; this.windscreen.begin(); this.setMode(null); }

  update(state, fields) {
    this.state = state;
    if (fields.feasible) for (const each of [...this.buttons, this.lights]) each.setAttribute('aria-disabled', String(!state.feasible.includes(each.dataset.action)));
    if ('lights' in fields) this.lights.setAttribute('aria-pressed', String(state.lights));
    if (fields.exits || 'manoeuvre' in fields) this.showExits(state);
    if (fields.landmarks) this.showNotes();
    this.showStatus(state);
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
