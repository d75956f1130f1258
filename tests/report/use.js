// Uses a figure as a reader would, and leaves what was seen as JSON in the page around its frame.
const breath = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
// a browser without a screen draws no frames by itself when it is busy
const until = async (holds) => {
  for (let i = 0; i < 30 && !holds(); i += 1) {
    figures.forEach((f) => f.engine.getZr().flush());
    await breath(100);
  }
};
const labels = (chart) => [...chart.querySelectorAll("text")].map((t) => t.textContent);

async function use() {
  while (document.documentElement.dataset.drawn !== "true") await breath(50);
  const figure = document.getElementById(FIGURE);
  const chart = figure.querySelector(".chart");
  const mouse = (kind, at, more = {}) => chart.querySelector("svg").dispatchEvent(
    new (kind === "wheel" ? WheelEvent : MouseEvent)(kind, { clientX: at.x, clientY: at.y, bubbles: true, cancelable: true, view: window, ...more }));
  // the last circle that was measured
  const numbers = JSON.parse(figure.querySelector("script").textContent);
  const measured = numbers.series.findLastIndex((s) => s.look.kind === "measured" && s.panel === 0);
  const last = numbers.series[measured].rows.at(-1);
  const ring = [...chart.querySelectorAll("path")].filter((p) => p.getAttribute("transform")?.startsWith("matrix(3,") && p.getAttribute("fill") === "none");
  const box = ring.map((p) => p.getBoundingClientRect()).reduce((a, b) => (b.left > a.left || (b.left === a.left && b.top < a.top) ? b : a));
  const at = { x: box.left + box.width / 2, y: box.top + box.height / 2 };
  const orbits = () => labels(document.querySelector("figure[id^=orbits]"));
  const unpointed = orbits();
  mouse("mousemove", at);
  const beside = () => [...chart.querySelectorAll("div")].map((d) => d.innerText).find((t) => t?.includes("measured"));
  await until(beside);
  const hover = beside() ?? "";
  const others = document.querySelectorAll("figure.drawn").length;

  const before = labels(chart);
  const button = (text) => [...figure.querySelectorAll(".tools button")].find((b) => b.textContent === text);
  button("zoom").click();
  mouse("wheel", at, { deltaY: -600, wheelDeltaY: 600 });
  await until(() => `${labels(chart)}` !== `${before}`);
  const zoomed = labels(chart);
  button("reset").click();
  await until(() => `${labels(chart)}` === `${before}`);
  const reset = labels(chart);

  mouse("mouseout", { x: 0, y: 0 });
  const lines = () => [...chart.querySelectorAll("svg path")].filter((p) => Number(p.getAttribute("stroke-width")) === 1.9).length;
  const all = lines();
  figure.querySelector(".legend button").click();
  await until(() => lines() < all);
  const without = lines();

  chart.focus();
  chart.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
  await until(() => `${orbits()}` !== `${unpointed}`);
  const pointed = orbits();
  const said = figure.querySelector(".said").textContent;
  figure.querySelector(".numbers summary").click();
  const numbered = () => figure.querySelectorAll(".numbers tbody tr").length;
  await until(numbered);
  const rows = numbered();

  // lines of orbits, and circles of polar plots, that the script computes
  const paths = (kind, width) => [...document.querySelector(`figure[id^=${kind}]`).querySelectorAll(".chart svg path")]
    .filter((p) => width.includes(p.getAttribute("stroke-width")));
  const computed = {
    orbits: paths("orbits", ["1.5", "1.9"]).map((p) => p.getBBox()).filter((b) => b.width > 10 && b.height > 10).length,
    circles: paths("polar", ["0.8"]).map((p) => p.getBBox()).filter((b) => b.width > 200 && b.height > 200).length,
  };

  const pre = parent.document.createElement("pre");
  pre.id = "measured";
  pre.textContent = JSON.stringify({ last, hover, unpointed, pointed, others, before, zoomed, reset, all, without, said, rows, computed });
  parent.document.body.append(pre);
}
addEventListener("load", use);
