// What the page asks of the server that it came from; addresses are relative, so that its token goes along.

// A refusal, in the sentence that the server says.
export class Refusal extends Error {
  constructor(message, exists) {
    super(message);
    this.exists = exists;
  }
}

async function answer(response) {
  const text = await response.text();
  let found = null;
  try {
    found = JSON.parse(text);
  } catch {
    throw new Refusal(text || `The server answers ${response.status}.`, false);
  }
  if (!response.ok) throw new Refusal(found.error, found.exists);
  return found;
}

async function reached(request) {
  try {
    return await request;
  } catch {
    throw new Refusal("The studio does not answer; start it again, and open the address that it prints.", false);
  }
}

// A change; what comes back is the state after it.
export async function ask(change, body = {}) {
  const request = fetch(`api/${change}`, {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body),
  });
  return answer(await reached(request));
}

export async function look(what) {
  return answer(await reached(fetch(`api/${what}`)));
}
