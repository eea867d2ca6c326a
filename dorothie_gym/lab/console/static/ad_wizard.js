// Seat of the Ad-Wizard: the world from above, weather, props and actors by clicks, faults, changes of the task.

import { button, h, icon, notice, panel, rebuild, words } from '/static/dom.js';
import { errandMarks } from './errands.js';
import { MapView } from '/static/map.js';
import { PinLinks, where, zoomButtons } from './pins.js';
import { Talk } from './talk.js';

const FAULTS = { blur: 'Blurred view', gps: 'No position (GPS)', view: 'No view' };
const CHANGES = { trigger: 'Add', delete: 'Drop', change: 'Change' };
const SHOWN_WEATHER = ['fog_density', 'precipitation', 'sun_altitude_angle', 'cloudiness', 'wetness', 'wind_intensity'];
const PRESETS = [
  ['Clear noon', { fog_density: 2, precipitation: 0, cloudiness: 5, sun_altitude_angle: 45, wetness: 0 }], ['Dense fog', { fog_density: 80, cloudiness: 60 }],
  ['Heavy rain', { precipitation: 90, cloudiness: 90, wetness: 80 }], ['Night', { sun_altitude_angle: -40 }],
];

export class AdWizardPage {
  constructor(link, keys) {
    Object.assign(this, { link, tool: null, count: 4, moving: null, drafts: new Map() });
    this.talk = new Talk(link, { acts: false, names: { ad_wizard: 'You, to the participant' } });
    this.canvas = h('canvas', { 'aria-label': 'The world from above; choose a tool, then click' });
    this.map = new MapView(this.canvas, { onclick: (at, reach) => this.click(at, reach) });
    this.hint = h('p', { class: 'hint', 'aria-live': 'polite' });
    this.tools = h('div', { class: 'props', role: 'group', 'aria-label': 'Props and actors' });
    this.weather = h('div', { class: 'sliders' });
    this.faults = h('div', { class: 'grid' });
    this.tasks = h('ul', { class: 'tasks editable' });
    this.links = new PinLinks(this.map, this.tasks, 'Errand');
    this.placed = h('ul', { class: 'placed' });
    this.message = h('input', { type: 'text', maxlength: '300', 'aria-label': 'Message to the participant', placeholder: 'Message to the participant …' });
    const form = h('form', { class: 'say', onsubmit: event => { event.preventDefault(); this.sendMessage(); } }, this.message, h('button', { type: 'submit', class: 'primary', 'aria-label': 'Send the message' }, icon('send')));
    const parts = [
      ['w', panel('Weather', { class: 'weather' }, h('div', { class: 'presets', role: 'group', 'aria-label': 'Kinds of weather' }, PRESETS.map(([label, values]) => button(label, { class: 'soft', run: () => this.preset(values) }))), this.weather)],
      ['r', panel('Road', { class: 'road' }, this.tools, this.hint, this.placed)],
      ['x', panel('Faults of the sensors', {}, this.faults)],
      ['t', panel('Errands', { class: 'errands' }, this.tasks)],
      ['m', panel('Message', {}, form)],
    ];
    for (const [key, part] of parts) keys.add(key, `Go to “${part.querySelector('h2').textContent}”`, () => part.querySelector('button, input')?.focus());
    keys.add('Escape', 'Put the tool down', () => this.take(null));
    this.element = h('div', { class: 'page ad_wizard' },
      h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas, this.links.element, h('div', { class: 'tools' }, zoomButtons(this.map))),
      h('div', { class: 'controls' }, parts.map(([, part]) => part)), this.talk.element);
  }

  begin(hello) {
    this.map.scale = 2.6;
    this.map.within = hello.stop.within;
    this.drafts.clear();
    const { vocabulary } = this.link.hello;
    const made = [...vocabulary.props.map(kind => [kind, words(kind), { prop: kind }]), ['vehicles', 'Vehicles', { what: 'vehicles' }], ['pedestrians', 'Pedestrians', { what: 'pedestrians' }]];
    this.tools.replaceChildren(...made.map(([id, label, tool]) => { const one = button(label, { 'aria-pressed': 'false', run: () => this.take(this.tool?.id === id ? null : { id, label, ...tool }) }); one.dataset.tool = id; return one; }),
      h('label', { class: 'count' }, 'Number', h('input', { type: 'number', min: '1', max: '16', value: String(this.count), onchange: event => { this.count = Math.min(16, Math.max(1, Number(event.target.value) || 1)); } })));
    this.sliders = new Map(SHOWN_WEATHER.map(name => [name, this.slider(vocabulary.weather.find(([other]) => other === name))]));
    this.weather.replaceChildren(...[...this.sliders.values()].map(each => each.row));
    this.switches = new Map(vocabulary.sensors.map(sensor => [sensor, button(FAULTS[sensor] ?? sensor, { 'aria-pressed': 'false', run: () => this.link.command('fault', { sensor, on: !this.state.faults.includes(sensor) }) })]));
    this.faults.replaceChildren(...this.switches.values());
  }

  slider([name, low, high, unit]) {
    const output = h('output', {}), shown = value => `${Math.round(value)} ${unit === 'degrees' ? '°' : unit}`;
    const input = h('input', { type: 'range', min: '0', max: '100', 'aria-label': words(name.replaceAll('_', ' ')), oninput: () => { output.value = shown(low + (high - low) * input.value / 100); },
      onchange: () => this.link.command('weather', { parameter: name, share: Number(input.value) / 100 }) });
    return { row: h('label', {}, h('span', { text: name.replaceAll('_', ' ') }), input, output), low, high,
      set: share => { if (document.activeElement !== input) input.value = String(Math.round(100 * share)); output.value = shown(low + (high - low) * share); } };
  }

  preset(values) {
    const { vocabulary } = this.link.hello;
    for (const [name, value] of Object.entries(values)) {
      const [, low, high] = vocabulary.weather.find(([other]) => other === name);
      const share = Math.round(100 * (value - low) / (high - low)) / 100;
      if (Math.abs(share - this.state.weather[name]) > 0.006) this.link.command('weather', { parameter: name, share });
    }
  }

  take(tool) {
    this.tool = tool; this.moving = null;
    for (const one of this.tools.querySelectorAll('[data-tool]')) one.setAttribute('aria-pressed', String(one.dataset.tool === tool?.id));
    this.hint.textContent = tool ? `Click on a road of the map to place: ${tool.label.toLowerCase()}.` : '';
    this.canvas.classList.toggle('armed', Boolean(tool));
    if (tool) this.canvas.focus();
  }

  click([x, y]) {
    if (this.moving !== null) { this.link.command('move', { item: this.moving, x, y }); this.moving = null; this.hint.textContent = ''; this.canvas.classList.remove('armed'); }
    else if (this.tool?.prop) this.link.command('prop', { prop: this.tool.prop, x, y });
    else if (this.tool?.what) this.link.command('spawn', { what: this.tool.what, x, y, count: this.count });
    else notice('Choose a prop or actors first.');
  }

  sendMessage() {
    const text = this.message.value.trim();
    if (!text) return;
    this.link.command('message', { text });
    this.message.value = '';
  }

  update(state, fields) {
    this.state = state;
    if (fields.weather) for (const [name, each] of this.sliders) each.set(state.weather[name]);
    if (fields.faults) for (const [sensor, each] of this.switches) each.setAttribute('aria-pressed', String(state.faults.includes(sensor)));
    if (fields.tasks || fields.landmarks) this.showTasks(state);
    if (fields.props) this.showProps(state);
  }

  showProps({ props }) {
    rebuild(this.placed, props, () => props.map(([kind], item) => h('li', {}, h('span', { text: words(kind) }),
      button('Move', { class: 'soft', 'data-id': `move-${item}`, run: () => { this.take(null); this.moving = item; this.hint.textContent = 'Click the new place on the map.'; this.canvas.classList.add('armed'); this.canvas.focus(); } }),
      button('Remove', { class: 'soft', 'data-id': `remove-${item}`, run: () => this.link.command('remove', { item }) }))));
  }

  showTasks({ tasks, landmarks }) {
    this.map.mark(errandMarks(tasks));
    rebuild(this.tasks, [tasks, landmarks], () => tasks.map((task, k) => h('li', { class: task.live || task.status === 'abandoned' ? task.status : 'untold', 'data-pin': String(task.landmark) },
      h('p', {}, h('span', {}, task.text, where(task, k, landmarks)), h('small', { text: task.live ? task.status : task.status === 'abandoned' ? 'dropped' : 'not yet' })),
      task.may.map(change => h('form', { class: 'change', onsubmit: event => { event.preventDefault(); const text = event.target.elements.text.value.trim(); this.link.command('task', { change, item: task.item, message: text }); } },
        h('input', { name: 'text', type: 'text', maxlength: '300', value: this.drafts.get(`${change}-${task.item}`) ?? task.messages[change], 'data-id': `text-${change}-${task.item}`, oninput: event => this.drafts.set(`${change}-${task.item}`, event.target.value), 'aria-label': `Message with which the participant learns it: ${CHANGES[change]} “${task.text}”`, placeholder: 'Message to the participant' }),
        h('button', { type: 'submit', 'data-id': `${change}-${task.item}`, title: change === 'change' ? task.after_change : '', text: CHANGES[change] }))))));
  }
}
