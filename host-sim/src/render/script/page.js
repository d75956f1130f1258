// What a reader can do with the figures: point, zoom, leave series out, take figures and numbers along.
const dark = matchMedia("(prefers-color-scheme: dark)");
const figures = [];
// Where along an orbit its arrow sits.
const ARROW_AT_DEG = 108;

// Where a motion is after so much of a turn; its path: real and imaginary part of the phasors along x and y.
function centre([a, b, c, d], turned_deg) {
  const [cos, sin] = [Math.cos((turned_deg * Math.PI) / 180), Math.sin((turned_deg * Math.PI) / 180)];
  return [a * cos - b * sin, c * cos - d * sin];
}

// A part of a turn, as points.
function arcRows({ path, from_deg, to_deg, step_deg }) {
  const steps = Math.round((to_deg - from_deg) / step_deg);
  return Array.from({ length: steps + 1 }, (_, i) => from_deg + i * step_deg).map((deg) => [...centre(path, deg), deg]);
}

// The chart with the points of its circles and ellipses.
function withPoints(chart) {
  for (const series of chart.series) if (series.arc) series.rows = arcRows(series.arc);
  return chart;
}

class Drawn {
  constructor(element) {
    this.element = element;
    this.chart = withPoints(JSON.parse(element.querySelector("script").textContent));
    this.place = element.querySelector(".chart");
    this.said = element.querySelector(".said");
    this.hidden = new Set();
    this.isZooming = false;
    this.at = null;
    this.engine = echarts.init(this.place, null, { renderer: "svg" });
    this.draw();
    this.legend();
    this.tools();
    this.numbers();
    this.listen();
  }

  draw(theme = THEMES[dark.matches ? "dark" : "light"]) {
    this.theme = theme;
    const option = chartOptions(this.chart, theme, this.engine.getWidth(), (points) => this.hover(points));
    option.legend.selected = Object.fromEntries([...this.hidden].map((name) => [name, false]));
    option.legend.data = [...new Set(option.series.map((s) => s.name))];
    if (this.isZooming) option.dataZoom.forEach((zoom) => Object.assign(zoom, { zoomOnMouseWheel: true, moveOnMouseMove: true }));
    this.engine.setOption(option, { notMerge: true });
    // paper is of another width than the screen
    this.place.querySelector("svg").setAttribute("viewBox", `0 0 ${this.engine.getWidth()} ${this.engine.getHeight()}`);
  }

  seriesOf(id) {
    return this.chart.series[parseInt(id, 10)];
  }

  // A point in words: its own name, then every column with its unit.
  told(series, row, skipped = 0) {
    const numbers = series.columns.map((c, i) => `${c.name} ${written(row[i])}${c.unit ? ` ${c.unit}` : ""}`);
    return numbers.slice(skipped).join(", ");
  }

  // As elements: names come from files and are no markup.
  hover(points) {
    const all = (Array.isArray(points) ? points : [points]).filter((p) => this.seriesOf(p.seriesId)?.columns.length);
    const box = document.createElement("div");
    const say = (text, isHead) => {
      const line = box.appendChild(document.createElement(isHead ? "b" : "div"));
      line.textContent = text;
    };
    if (!all.length) return "";
    const seen = new Set();
    const first = this.seriesOf(all[0].seriesId);
    say(`${first.columns[0].name} ${written(this.rowOf(all[0])[0])} ${first.columns[0].unit}`, true);
    for (const point of all) {
      const series = this.seriesOf(point.seriesId);
      const text = `${series.name}: ${this.told(series, this.rowOf(point), 1)}`;
      const sameColumns = `${series.name} ${series.columns.map((c) => c.name).sort()}`;
      if (!seen.has(sameColumns)) say(text, false);
      seen.add(sameColumns);
    }
    return box;
  }

  rowOf(point) {
    return this.seriesOf(point.seriesId).rows[point.dataIndex];
  }

  legend() {
    const list = this.element.querySelector(".legend");
    if (this.chart.series.some((s) => s.look.kind === "cells")) return classes(list);
    for (const name of new Set(this.chart.series.map((s) => s.name).filter((n) => n))) {
      const button = list.appendChild(document.createElement("li")).appendChild(document.createElement("button"));
      button.type = "button";
      button.setAttribute("aria-pressed", "true");
      button.append(sample(this.chart.series.find((s) => s.name === name).look), name);
      button.addEventListener("click", () => {
        const isShown = this.hidden.delete(name) || !this.hidden.add(name);
        button.setAttribute("aria-pressed", `${isShown}`);
        this.engine.dispatchAction({ type: isShown ? "legendSelect" : "legendUnSelect", name }, { flush: true });
      });
    }
    return undefined;
  }

  tools() {
    const bar = this.element.querySelector(".tools");
    const tool = (text, what, action) => {
      const button = bar.appendChild(document.createElement("button"));
      Object.assign(button, { type: "button", textContent: text, title: what });
      button.addEventListener("click", () => action(button));
    };
    tool("zoom", "wheel or pinch zooms, dragging moves; Ctrl and wheel zooms always", (button) => {
      this.isZooming = !this.isZooming;
      button.setAttribute("aria-pressed", `${this.isZooming}`);
      const wheel = { zoomOnMouseWheel: this.isZooming || "ctrl", moveOnMouseMove: this.isZooming };
      this.engine.setOption({ dataZoom: this.zooms().map(({ id }) => ({ id, ...wheel })) });
    });
    tool("reset", "the whole range again", () => this.zoom(0));
    tool("SVG", "save the figure as a drawing", () => save(`${this.element.id}.svg`, new Blob([this.svg()], { type: "image/svg+xml" })));
    tool("PNG", "save the figure as an image", () => this.png());
    tool("CSV", "save the numbers", () => save(`${this.element.id}.csv`, new Blob([this.csv()], { type: "text/csv" })));
  }

  // All numbers as tables, for who cannot see the figure; made when they are asked for.
  numbers() {
    const details = document.createElement("details");
    details.className = "numbers";
    details.appendChild(document.createElement("summary")).textContent = "numbers";
    details.addEventListener("toggle", () => {
      if (details.children.length > 1) return;
      const box = details.appendChild(document.createElement("div"));
      this.chart.series.filter((s) => s.columns.length).forEach((series) => {
        const table = box.appendChild(document.createElement("table"));
        table.createCaption().textContent = series.name;
        const head = table.createTHead().insertRow();
        for (const { name, unit } of series.columns) {
          const cell = head.appendChild(document.createElement("th"));
          Object.assign(cell, { scope: "col", textContent: unit ? `${name}, ${unit}` : name });
        }
        const body = table.createTBody();
        for (const row of series.rows) {
          const line = body.insertRow();
          series.columns.forEach((_, i) => { line.insertCell().textContent = written(row[i]); });
        }
      });
    });
    this.element.querySelector("figcaption").after(details);
  }

  zooms() {
    return this.engine.getOption().dataZoom;
  }

  // By a factor around the middle of what is shown; 0: everything.
  zoom(factor) {
    for (const [dataZoomIndex, { start, end }] of this.zooms().entries()) {
      const half = 0.5 * (end - start) * factor;
      const [from, to] = factor ? [Math.max(0, 0.5 * (start + end) - half), Math.min(100, 0.5 * (start + end) + half)] : [0, 100];
      this.engine.dispatchAction({ type: "dataZoom", dataZoomIndex, start: from, end: to }, { flush: true });
    }
  }

  listen() {
    this.place.addEventListener("dblclick", () => this.zoom(0));
    this.place.addEventListener("keydown", (event) => this.key(event));
    this.engine.on("mouseover", (point) => point.componentType === "series" && this.pointed(point.seriesId, point.dataIndex));
    this.engine.on("updateAxisPointer", ({ axesInfo }) => {
      const at = axesInfo?.[0]?.value;
      if (at !== undefined && this.chart.series.some((s) => s.columns[0]?.is_key)) link(this, at);
    });
    this.engine.on("globalout", () => link(this, null));
  }

  pointed(seriesId, dataIndex) {
    const series = this.seriesOf(seriesId);
    const key = series.columns.findIndex((c) => c.is_key);
    if (key >= 0 && series.rows[dataIndex]) link(this, series.rows[dataIndex][key]);
  }

  // Marks the readings nearest to this key; none for null.
  mark(at) {
    this.engine.dispatchAction({ type: "downplay" });
    if (at === null) return;
    if (this.chart.turns.length) this.turn(this.chart.turns.reduce((best, t) => (Math.abs(t.key - at) < Math.abs(best.key - at) ? t : best)));
    this.chart.series.forEach((series, id) => {
      const key = series.columns.findIndex((c) => c.is_key);
      if (key < 0 || !series.rows.length) return;
      const off = (i) => Math.abs(series.rows[i][key] - at);
      const nearest = series.rows.reduce((best, _, i) => (off(i) < off(best) ? i : best), 0);
      this.engine.dispatchAction({ type: "highlight", seriesId: `${id}`, dataIndex: nearest });
    });
  }

  // Draws another reading's orbits in the first panel: of each path a line, the keyphasor's dot and an arrow.
  turn({ head, reach, paths }) {
    const [panel] = this.chart.panels;
    if (`${panel.head}` === `${head}`) return;
    Object.assign(panel, { head });
    panel.x.to = reach;
    panel.y.to = reach;
    const drawn = this.chart.series.filter((s) => s.panel === 0 && s.name);
    paths.forEach((path, i) => {
      const [line, dot, arrow] = drawn.slice(3 * i, 3 * i + 3);
      line.rows = arcRows({ ...line.arc, path });
      dot.rows = [[...centre(path, 0), 0]];
      const [[x, y], [ahead_x, ahead_y]] = [centre(path, ARROW_AT_DEG), centre(path, ARROW_AT_DEG + 1)];
      arrow.rows = [[x, y, (Math.atan2(ahead_y - y, ahead_x - x) * 180) / Math.PI]];
    });
    this.draw();
  }

  // Arrows walk from point to point and say what is there; plus, minus and 0 zoom.
  key(event) {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    const factor = { "+": 0.5, "-": 2, 0: 0 }[event.key];
    if (factor !== undefined) this.zoom(factor);
    if (step) {
      const id = this.chart.series.findIndex((s) => s.columns.length && !this.hidden.has(s.name));
      if (id < 0) return;
      const series = this.chart.series[id];
      this.at = this.at === null ? 0 : (this.at + step + series.rows.length) % series.rows.length;
      const seriesIndex = this.engine.getOption().series.findIndex((s) => parseInt(s.id, 10) === id);
      this.engine.dispatchAction({ type: "showTip", seriesIndex, dataIndex: this.at });
      this.pointed(`${id}`, this.at);
      this.said.textContent = `${series.name}: ${this.told(series, series.rows[this.at])}`;
    }
    if (step || factor !== undefined) event.preventDefault();
  }

  resize() {
    if (this.place.clientWidth === this.engine.getWidth()) return;
    this.engine.resize();
    this.draw();
  }

  svg() {
    const drawing = this.place.querySelector("svg").cloneNode(true);
    drawing.setAttribute("xmlns", "http://www.w3.org/2000/svg");
    drawing.style.background = this.theme.paper;
    return new XMLSerializer().serializeToString(drawing);
  }

  png() {
    const image = new Image();
    image.onload = () => {
      const sheet = document.createElement("canvas");
      [sheet.width, sheet.height] = [2 * image.width, 2 * image.height];
      const pen = sheet.getContext("2d");
      pen.fillStyle = this.theme.paper;
      pen.fillRect(0, 0, sheet.width, sheet.height);
      pen.drawImage(image, 0, 0, sheet.width, sheet.height);
      sheet.toBlob((blob) => save(`${this.element.id}.png`, blob));
    };
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(this.svg())}`;
  }

  csv() {
    // a spreadsheet would compute a name that looks like a formula
    const plain = (text) => (/^[=+\-@\t\r]/.test(text) ? `'${text}` : text);
    const cell = (text) => (/[",\n]/.test(text) ? `"${plain(text).replaceAll('"', '""')}"` : plain(text));
    return this.chart.series.filter((s) => s.columns.length && !this.hidden.has(s.name)).map((series) => {
      const head = series.columns.map((c) => cell(c.unit ? `${c.name}, ${c.unit}` : c.name));
      const rows = series.rows.map((row) => [cell(series.name), ...series.columns.map((_, i) => row[i] ?? "")].join(","));
      return [["series", ...head].join(","), ...rows].join("\n");
    }).join("\n\n") + "\n";
  }
}

// What the colours of cells mean.
function classes(list) {
  list.classList.add("classes");
  CLASSES.forEach((least, i) => {
    const item = list.appendChild(document.createElement("li"));
    item.appendChild(document.createElement("i")).className = `class-${i}`;
    item.append(`from ${least} σ`);
  });
  for (const note of ["up to 2.5 σ is noise", "a stroke is a lost reading"]) list.appendChild(document.createElement("li")).textContent = note;
}

// What a kind of points looks like, beside its name: the symbol that the figure draws.
function sample({ kind, index }) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 26 12");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add(["limit", "faint"].includes(kind) ? kind : index === null || index === undefined ? "measured" : `model-${index % 4}`);
  const isLine = ["model", "measured_line", "band", "faint", "limit"].includes(kind);
  const isTriangle = ["flags", "arrows"].includes(kind);
  const form = isLine ? "line" : isTriangle ? "polygon" : "circle";
  const shape = svg.appendChild(document.createElementNS("http://www.w3.org/2000/svg", form));
  const points = "8.5,10.5 17.5,10.5 13,1.5";
  const attributes = { line: { x1: 0, x2: 26, y1: 6, y2: 6 }, polygon: { points }, circle: { cx: 13, cy: 6, r: kind === "rings" ? 4.6 : 3.2 } }[form];
  if (kind === "model" && index % 4) attributes["stroke-dasharray"] = DASHES[index % 4].join(" ");
  if (kind === "limit") attributes["stroke-dasharray"] = DASHES[3].join(" ");
  if (kind === "band") shape.classList.add("band");
  if (isTriangle || ["dots", "marks"].includes(kind)) shape.classList.add("full");
  for (const [name, value] of Object.entries(attributes)) shape.setAttribute(name, value);
  return svg;
}

function save(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// The same reading in every figure of a group.
function link(source, at) {
  if (!source.chart.group) return;
  for (const other of figures) if (other.chart.group === source.chart.group) other.mark(at);
}

const breath = () => new Promise((resolve) => { setTimeout(resolve); });

(async () => {
  for (const element of document.querySelectorAll("figure.drawn")) {
    figures.push(new Drawn(element));
    await breath();
  }
  let waiting = null;
  addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(() => figures.forEach((f) => f.resize()), 100); });
  dark.addEventListener("change", () => figures.forEach((f) => f.draw()));
  addEventListener("beforeprint", () => figures.forEach((f) => f.draw(THEMES.light)));
  addEventListener("afterprint", () => figures.forEach((f) => f.draw()));
  document.documentElement.dataset.drawn = "true";
})();
