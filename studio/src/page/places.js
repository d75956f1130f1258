// The machine with its places, the effects that can sit at the chosen one, and the fit of the effect that is looked at.
const drawing = document.getElementById("drawing");
const places = document.getElementById("places");
const effects = document.getElementById("effects");
const preview = document.getElementById("preview");
// Places less probable than this are not told apart.
const LEAST_SHOWN = 0.001;
let chosen = null;
let drawn = null;

function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

function isShown(place) {
  return place.probability !== null && place.probability >= LEAST_SHOWN;
}

function chosenOf(session) {
  return session.places.find((place) => place.label === chosen) ?? null;
}

function placeButton(place, choose, isSpot) {
  const button = element("button", { type: "button", title: `${place.kind} ${place.label}` });
  button.dataset.key = `${isSpot ? "spot" : "place"} ${place.label}`;
  button.dataset.place = place.label;
  button.setAttribute("aria-pressed", `${place.label === chosen}`);
  if (isSpot) {
    button.className = "spot";
    button.style.left = `${100 * place.across}%`;
    button.setAttribute("aria-label", `${place.kind} ${place.label}`);
    button.tabIndex = -1;
  } else {
    button.append(element("span", { textContent: place.label }));
    if (isShown(place)) button.append(element("b", { textContent: place.probable }));
  }
  button.addEventListener("click", () => { chosen = place.label; choose(); });
  return button;
}

const KINDS = [["machine", "Machine"], ["bearing", "Bearings"], ["disk", "Disks"], ["probe", "Probes"], ["end", "Ends"], ["run", "Runs"], ["length", "Lengths of shaft"]];

function showPlaces(session, choose) {
  if (drawn !== session.drawing) {
    drawing.innerHTML = session.drawing;
    drawn = session.drawing;
  }
  drawing.querySelectorAll(".spot").forEach((spot) => spot.remove());
  const spots = session.places.filter((place) => place.across !== null && ["disk", "bearing"].includes(place.kind));
  drawing.append(...spots.map((place) => placeButton(place, choose, true)));
  places.replaceChildren(...KINDS.flatMap(([kind, name]) => {
    const own = session.places.filter((place) => place.kind === kind);
    if (!own.length) return [];
    const row = element("div", { className: "row" }, element("span", { className: "kind", textContent: name }));
    row.append(element("div", { className: "chips" }, ...own.map((place) => placeButton(place, choose, false))));
    return [row];
  }));
}

function effectButton(place, effect, look) {
  const button = element("button", { type: "button", title: effect.what, disabled: effect.is_present });
  button.dataset.key = `effect ${place.label} ${effect.effect}`;
  button.dataset.effect = effect.effect;
  button.setAttribute("aria-pressed", `${effect.is_chosen}`);
  const told = effect.is_present ? "in the model" : effect.disqualified ? "ruled out" : effect.probable;
  button.append(
    element("span", { textContent: effect.words }),
    element("b", { textContent: told }),
    element("small", { textContent: effect.disqualified ?? effect.gain }),
  );
  if (effect.probability > 0) button.style.setProperty("--share", `${100 * effect.probability}%`);
  button.addEventListener("click", () => look(effect.effect, place.name));
  return button;
}

function showEffects(session, look) {
  const place = chosenOf(session);
  document.getElementById("effects-title").textContent = place ? `Effects at ${place.label}` : "Effects";
  if (!place) {
    effects.replaceChildren(element("p", { className: "note", textContent: "Choose a place of the machine to see which effects can sit there." }));
    return;
  }
  effects.replaceChildren(...place.effects.map((effect) => effectButton(place, effect, look)));
}

function showPreview(session, add, forget) {
  const found = session.preview;
  preview.hidden = !found && !session.looking;
  const waiting = session.looking ? [element("p", { className: "note", textContent: `Fitting ${session.looking} …` })] : [];
  if (!found) { preview.replaceChildren(...waiting); return; }
  const button = element("button", { type: "button", className: "main", id: "add", textContent: "Add" });
  button.dataset.key = "add";
  button.addEventListener("click", () => add(found.effect, found.at));
  const no = element("button", { type: "button", textContent: "Not this one" });
  no.dataset.key = "forget";
  no.addEventListener("click", forget);
  const about = () => element("details", {}, element("summary", { textContent: "About this effect" }), element("p", { className: "note", textContent: found.explanation }));
  const more = found.explanation ? [about()] : [];
  preview.replaceChildren(
    element("h3", { textContent: `${found.words}: ${found.gain}` }),
    element("ul", {}, ...found.lines.map((line) => element("li", { textContent: line }))),
    element("div", { className: "buttons" }, button, no),
    ...more, ...waiting,
  );
}

export function forgetPlace() {
  chosen = null;
}

export function show(session, actions) {
  if (session.preview && !chosen) chosen = session.preview.at ?? "whole machine";
  showPlaces(session, actions.choose);
  showEffects(session, actions.look);
  showPreview(session, actions.add, actions.forget);
}
