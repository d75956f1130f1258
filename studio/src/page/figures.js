// The figures of one tab. The reports' own script draws them: its classes are those of this page's other scripts.
/* global Drawn, figures */
import { look } from "./server.js";

const place = document.getElementById("figures");
const tabs = document.getElementById("tabs");
let chosen = null;
let shown = [];
let asked = 0;

export function chosenTab() {
  return chosen;
}

// The numbers of a figure are others now; its element stays, and so do zoom and hidden series.
function redraw(drawn, chart) {
  drawn.chart = chart;
  drawn.at = null;
  drawn.element.querySelector(".legend").replaceChildren();
  drawn.element.querySelector("details.numbers")?.remove();
  drawn.draw();
  drawn.legend();
  drawn.numbers();
}

// Draws what the server answered, in the elements that are there where they are for the same figures.
export function draw(answer) {
  if (answer.tab !== chosen) return;
  const same = shown.length === answer.figures.length && shown.every((one, i) => one.id === answer.figures[i].id);
  if (same) {
    answer.figures.forEach((figure, i) => figure.chart && redraw(shown[i].drawn, figure.chart));
  } else {
    figures.length = 0;
    place.innerHTML = answer.figures.map((figure) => figure.markup).join("");
    shown = answer.figures.map((figure, i) => {
      const drawn = figure.chart ? new Drawn(place.children[i]) : null;
      if (drawn) figures.push(drawn);
      return { id: figure.id, drawn };
    });
  }
  place.dataset.drawn = `${Number(place.dataset.drawn ?? 0) + 1}`;
}

export async function refresh() {
  if (!chosen) return null;
  asked += 1;
  const own = asked;
  const answer = await look(`figures?tab=${encodeURIComponent(chosen)}`);
  // a later request is under way
  if (own === asked) draw(answer);
  return answer;
}

export function showTabs(names, choose) {
  if (!names.includes(chosen)) chosen = names[0] ?? null;
  tabs.replaceChildren(...names.map((name) => {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: name });
    button.dataset.key = `tab ${name}`;
    button.setAttribute("aria-pressed", `${name === chosen}`);
    button.addEventListener("click", () => { chosen = name; choose(); });
    return button;
  }));
}
