import { connect, find, known, write } from "/link.js";
import { Plot } from "/plot.js";
import { next, STATES } from "/words.js";

let hello = { experiment: "tracking" }, shown = null, steps = "";
const plot = new Plot(find("plot"));
const send = connect("panel", {
  hello(message) {
    hello = message;
    const what = message.experiment === "picking" ? "Pick and place" : "Tracking";
    write("title", message.participant ? `${what}, participant ${message.participant}` : what);
    document.title = message.simulated ? `${what} (simulated)` : what;
    find("simulated").hidden = !message.simulated;
    const picking = message.experiment === "picking";
    for (const id of ["toggle", "success", "dropped", "comment"]) find(id).hidden = !picking;
    find("plot").hidden = picking;
    if (message.view && find("view").src !== message.view) find("view").src = message.view;
    find("view").hidden = !message.view;
    find("task").hidden = !picking;
  },
  plan(message) { showSteps(message.steps); },
  curve(message) { plot.begin(message); },
  now(message) {
    shown = message;
    send({ n: message.n });
  },
});

const MARKS = { done: "\u2713", success: "\u2713", dropped: "\u2715", timeout: "\u23f1", skipped: "\u2013" };

function item(name, ...parts) {
  const element = document.createElement("li");
  element.className = name;
  for (const part of parts) {
    const span = document.createElement("span");
    span.textContent = part;
    element.append(span);
  }
  return element;
}

function showSteps(list) {
  const items = [];
  let head = "";
  list.forEach((step, k) => {
    const title = step.kind === "rest" ? "" : `${step.condition}, ${step.kind === "training" ? "training" : "trials"}`;
    if (title && title !== head) items.push(item("head", title));
    head = title || head;
    const words = step.kind === "rest" ? "Rest" : step.name ? `${step.what} ${step.name}` : `${step.what} \u00b7 ${step.repeat}`;
    const element = item("step", MARKS[step.outcome] ?? "", words, step.tries > 1 ? `${step.tries} tries` : "");
    element.dataset.place = k;
    element.classList.toggle("over", step.outcome !== "");
    items.push(element);
  });
  find("steps").replaceChildren(...items);
  steps = "";
}

function showPlace() {
  const place = shown.step_index === null ? "" : String(shown.step_index);
  if (steps === place) return;
  steps = place;
  for (const element of find("steps").children) {
    const here = place !== "" && element.dataset.place === place;
    element.classList.toggle("here", here);
    if (here) element.scrollIntoView({ block: "nearest" });
  }
}

const number = (value, digits, unit = "") => (known(value) ? `${value.toFixed(digits)}${unit}` : "\u2013");

// What a row is called; of several fingers each has its number, the trial's first.
const CALLED = { c: ["c", "c of finger "], flexion: ["Flexion commanded", "Flexion commanded "], measured: ["Flexion measured", "Flexion measured "] };
const called = (what, dof) => (dof === undefined ? CALLED[what][0] : CALLED[what][1] + dof);

function facts() {
  const source = shown.source;
  const rows = [[called("c", source.dof), number(shown.c, 3), known(shown.c) ? "" : "bad"]];
  if (source.kind === "page") {
    rows.push(["Participant's page", shown.page_connected ? "connected" : "not open", shown.page_connected ? "good" : "bad"]);
    if (source.device) rows.push(["Gamepad", source.device, known(shown.c) ? "" : "bad"]);
    rows.push(["Page round trip, p99", number(known(source.round_trip) ? 1000 * source.round_trip : null, 0, " ms")]);
  }
  const milli = (value, digits, unit) => number(known(value) ? 1000 * value : null, digits, unit);
  // A value that was measured too long ago is unknown, whatever it was.
  const add = (key, name, text, kind = () => "") => {
    if (!(key in source)) return;
    const old = (source.unknown ?? []).includes(key);
    rows.push(old ? [name, "unknown", "bad"] : [name, text(source[key]), kind(source[key])]);
  };
  add("state", "Control", String, (state) => ({ active: "good", stopped: "bad" })[state] ?? "");
  if (source.finger !== "") add("finger", known(source.dof) ? "Fingers" : "Finger", String, (finger) => (finger.startsWith("stopped") ? "bad" : ""));
  for (const what of ["flexion", "measured"]) add(what, called(what, source.dof), (value) => number(value, 2));
  for (const key of Object.keys(source).filter((name) => /^(c|flexion|measured)_\d+$/.test(name))) {
    add(key, called(...key.split("_")), (value) => number(value, 2));
  }
  add("rate", "Frames", (value) => number(value, 0, " /s"));
  add("latency", "Receipt to command, p99", (value) => milli(value, 2, " ms"));
  add("misses", "Late frames", String, (count) => (count ? "" : "good"));
  add("refused", "Pose", (reason) => reason || "valid", (reason) => (reason ? "bad" : ""));
  add("residual", "Residual", (value) => milli(value, 1, " mm"));
  add("worst_residual", "Farthest marker", (value) => milli(value, 0, " mm"));
  add("inside", "Hand", (inside) => (inside ? "inside the points" : "outside the points"), (inside) => (inside ? "" : "bad"));
  if (known(source.session)) rows.push(["Session", source.session || "recorded", source.session ? "bad" : ""]);
  if (source.lost_rows) rows.push(["Rows lost", String(source.lost_rows), "bad"]);
  return rows;
}

function showFacts() {
  const rows = facts(), list = find("facts"), text = JSON.stringify(rows);
  if (list.dataset.text === text) return;
  list.dataset.text = text;
  list.replaceChildren(...rows.flatMap(([name, value, kind]) => {
    const term = document.createElement("dt"), entry = document.createElement("dd");
    term.textContent = name;
    entry.textContent = value;
    entry.className = kind ?? "";
    return [term, entry];
  }));
}

function cells(kind, ...values) {
  const row = document.createElement("tr");
  values.forEach((value, k) => {
    const cell = document.createElement(kind);
    cell.textContent = value;
    if (k >= 3) cell.className = "number";
    row.append(cell);
  });
  return row;
}

function showAttempts() {
  const table = find("attempts"), text = JSON.stringify(shown.attempts);
  if (table.dataset.text === text) return;
  table.dataset.text = text;
  const picking = shown.experiment === "picking";
  find("heads").replaceChildren(cells("th", "", "Step", "Outcome", picking ? "Time" : "RMSE", ...(picking ? [] : ["Lag"])));
  table.replaceChildren(...[...shown.attempts].reverse().map((a) => {
    const figures = picking ? [number(a.time, 2, " s")] : [number(a.rmse, 2), number(a.lag, 2, " s")];
    const row = cells("td", a.number, a.step, a.outcome, ...figures);
    row.title = a.reason;
    return row;
  }));
}

function allow(id, yes) {
  find(id).disabled = !yes;
}

function showControls() {
  const { state } = shown, running = ["align", "track", "ready", "running", "judge"].includes(state);
  const ready = state === "waiting", idle = !running && state !== "stopped";
  allow("begin", ready && shown.stopped === null);
  allow("abort", running);
  allow("skip", running || ready || state === "rest");
  allow("repeat", idle && shown.attempts.length > 0);
  allow("rest", ready);
  allow("pause", idle && state !== "finished");
  allow("toggle", state === "ready" || state === "running");
  allow("success", state === "running" || state === "judge");
  allow("dropped", state === "running" || state === "judge");
  write("toggle", state === "ready" ? "Start the clock" : "Stop the clock");
  write("pause", state === "paused" ? "Continue" : "Pause");
  write("end", state === "stopped" ? "Acknowledge and end the run" : "End the run");
}

// Object and clock, readable from where the object lies.
function showTask(step, time) {
  const there = step !== null && step.kind !== "rest" && shown.experiment === "picking";
  write("task_code", there ? `Object ${step.what}` : "");
  write("task_name", there ? step.name : STATES[shown.state] ?? "");
  write("task_left", time);
}

function showBanner() {
  const { stopped } = shown;
  find("banner").hidden = stopped === null;
  write("stopped", stopped?.title ?? "");
  write("reason", stopped?.reason ?? "");
  write("remedy", stopped?.remedy ?? "");
  find("connect").hidden = !shown.can_connect;
}

function frame() {
  if (shown !== null) {
    const { state, step, trial } = shown;
    write("state", STATES[state] ?? state);
    const words = step === null || step.kind === "rest" ? "" : `${step.condition} \u00b7 ${step.kind} \u00b7 ${step.what}${step.name ? ` ${step.name}` : ` \u00b7 ${step.repeat}`}`;
    write("what", words);
    const left = state === "align" || state === "rest" ? shown.countdown : trial.time_left;
    const time = known(left) ? `${left.toFixed(1)} s` : "";
    write("clock", time);
    write("next", next(shown));
    showTask(step, time);
    write("place", `${shown.trials - shown.trials_left} of ${shown.trials} done`);
    write("page", shown.page_connected ? "Participant's page is open" : "");
    find("open").hidden = shown.page_connected || !shown.page_condition;
    showBanner();
    write("message", shown.unsaved || shown.message);
    find("message").classList.toggle("fault", Boolean(shown.unsaved) || state === "stopped");
    const gauge = find("gauge");
    gauge.classList.toggle("none", !known(shown.c));
    gauge.firstElementChild.style.width = `${100 * Math.min(1, Math.max(0, shown.c ?? 0))}%`;
    showPlace();
    showFacts();
    showAttempts();
    showControls();
    if (shown.experiment === "tracking") plot.draw({ state, trial, c: shown.c });
  }
  requestAnimationFrame(frame);
}

function submit(name) {
  const text = find("text");
  send({ command: name, text: text.value });
  if (["abort", "skip", "repeat", "success", "dropped", "comment"].includes(name)) text.value = "";
}

find("emergency").addEventListener("click", () => send({ command: "emergency" }));
for (const button of document.querySelectorAll("[data-command]"))
  button.addEventListener("click", (event) => {
    submit(button.dataset.command);
    // The space bar does not press it again; with the keyboard the focus stays.
    if (event.detail > 0) button.blur();
  });
window.addEventListener("keydown", (event) => {
  if (event.code === "Escape") send({ command: "emergency" });
  if (event.target === find("text") || event.repeat) return;
  if (event.code === "Space" && hello.experiment === "picking") {
    event.preventDefault();
    send({ command: "toggle" });
  }
});
requestAnimationFrame(frame);
