// From the panels and series of a figure to the options of the charting library.
const THEMES = {
  light: {
    ink: "#1b1b1b", faint: "#5c5c5c", line: "#8a8a8a", grid: "#dedede", paper: "#ffffff", limit: "#9e261a",
    models: ["#0072b2", "#b34a00", "#00735a", "#99407f"],
    cells: ["#f7fafc", "#cedeec", "#f4b260", "#de6924", "#9e261a", "#400616"],
  },
  dark: {
    ink: "#ececec", faint: "#b4b4b4", line: "#8a8a8a", grid: "#3a3d42", paper: "#16181b", limit: "#f2a08c",
    models: ["#62b8f0", "#f0a04b", "#4fd0ab", "#e79bd0"],
    cells: ["#20252b", "#33475c", "#8a5a1e", "#d07a2c", "#f2a08c", "#ffe9e4"],
  },
};
// Models are told apart without colour too.
const DASHES = ["solid", [7, 3], [2.5, 2.5], [12, 4]];
// Least standard deviations of the classes of cells.
const CLASSES = [0, 1.5, 2.5, 4, 8, 16];
const TEXT_PX = 12.5;
const HEAD_PX = 17;
// Under the lines above a panel: half of a number beside its upper end.
const HEAD_GAP_PX = 7;
const MARGIN_PX = { left: 64, right: 16, top: 10, named: 44, bare: 14 };

// A number as people write it: four digits, or all before the point.
function written(value) {
  if (value === null || value === undefined || Number.isNaN(value)) return "lost";
  const digits = Math.abs(value) >= 1000 ? { maximumFractionDigits: 0 } : { maximumSignificantDigits: 4 };
  return value.toLocaleString("en", digits).replace("-", "−");
}

const DAY_MS = 86_400_000;
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

// The date of a day since this moment; a clock whose zone nobody stated is read as it is.
function dateOf(begin, day) {
  const start = Date.parse(/Z$|[+-]\d\d:\d\d$/.test(begin) ? begin : `${begin}Z`);
  return new Date(start + day * DAY_MS).toISOString().slice(0, 10);
}

// A round number as a power of ten where it is long.
function power(value) {
  const exponent = Math.floor(Math.log10(value) + 1e-9);
  if (exponent >= -3 && exponent < 6) return written(value);
  const head = Math.round(value / 10 ** exponent);
  const raised = `${exponent}`.replace("-", "⁻").replace(/\d/g, (d) => RAISED[d]);
  return `${head === 1 ? "" : `${head}·`}10${raised}`;
}

// 1, 2 and 5 in every decade; of many decades the powers of ten.
function logTicks(low, high) {
  const decades = Math.log10(high / low);
  const heads = decades > 2.5 ? [1] : [1, 2, 5];
  const all = [];
  for (let exponent = Math.floor(Math.log10(low) + 1e-9); 10 ** exponent <= high * (1 + 1e-9); exponent += 1) {
    for (const head of heads) {
      const value = Number(`${head}e${exponent}`);
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) all.push(value);
    }
  }
  return all;
}

function gridOf(chart, index, width_px) {
  const panel = chart.panels[index];
  const row = Math.floor(index / chart.columns);
  const heightOf = (r) => Math.max(...chart.panels.slice(r * chart.columns, (r + 1) * chart.columns).map((p) => p.height_px));
  const head_px = panel.head.length ? HEAD_PX * panel.head.length + HEAD_GAP_PX : 0;
  let top = MARGIN_PX.top + head_px;
  for (let r = 0; r < row; r += 1) top += heightOf(r);
  const cell_px = width_px / chart.columns;
  const left_px = panel.y.is_hidden ? 8 : leftOf(chart, index);
  const bottom_px = panel.x.is_hidden ? 8 : panel.x.name ? MARGIN_PX.named : MARGIN_PX.bare;
  return {
    left: (index % chart.columns) * cell_px + left_px,
    width: cell_px - left_px - (panel.y.is_hidden ? 8 : MARGIN_PX.right),
    top,
    height: heightOf(row) - MARGIN_PX.top - head_px - bottom_px,
    outerBoundsMode: "none",
  };
}

function textWidth(text) {
  const pen = document.createElement("canvas").getContext("2d");
  pen.font = `${TEXT_PX}px ${getComputedStyle(document.body).fontFamily}`;
  return pen.measureText(text).width;
}

// Room for the labels of an upward axis and its name, the same for panels one below the other.
function leftOf(chart, index) {
  const { rows } = chart.panels[index].y;
  if (rows.length) return 16 + Math.max(...rows.map(textWidth));
  const column = chart.panels.map((_, i) => i).filter((i) => i % chart.columns === index % chart.columns);
  const longest = column.flatMap((i) => {
    const shown = chart.series.filter((s) => s.panel === i).flatMap((s) => s.rows.map((row) => row[1])).filter(Number.isFinite);
    const { from, to } = chart.panels[i].y;
    const high = Math.max(...shown.map(Math.abs), Math.abs(from ?? 0), Math.abs(to ?? 0));
    // labels are rounder than what is shown, and may lie above it
    return [high, 1.2 * high].map((value) => textWidth(`−${written(Number(value.toPrecision(2)))}`));
  });
  return Math.max(MARGIN_PX.left, 32 + Math.max(...longest));
}

// The axes of a plane reach equally far for each pixel.
function reaches(panel, grid) {
  const reach = panel.x.to;
  const stretch = Math.max(1, grid.width / grid.height);
  return { x: reach * stretch, y: reach * stretch * grid.height / grid.width };
}

function axisOption(axis, index, isUpward, reach, theme, left_px) {
  const [low, high] = reach ? [-reach, reach] : [axis.from, axis.to];
  const isTurned = !reach && low !== null && high !== null && low > high;
  const isRound = axis.rows.length > 0 || axis.step !== null || axis.is_log || (low === null && !reach);
  const tick = (value) => {
    if (axis.rows.length) return axis.rows[value] ?? "";
    if (axis.is_log) return power(value);
    return axis.begin ? dateOf(axis.begin, value) : written(Math.abs(value) < 1e-12 ? 0 : value);
  };
  const marks = axis.is_log ? logTicks(low, high) : undefined;
  return {
    gridIndex: index,
    type: axis.is_log ? "log" : "value",
    show: !axis.is_hidden,
    // the labels are dates, and the table has the days
    name: axis.begin ? (axis.begin.endsWith("Z") ? "date, UTC" : "date") : axis.name ?? "",
    nameLocation: "middle",
    nameGap: isUpward ? left_px - 18 : 27,
    nameTextStyle: { color: theme.ink, fontSize: TEXT_PX },
    scale: !axis.from_zero,
    min: (isTurned ? high : low) ?? undefined,
    max: (isTurned ? low : high) ?? undefined,
    inverse: isTurned || (isUpward && axis.rows.length > 0),
    interval: axis.step ?? undefined,
    splitNumber: isUpward ? 4 : axis.begin ? 4 : 5,
    axisLine: { show: true, onZero: false, lineStyle: { color: theme.line } },
    axisTick: { show: !axis.rows.length, customValues: marks, lineStyle: { color: theme.line } },
    splitLine: { show: !axis.rows.length, lineStyle: { color: theme.grid, width: 0.75 } },
    axisLabel: {
      show: axis.name !== null || axis.rows.length > 0,
      color: theme.ink, fontSize: TEXT_PX, hideOverlap: true, formatter: tick,
      // the ends of what is shown are no round numbers
      customValues: axis.rows.length ? axis.rows.map((_, i) => i) : marks,
      // centred at the corner, dates and powers of ten reach the lowest label of the other axis
      alignMinLabel: !isUpward && (axis.begin || axis.is_log) ? "left" : undefined,
      alignMaxLabel: isUpward ? undefined : "right",
      showMinLabel: isRound ? null : false, showMaxLabel: isRound ? null : false,
    },
    axisPointer: { label: { show: false } },
  };
}

function cellShape(theme) {
  return (params, api) => {
    const [from, to] = [api.coord([api.value(0), api.value(2) - 0.5]), api.coord([api.value(1), api.value(2) + 0.5])];
    const value = api.value(3);
    const lost = Number.isNaN(value);
    const [top, bottom] = [Math.min(from[1], to[1]) + 1.5, Math.max(from[1], to[1]) - 1.5];
    const outline = { stroke: theme.line, lineWidth: 0.5 };
    if (lost) return { type: "line", shape: { x1: from[0], y1: top, x2: to[0], y2: bottom }, style: outline };
    const level = CLASSES.findLastIndex((least) => value >= least);
    const shape = { x: from[0], y: top, width: to[0] - from[0], height: bottom - top };
    return { type: "rect", shape, style: { fill: theme.cells[Math.max(level, 0)], ...outline } };
  };
}

// The two edges of a band as one area: the lower edge unseen, the rest stacked on it.
function bandOptions(series, base, theme) {
  const colour = theme.models[series.look.index % theme.models.length];
  const common = { ...base, type: "line", symbol: "none", stack: `${base.id}`, stackStrategy: "all", silent: true, lineStyle: { opacity: 0 } };
  return [
    { ...common, id: `${base.id}-low`, data: series.rows.map((r) => [r[0], r[1]]), tooltip: { show: false } },
    { ...common, id: `${base.id}-high`, data: series.rows.map((r) => [r[0], r[2] - r[1]]), areaStyle: { color: colour, opacity: 0.22 } },
  ];
}

const ALIGN = { left: "right", right: "left", centre: "inside" };

// A word as long as there is room for it.
function shortened(text, room_px) {
  if (textWidth(text) <= room_px) return text;
  let kept = text;
  while (kept && textWidth(`${kept}…`) > room_px) kept = kept.slice(0, -1);
  return `${kept}…`;
}

function seriesOptions(series, index, theme, along, grid) {
  const { kind, index: which } = series.look;
  const colour = which === null || which === undefined || kind === "words" ? theme.ink : theme.models[which % theme.models.length];
  const dash = DASHES[(which ?? 0) % DASHES.length];
  const base = {
    id: `${index}`, name: series.name ?? `ground ${index}`, xAxisIndex: series.panel, yAxisIndex: series.panel,
    data: series.rows, animation: false, silent: !series.name, z: series.name ? 3 : 1,
    color: colour,
  };
  // a line has points to point at, seen where it is one point alone
  const unseen = series.rows.length > 1 ? { itemStyle: { opacity: 0 }, emphasis: { itemStyle: { opacity: 1 } } } : {};
  const bend = series.is_curved ? { smooth: 0.5 } : {};
  const line = (style, rest) => ({
    ...base, ...bend, type: "line", symbol: "circle", symbolSize: 7, showSymbol: series.rows.length === 1 || !along, lineStyle: style, ...unseen, ...rest,
  });
  const points = (symbol, size, style, rest) => ({ ...base, type: "scatter", symbol, symbolSize: size, itemStyle: { opacity: 1, ...style }, z: 4, ...rest });
  // more than one a pixel would hide the line that they are held against
  const isDense = series.rows.length > grid.width;
  const ring = (width) => ({ color: "transparent", borderColor: colour, borderWidth: width });
  switch (kind) {
    case "measured": return [isDense ? points("circle", 3, ring(0.7)) : points("circle", 6, ring(1.1))];
    case "measured_line": return [line({ color: theme.ink, width: 1.5, type: "solid" })];
    case "model": return [line({ color: colour, width: 1.9, type: dash })];
    case "faint": return [line({ color: theme.line, width: 0.8, type: "solid" }, { z: 1, showSymbol: false })];
    case "limit": return [line({ color: theme.limit, width: 1.6, type: DASHES[3] }, { color: theme.limit })];
    case "band": return bandOptions(series, base, theme);
    case "dots": case "marks": return [points("circle", 7, { color: colour })];
    case "rings": return [points("circle", 10, ring(1.7))];
    case "flags": return [points("triangle", 9, { color: theme.ink }, { symbolOffset: [0, -4] })];
    case "arrows": return [points("triangle", 10, { color: colour }, {
      data: series.rows.map((row) => ({ value: row, symbolRotate: row[2] - 90 })),
    })];
    case "words": return [points("circle", 1, { color: "transparent" }, {
      data: series.rows.map((row, i) => ({ value: row, label: { formatter: shortened(series.words[i], 0.55 * grid.width) } })),
      label: {
        show: true, position: ALIGN[which], color: theme.faint, fontSize: TEXT_PX, distance: 7,
        textBorderColor: theme.paper, textBorderWidth: 3,
      },
      labelLayout: { hideOverlap: true },
    })];
    case "cells": return [{
      ...base, type: "custom", renderItem: cellShape(theme), encode: { x: [0, 1], y: 2, tooltip: [3] }, clip: true,
    }];
    default: throw new Error(`a look without a drawing: ${kind}`);
  }
}

// Whether a reader who points at a place along the axis means every series there: one of each name, and no plane.
function pointsAlong(chart) {
  const named = chart.series.filter((s) => s.name).map((s) => `${s.panel} ${s.name}`);
  return chart.panels.every((panel) => !panel.is_plane) && chart.series.every((s) => s.look.kind !== "cells")
    && new Set(named).size === named.length;
}

// All options of a figure at this width; `hover` says what a reader sees who points at something.
function chartOptions(chart, theme, width_px, hover) {
  const grids = chart.panels.map((_, i) => gridOf(chart, i, width_px));
  const axes = (isUpward) => chart.panels.map((panel, i) => {
    const reach = panel.is_plane ? reaches(panel, grids[i])[isUpward ? "y" : "x"] : null;
    return axisOption(isUpward ? panel.y : panel.x, i, isUpward, reach, theme, leftOf(chart, i));
  });
  const along = pointsAlong(chart);
  const zooms = chart.panels.flatMap((panel, i) => [
    ...(chart.shares_x && i > 0 ? [] : [{ xAxisIndex: chart.shares_x ? chart.panels.map((_, k) => k) : [i] }]),
    ...(panel.y.rows.length ? [] : [{ yAxisIndex: [i] }]),
  ]);
  return {
    animation: false,
    textStyle: { fontFamily: getComputedStyle(document.body).fontFamily, color: theme.ink },
    title: chart.panels.flatMap((panel, i) => panel.head.map((text, k) => ({
      text, left: grids[i].left + grids[i].width / 2, top: grids[i].top - HEAD_GAP_PX - HEAD_PX * (panel.head.length - k), textAlign: "center",
      padding: 0, textStyle: { color: theme.ink, fontSize: TEXT_PX, fontWeight: "normal" },
    }))),
    grid: grids,
    xAxis: axes(false),
    yAxis: axes(true),
    legend: { show: false },
    axisPointer: chart.shares_x ? { link: [{ xAxisIndex: "all" }] } : {},
    tooltip: {
      trigger: along ? "axis" : "item", formatter: hover, confine: true, transitionDuration: 0,
      backgroundColor: theme.paper, borderColor: theme.line, textStyle: { color: theme.ink, fontSize: 13 },
      axisPointer: { type: "line", lineStyle: { color: theme.line } },
    },
    dataZoom: zooms.map((axesOf, i) => ({
      id: `zoom ${i}`, type: "inside", filterMode: "none", zoomOnMouseWheel: "ctrl", moveOnMouseMove: false, preventDefaultMouseMove: false,
      ...axesOf,
    })),
    series: chart.series.flatMap((s, i) => seriesOptions(s, i, theme, along, grids[s.panel])),
  };
}
