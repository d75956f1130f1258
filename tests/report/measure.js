// Measures the page it is put into and leaves the answer as JSON in the page around its frame.
addEventListener("load", () => {
  const inside = (a, b) => a.left >= b.left - 1 && a.right <= b.right + 1 && a.top >= b.top - 1 && a.bottom <= b.bottom + 1;
  const apart = (a, b) => a.right <= b.left + 1 || b.right <= a.left + 1 || a.bottom <= b.top + 1 || b.bottom <= a.top + 1;
  const figures = [...document.querySelectorAll("figure")].map((figure) => {
    const svg = figure.querySelector("svg");
    const frame = svg.getBoundingClientRect();
    const texts = [...svg.querySelectorAll("text")].filter((t) => t.textContent.trim());
    const boxes = texts.map((t) => ({ name: t.textContent.trim(), box: t.getBoundingClientRect() }));
    const overlapping = boxes.flatMap((a, i) =>
      boxes.slice(i + 1).filter((b) => !apart(a.box, b.box)).map((b) => [a.name, b.name]));
    return {
      id: figure.id,
      width: frame.width,
      height: frame.height,
      shapes: svg.querySelectorAll("polyline, polygon, circle, rect, path, line").length,
      caption: figure.querySelector("figcaption").textContent,
      title: svg.querySelector("title").textContent,
      smallest_text_px: Math.min(...texts.map((t) => parseFloat(t.getAttribute("font-size")) * frame.width / svg.viewBox.baseVal.width)),
      clipped: boxes.filter((t) => !inside(t.box, frame)).map((t) => t.name),
      overlapping,
    };
  });
  const answer = {
    figures,
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
});
