// Film of the session: the map as it was recorded, or pictures through the windscreen, with the sound of the talk.

import { button, clock, h } from '/static/dom.js';
import { MapView } from '/static/map.js';

const WINDOW = 300, RATE = 30;  // frames of a window of bodies; frames a second

export class Film extends EventTarget {
  constructor(api, number, page) {
    super();
    Object.assign(this, { api, number, page, time: 0, playing: false, windows: new Map(), sounds: new Map(), mode: page.town ? 'map' : 'none', source: null });
    this.canvas = h('canvas', { class: 'mapcanvas', 'aria-label': `Map of ${page.town}`, role: 'application' });
    this.screen = h('canvas', { class: 'screen', width: 480, height: 270, role: 'img', 'aria-label': 'View through the windscreen', hidden: true });
    this.note = h('p', { class: 'note', role: 'status' });
    this.shown = h('output', { class: 'time', 'aria-label': 'Time' });
    this.play = button('Play', { glyph: 'go', key: ' ', run: () => this.toggle(), class: 'soft' });
    this.view = button('Windscreen', { glyph: 'eye', key: 'b', run: () => this.swap(), class: 'soft' });
    this.element = h('section', { class: 'film', 'aria-label': 'Film' }, h('div', { class: 'picture' }, this.canvas, this.screen, this.note),
      h('div', { class: 'reel' }, this.play, this.view, this.shown));
    if (!page.pictures) this.view.remove();
    if (page.town) this.openMap(); else { this.canvas.remove(); this.note.textContent = 'The map of the town is not known.'; }
    const loop = now => { this.tick(now); this.frame = requestAnimationFrame(loop); };
    this.frame = requestAnimationFrame(loop);
    this.show();
  }

  async openMap() {
    this.map = new MapView(this.canvas);
    this.note.textContent = 'The map is being loaded …';
    const town = await this.api.json(`sessions/${this.number}/town`);
    this.map.setTown({ ...town, name: this.page.town }, this.page.streets);
    this.note.textContent = '';
    this.show();
  }

  close() { cancelAnimationFrame(this.frame); this.silence(); this.element.remove(); }

  // --- time ---------------------------------------------------------------------------------------------------------

  seek(time, { jump = true } = {}) {
    this.time = Math.min(Math.max(0, time), this.page.seconds);
    if (jump) { this.silence(); if (this.map) { this.map.poses = []; this.map.trail = []; this.map.offset = null; } }
    this.show();
    this.dispatchEvent(new Event('time'));
  }

  toggle(play = !this.playing) {
    if (play && this.time >= this.page.seconds - 0.1) this.seek(0);
    this.playing = play;
    this.until = null;
    if (!play) this.silence();
    this.play.querySelector('.label').textContent = play ? 'Pause' : 'Play';
  }

  /** Plays an utterance, with its sound if there is one. */
  playLine(line) {
    this.seek(line.start);
    this.toggle(true);
    this.until = line.end + 0.3;
    if (line.audio.length) this.speak(line);
  }

  tick(now) {
    const passed = Math.min(0.1, (now - (this.last ?? now)) / 1000);
    this.last = now;
    if (!this.playing) return;
    const before = this.time;
    this.seek(before + passed, { jump: false });
    for (const line of this.page.utterances) if (line.audio.length && line.start > before && line.start <= this.time) this.speak(line);
    if (this.time >= Math.min(this.until ?? Infinity, this.page.seconds)) this.toggle(false);
  }

  // --- sound --------------------------------------------------------------------------------------------------------

  async speak(line) {
    this.audio ??= new AudioContext();
    this.silence();
    const order = this.order = (this.order ?? 0) + 1;
    let at = this.audio.currentTime;
    const sources = [];
    for (const name of line.audio) {
      const sound = await this.sound(name);
      if (order !== this.order) return;
      const source = this.audio.createBufferSource();
      source.buffer = sound;
      source.connect(this.audio.destination);
      at = Math.max(at, this.audio.currentTime);
      source.start(at);
      at += sound.duration;
      sources.push(source);
      this.source = sources;
    }
    this.spoken = (this.spoken ?? 0) + 1;
  }

  async sound(name) {
    if (!this.sounds.has(name)) this.sounds.set(name, this.api.ask(`sessions/${this.number}/audio/${encodeURIComponent(name)}`).then(answer => answer.arrayBuffer()).then(content => this.audio.decodeAudioData(content)));
    return this.sounds.get(name);
  }

  silence() { this.order = (this.order ?? 0) + 1; for (const each of this.source ?? []) each.stop(); this.source = null; }

  // --- pictures -----------------------------------------------------------------------------------------------------

  swap() {
    if (!this.page.pictures) return;
    this.mode = this.mode === 'map' ? 'windscreen' : 'map';
    this.screen.hidden = this.mode !== 'windscreen';
    this.canvas.hidden = !this.screen.hidden;
    this.view.querySelector('.label').textContent = this.mode === 'map' ? 'Windscreen' : 'Map';
    this.show();
  }

  show() {
    this.shown.textContent = `${clock(this.time)} / ${clock(this.page.seconds)}`;
    if (this.mode === 'windscreen') this.drawPicture();
    else if (this.map) this.map.update(this.state());
  }

  state() {
    const { poses, landmarks, hidden } = this.page, k = lastAt(poses, this.time), pose = poses[k];
    const next = poses[Math.min(k + 1, poses.length - 1)];
    const share = pose && next[0] > pose[0] ? Math.min(1, Math.max(0, (this.time - pose[0]) / (next[0] - pose[0]))) : 0;
    const turn = pose ? Math.atan2(Math.sin(next[3] - pose[3]), Math.cos(next[3] - pose[3])) : 0;
    return {
      time: this.time, landmarks, hidden, objects: this.bodies(),
      pose: pose && [pose[1] + share * (next[1] - pose[1]), pose[2] + share * (next[2] - pose[2]), pose[3] + share * turn],
    };
  }

  /** Bodies at the present time; a window that is missing is asked for. */
  bodies() {
    const number = Math.floor(this.time * RATE / WINDOW);
    if (!this.windows.has(number)) {
      this.windows.set(number, []);
      this.api.json(`sessions/${this.number}/bodies?frame=${number * WINDOW}`).then(rows => { this.windows.set(number, rows); if (this.map) { this.map.poses = []; this.map.update(this.state()); } }, () => this.windows.delete(number));
    }
    const rows = this.windows.get(number), k = lastAt(rows, this.time);
    return rows[k]?.[1] ?? [];
  }

  async drawPicture() {
    if (this.drawing) { this.again = true; return; }
    this.drawing = true;
    this.note.textContent = this.drawn ? '' : 'The view of the town is being built …';
    try {
      const answer = await this.api.ask(`sessions/${this.number}/picture?frame=${Math.round(this.time * RATE)}`);
      const picture = await createImageBitmap(await answer.blob());
      this.screen.getContext('2d').drawImage(picture, 0, 0);
      this.drawn = (this.drawn ?? 0) + 1;
      this.note.textContent = '';
    } catch (error) { this.note.textContent = error.message; }
    this.drawing = false;
    if (this.again) { this.again = false; setTimeout(() => this.mode === 'windscreen' && this.drawPicture(), 60); }
  }
}

/** Index of the last row whose first value is at most `time`; 0 before the first. */
function lastAt(rows, time) {
  let [low, high] = [0, rows.length - 1];
  while (low < high) { const middle = Math.ceil((low + high) / 2); if (rows[middle][0] <= time) low = middle; else high = middle - 1; }
  return Math.max(0, low);
}
