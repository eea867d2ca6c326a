// Seat of the participant: story, errands, map with all places, view through the windscreen, talk.

import { h, icon, panel, rebuild } from '/static/dom.js';
import { errandMarks, nextStops } from './errands.js';
import { Hints } from './hints.js';
import { MapView } from '/static/map.js';
import { PinLinks, where, zoomButtons } from './pins.js';
import { Speech } from './speech.js';
import { rule, StopSign } from './stops.js';
import { Talk } from './talk.js';
import { Windscreen } from './windscreen.js';

const QUICK = ['Okay.', 'Yes.', 'No.', 'Turn left.', 'Turn right.', 'Straight ahead.', 'Stop here, please.', 'You can go.', 'What did you say?'];
const MARKS = { complete: 'check', ongoing: 'dot', pending: 'clock', abandoned: 'cross' };
const STATES = { complete: 'done', ongoing: 'next', pending: 'later', abandoned: 'dropped' };

export class ParticipantPage {
  constructor(link, keys) {
    this.link = link;
    this.windscreen = new Windscreen(link, { stops: () => nextStops(link.state, this.map.marks) });
    this.talk = new Talk(link, { own: 'participant', quick: QUICK, keys });
    this.speech = new Speech(link, this.talk, keys);
    this.canvas = h('canvas', { 'aria-label': 'Map of the town with all places' });
    this.map = new MapView(this.canvas);
    this.story = h('p', { class: 'story' });
    this.tasks = h('ol', { class: 'tasks' });
    this.rule = h('p', { class: 'rule' });
    this.sign = new StopSign();
    this.links = new PinLinks(this.map, this.tasks, 'Errand');
    this.hints = new Hints([
      ['Tell the car in your own words where your first errand is: press Enter, type, and press Enter again. It does not see your errands.', () => this.talk.list.querySelector('.line.own:not(.waiting)')],
      ['The car hears what a recogniser understood, and may ask back. Answer in the same field.', () => this.talk.list.querySelector('.line.co_wizard')],
      ['Point at an errand to see its pin. When the car comes near, tell it where to stop: at the ring beside the pin.', () => false],
    ]);
    this.talk.element.querySelector('h2').after(this.hints.element);
    this.speed = h('output', { 'aria-label': 'Speed' });
    this.texts = new Map();
    const errands = panel('Your errands', { class: 'errands', tabindex: '0' }, this.story, this.tasks, this.rule);
    this.element = h('div', { class: 'page participant' },
      h('div', { class: 'front' }, this.windscreen.element, this.sign.element, h('div', { class: 'gauge' }, this.speed, h('span', { text: 'km/h' }))),
      errands, h('section', { class: 'panel map', 'aria-label': 'Map' }, this.canvas, this.links.element, h('div', { class: 'tools' }, zoomButtons(this.map))), this.talk.element);
    keys.add('v', 'View through the windscreen on or off', () => this.windscreen.turn(!this.windscreen.on));
    keys.add('m', 'Map: whole town, or follow the car', () => (this.map.follow ? this.map.overview() : Object.assign(this.map, { follow: true, scale: 3 })));
    keys.add('e', 'Go to the errands', () => errands.querySelector('h2').scrollIntoView());
  }

  begin(hello) {
    this.speech.begin(hello);
    this.story.textContent = hello.story;
    this.windscreen.begin();
    this.map.scale = 2.4;
    this.map.within = hello.stop.within;
    this.rule.textContent = rule(hello);
  }

  update(state, fields) {
    if ('speed' in fields) this.speed.value = Math.round(state.speed);
    if (fields.tasks || fields.landmarks) this.showTasks(state);
    this.sign.update(state, nextStops(state, this.map.marks), this.link.hello.stop);
    this.hints.update(state);
  }

  showTasks({ tasks, landmarks }) {
    for (const task of tasks) if (task.text) this.texts.set(task.item, task.text);
    this.map.mark(errandMarks(tasks));
    rebuild(this.tasks, [tasks, landmarks], () => tasks.map((task, k) => {
      const place = landmarks[task.landmark]?.[3] ?? '';
      return h('li', { class: task.status, 'data-pin': String(task.landmark) }, icon(MARKS[task.status] ?? 'dot'),
        h('div', {}, h('span', { text: this.texts.get(task.item) ?? place }), where(task, k, landmarks)),
        h('small', { text: STATES[task.status] ?? task.status }));
    }));
  }
}
