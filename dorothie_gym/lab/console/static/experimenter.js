// Seats of the experimenter and of spectators: the true state of everything, and the control of the session.

import { button, clock, h, icon, panel, rebuild, words } from '/static/dom.js';
import { errandMarks, nextStops } from './errands.js';
import { MapView } from '/static/map.js';
import { PinLinks, where } from './pins.js';
import { Talk } from './talk.js';
import { Windscreen } from './windscreen.js';

const NAMES = { participant: 'Participant', co_wizard: 'Co-Wizard', ad_wizard: 'Ad-Wizard', agent: 'Car' };
const BY = { person: 'a person', policy: 'a policy', nobody: 'nobody' };

export class ExperimenterPage {
  constructor(link, keys, { controls }) {
    Object.assign(this, { link, controls });
    this.windscreen = new Windscreen(link, { rate: 5, stops: () => nextStops(link.state, this.map.marks) });
    this.talk = new Talk(link, { names: { co_wizard: 'Co-Wizard', ad_wizard: 'Ad-Wizard, to the participant' } });
    this.canvas = h('canvas', { 'aria-label': 'Map with the true state of the world' });
    this.map = new MapView(this.canvas);
    this.facts = h('dl', { class: 'status' });
    this.events = h('div', { class: 'events', role: 'log', 'aria-label': 'Events', tabindex: '0' });
    this.tasks = h('ol', { class: 'tasks' });
    this.links = new PinLinks(this.map, this.tasks, 'Errand');
    this.seats = h('ul', { class: 'seats' });
    this.element = h('div', { class: 'page experimenter' },
      h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas, this.links.element, this.facts, this.windscreen.element),
      h('div', { class: 'controls' }, controls ? this.panelOfControls(keys) : null, panel('Errands', { class: 'errands' }, this.tasks), panel('Events', { class: 'log' }, this.events)),
      this.talk.element);
    keys.add('v', 'View through the windscreen on or off', () => this.windscreen.turn(!this.windscreen.on));
    keys.add('m', 'Map: whole town, or follow the car', () => (this.map.follow ? this.map.overview() : Object.assign(this.map, { follow: true, scale: 3 })));
  }

  panelOfControls(keys) {
    this.start = button('Start', { glyph: 'go', key: 's', run: () => this.control('start') });
    this.pause = button('Pause', { glyph: 'pause', key: 'p', run: () => this.control(this.held ? 'resume' : 'pause') });
    this.end = button('End', { glyph: 'stop', key: null, run: () => { if (confirm('End the session for everybody?')) this.control('end'); } });
    keys.add('s', 'Start without waiting', () => this.start.click());
    keys.add('p', 'Pause or resume', () => this.pause.click());
    this.text = h('input', { type: 'text', maxlength: '400', 'aria-label': 'Message to all seats', placeholder: 'Message to all seats …' });
    return panel('Session', { class: 'session' }, this.seats, h('div', { class: 'grid' }, this.start, this.pause, this.end),
      h('form', { class: 'say', onsubmit: event => { event.preventDefault(); const text = this.text.value.trim(); if (text) { this.link.send({ k: 'announce', text }); this.text.value = ''; } } }, this.text, h('button', { type: 'submit', class: 'primary', 'aria-label': 'Send to all seats' }, icon('send'))));
  }

  control(act) { this.link.send({ k: 'control', act }); }

  begin(hello) { this.map.scale = 2.6; this.map.within = hello.stop.within; this.events.replaceChildren(); this.windscreen.begin(); }

  update(state, fields) {
    if (this.controls) {
      this.held = state.why === 'experimenter';
      this.pause.querySelector('.label').textContent = this.held ? 'Resume' : 'Pause';
      this.start.hidden = state.state !== 'waiting';
      if (fields.seats) rebuild(this.seats, state.seats, () => state.seats.map(({ role, plan, present, by }) => h('li', { class: by }, h('b', { text: NAMES[role] }), h('span', { text: plan }), h('small', { text: `${present ? 'connected, ' : ''}played by ${BY[by]}` }))));
    }
    if (fields.tasks || fields.landmarks) this.showTasks(state);
    const rows = [['Time', clock(state.time ?? 0)], ['Speed', `${Math.round(state.speed ?? 0)} km/h`], ['Goals', state.goals?.map(words).join(', ') || '–'], ['Faults', state.faults?.join(', ') || 'none'], ['Fog', `${Math.round(100 * (state.weather?.fog_density ?? 0))} %`]];
    rebuild(this.facts, rows, () => rows.map(([name, value]) => h('div', {}, h('dt', { text: name }), h('dd', { text: value }))));
  }

  showTasks({ tasks, landmarks }) {
    this.map.mark(errandMarks(tasks));
    rebuild(this.tasks, [tasks, landmarks], () => tasks.map((task, k) => h('li', { class: task.live || task.status === 'abandoned' ? task.status : 'untold', 'data-pin': String(task.landmark) },
      h('div', {}, h('span', { text: task.text }), where(task, k, landmarks)), h('small', { text: task.live ? task.status : task.status === 'abandoned' ? 'dropped' : 'not yet' }))));
  }

  addEvents(events) {
    for (const { t, type, role, text } of events) {
      this.events.append(h('div', { class: type }, h('time', { text: clock(t) }), h('b', { text: words(type) }), ` ${NAMES[role] ?? role}: ${text}`));
    }
    while (this.events.children.length > 300) this.events.firstChild.remove();
    this.events.scrollTop = this.events.scrollHeight;
  }
}
