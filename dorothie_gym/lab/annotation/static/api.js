// Requests to the server, with the secret of the link in a header.

const PATIENCE = 20_000;  // time for an answer [ms]

export class Refusal extends Error {
  constructor(status, reason) { super(reason); this.status = status; }

  /** Whether the same request may succeed later: the server is busy, its disk is full, or a proxy does not reach it. */
  get passes() { return this.status >= 500 || [408, 425, 429].includes(this.status); }

  /** Whether the link does not work, which a server that is started anew, or a new link, may change. */
  get isOfLink() { return this.status === 401 || this.status === 403; }
}

export class Api {
  constructor(token) { this.token = token; }

  async ask(path, body, options = {}) {
    const headers = { Authorization: `Bearer ${this.token}` };
    const answer = await fetch(`/api/${path}`, { headers, ...options, ...(body !== undefined && { method: 'POST', body: JSON.stringify(body) }) });
    if (answer.ok) return answer;
    const { reason } = await answer.json().catch(() => ({ reason: `the server answers with ${answer.status}` }));
    throw new Refusal(answer.status, reason);
  }

  async json(path, body, options) { return (await this.ask(path, body, options)).json(); }

  /**
   * Asks until the server answers or refuses.
   * @param body makes the body from whether the request was sent before.
   * @param onwait takes why the request is sent again later; null once there is an answer.
   * @param waits whether a refusal is waited for to pass.
   */
  async patiently(path, { body = () => undefined, onwait = () => {}, waits = refusal => refusal.passes } = {}) {
    for (let tries = 0; ; tries++) {
      try {
        const answer = await this.json(path, body(tries > 0), { signal: AbortSignal.timeout(PATIENCE) });
        onwait(null);
        return answer;
      } catch (error) {
        if (error instanceof Refusal && !waits(error)) { onwait(null); throw error; }
        onwait(error instanceof Refusal ? error.message : 'the server does not answer');
        await moment(Math.min(250 * 2 ** tries, 4000));
      }
    }
  }
}

/** Waits for a time [ms], or until the network is there again. */
function moment(time) {
  return new Promise(resolve => {
    const end = () => { clearTimeout(timer); removeEventListener('online', end); resolve(); };
    const timer = setTimeout(end, time);
    addEventListener('online', end);
  });
}
