// Requests to the server of the study.

/** Sends a request; returns the view and its tag. Errors have the status of a refusal, and the time after which to ask again [ms]. */
export async function post(name, body, signal) {
  const answer = await fetch(`/study/${name}`, { method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body), signal });
  const view = await answer.json();
  if (!answer.ok) throw Object.assign(new Error(view.error), { status: answer.status, wait: 1000 * Number(answer.headers.get('Retry-After')) });
  return { view, newTag: answer.headers.get('ETag') };
}

/** Whether the same request may succeed later: there is no connection, or the server has too much to do. */
export const passes = error => !error.status || error.status === 429 || error.status >= 500;
