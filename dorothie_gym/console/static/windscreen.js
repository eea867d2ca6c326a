// View through the windscreen: a stream of pictures, which can be turned off.

import { h, icon } from './dom.js';

export class Windscreen {
  constructor(link, { rate = 10 } = {}) {
    Object.assign(this, { link, wanted: rate, frames: 0 });
    this.canvas = h('canvas', { width: '480', height: '270', role: 'img', 'aria-label': 'View through the windscreen' });
    this.note = h('p', { class: 'note', text: 'The view is being prepared …' });
    this.toggle = h('button', { type: 'button', class: 'round', 'aria-pressed': 'true', 'aria-label': 'View through the windscreen', title: 'Turn the view on or off', onclick: () => this.turn(!this.on) }, icon('eye'));
    this.element = h('div', { class: 'windscreen' }, this.canvas, this.note, this.toggle);
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
    this.frames++;
    this.note.hidden = true;
  }
}
