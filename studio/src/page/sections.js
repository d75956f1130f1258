// The answer, the steps, and the sections beside them.
function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

const at = (id) => document.getElementById(id);
const inside = (id) => at(id).querySelector("div");
const button = (text, key, action, properties = {}) => {
  const made = element("button", { type: "button", textContent: text, ...properties });
  made.dataset.key = key;
  made.addEventListener("click", action);
  return made;
};
const note = (text) => element("p", { className: "note", textContent: text });
const list = (lines) => element("ul", {}, ...lines.map((line) => element("li", { textContent: line })));

// Whoever listens hears a text once: it is set where it changed alone.
function set(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function answer({ verdict, machine, rotor_file, data_file, session_file, not_saved }) {
  const words = { working: "looking for what is missing", failed: "no diagnosis", not_determined: "not determined" };
  set(at("word"), words[verdict.word] ?? verdict.word);
  set(at("sentence"), verdict.sentence);
  at("answer").dataset.verdict = verdict.word;
  set(at("numbers"), `error ${verdict.error} · noise alone ${verdict.noise} · χ² per value ${verdict.chi2} (noise: 1)`);
  const progress = at("progress");
  progress.hidden = verdict.word !== "working";
  const [done, planned] = verdict.progress ?? [0, 0];
  if (planned) Object.assign(progress, { value: done, max: planned });
  else progress.removeAttribute("value");
  at("remarks").hidden = !verdict.remarks.length;
  at("remarks").querySelector("ul").replaceChildren(...verdict.remarks.map((text) => element("li", { textContent: text })));
  const kept = not_saved ?? (session_file ? `kept in ${session_file}` : "");
  set(at("files"), [machine, `${rotor_file}, ${data_file}`, kept].filter((text) => text).join(" · "));
}

// Sessions that ended unsaved, a line each.
export function unsaved(found, goOn, dismiss) {
  at("unsaved").hidden = !found.length;
  at("unsaved").replaceChildren(...found.map(({ name, sentence, is_usable }) => element("div", { className: "buttons" },
    element("span", { textContent: sentence }),
    ...(is_usable ? [button("Go on with it", `recover ${name}`, () => goOn(name), { className: "main" })] : []),
    button("Delete it", `dismiss ${name}`, () => dismiss(name)))));
}

export function fall(session) {
  at("fall").innerHTML = session.fall;
  const ahead = session.steps.filter((step) => step.is_ahead);
  if (ahead.length) at("fall").append(note(`Undone: ${ahead.map((step) => `${step.label} (${step.error})`).join(", ")}.`));
}

export function branches(session, go) {
  const rows = session.branches.map((branch, k) => element("li", {},
    button(branch.name, `branch ${branch.name}`, () => go(k), { ariaPressed: `${branch.is_current}` }),
    element("span", { textContent: `${branch.label}: error ${branch.error}, ${branch.verdict}` })));
  const fork = session.branches.length < 2 ? [button("Go on in a second branch", "fork", () => go(null))] : [];
  const told = session.branches.length < 2 ? "Try another effect from here, and hold the two side by side." : "The figures show both; the branch that is pressed is the one that changes.";
  inside("branches").replaceChildren(element("ul", { className: "plain" }, ...rows), ...fork, note(told));
}

export function mask({ mask: found }, leaveOut) {
  const { chosen, runs, probes, speeds_rpm: [slowest, fastest], sentence } = found;
  const box = (kind, name, shown) => {
    const input = element("input", { type: "checkbox", checked: chosen[kind].includes(name) });
    input.dataset.key = `mask ${kind} ${name}`;
    input.addEventListener("change", () => {
      const others = chosen[kind].filter((other) => other !== name);
      leaveOut({ ...chosen, [kind]: input.checked ? [...others, name] : others });
    });
    return element("label", { className: "check" }, input, shown);
  };
  const range = element("form", { className: "range" });
  const field = (name, value) => element("input", { name, type: "number", step: "any", value, required: true, ariaLabel: `${name}, rpm` });
  const [from, to] = chosen.speeds_rpm ?? [slowest, fastest];
  range.append("Speeds ", field("from", from), " to ", field("to", to), " rpm ", element("button", { textContent: "Leave out" }));
  range.addEventListener("submit", (event) => {
    event.preventDefault();
    const ends = ["from", "to"].map((name) => Number(range.elements[name].value));
    leaveOut({ ...chosen, speeds_rpm: ends });
  });
  const all = chosen.speeds_rpm ? [button("All speeds", "all speeds", () => leaveOut({ ...chosen, speeds_rpm: null }))] : [];
  inside("mask").replaceChildren(
    ...(runs.length > 1 ? [element("div", { className: "checks" }, "Runs ", ...runs.map((run) => box("runs", run, run || "without a name")))] : []),
    element("div", { className: "checks" }, "Probes ", ...probes.map((probe) => box("probes", probe, probe))),
    range, ...all,
    sentence ? element("p", { textContent: sentence }) : note("What is left out is no part of a fit; its prediction shows whether the model holds beyond its data."),
  );
  if (sentence) at("mask").open = true;
}

export function further({ further: found }, plan) {
  const parts = [];
  if (found.rivals.length) parts.push(element("p", { textContent: `These data cannot tell apart: ${found.rivals.join(", ")}.` }));
  if (found.advice.length) parts.push(list(found.advice));
  if (found.decision) parts.push(element("p", { textContent: found.decision }));
  if (found.next.length) parts.push(element("p", { textContent: "Measurements that tell most, of the machine as its file states it:" }), list(found.next));
  if (found.error) parts.push(note(found.error));
  if (found.progress) parts.push(element("progress", { max: found.progress[1] || 1, value: found.progress[0], ariaLabel: "Effects planned" }));
  if (!found.is_asked) parts.push(button("What would help most?", "plan", plan));
  if (!found.rivals.length && !found.advice.length && !found.next.length) parts.push(note("The diagnosis names no rivals that further measurements would have to tell apart."));
  inside("further").replaceChildren(...parts);
}

export function practice({ practice: found }, openHidden, reveal, end) {
  const parts = [];
  if (!found) parts.push(note("Hide an effect in this machine: simulated readings at the same speeds, with noise."));
  if (found?.reveal) {
    parts.push(element("p", { className: "reveal", textContent: found.reveal.sentence }));
    const table = element("table");
    table.createTHead().append(element("tr", {}, ...["parameter", "in truth", "found"].map((text) => element("th", { scope: "col", textContent: text }))));
    const body = table.createTBody();
    for (const row of found.reveal.rows) body.append(element("tr", {}, ...row.map((text) => element("td", { textContent: text }))));
    parts.push(table);
  } else if (found) {
    parts.push(note("Something is hidden in this machine."), button("Reveal", "reveal", reveal));
  }
  parts.push(button(found ? "Hide another" : "Hide something in it", "hide", openHidden));
  if (found?.can_end) parts.push(button("Back to the measurements", "end practice", end));
  inside("practice").replaceChildren(element("div", {}, ...parts.filter((part) => part.tagName !== "BUTTON")), element("div", { className: "buttons" }, ...parts.filter((part) => part.tagName === "BUTTON")));
  if (found) at("practice").open = true;
}

export function commands({ commands: lines }) {
  const text = lines.join("\n");
  const copy = button("Copy", "copy", () => navigator.clipboard?.writeText(text));
  inside("commands").replaceChildren(element("pre", { tabIndex: 0, textContent: text }), copy);
}
