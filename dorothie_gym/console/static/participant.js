// Seat of the participant: story, errands, map with all places, view through the windscreen, talk.

import { h, icon, panel, rebuild } from './dom.js';
import { MapView } from './map.js';
import { Speech } from './speech.js';
import { Talk } from './talk.js';
import { Windscreen } from './windscreen.js';

const QUICK = ['Okay.', 'Yes.', 'No.', 'Turn left.', 'Turn right.', 'Straight ahead.', 'Stop here, please.', 'You can go.', 'What did you say?'];
const MARKS = { complete: 'check', ongoing: 'dot', pending: 'clock', abandoned: 'cross' };
const STATES = { complete: 'done', ongoing: 'next', pending: 'later', abandoned: 'dropped' };

export class ParticipantPage {
  constructor(link, keys) {
    this.windscreen = new Windscreen(link);
    this.talk = new Talk(link, { own: 'participant', quick: QUICK, keys });
    this.speech = new Speech(link, this.talk, keys);
    this.canvas = h('canvas', { 'aria-label': 'Map of the town with all places' });
    this.map = new MapView(this.canvas);
    this.story = h('p', { class: 'story' });
    this.tasks = h('ol', { class: 'tasks' });
    this.speed = h('output', { 'aria-label': 'Speed' });
    this.texts = new Map();
    const errands = panel('Your errands', { class: 'errands', tabindex: '0' }, this.story, this.tasks);
    this.element = h('div', { class: 'page participant' },
      h('div', { class: 'front' }, this.windscreen.element, h('div', { class: 'gauge' }, this.speed, h('span', { text: 'km/h' }))),
      errands, h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas), this.talk.element);
    keys.add('v', 'View through the windscreen on or off', () => this.windscreen.turn(!this.windscreen.on));
    keys.add('m', 'Map: whole town, or follow the car', () => (this.map.follow ? this.map.overview() : Object.assign(this.map, { follow: true, scale: 3 })));
    keys.add('e', 'Go to the errands', () => errands.querySelector('h2').scrollIntoView());
  }

  begin(hello) {
    this.speech.begin(hello);
    this.story.textContent = hello.story;
    this.windscreen.begin();
    this.map.scale = 2.4;
  }

  update(state, fields) {
    if ('speed' in fields) this.speed.value = Math.round(state.speed);
    if (fields.tasks) this.showTasks(state);
  }

  showTasks({ tasks, landmarks }) {
    for (const task of tasks) if (task.text) this.texts.set(task.item, task.text);
    rebuild(this.tasks, tasks, () => tasks.map(task => h('li', { class: task.status },
      icon(MARKS[task.status] ?? 'dot'), h('span', { text: this.texts.get(task.item) ?? landmarks[task.landmark]?.[0] ?? '' }),
      h('small', { text: STATES[task.status] ?? task.status }))));
  }
}
