// A slider for every number of the model. One that moves asks for the model with it, never for more than one at a time.
import { ask } from "./server.js";
import { chosenTab, draw } from "./figures.js";

const place = document.getElementById("sliders");
const moved = document.getElementById("moved");
const STEPS = 1000;
let waiting = null;
let isAsking = false;
// Of every move: milliseconds until the server answered and until the figures were drawn, and evaluations of the model.
export const timings = [];

async function move(entry, refused) {
  waiting = entry;
  if (isAsking) return;
  isAsking = true;
  while (waiting) {
    const { id, input, output } = waiting;
    waiting = null;
    const begun = performance.now();
    try {
      const answer = await ask("move", { id, share: Number(input.value) / STEPS, tab: chosenTab() });
      const answered = performance.now();
      output.textContent = answer.text;
      input.setAttribute("aria-valuetext", answer.text);
      say(answer.figures.moved);
      draw(answer.figures);
      timings.push({ ms: performance.now() - begun, answer_ms: answered - begun, evaluations: answer.figures.moved.evaluations });
      document.documentElement.dataset.moves = `${timings.length}`;
    } catch (refusal) {
      refused(refusal);
    }
  }
  isAsking = false;
  document.getElementById("put-back").disabled = false;
}

export function say(found) {
  moved.textContent = found ? `Moved by hand: error ${found.error}, χ² per value ${found.chi2}. Nothing is fitted.` : "Move a number to see the curves follow; “fit” settles those that are not held.";
}

function line(parameter, hold, refused) {
  const row = document.createElement("div");
  row.className = "slider";
  const name = `${parameter.owner}, ${parameter.name}`;
  const label = row.appendChild(document.createElement("label"));
  label.append(parameter.name);
  const input = document.createElement("input");
  Object.assign(input, { type: "range", min: 0, max: STEPS, value: Math.round(STEPS * parameter.share) });
  input.setAttribute("aria-label", name);
  input.setAttribute("aria-valuetext", parameter.text);
  input.dataset.key = `slider ${name}`;
  const output = document.createElement("output");
  output.textContent = parameter.text;
  output.title = `as fitted: ${parameter.fitted}`;
  label.append(input);
  row.append(output);
  input.addEventListener("input", () => move({ id: parameter.id, input, output }, refused));
  const held = document.createElement("input");
  Object.assign(held, { type: "checkbox", checked: parameter.is_held, disabled: !parameter.can_hold });
  held.title = parameter.can_hold ? "hold it in a fit" : "a phasor is solved for, and cannot be held";
  held.setAttribute("aria-label", `hold ${name}`);
  held.dataset.key = `hold ${name}`;
  held.addEventListener("change", () => hold(parameter.id, held.checked));
  row.append(held);
  return row;
}

export function show(session, hold, refused) {
  const owners = [...new Set(session.parameters.map((p) => p.owner))];
  place.replaceChildren(...owners.map((owner) => {
    const group = document.createElement("fieldset");
    group.appendChild(document.createElement("legend")).textContent = owner;
    group.append(...session.parameters.filter((p) => p.owner === owner).map((p) => line(p, hold, refused)));
    return group;
  }));
  document.getElementById("put-back").disabled = !session.is_moved;
  if (!session.is_moved) say(null);
}
