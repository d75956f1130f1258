// Measures the page it is put into once its figures are drawn, and leaves the answer as JSON in the page around its frame.
const luminance = (colour) => {
  const part = (c) => (c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const [r, g, b] = colour.match(/[\d.]+/g).map((c) => part(c / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const contrast = (a, b) => {
  const [low, high] = [luminance(a), luminance(b)].sort((x, y) => x - y);
  return (high + 0.05) / (low + 0.05);
};
const drawn = () => document.documentElement.dataset.drawn === "true" || !document.querySelector("figure.drawn");
const rounded = (box) => ({ left: box.left, right: box.right, top: box.top, bottom: box.bottom });

function measure() {
  const inside = (a, b) => a.left >= b.left - 1 && a.right <= b.right + 1 && a.top >= b.top - 1 && a.bottom <= b.bottom + 1;
  const apart = (a, b) => a.right <= b.left + 1 || b.right <= a.left + 1 || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
  const paper = getComputedStyle(document.body).backgroundColor;
  const faintest = (texts, colourOf) => Math.min(21, ...texts.map((t) => contrast(colourOf(t), paper)));
  const figures = [...document.querySelectorAll("figure")].map((figure) => {
    const drawing = figure.querySelector(".chart svg, .sketch, .bars, .waterfall");
    const frame = drawing.getBoundingClientRect();
    const texts = [...drawing.querySelectorAll("text, span, .waterfall > div > b")].filter((t) => t.textContent.trim());
    const boxes = texts.map((t) => ({ name: t.textContent.trim(), box: rounded(t.getBoundingClientRect()) }));
    const overlapping = boxes.flatMap((a, i) =>
      boxes.slice(i + 1).filter((b) => !apart(a.box, b.box)).map((b) => [a.name, b.name]));
    const scale = drawing.viewBox?.baseVal?.width ? frame.width / drawing.viewBox.baseVal.width : 1;
    return {
      id: figure.id,
      width: frame.width,
      height: frame.height,
      shapes: drawing.querySelectorAll("polyline, polygon, circle, rect, path, line, div").length,
      caption: figure.querySelector("figcaption").textContent,
      smallest_text_px: Math.min(99, ...texts.map((t) => parseFloat(getComputedStyle(t).fontSize) * scale)),
      faintest_text: faintest(texts, (t) => (t.tagName === "text" ? getComputedStyle(t).fill : getComputedStyle(t).color)),
      clipped: boxes.filter((t) => !inside(t.box, frame)).map((t) => t.name),
      overlapping,
    };
  });
  const words = [...document.querySelectorAll("h1, h2, p, li, td, th, caption, figcaption, a, button, summary")];
  const answer = {
    figures,
    faintest_text: faintest(words.filter((w) => w.textContent.trim()), (w) => getComputedStyle(w).color),
    wider_than_screen_px: document.documentElement.scrollWidth - innerWidth,
    wide_tables: [...document.querySelectorAll(".table")].filter((t) => t.scrollWidth > t.clientWidth + 1).map((t) => t.innerText),
    width: innerWidth,
    height: document.documentElement.scrollHeight,
    fetched: performance.getEntriesByType("resource").map((r) => r.name),
  };
  const pre = parent.document.createElement("pre");
  pre.id = "measured";
  pre.textContent = JSON.stringify(answer);
  parent.document.body.append(pre);
}

addEventListener("load", () => {
  const waiting = setInterval(() => {
    if (!drawn()) return;
    clearInterval(waiting);
    measure();
  }, 50);
});
