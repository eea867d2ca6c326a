// Connection to the server: joins a seat, merges changed fields into the state, connects again after a loss.

const FINAL = { 4400: 'refused', 4404: 'unknown', 4409: 'replaced', 4429: 'too fast', 4500: 'failed' };

export class Link extends EventTarget {
  constructor(token) {
    super();
    Object.assign(this, { token, state: {}, hello: null, number: 0, wait: 250, delays: [], gaps: [], waiting: new Map() });
  }

  connect() {
    this.socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.socket.send(JSON.stringify({ k: 'join', token: this.token }));
    this.socket.onmessage = event => (typeof event.data === 'string' ? this.read(JSON.parse(event.data)) : this.emit('picture', event.data));
    this.socket.onclose = event => this.closed(event.code);
  }

  closed(code) {
    clearInterval(this.pinging);
    if (this.stopped) return;
    if (FINAL[code]) return this.emit('final', FINAL[code]);
    this.emit('lost');
    setTimeout(() => this.connect(), this.wait);
    this.wait = Math.min(4000, this.wait * 1.6);
  }

  /** Ends the connection for good. */
  stop() { this.stopped = true; this.socket?.close(); }

  read(message) {
    if (message.k === 'hello') {
      this.hello = message; this.state = {}; this.number = 0; this.wait = 250; this.waiting.clear();
      clearInterval(this.pinging);
      this.pinging = setInterval(() => this.send({ k: 'ping', c: performance.now() }), 2000);
      this.emit('hello', message);
    } else if (message.k === 'frame') {
      const now = performance.now();
      if (this.last) { this.gaps.push(now - this.last); if (this.gaps.length > 2000) this.gaps.shift(); }
      this.last = now;
      const { k, talk, events, refused, done, ...fields } = message;
      Object.assign(this.state, fields);
      if (done) for (const [n, sent] of this.waiting) if (n <= done) { this.delays.push(now - sent); this.waiting.delete(n); }
      this.emit('frame', { fields, talk, events, refused });
    } else {
      if (message.k === 'refused') this.waiting.delete(message.n);
      this.emit(message.k, message);
    }
  }

  emit(type, detail) { this.dispatchEvent(new CustomEvent(type, { detail })); }
  on(type, listener) { this.addEventListener(type, event => listener(event.detail)); return this; }

  send(message) { if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message)); }

  /** Sends a command, which is acknowledged by its number. */
  command(k, fields = {}) {
    const n = ++this.number;
    this.waiting.set(n, performance.now());
    this.send({ k, n, ...fields });
    return n;
  }
}
