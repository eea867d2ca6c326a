// Requests to the server, with the secret of the link in a header.

export class Refusal extends Error {
  constructor(status, reason) { super(reason); this.status = status; }
}

export class Api {
  constructor(token) { this.token = token; }

  async ask(path, body) {
    const headers = { Authorization: `Bearer ${this.token}` };
    const answer = await fetch(`/api/${path}`, body === undefined ? { headers } : { method: 'POST', headers, body: JSON.stringify(body) });
    if (answer.ok) return answer;
    const { reason } = await answer.json().catch(() => ({ reason: `the server answers with ${answer.status}` }));
    throw new Refusal(answer.status, reason);
  }

  async json(path, body) { return (await this.ask(path, body)).json(); }
}
