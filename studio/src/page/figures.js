// The figures of one tab. The reports' own script draws them: its classes are those of this page's other scripts.
/* global Drawn, chartOptions, figures, withPoints */
import { look } from "./server.js";

const place = document.getElementById("figures");
const tabs = document.getElementById("tabs");
let chosen = null;
let shown = [];
let asked = 0;

export function chosenTab() {
  return chosen;
}

const seen = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    const one = shown.find(({ drawn }) => drawn?.element === entry.target);
    if (!one) continue;
    one.isSeen = entry.isIntersecting;
    if (one.isSeen && one.waits) renew(one, one.waits);
  }
}, { rootMargin: "40px" });

const outline = (chart) => JSON.stringify([chart.panels.length, chart.series.map((s) => [s.panel, s.name, s.look])]);

// The numbers of a figure are others now; its element stays, and so do zoom and hidden series. One that nobody sees waits.
function renew(one, answered) {
  const { drawn, isSeen } = one;
  one.waits = isSeen ? null : answered;
  if (!isSeen) return;
  const chart = withPoints(answered);
  const isAlike = outline(drawn.chart) === outline(chart);
  Object.assign(drawn, { chart, at: null });
  const numbers = drawn.element.querySelector("details.numbers");
  if (numbers?.children.length > 1 || !isAlike) {
    numbers?.remove();
    drawn.numbers();
  }
  if (isAlike) {
    const { series, xAxis, yAxis } = chartOptions(chart, drawn.theme, drawn.engine.getWidth(), (points) => drawn.hover(points));
    drawn.engine.setOption({ series, xAxis, yAxis });
    return;
  }
  drawn.element.querySelector(".legend").replaceChildren();
  drawn.draw();
  drawn.legend();
}

// Draws what the server answered, in the elements that are there where they are for the same figures.
export function draw(answer) {
  if (answer.tab !== chosen) return;
  const same = shown.length === answer.figures.length && shown.every((one, i) => one.id === answer.figures[i].id);
  if (same) {
    answer.figures.forEach((figure, i) => figure.chart && renew(shown[i], figure.chart));
  } else {
    figures.length = 0;
    seen.disconnect();
    place.innerHTML = answer.figures.map((figure) => figure.markup).join("");
    shown = answer.figures.map((figure, i) => {
      const drawn = figure.chart ? new Drawn(place.children[i]) : null;
      if (drawn) figures.push(drawn);
      return { id: figure.id, drawn, isSeen: true, waits: null };
    });
    shown.forEach(({ drawn }) => drawn && seen.observe(drawn.element));
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

// More kinds than these, of many runs, stand in a list.
const MOST_TABS = 8;

export function showTabs(names, choose) {
  if (!names.includes(chosen)) chosen = names[0] ?? null;
  if (names.length > MOST_TABS) {
    const list = document.createElement("select");
    list.setAttribute("aria-label", "Kind of figure");
    list.dataset.key = "tabs";
    list.append(...names.map((name) => new Option(name, name, false, name === chosen)));
    list.addEventListener("change", () => { chosen = list.value; choose(); });
    tabs.replaceChildren(list);
    return;
  }
  tabs.replaceChildren(...names.map((name) => {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", textContent: name });
    button.dataset.key = `tab ${name}`;
    button.setAttribute("aria-pressed", `${name === chosen}`);
    button.addEventListener("click", () => { chosen = name; choose(); });
    return button;
  }));
}
