// View through the windscreen: a stream of pictures, which can be turned off.

import { h, icon } from '/static/dom.js';
import { paintStops } from './stops.js';

export class Windscreen {
  /** @param stops function that returns the stopping places to mark above the picture. */
  constructor(link, { rate = 10, stops = () => [] } = {}) {
    Object.assign(this, { link, wanted: rate, frames: 0, stops });
    this.above = h('canvas', { width: '960', height: '540', 'aria-hidden': 'true' });
    this.canvas = h('canvas', { width: '480', height: '270', role: 'img', 'aria-label': 'View through the windscreen' });
    this.note = h('p', { class: 'note', text: 'The view is being prepared …' });
    this.toggle = h('button', { type: 'button', class: 'round', 'aria-pressed': 'true', 'aria-label': 'View through the windscreen', title: 'Turn the view on or off', onclick: () => this.turn(!this.on) }, icon('eye'));
    this.element = h('div', { class: 'windscreen' }, this.canvas, this.above, this.note, this.toggle);
    link.on('picture', data => this.show(data));
  }

  /** Asks for pictures, after each new connection. */
  begin() {
    this.element.hidden = !this.link.hello.pictures;
    if (this.link.hello.pictures) this.turn(this.on ?? true);
  }

  turn(on) {
    this.on = on;
    this.toggle.setAttribute('aria-pressed', String(on));
    this.element.classList.toggle('off', !on);
    this.note.textContent = on ? 'The view is being prepared …' : 'The view is off.';
    if (!on || !this.frames) this.note.hidden = false;
    this.link.send({ k: 'view', rate: on ? this.wanted : 0 });
  }

  async show(data) {
    if (!this.on) return;
    const picture = await createImageBitmap(new Blob([data], { type: 'image/jpeg' }));
    if (this.canvas.width !== picture.width) { this.canvas.width = picture.width; this.canvas.height = picture.height; }
    this.canvas.getContext('2d').drawImage(picture, 0, 0);
    picture.close();
    this.mark();
    this.frames++;
    this.note.hidden = true;
  }

  /** Marks the stopping places for people, above the picture of the camera. */
  mark() {
    const { hello, state } = this.link, { width, height } = this.canvas;
    if (this.above.width !== 2 * width || this.above.height !== 2 * height) { this.above.width = 2 * width; this.above.height = 2 * height; }
    if (state.pose) paintStops(this.above.getContext('2d'), state.pose, this.stops(), hello.camera, hello.stop.within);
  }
}
