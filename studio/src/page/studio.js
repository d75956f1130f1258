// The page: what a person does becomes a change on the server, and what the server answers is shown. Nothing is computed here.
import * as figuresOf from "./figures.js";
import * as places from "./places.js";
import * as sections from "./sections.js";
import { ask, look, Refusal } from "./server.js";
import * as sliders from "./sliders.js";

const at = (id) => document.getElementById(id);
const POLL_MS = 250;
let current = null;
let seen = null;
let polling = null;
let asking = 0;

function refused(refusal) {
  at("message").textContent = refusal.message;
  at("message").hidden = false;
  if (!(refusal instanceof Refusal)) throw refusal;
}

// The element that had the focus has it again after the lists are made anew.
function keepingFocus(show) {
  const key = document.activeElement?.dataset?.key;
  show();
  if (key && !document.activeElement?.dataset?.key) {
    [...document.querySelectorAll("[data-key]")].find((node) => node.dataset.key === key)?.focus({ preventScroll: true });
  }
}

function show() {
  const session = current.session;
  at("start").hidden = session !== null && !at("start").dataset.again;
  const offered = at("start").hidden ? [] : current.unsaved;
  sections.unsaved(offered, (name) => open({ what: "recovered", name }), (name) => change("dismiss", { name }));
  for (const id of ["answer", "desk", "open-again", "undo", "redo", "save"]) at(id).hidden = session === null;
  if (!session) return;
  at("undo").disabled = !session.can_undo;
  at("redo").disabled = !session.can_redo;
  sections.answer(session);
  sections.fall(session);
  places.show(session, { choose: () => keepingFocus(show), look: lookAt, add, forget: () => change("forget") });
  sliders.show(session, (id, is_held) => change("hold", { id, is_held }), refused);
  sections.branches(session, (branch) => change("branch", { branch }));
  sections.mask(session, (mask) => change("leave_out", mask));
  sections.further(session, () => change("plan"));
  sections.practice(session, () => open({ what: "hidden" }), () => change("reveal"), () => open({ what: "before_hidden" }));
  sections.commands(session);
  figuresOf.showTabs(session.tabs, () => { keepingFocus(show); figuresOf.refresh().catch(refused); });
}

function showProgress() {
  sections.answer(current.session);
  sections.further(current.session, () => change("plan"));
}

function isWorking(state) {
  return state.session?.verdict.word === "working" || Boolean(state.session?.looking) || Boolean(state.session?.further.progress);
}

async function take(state) {
  // an answer that a newer one overtook
  if (current && state.version < current.version) return;
  const isKnown = state.session !== null && current?.session && state.version === current.version;
  current = state;
  // what is pressed or dragged stays where it is while only the progress changes
  if (isKnown) showProgress();
  else keepingFocus(show);
  document.documentElement.dataset.version = `${state.version}`;
  if (state.session && seen !== state.version) {
    seen = state.version;
    await figuresOf.refresh();
  }
  clearTimeout(polling);
  if (isWorking(state)) polling = setTimeout(poll, POLL_MS);
}

async function poll() {
  try {
    await take(await look("state"));
  } catch (refusal) {
    refused(refusal);
  }
}

// The page says that it is busy while it waits for any change.
async function change(name, body) {
  at("message").hidden = true;
  asking += 1;
  document.body.setAttribute("aria-busy", "true");
  try {
    await take(await ask(name, body));
    return true;
  } catch (refusal) {
    refused(refusal);
    return false;
  } finally {
    asking -= 1;
    if (!asking) document.body.removeAttribute("aria-busy");
  }
}

// Its fit takes a while; the page says so until it is there.
async function lookAt(effect, place) {
  const looked = change("preview", { effect, at: place });
  await poll();
  return looked;
}

async function add(effect, place) {
  await change("add", { effect, at: place });
}

async function open(what) {
  if (!(await change("open", what))) return;
  places.forgetPlace();
  delete at("start").dataset.again;
  keepingFocus(show);
}

async function openFiles(list) {
  const files = await Promise.all([...list].map(async (file) => ({ name: file.name, text: await file.text() })));
  if (files.length) await open({ what: "files", files });
}

// Names that are proposed where nothing was saved yet.
const PROPOSED = { rotor: "better.toml", report: "report.html", session: "session.json", readings: "kept.csv" };

function saving() {
  const dialog = at("saving");
  const form = dialog.querySelector("form");
  const propose = () => { form.path.value = (form.what.value === "session" && current.session.session_file) || PROPOSED[form.what.value]; };
  const clean = () => { at("saving-said").textContent = ""; at("saving-over").hidden = true; };
  at("save").addEventListener("click", () => { propose(); clean(); dialog.showModal(); form.path.select(); });
  form.what.addEventListener("change", () => { propose(); clean(); });
  form.path.addEventListener("input", clean);
  form.addEventListener("submit", async (event) => {
    const how = event.submitter?.value ?? "save";
    if (how === "cancel") return;
    event.preventDefault();
    const overwrite = how === "over" || (form.what.value === "session" && form.path.value === current.session.session_file);
    try {
      await take(await ask("save", { what: form.what.value, path: form.path.value, overwrite }));
      dialog.close();
      at("files").textContent += ` · ${form.path.value} written`;
    } catch (refusal) {
      at("saving-said").textContent = refusal.message;
      at("saving-over").hidden = !refusal.exists;
      if (!(refusal instanceof Refusal)) throw refusal;
    }
  });
}

function listen() {
  at("open-sample").addEventListener("click", () => open({ what: "sample" }));
  at("open-hidden").addEventListener("click", () => open({ what: "hidden" }));
  at("open-again").addEventListener("click", () => {
    if (at("start").dataset.again) delete at("start").dataset.again;
    else at("start").dataset.again = "true";
    show();
    at("open-sample").focus();
  });
  at("undo").addEventListener("click", () => change("undo"));
  at("redo").addEventListener("click", () => change("redo"));
  at("fit").addEventListener("click", () => change("fit"));
  at("put-back").addEventListener("click", () => change("put_back"));
  const ofForm = (form) => Object.fromEntries(new FormData(form).entries());
  at("open-paths").addEventListener("submit", (event) => {
    event.preventDefault();
    const files = ofForm(event.target);
    open(event.submitter?.value === "hidden" ? { what: "hidden", files } : { what: "paths", ...files });
  });
  at("open-session").addEventListener("submit", (event) => { event.preventDefault(); open({ what: "session_path", ...ofForm(event.target) }); });
  at("choose").addEventListener("change", (event) => openFiles(event.target.files));
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => { event.preventDefault(); openFiles(event.dataTransfer.files); });
  addEventListener("keydown", (event) => {
    const isText = event.target.matches?.("input:not([type=range], [type=checkbox]), select, textarea");
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z" || isText || !current?.session) return;
    event.preventDefault();
    change(event.shiftKey ? "redo" : "undo");
  });
}

listen();
saving();
await poll();
// for whoever measures
globalThis.studio = { timings: sliders.timings };
document.documentElement.dataset.ready = "true";
