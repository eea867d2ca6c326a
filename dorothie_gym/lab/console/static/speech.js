// Speech at a seat: hold to talk, the recognised words as typed ones, and what others say spoken aloud.

import { button, h, notice } from '/static/dom.js';

const RATE = 16000, LONGEST = 30;

export class Speech {
  /** Adds its controls to the talk when the server offers speech. */
  constructor(link, talk, keys) {
    Object.assign(this, { link, talk, keys, on: false, parts: null, lines: 0, queue: Promise.resolve() });
    const add = talk.add.bind(talk), clear = talk.clear.bind(talk);
    talk.clear = () => { clear(); this.lines = 0; this.live = false; };
    talk.add = entries => { add(entries); this.hear(entries); };
    link.on('frame', () => { this.live = true; });  // what was said before the first frame stays silent
  }

  begin(hello) {
    if (!hello.speech || this.on) return;
    this.on = true;
    this.hold = button('Hold to talk', { glyph: 'microphone', key: 't', class: 'hold', 'aria-pressed': 'false' });
    this.atOnce = h('input', { type: 'checkbox', id: 'at-once' });
    this.aloud = h('input', { type: 'checkbox', id: 'aloud', onchange: () => { if (this.aloud.checked) this.context().resume(); } });
    const press = event => { event.preventDefault(); this.start(); }, release = () => this.stop();
    this.hold.addEventListener('pointerdown', press);
    for (const over of ['pointerup', 'pointercancel', 'pointerleave']) this.hold.addEventListener(over, release);
    this.hold.addEventListener('keydown', event => { if (!event.repeat && (event.key === ' ' || event.key === 'Enter')) press(event); });
    this.hold.addEventListener('keyup', event => { if (event.key === ' ' || event.key === 'Enter') release(); });
    this.hold.addEventListener('blur', release);
    this.keys.add('t', 'Start to talk; again: end', () => (this.parts ? this.stop() : this.start()));
    this.talk.element.append(h('div', { class: 'speech', role: 'group', 'aria-label': 'Speech' }, this.hold,
      h('label', { for: 'at-once' }, this.atOnce, ' Say at once'), h('label', { for: 'aloud' }, this.aloud, ' Hear the talk')));
  }

  context() { return (this.audio ??= new AudioContext({ sampleRate: RATE })); }

  // --- microphone ---------------------------------------------------------------------------------------------------

  async start() {
    if (this.parts) return;
    const parts = this.parts = [];
    this.hold.setAttribute('aria-pressed', 'true');
    try {
      const context = this.context();
      await context.resume();
      this.ready ??= context.audioWorklet.addModule('/console/microphone.js');
      await this.ready;
      this.stream = await navigator.mediaDevices.getUserMedia({ audio: { channelCount: 1, echoCancellation: true, noiseSuppression: false } });
    } catch (error) {
      this.parts = null;
      this.release();
      return notice(`The microphone cannot be used: ${error.message}`, 'error');
    }
    if (this.parts !== parts) return this.release();  // let go before the microphone was there
    this.source = this.context().createMediaStreamSource(this.stream);
    this.node = new AudioWorkletNode(this.context(), 'microphone');
    this.node.port.onmessage = ({ data }) => { if (this.parts === parts) parts.push(data); };
    this.source.connect(this.node);
    this.timer = setTimeout(() => this.stop(), LONGEST * 1000 - 500);
  }

  release() {
    clearTimeout(this.timer);
    this.source?.disconnect();
    this.stream?.getTracks().forEach(track => track.stop());
    this.source = this.stream = this.node = null;
    this.hold.setAttribute('aria-pressed', 'false');
  }

  async stop() {
    const parts = this.parts;
    if (!parts) return;
    this.parts = null;
    this.release();
    const samples = parts.flatMap(part => [...part]);
    if (!samples.length) return;
    const pcm = new DataView(new ArrayBuffer(2 * samples.length));
    samples.forEach((value, k) => pcm.setInt16(2 * k, Math.max(-1, Math.min(1, value)) * 32767, true));
    const answer = await this.ask('/speech/heard', { method: 'POST', body: pcm.buffer });
    if (!answer) return;
    const { text, audio } = await answer.json();
    if (!text) return notice('Nothing was understood. Say it again, or type it.', 'error');
    this.take(text, audio);
  }

  /** Puts recognised words where typed ones stand, or says them at once. */
  take(text, audio) {
    const { talk } = this;
    const before = talk.input.value.trim();
    talk.input.value = before && !this.atOnce.checked ? `${before} ${text}` : text;
    talk.changed();
    talk.recorded = audio;
    if (this.atOnce.checked) talk.say(talk.input.value); else talk.input.focus();
  }

  // --- voices -------------------------------------------------------------------------------------------------------

  hear(entries) {
    entries.forEach(({ who }, k) => { if (this.live && this.aloud?.checked && who !== this.talk.own && who !== 'ad_wizard' && who !== 'experimenter') this.speak(this.lines + k); });
    this.lines += entries.length;
  }

  speak(line) {
    this.queue = this.queue.then(async () => {
      const answer = await this.ask(`/speech/said/${line}`);
      if (!answer) return;
      const source = this.context().createBufferSource();
      source.buffer = await this.context().decodeAudioData(await answer.arrayBuffer());
      source.connect(this.context().destination);
      await new Promise(done => { source.onended = done; source.start(); });
      this.spoken = (this.spoken ?? 0) + 1;
    }).catch(error => notice(`The voice cannot be played: ${error.message}`, 'error'));
  }

  /** Returns the answer of the server, or shows why there is none. */
  async ask(path, options = {}) {
    try {
      const answer = await fetch(path, { ...options, headers: { Authorization: `Bearer ${this.link.token}` } });
      if (answer.ok) return answer;
      notice(await answer.text(), 'error');
    } catch { notice('The server does not answer.', 'error'); }
    return null;
  }
}
